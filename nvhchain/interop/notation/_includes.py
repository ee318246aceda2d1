"""Lines of a text file with included files in their places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from nvhchain.errors import FileFormatError


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
    try:
        content = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    for line in joined(content):
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
    beside = path.parent / plain
    first = including[0].parent / plain if including else beside
    return first if first.exists() and not beside.exists() else beside
