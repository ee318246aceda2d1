"""One process at a time in a folder."""

from __future__ import annotations

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
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


def say_waiting(place: Path, held: Path | None = None) -> None:
    """Log what `place` is waited for.  held: locked file or folder, `place` by default."""
    _log.warning("%s: waits for %s, which is at work there", place, _holder(held or place))


def _holder(locked: Path) -> str:
    """Process that holds a lock on a file or folder, as far as this one may see."""
    try:
        inode = str(locked.stat().st_ino)
        for line in Path("/proc/locks").read_text(encoding="ascii").splitlines():
            fields = line.split()
            if "FLOCK" in fields and "->" not in fields and fields[-3].split(":")[-1] == inode:
                command = " ".join(psutil.Process(int(fields[-4])).cmdline()[1:])
                return f"process {fields[-4]} ({' '.join(command.split())[:80]})"
    except (OSError, ValueError, IndexError, psutil.Error):
        pass
    return "another process"
