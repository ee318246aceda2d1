"""The one way to write a file: it appears whole and as it was meant, or the failure is an error.

Libraries swallow what fails while they close a file: h5py does, and leaves zeros or nothing.  Writers therefore make
their content in memory (`in_memory`) or piece by piece, and `write_whole` takes it to the disk.
"""

from __future__ import annotations

import errno
import fcntl
import os
import secrets
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, TypeAlias
from zlib import crc32

from nvhchain.errors import InputError, WriteError, require
from nvhchain.files.alone import remove_left

Content: TypeAlias = bytes | bytearray | memoryview
"""Bytes of a file, or of a piece of one."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Failures of the disk, not of the name that was given."""

_REMEDIES = {
    errno.ENOSPC: "make room there or name another folder",
    errno.EDQUOT: "make room within the quota or name another folder",
    errno.EFBIG: "raise the limit on the size of files (ulimit -f)",
    errno.EIO: "check the disk or name another folder",
}

_PIECE = 1 << 20
"""Bytes read at once."""


def in_memory(write: Callable[[BytesIO], object]) -> memoryview:
    """Return what `write` writes into a file in memory."""
    file = BytesIO()
    write(file)
    return file.getbuffer()


def write_whole(path: Path, content: Content | Iterable[Content]) -> Path:
    """Write `content` under a name of its own beside `path`, read it back from the disk, and rename it.

    Unfinished files of killed processes in the folder are removed.  Raises WriteError where the system refuses or the
    disk returns something else; `path` is then what it was before.
    """
    pieces = [content] if isinstance(content, Content) else content
    remove_left(path.parent, ".nvhchain-*.part")
    part = path.with_name(f".nvhchain-{secrets.token_hex(8)}.part")
    try:
        with _held(part) as file:
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
    """Write `content` to a `path` that a user has named, whole or not at all.

    Raises InputError where there is no folder for it, one in its place, or the system lets nothing be written;
    WriteError where the disk is full or fails.
    """
    try:
        folder = path.absolute().parent
        require(folder.is_dir(), f"{path}: the folder {path.parent} does not exist: make it or choose another")
        require(not path.is_dir(), f"{path}: a folder stands where a file is to be written: choose another name")
        return write_whole(path, content)
    except OSError as error:
        if error.errno in FULL:
            raise
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise InputError(f"{path}: cannot be written ({reason}): choose another folder or name") from error


def _held(part: Path) -> BinaryIO:
    """A new file with a lock that ends with this process: `remove_left` leaves it alone until then."""
    while True:
        file = part.open("xb")
        with suppress(OSError):  # no locks on this file system: nothing is removed there
            fcntl.flock(file.fileno(), fcntl.LOCK_EX)
        if os.fstat(file.fileno()).st_nlink:
            return file
        file.close()  # another process took it for one that was left


def _write(file: BinaryIO, part: Path, pieces: Iterable[Content]) -> None:
    """Take the pieces to the disk and compare what it returns with them."""
    size = digest = 0
    for piece in pieces:
        file.write(piece)
        size, digest = size + memoryview(piece).nbytes, crc32(piece, digest)
    file.flush()
    os.fsync(file.fileno())
    os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)  # else memory answers for the disk
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
    """Have the new name on the disk, where the file system syncs folders."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.EBADF, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)
