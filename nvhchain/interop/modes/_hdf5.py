"""Tables of an HDF5 file, read in a process of its own: libhdf5 may crash on a damaged file."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.runtime.processes import exchange

_TIME_LIMIT = 3600.0
"""Time (s) after which the reader is stopped."""

_READER = """
import io, sys
import h5py, numpy
path, *names = sys.stdin.buffer.read().decode().split("\\n")
with h5py.File(path, "r") as file:
    found = {name: numpy.asarray(file[name][()]) for name in names if name in file}
content = io.BytesIO()
numpy.savez(content, **found)
sys.stdout.buffer.write(content.getbuffer())
"""


def read_tables(path: Path, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return the tables of `names` that there are; FileFormatError for a damaged file."""
    done = exchange("-c", _READER, content="\n".join((str(path), *names)).encode(), seconds=_TIME_LIMIT)
    said = "it takes too long"
    if done is not None:
        try:
            with np.load(BytesIO(done.stdout)) as file:
                return {name: file[name] for name in file.files}
        except (OSError, EOFError, ValueError, BadZipFile):
            lines = done.stderr.decode(errors="replace").split("\n") if done.returncode > 0 else []
            said = next((line for line in reversed(lines) if line.strip()), "libhdf5 crashed")
    raise FileFormatError(f"{path}: damaged or truncated HDF5, export it again: {said}")
