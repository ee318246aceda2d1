"""Numbers of threads: those granted to the work under way, and those of BLAS, which a whole process shares."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")

_GRANTED: ContextVar[int | None] = ContextVar("granted_threads", default=None)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def granted(threads: int) -> Iterator[None]:
    """Grant so many threads (`limit_threads`) to the work in this context, which shares the machine with others."""
    token = _GRANTED.set(threads)
    try:
        yield
    finally:
        _GRANTED.reset(token)


def limit_threads(threads: int) -> int:
    """Return `threads`, or fewer if fewer are granted to the work under way."""
    allowed = _GRANTED.get()
    return threads if allowed is None else min(threads, allowed)


class _Shared:
    """Libraries with one number of threads for the whole process, whichever thread calls them.

    If every user restored the number by himself, a limit would end with the first of two that overlap, or outlast both.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._asked: list[int] = []
        self._libraries: dict[str, tuple[Any, int]] = {}

    def limit(self, libraries: list[Any], threads: int) -> None:
        """Request so many threads; libraries loaded since the last time come under the limit, too."""
        with self._lock:
            self._asked.append(threads)
            for library in libraries:
                self._libraries.setdefault(library.filepath, (library, library.num_threads))
            self._set()

    def release(self, threads: int) -> None:
        """Withdraw a request."""
        with self._lock:
            self._asked.remove(threads)
            self._set()
            if not self._asked:
                self._libraries.clear()

    def begin_with(self, libraries: list[Any], threads: int) -> None:
        """Set the number without requests to `threads`, whatever it was."""
        with self._lock:
            for library in libraries:
                self._libraries[library.filepath] = (library, threads)
            self._set()
            if not self._asked:
                self._libraries.clear()

    def _set(self) -> None:
        for library, before in self._libraries.values():
            # threadpoolctl leaves a library to the first thread that limits it and silently ignores all others
            anybody = getattr(library, "clear_controlling_thread", lambda force: None)
            anybody(force=True)
            library.set_num_threads(min([before, *self._asked]))
            anybody(force=True)


_shared = _Shared()


def _forget() -> None:
    """Discard the requests of the parent process: none of its threads exists in a fork."""
    global _shared
    _shared = _Shared()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)


def set_blas_threads(threads: int) -> None:
    """Set the threads of linear algebra in this process to `threads`, unless less is requested.

    A worker may have begun with fewer; those of dask begin with one.
    """
    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    _shared.begin_with([library for library in libraries if not _limits_each_thread(library)], threads)
    for library in filter(_limits_each_thread, libraries):
        library.set_num_threads(threads)


@contextmanager
def blas_threads(limit: int) -> Iterator[None]:
    """Limit linear algebra to `limit` threads: of this process, or of this thread if the library distinguishes them.

    Such limits may overlap, in threads beside each other or nested. The lowest then holds for all. After the last, in
    any order, the number is that before the first.
    """
    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    own = [(library, library.num_threads) for library in libraries if _limits_each_thread(library)]
    shared = _shared
    shared.limit([library for library in libraries if not _limits_each_thread(library)], limit)
    try:
        for library, before in own:
            library.set_num_threads(min(before, limit))
        yield
    finally:
        for library, before in own:
            library.set_num_threads(before)
        shared.release(limit)


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate `function` to run with the linear algebra of the process on one thread.

    Small matrices take less processor time so, and results do not depend on the number of threads.
    """

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with blas_threads(1):
            return function(*args, **kwargs)

    return limited


def _limits_each_thread(library: Any) -> bool:
    """Return True if every thread has a number of its own: MKL, and OpenBLAS built with OpenMP."""
    return library.internal_api == "mkl" or getattr(library, "threading_layer", None) == "openmp"


def threads() -> int:
    """Return the number of threads for assembly: cores or NUMBA_NUM_THREADS, fewer beside tasks on one machine."""
    import numba

    return limit_threads(int(numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
