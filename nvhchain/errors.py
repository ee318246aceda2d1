"""Exceptions and warnings of nvhchain, and the check that raises them.

Input errors name value, limit and remedy.
"""

from __future__ import annotations

import re
import sys
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from numbers import Real
from typing import Any, TypeVar

__all__ = ["AccuracyWarning", "FileFormatError", "InputError", "ResourceError", "SolverError"]

T = TypeVar("T")


class InputError(ValueError):
    """Unusable input; the message names the value, the limit and the remedy.

    Text that it quotes from a file is printable.
    """

    def __str__(self) -> str:
        return printable(super().__str__())


MOST_MISTAKES = 30
"""Largest number of mistakes in one message; further ones are counted."""


class Mistakes(InputError):
    """Several mistakes in one input; the message joins them by semicolons.

    each: text of every mistake, with its field.
    """

    def __init__(self, each: list[str]) -> None:
        self.each = each
        super().__init__("; ".join(self.lines))

    @property
    def lines(self) -> list[str]:
        """Text of every mistake in one line each; further ones are counted."""
        more = [f"and {len(self.each) - MOST_MISTAKES} more"] if len(self.each) > MOST_MISTAKES else []
        return [" ".join(printable(text).split()) for text in self.each[:MOST_MISTAKES]] + more

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.each,)


class FileFormatError(InputError):
    """Truncated or damaged file, or a file of another format than claimed."""


class ResourceError(InputError):
    """Job too large for this machine; the message states its size and how to reduce it."""


class WriteError(OSError):
    """Failed write of a file; the message names the file, the reason and the remedy.

    message: text of the error.
    number: error number of the operating system.
    """

    def __init__(self, message: str, number: int | None = None) -> None:
        super().__init__(message)
        self.errno = number


class SolverError(RuntimeError):
    """Numerical method that did not reach its stated residual."""


_NUMBER = re.compile(r"\d[\d.]*")


class AccuracyWarning(UserWarning):
    """Result less accurate than its fidelity asks for; the message states by how much, and the remedy.

    Parameters
    ----------
    message : str
        Text of the warning.
    kind : str, optional
        Kind of the warning, such as "interpolation"; the command line shows one line of each. By default it is the
        message without its numbers.

    Attributes
    ----------
    subjects : tuple of str
        Case and step that were under way (`concerning`).
    """

    def __init__(self, message: str = "", kind: str = "") -> None:
        super().__init__(message)
        self.kind = kind or _NUMBER.sub("", message)
        self.subjects = _CONCERNED.get()


_CONCERNED: ContextVar[tuple[str, ...]] = ContextVar("concerned", default=())


@contextmanager
def concerning(name: str) -> Iterator[None]:
    """Add a name to the subject of warnings, such as that of a case and, inside, that of a step."""
    token = _CONCERNED.set((*_CONCERNED.get(), name))
    try:
        yield
    finally:
        _CONCERNED.reset(token)


def subject() -> tuple[str, ...]:
    """Return the names that `concerning` has added."""
    return _CONCERNED.get()


_SILENT: ContextVar[bool] = ContextVar("silent", default=False)


@contextmanager
def silence_accuracy_warnings(*, silent: bool = True) -> Iterator[None]:
    """Issue no accuracy warnings in this thread, where a run has given them already; other threads go on with theirs.

    silent: False to issue them as before.
    """
    token = _SILENT.set(silent or _SILENT.get())
    try:
        yield
    finally:
        _SILENT.reset(token)


_COLLECTED: ContextVar[list[AccuracyWarning] | None] = ContextVar("collected", default=None)


@contextmanager
def collected_warnings() -> Iterator[list[AccuracyWarning]]:
    """Yield a list to which every accuracy warning of this thread is added; they are issued as before.

    A list of warnings around it receives them, too.
    """
    given: list[AccuracyWarning] = []
    outer = _COLLECTED.get()
    token = _COLLECTED.set(given)
    try:
        yield given
    finally:
        _COLLECTED.reset(token)
        if outer is not None:
            outer += given


