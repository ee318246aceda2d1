"""SIGTERM and SIGHUP as interruptions: they end a command as Ctrl-C does, with its children and temporary files.

Python runs handlers of signals between any two of its operations. It drops an exception raised while it deletes an
object, or in a function that C code has called. A dropped interruption is raised again. It comes too late where the C
code goes on without the result of that function: an interruption waits there.
"""

from __future__ import annotations

import logging
import signal
import sys
import threading
import time
from _thread import interrupt_main, start_new_thread
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType, TracebackType
from typing import Any

import psutil

_CALLED_BY_C = ("_raw_object_cache_getbuffer", "_raw_object_cache_notify")
"""Functions whose results C code uses without a check.

By the first LLVM asks llvmlite for a kernel from the cache. Without an answer it compiles an empty module, and the call
of the kernel is a segmentation fault.
"""


class Terminated(KeyboardInterrupt):
    """Interruption by SIGTERM, or by SIGHUP, the end of the terminal.

    number: number of the signal.
    """

    def __init__(self, number: int = signal.SIGTERM) -> None:
        super().__init__()
        self.number = number


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end child processes, which Ctrl-C reaches through the terminal, and raise Terminated.

    Neither interrupts functions of `_CALLED_BY_C`. Handlers of Ctrl-C that a program has set remain. Modules in C turn
    an interruption of what they import into an ImportError of their own: it is raised as the interruption. Some print
    it first, which is suppressed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:  # not under nohup
        numbers.append(signal.SIGHUP)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        numbers.append(signal.SIGINT)
    before, hooks = [signal.signal(number, _interrupt) for number in numbers], (sys.unraisablehook, sys.excepthook)
    sys.unraisablehook, sys.excepthook = _raised_again, _print_error
    _raised.clear()
    try:
        yield
    except ImportError:
        if _raised:
            raise _raised[-1] from None
        raise
    finally:
        sys.unraisablehook, sys.excepthook = hooks
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


_raised: list[KeyboardInterrupt] = []
"""Interruptions that the handler has raised."""

_AGAIN = 0.02
"""Time (s) after which a dropped or deferred interruption is raised again."""


def _raised_again(dropped: Any) -> None:
    """Handle an exception that Python drops."""
    if not issubclass(dropped.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(dropped)
        return
    number = signal.SIGINT
    if issubclass(dropped.exc_type, Terminated):
        number = signal.SIGTERM
        signal.signal(number, _interrupt)
    _send_again(number)


def _print_error(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print an exception that C code prints, such as that of NumPy's modules; an interruption ends in a line."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)


def _send_again(number: signal.Signals) -> None:
    """Signal this process after a while, from a thread without locks of Python, which the main thread may hold."""

    def send() -> None:
        time.sleep(_AGAIN)
        interrupt_main(number)

    with suppress(RuntimeError):  # Python is ending
        start_new_thread(send, ())


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _is_called_by_c(frame):
        _send_again(signal.Signals(number))
        return
    logging.getLogger("asyncio").disabled = True  # tasks of dask end with their workers, and would print it
    _raised.append(KeyboardInterrupt() if number == signal.SIGINT else Terminated(number))
    if number == signal.SIGINT:
        raise _raised[-1]
    signal.signal(number, signal.SIG_IGN)  # a second one does not disturb the end
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            child.terminate()
    raise _raised[-1]


def _is_called_by_c(frame: FrameType | None) -> bool:
    """Return True if one of the callers is among `_CALLED_BY_C`."""
    while frame is not None and frame.f_code.co_name not in _CALLED_BY_C:
        frame = frame.f_back
    return frame is not None
