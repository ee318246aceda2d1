"""Lines of a text file with the files that it includes in their places."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from nvhchain.errors import FileFormatError


def lines_with_includes(
    path: Path, included: Callable[[str], str | None], within: tuple[Path, ...] = ()
) -> Iterator[str]:
    """Lines of `path`.  included: name of the file, beside this one, that a line includes, or None.

    Raises FileFormatError where a file is missing or includes itself.
    """
    if path in within:
        raise FileFormatError(f"{path}: includes itself")
    try:
        content = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    for line in content:
        name = included(line)
        if name is None:
            yield line.rstrip()
        else:
            yield from lines_with_includes(path.parent / name, included, (*within, path))
