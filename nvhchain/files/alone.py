"""One process at a time in a folder; what killed processes left is told from what others are at by its lock."""

from __future__ import annotations

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil

_log = logging.getLogger(__name__)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a folder that exists; wait for the process that holds it, with a line that says which it is.

    The system ends the hold with the process, and nothing is left in the folder.  File systems without locks, such as
    some on networks, do not hold.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say_waiting(folder)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        except OSError:
            _log.debug("%s: its file system has no locks", folder)
        yield
    finally:
        os.close(descriptor)


def remove_left(folder: Path, pattern: str) -> None:
    """Remove files of `folder` whose makers held a lock on them and have ended; others stay, as where locks fail."""
    for path in folder.glob(pattern):
        with suppress(OSError):
            descriptor = os.open(path, os.O_RDWR)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.fstat(descriptor).st_nlink:  # else the name is another file's by now
                    path.unlink()
            finally:
                os.close(descriptor)


def say_waiting(place: Path, held: Path | None = None) -> None:
    """Log which process `place` is waited for, unless this one started it.

    held: locked file or folder, `place` by default.
    """
    try:
        holder = psutil.Process(_holder(held or place))
        if holder.ppid() == os.getpid():
            return
        command = " ".join(" ".join(holder.cmdline()[1:]).split())
        who = f"process {holder.pid} ({command[:80]})"
    except (OSError, ValueError, psutil.Error):
        who = "another process"
    _log.warning("%s: waits for %s, which is at work there", place, who)


def _holder(locked: Path) -> int:
    """Identifier of the process that holds a file or folder.  ValueError where the system does not list it."""
    inode = str(locked.stat().st_ino)
    for line in Path("/proc/locks").read_text(encoding="ascii").splitlines():
        *_, pid, place, _, _ = line.split()
        if "FLOCK" in line and "->" not in line and place.split(":")[-1] == inode:
            return int(pid)
    raise ValueError(f"{locked} is not listed")
