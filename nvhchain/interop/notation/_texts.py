"""Text files: their lines, with included files in their places, and one error for whatever is damaged in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nvhchain.errors import FileFormatError, InputError


@contextmanager
def damaged(source: str | Path, what: Callable[[Exception], str], *more: type[Exception]) -> Iterator[None]:
    """Raise FileFormatError for errors of lookup, values and numbers, and `more` of them; an InputError passes.

    what : function from an error to its message.
    """
    failures: tuple[type[Exception], ...] = (LookupError, ValueError, ArithmeticError, *more)
    try:
        yield
    except InputError:
        raise
    except failures as error:
        raise FileFormatError(f"{source}: {what(error)}") from None


def named(error: Exception) -> str:
    """Return an error with its type, for errors whose text alone is a number or a key."""
    return f"{type(error).__name__} {error}"


def first_line(error: BaseException) -> str:
    """Return the first line of an error, or its type where it has no text."""
    return str(error).splitlines()[0] if str(error) else type(error).__name__


def text_lines(path: Path) -> list[str]:
    """Return the lines of a text file; FileFormatError where it cannot be read."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None


def lines_with_includes(
    path: Path,
    joined: Callable[[Iterable[str]], Iterator[str]],
    included: Callable[[str], tuple[str, str] | None],
    including: tuple[Path, ...] = (),
) -> Iterator[str]:
    r"""Yield the lines of `path`.

    joined : function that joins statements over several lines into one.
    included : function that returns, for a line that includes a file, the rest of the line and the name of the file;
        None for other lines. The file lies beside this one, or beside the first one; `\\` and `/` part folders alike.

    Raises FileFormatError if a file is missing or includes itself.
    """
    if path in including:
        raise FileFormatError(f"{path}: includes itself")
    for line in joined(text_lines(path)):
        found = included(line)
        yield line.rstrip() if found is None else found[0]
        if found is not None:
            yield from lines_with_includes(_place(path, found[1], including), joined, included, (*including, path))


def _place(path: Path, name: str, including: tuple[Path, ...]) -> Path:
    """Return the path of a file that `path` includes; FileFormatError for a logical symbol."""
    symbol, colon, _ = name.partition(":")
    if colon and len(symbol) > 1:
        raise FileFormatError(
            f"{path}: includes {name}, where {symbol} stands for a folder that only the solver's settings name: write "
            "the path itself"
        )
    plain = name.replace("\\", "/")
    neighbour = path.parent / plain
    first = including[0].parent / plain if including else neighbour
    return first if first.exists() and not neighbour.exists() else neighbour
