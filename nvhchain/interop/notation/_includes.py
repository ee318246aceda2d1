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
    """Yield the lines of `path`.

    joined : function that joins statements over several lines into one.
    included : function that returns, for a line that includes a file, the rest of the line and the name of the file,
        beside this one; None for other lines.

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
            yield from lines_with_includes(path.parent / found[1], joined, included, (*including, path))
