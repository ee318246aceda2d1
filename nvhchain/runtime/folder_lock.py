"""Locks for one process at a time in a folder; an unlocked unfinished file or folder belongs to a killed process."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir

import psutil
from filelock import FileLock

try:
    import fcntl
except ImportError:  # not on Windows, where a lock file stands in
    fcntl = None  # type: ignore[assignment]

_log = logging.getLogger(__name__)


@contextmanager
def hold_folder(folder: Path) -> Iterator[None]:
    """Hold an existing folder; wait for the process that holds it, and log which it is.

    The system ends the hold with the process, and nothing remains in the folder. The hold has no effect on file systems
    without locks, such as some on networks.
    """
    if fcntl is None:
        with FileLock(folder / ".nvhchain.lock"):
            yield
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log_waiting(folder)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        except OSError:
            _log.debug("%s: its file system has no locks", folder)
        yield
    finally:
        os.close(descriptor)


def remove_abandoned(folder: Path, pattern: str) -> None:
    """Remove files of `folder` whose makers held a lock on them and have ended; the others stay.

    On systems and file systems without such locks all files stay.
    """
    if fcntl is None:
        return
    for path in folder.glob(pattern):
        with suppress(OSError):
            descriptor = os.open(path, os.O_RDWR)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.fstat(descriptor).st_nlink:  # else the name belongs to another file by now
                    path.unlink()
            finally:
                os.close(descriptor)


@contextmanager
def temporary_folder(kind: str) -> Iterator[Path]:
    """Yield a new folder among the temporary files, which is removed at the end.

    That of a killed process goes with the next one of its `kind`. On systems without locks of folders it stays.
    """
    prefix = f"nvhchain-{kind}-"
    _remove_abandoned_folders(Path(gettempdir()), f"{prefix}*")
    while True:
        with TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True) as folder, _locked(folder):
            if Path(folder).is_dir():  # else another process took it as abandoned before its lock
                yield Path(folder)
                return


@contextmanager
def _locked(folder: str) -> Iterator[None]:
    """Hold the lock of a new folder, where the system has such locks."""
    if fcntl is None:
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        lock_file(descriptor)
        yield
    finally:
        os.close(descriptor)


def _remove_abandoned_folders(place: Path, pattern: str) -> None:
    """Remove folders in `place` whose makers held a lock on them and have ended; the others stay."""
    if fcntl is None:
        return
    for path in place.glob(pattern):
        with suppress(OSError):  # a link, a file, or the folder of another user
            descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(descriptor)


def lock_file(descriptor: int) -> None:
    """Lock an open file until it is closed, where the system has such locks."""
    if fcntl is not None:
        with suppress(OSError):  # file systems without locks: `remove_abandoned` removes nothing there
            fcntl.flock(descriptor, fcntl.LOCK_EX)


def log_waiting(place: Path, locked: Path | None = None) -> None:
    """Log the process that `place` is waited for, unless this process started it.

    `locked` is the locked file or folder, by default `place`.
    """
    try:
        holder = psutil.Process(_holder(locked or place))
        if holder.ppid() == os.getpid():
            return
        command = " ".join(" ".join(holder.cmdline()[1:]).split())
        who = f"process {holder.pid} ({command[:80]})"
    except (OSError, ValueError, psutil.Error):
        who = "another process"
    _log.warning("%s: waits for %s, which is at work there", place, who)


def _holder(locked: Path) -> int:
    """Return the identifier of the process that holds a file or folder; ValueError if the system does not list it."""
    inode = str(locked.stat().st_ino)
    for line in Path("/proc/locks").read_text(encoding="ascii").splitlines():
        *_, pid, place, _, _ = line.split()
        if "FLOCK" in line and "->" not in line and place.split(":")[-1] == inode:
            return int(pid)
    raise ValueError(f"{locked} is not listed")
