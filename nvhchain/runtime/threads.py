"""Threads that work may take: those granted to what is under way, and those of BLAS, which a whole process shares."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock
from typing import Any

from threadpoolctl import ThreadpoolController

_GRANTED: ContextVar[int | None] = ContextVar("granted_threads", default=None)


@contextmanager
def granted(threads: int) -> Iterator[None]:
    """What runs in here shares the machine with others and may take so many threads (`at_most`)."""
    token = _GRANTED.set(threads)
    try:
        yield
    finally:
        _GRANTED.reset(token)


def at_most(threads: int) -> int:
    """`threads`, or fewer where fewer are granted to the work under way."""
    allowed = _GRANTED.get()
    return threads if allowed is None else min(threads, allowed)


class _Shared:
    """Libraries with one number of threads for the whole process, whichever thread calls them.

    A limit that everybody put back by himself would end with the first of two that overlap, or outlast both.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._asked: list[int] = []
        self._before: dict[str, tuple[Any, int]] = {}

    def limit(self, libraries: list[Any], threads: int) -> None:
        """Ask for so many threads; libraries that were loaded since the last time come under the limit, too."""
        with self._lock:
            self._asked.append(threads)
            for library in libraries:
                self._before.setdefault(library.filepath, (library, library.num_threads))
            self._set()

    def release(self, threads: int) -> None:
        """Take back what was asked for."""
        with self._lock:
            self._asked.remove(threads)
            self._set()
            if not self._asked:
                self._before.clear()

    def begin_with(self, libraries: list[Any], threads: int) -> None:
        """Have so many where nothing less is asked for, whatever the number was."""
        with self._lock:
            for library in libraries:
                self._before[library.filepath] = (library, threads)
            self._set()
            if not self._asked:
                self._before.clear()

    def _set(self) -> None:
        for library, before in self._before.values():
            # threadpoolctl leaves a library to the first thread that limits it and ignores all others in silence
            anybody = getattr(library, "clear_controlling_thread", lambda force: None)
            anybody(force=True)
            library.set_num_threads(min([before, *self._asked]))
            anybody(force=True)


_shared = _Shared()


def _forget() -> None:
    """What the threads of the parent process asked for, none of which lives on in a fork."""
    global _shared
    _shared = _Shared()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)


def give_blas(threads: int) -> None:
    """Linear algebra of this process on so many threads from now on, where nothing less is asked for: that of a worker
    which began with fewer (those of dask begin with one)."""
    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    _shared.begin_with([library for library in libraries if not _by_thread(library)], threads)
    for library in filter(_by_thread, libraries):
        library.set_num_threads(threads)


@contextmanager
def blas_threads(most: int) -> Iterator[None]:
    """Linear algebra on at most `most` threads: of this process, or of this thread where the library can tell.

    Where several such limits overlap, in threads beside each other or nested, the lowest holds for all; after the last,
    whatever their order, the number is what it was before the first.
    """
    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    own = [(library, library.num_threads) for library in libraries if _by_thread(library)]
    shared = _shared
    shared.limit([library for library in libraries if not _by_thread(library)], most)
    try:
        for library, before in own:
            library.set_num_threads(min(before, most))
        yield
    finally:
        for library, before in own:
            library.set_num_threads(before)
        shared.release(most)


def _by_thread(library: Any) -> bool:
    """Whether every thread has a number of its own: MKL, and OpenBLAS made with OpenMP."""
    return library.internal_api == "mkl" or getattr(library, "threading_layer", None) == "openmp"


def threads() -> int:
    """Threads that assemble: as many as cores, or NUMBA_NUM_THREADS; fewer beside tasks on one machine."""
    import numba

    return at_most(int(numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
