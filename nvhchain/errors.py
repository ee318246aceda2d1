"""Exceptions and warnings of nvhchain, and the check that raises them.

Input errors name value, limit and remedy.
"""

from __future__ import annotations

import sys
import unicodedata
import warnings
from numbers import Real


class InputError(ValueError):
    """Unusable input; the message names the value, the limit and the remedy.

    Text that it quotes from a file is printable.
    """

    def __str__(self) -> str:
        return printable(super().__str__())


class FileFormatError(InputError):
    """Truncated or damaged file, or a file of another format than claimed."""


class ResourceError(InputError):
    """Job too large for this machine; the message states its size and how to reduce it."""


class WriteError(OSError):
    """Failed write of a file; the message names the file, the reason and the remedy.

    Parameters
    ----------
    message : str
        Text of the error.
    number : int, optional
        Error number of the operating system.
    """

    def __init__(self, message: str, number: int | None = None) -> None:
        super().__init__(message)
        self.errno = number


class SolverError(RuntimeError):
    """Numerical method that did not reach its stated residual."""


class AccuracyWarning(UserWarning):
    """Result less accurate than its fidelity asks for; the message states by how much, and the remedy."""


def warn_caller(message: str, category: type[Warning] = AccuracyWarning) -> None:
    """Issue a warning that points at the first caller outside this package."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)


def printable(text: str) -> str:
    """Return the text with characters that move a cursor or turn the reading escaped; line ends and tabs stay."""
    if text.isprintable():
        return text
    return "".join(letter if _shown(letter) else letter.encode("unicode_escape").decode() for letter in text)


def _shown(letter: str) -> bool:
    return letter.isprintable() or letter in "\n\t" or unicodedata.category(letter) == "Zs"


def require(condition: bool, message: str) -> None:
    """Raise `InputError` with `message` unless `condition` holds."""
    if not condition:
        raise InputError(message)


def is_whole(value: object) -> bool:
    """Return True if `value` is a whole number, of any numeric type."""
    return isinstance(value, Real) and float(value).is_integer()
