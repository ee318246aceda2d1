"""SIGTERM as an interruption, so that it ends a command as Ctrl-C does: with its children and its temporary files."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

import psutil


class Terminated(KeyboardInterrupt):
    """SIGTERM came."""


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Let SIGTERM end the processes started here, which Ctrl-C reaches by the terminal, and raise Terminated."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _interrupt(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second one does not disturb the end
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            child.terminate()
    raise Terminated
