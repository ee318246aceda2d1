"""Files that appear whole and verified, or fail with an error.

Libraries hide errors at the closing of a file: h5py leaves zeros or nothing. Writers therefore make their content in
memory (`content_of`) or piece by piece, and `write_atomic` writes it to the disk.
"""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, TypeAlias
from zlib import crc32

from nvhchain.errors import InputError, WriteError, require
from nvhchain.runtime.folder_lock import lock_file, remove_abandoned

Content: TypeAlias = bytes | bytearray | memoryview
"""Bytes of a file, or of a piece of one."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Error numbers of the disk, not of the given name."""

_REMEDIES = {
    errno.ENOSPC: "make room there or name another folder",
    errno.EDQUOT: "make room within the quota or name another folder",
    errno.EFBIG: "raise the limit on the size of files (ulimit -f)",
    errno.EIO: "check the disk or name another folder",
}

_PIECE = 1 << 20
"""Bytes read at once."""


def content_of(write: Callable[[BytesIO], object]) -> memoryview:
    """Return everything that `write` writes to a file in memory."""
    file = BytesIO()
    write(file)
    return file.getbuffer()


def write_atomic(path: Path, content: Content | Iterable[Content]) -> Path:
    """Write `content` under a temporary name beside `path`, read it back from the disk, and rename it.

    Unfinished files of killed processes in the folder are removed. WriteError is raised if the system refuses or the
    disk returns something else; `path` is then unchanged.
    """
    pieces = [content] if isinstance(content, Content) else content
    remove_abandoned(path.parent, ".nvhchain-*.part")
    part = path.with_name(f".nvhchain-{secrets.token_hex(8)}.part")
    try:
        with _locked_file(part) as file:
            _write(file, part, pieces)
            os.replace(part, path)
        _sync_folder(path.parent)
    except BaseException as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, WriteError):
            remedy = _REMEDIES.get(error.errno or 0, "name another folder or file")
            raise WriteError(
                f"{path}: cannot be written ({error.strerror or error}): {remedy}; what was finished before is kept",
                error.errno,
            ) from error
        raise
    return path


def write_output(path: Path, content: Content | Iterable[Content]) -> Path:
    """Write `content` to a `path` from a user, whole or not at all.

    InputError is raised where its folder is missing, a folder has its name, or the system refuses. WriteError is raised
    where the disk is full or fails.
    """
    try:
        folder = path.absolute().parent
        require(folder.is_dir(), f"{path}: the folder {path.parent} does not exist: make it or choose another")
        require(not path.is_dir(), f"{path}: a folder stands where a file is to be written: choose another name")
        return write_atomic(path, content)
    except OSError as error:
        if error.errno in FULL:
            raise
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise InputError(f"{path}: cannot be written ({reason}): choose another folder or name") from error


def _locked_file(part: Path) -> BinaryIO:
    """Return a new file with a lock that ends with this process; `remove_abandoned` ignores it until then."""
    while True:
        file = part.open("xb")
        lock_file(file.fileno())
        if os.fstat(file.fileno()).st_nlink:
            return file
        file.close()  # another process removed it as a remainder


def _write(file: BinaryIO, part: Path, pieces: Iterable[Content]) -> None:
    """Write the pieces to the disk, and compare them with the data read back."""
    size = digest = 0
    for piece in pieces:
        file.write(piece)
        size, digest = size + memoryview(piece).nbytes, crc32(piece, digest)
    file.flush()
    os.fsync(file.fileno())
    if hasattr(os, "posix_fadvise"):  # else the read-back comes from memory, not from the disk
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    found_size = found_digest = 0
    for piece in _read(part):
        found_size, found_digest = found_size + len(piece), crc32(piece, found_digest)
    if (found_size, found_digest) != (size, digest):
        raise OSError(errno.EIO, f"{found_size} bytes on the disk differ from the {size} that were written")


def _read(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            yield piece


def _sync_folder(folder: Path) -> None:
    """Force the new name to the disk, where the file system syncs folders."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.EBADF, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)
