"""SIGTERM as an interruption: it ends a command as Ctrl-C does, with its children and its temporary files.

Python drops exceptions raised while it deletes an object; an interruption is raised again.
"""

from __future__ import annotations

import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

import psutil


class Terminated(KeyboardInterrupt):
    """Interruption by SIGTERM."""


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Let SIGTERM end child processes, which Ctrl-C reaches through the terminal, and raise Terminated."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before, hook = signal.signal(signal.SIGTERM, _interrupt), sys.unraisablehook
    sys.unraisablehook = _raised_again
    try:
        yield
    finally:
        sys.unraisablehook = hook
        signal.signal(signal.SIGTERM, before)


_AGAIN = 0.02
"""Time (s) after which a dropped interruption is raised again, once the object is deleted."""


def _raised_again(dropped: Any) -> None:
    """Handle an exception that Python drops."""
    if not issubclass(dropped.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(dropped)
        return
    number = signal.SIGINT
    if issubclass(dropped.exc_type, Terminated):
        number = signal.SIGTERM
        signal.signal(number, _interrupt)
    timer = threading.Timer(_AGAIN, interrupt_main, (number,))
    timer.daemon = True
    timer.start()


def _interrupt(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second one does not disturb the end
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            child.terminate()
    raise Terminated