def warn_caller(message: str, category: type[Warning] = AccuracyWarning, *, kind: str = "") -> None:
    """Issue a warning that points at the first caller outside this package."""
    if _SILENT.get() and category is AccuracyWarning:
        return
    warning = AccuracyWarning(message, kind) if category is AccuracyWarning else category(message)
    if isinstance(warning, AccuracyWarning) and (collected := _COLLECTED.get()) is not None:
        collected.append(warning)
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(warning, stacklevel=level)


Repeated = tuple[str, str, tuple[str, ...]]
"""Text, kind and subject of a warning that was given before."""

_DEEPEST = 10
"""Largest number of names in a subject."""


def checked_warnings(given: Any) -> list[Repeated]:
    """Return warnings from a file in their form; ValueError for what has another one."""
    try:
        found = [(text, kind, tuple(names)) for text, kind, names in given]
    except TypeError as error:
        raise ValueError(f"no warnings: {error}") from None
    for text, kind, names in found:
        if not all(isinstance(word, str) for word in (text, kind, *names)) or len(names) > _DEEPEST:
            raise ValueError("no warnings: a text, a kind and a few names are needed")
    return found


def warn_again(text: str, kind: str, names: Sequence[str]) -> None:
    """Issue an accuracy warning that was given before.

    names: names of its subject below those that `concerning` has added here.
    """
    if not names:
        warn_caller(text, kind=kind)
        return
    with concerning(names[0]):
        warn_again(text, kind, names[1:])


def printable(text: str) -> str:
    """Escape characters that move a cursor or reverse the reading direction; line ends and tabs stay."""
    if text.isprintable():
        return text
    return "".join(letter if _is_printable(letter) else letter.encode("unicode_escape").decode() for letter in text)


def _is_printable(letter: str) -> bool:
    return letter.isprintable() or letter in "\n\t" or unicodedata.category(letter) == "Zs"


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: "1 line", "2 lines".

    noun: noun in the singular, whose plural takes an s.
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def require(condition: bool, message: str) -> None:
    """Raise `InputError` unless a condition holds."""
    if not condition:
        raise InputError(message)


def require_within(
    name: str, value: float, low: float, high: float, unit: str = "", remedy: str = "", *, above: bool = False
) -> None:
    """Raise `InputError` for a number outside its limits; the default remedy is to give it in its unit.

    above: True if `low` itself is no admissible value.
    """
    unit = f" {unit}" if unit else ""
    inside = low <= value <= high and not (above and value == low)
    require(inside, f"{name} = {value:g}{unit} is outside {low:g}…{high:g}{unit}: {remedy or f'give it in{unit}'}")


def required(value: T | None, message: str) -> T:
    """Return a value that is not None; else raise `InputError`."""
    if value is None:
        raise InputError(message)
    return value


def mistakes(error: InputError) -> list[str]:
    """Return the text of every mistake of an error."""
    return error.each if isinstance(error, Mistakes) else [str(error)]


def require_all(wrong: Iterable[str]) -> None:
    """Raise one error for all mistakes."""
    each = list(wrong)
    if each:
        raise Mistakes(each)


def require_each(*claims: tuple[bool, str]) -> None:
    """Raise one error for all conditions that do not hold.

    *claims tuple of (bool, str): condition and text of its error.
    """
    require_all(message for condition, message in claims if not condition)


def check_all(*checks: Callable[[], object]) -> None:
    """Run independent checks and raise one error for all of their mistakes."""
    wrong: list[str] = []
    for check in checks:
        try:
            check()
        except InputError as error:
            wrong += mistakes(error)
    require_all(dict.fromkeys(wrong))


def is_whole(value: object) -> bool:
    """Return True for a whole number of any numeric type."""
    return isinstance(value, Real) and float(value).is_integer()
