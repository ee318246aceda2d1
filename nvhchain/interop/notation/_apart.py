"""Files read in a process of their own: libraries in C may crash on a damaged file."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.runtime.processes import exchange

_TIME_LIMIT = 3600.0
"""Time (s) after which the reader is stopped."""

_END = """
content = io.BytesIO()
numpy.savez(content, **found)
sys.stdout.buffer.write(content.getbuffer())
"""


def read_apart(code: str, path: Path, *arguments: str, kind: str) -> dict[str, np.ndarray]:
    """Return the arrays that code makes of a file.

    code : lines of Python that import io, numpy and sys, read path and arguments as lines from stdin, and make a dict
        `found` of arrays.
    kind : format, for messages.

    Raises FileFormatError for a damaged file, with the last message of the reader.
    """
    done = exchange("-c", code + _END, content="\n".join((str(path), *arguments)).encode(), seconds=_TIME_LIMIT)
    said = "reading takes too long"
    if done is not None:
        try:
            with np.load(BytesIO(done.stdout)) as file:
                return {name: file[name] for name in file.files}
        except (OSError, EOFError, ValueError, BadZipFile):
            lines = done.stderr.decode(errors="replace").split("\n") if done.returncode > 0 else []
            said = next((line for line in reversed(lines) if line.strip()), "its reader crashed")
    raise FileFormatError(f"{path}: damaged, truncated or no {kind}, export it again: {said}")
