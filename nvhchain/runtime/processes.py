"""Child processes: the only module that starts them.

Python puts the working directory in front of the modules of a child (`-c`, `-m`). A file `gmsh.py` or `pickle.py` there
would replace the module of that name. Children start without it (`-P`); PYTHONPATH keeps its meaning. They end with
their caller, even if it is killed. The system sees to it (`_child`), or a pipe whose end they read.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from _thread import interrupt_main
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from queue import SimpleQueue
from subprocess import DEVNULL, PIPE
from threading import Thread, current_thread, main_thread
from typing import IO, Any

__all__ = [
    "DEVNULL",
    "PIPE",
    "end_here",
    "exchange",
    "interrupts_for_this_process_alone",
    "isolated",
    "process_pool",
    "run",
    "run_python",
    "start_python",
]


def run_python(*arguments: str, seconds: float) -> subprocess.CompletedProcess[str] | None:
    """Run `python *arguments` to its end and capture its output; return None if it takes more than `seconds`."""
    # stdout of the child is read as UTF-8, whatever the terminal takes
    return run(_python(*arguments), seconds=seconds, environment={"PYTHONIOENCODING": "utf-8"})


def exchange(*arguments: str, content: bytes | memoryview, seconds: float) -> subprocess.CompletedProcess[bytes] | None:
    """Run `python *arguments` with bytes on its stdin and capture its output as bytes.

    seconds: longest duration (s).
    Returns finished process; None if it takes more than `seconds`.
    """
    _ignore_broken_pipes()
    try:
        return subprocess.run(
            _python(*arguments),
            input=content,
            capture_output=True,
            timeout=seconds,
            env=_child_environment(None),
        )
    except subprocess.TimeoutExpired:
        return None


def run(
    command: Sequence[str], *, seconds: float | None = None, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str] | None:
    """Run a program to its end and capture its output.

    seconds: longest duration (s).
    environment: variables added to the environment of this process.
    Returns finished process; None if it takes more than `seconds`.
    """
    try:
        return subprocess.run(
            command,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            stdin=DEVNULL,
            timeout=seconds,
            env=_child_environment(environment),
        )
    except subprocess.TimeoutExpired:
        return None


def start_python(
    *arguments: str,
    stdin: int | IO[bytes] = DEVNULL,
    stderr: int | IO[bytes] = DEVNULL,
    environment: Mapping[str, str] | None = None,
) -> subprocess.Popen[bytes]:
    """Start `python *arguments`, whose standard output is discarded.

    stdin, stderr: streams of the process; discarded by default.
    environment: variables added to the environment of this process.

    A child with a pipe on `stdin` ends by itself when this end closes, and removes its files.
    """
    _ignore_broken_pipes()
    return subprocess.Popen(
        [sys.executable, "-P", *arguments] if stdin == PIPE else _python(*arguments),
        stdin=stdin,
        stdout=DEVNULL,
        stderr=stderr,
        env=_child_environment(environment),
    )


_GRACE = 5.0
"""s after an interruption in which a child ends by itself."""


def end_here() -> None:
    """Interrupt this process, from one of its threads; the system ends it where compiled code goes on for too long."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, _GRACE)
    interrupt_main()


def _python(*arguments: str) -> list[str]:
    """Return the command of a child that the system ends with this process."""
    return [sys.executable, "-P", str(Path(__file__).with_name("_child.py")), str(os.getpid()), *arguments]


def _ignore_broken_pipes() -> None:
    """Let a write to a child that has ended raise BrokenPipeError, as Python sets it.

    `gmsh.initialize` restores the system's default, by which that write ends this process.
    """
    if not hasattr(signal, "SIGPIPE") or current_thread() is not main_thread():
        return
    if signal.getsignal(signal.SIGPIPE) is signal.SIG_IGN:  # not changed through Python
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)


def _child_environment(added: Mapping[str, str] | None) -> dict[str, str]:
    """Return the environment of a child, in which warnings of other packages are no errors.

    An empty entry of PYTHONPATH would be the working directory.
    """
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONWARNINGS"}
    if "PYTHONPATH" in kept:
        kept["PYTHONPATH"] = os.pathsep.join(filter(None, kept["PYTHONPATH"].split(os.pathsep)))
    return kept | dict(added or {})


@contextmanager
def isolated() -> Iterator[None]:
    """Let processes that a library starts in this context ignore modules of the working directory, too.

    Once started, workers of `multiprocessing` search where this process does.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("PYTHONSAFEPATH", None)
        else:
            os.environ["PYTHONSAFEPATH"] = before


@contextmanager
def interrupts_for_this_process_alone() -> Iterator[None]:
    """Block SIGINT in threads and processes that begin here; one that this thread receives waits for the end.

    Workers end with this process, and their own interruption would be a traceback on the terminal.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    with isolated():
        resource_tracker.ensure_running()  # which unblocks SIGINT in its thread, hence in workers that follow
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_caller(pool: Connection) -> None:
    """Let this worker of `multiprocessing` end once the pool closes its end of a pipe, even as its caller is killed."""

    def watch() -> None:
        wait([pool])
        os._exit(1)

    Thread(target=watch, name="end with the caller", daemon=True).start()


class _Workers(Executor):
    """Processes with one task each: one that dies ends its own task alone, and the next task has a new one."""

    def __init__(self, workers: int) -> None:
        self._max_workers = workers
        self._threads = ThreadPoolExecutor(workers)
        self._idle: SimpleQueue[ProcessPoolExecutor | None] = SimpleQueue()
        for _ in range(workers):
            self._idle.put(None)
        self._theirs, self._ours = get_context("spawn").Pipe(duplex=False)

    def submit(self, task: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        return self._threads.submit(self._run, task, arguments, named)

    def _run(self, task: Callable[..., Any], arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Run a task in a process that no other task has."""
        process: ProcessPoolExecutor | None = self._idle.get()
        try:
            if process is None:
                process = ProcessPoolExecutor(1, get_context("spawn"), _end_with_caller, (self._theirs,))
            with interrupts_for_this_process_alone():
                future = process.submit(task, *arguments, **named)
            return future.result()
        except BrokenExecutor:
            process = None
            raise
        finally:
            self._idle.put(process)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._threads.shutdown(wait=wait, cancel_futures=cancel_futures)
        while not self._idle.empty():
            process = self._idle.get()
            if process is not None:
                process.shutdown(wait=wait, cancel_futures=cancel_futures)

    def end(self) -> None:
        """End all processes, whatever their tasks, and cancel waiting tasks."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._ours.close()
        self.shutdown(cancel_futures=True)


@contextmanager
def process_pool(workers: int) -> Iterator[Executor]:
    """Yield an executor of `workers` processes, which end with this context and cancel waiting tasks on an error.

    A process that dies costs its own task alone (BrokenExecutor) and is replaced.
    """
    with isolated():
        pool = _Workers(workers)
        try:
            yield pool
        except BaseException:
            pool.end()
            raise
        pool.shutdown()
