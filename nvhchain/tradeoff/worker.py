"""One run of the chain in a process of its own, with its events in a file.

`measure` starts this module with `python -m`. Standard input brings the pickled arguments of `chain.run` and the path
of the file, which takes one JSON object per line and event. The process ends when standard input closes.
"""

from __future__ import annotations

import dataclasses
import json
import os
import pickle
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from signal import SIGINT, SIGTERM, default_int_handler, signal
from threading import Thread
from typing import Any, TextIO

from nvhchain import chain
from nvhchain.chain.result import Result
from nvhchain.errors import InputError, SolverError
from nvhchain.files.result_cache import Watcher, key_in, origin
from nvhchain.handoff import HandOff
from nvhchain.runtime import processes


class EventWatcher(Watcher):
    """Watcher that sends every step with its seconds and the cache key of its result."""

    def __init__(self, events: TextIO, folders: tuple[Path, ...]) -> None:
        self._events, self._folders, self._begun = events, folders, (0.0, 0.0)

    def send(self, **event: Any) -> None:
        """Send one event."""
        self._events.write(json.dumps(event) + "\n")
        self._events.flush()

    def begin(self, step: str) -> None:
        """Send the begin of a step."""
        self.send(event="begin", stage=step)
        self._begun = _clocks()

    def step(self, step: str, done: int, total: int) -> None:
        """Ignore progress within a step."""
        pass

    def end(self, step: str, outcome: str) -> None:
        """Send the end of a computed step with its time and key."""
        if outcome == "computed":
            seconds, processor = (now - begun for now, begun in zip(_clocks(), self._begun, strict=True))
            self.send(event="end", stage=step, seconds=seconds, processor=processor, key=self._key(step))

    def _key(self, step: str) -> str:
        """Return the key of the newest file of a step."""
        files = [f for folder in self._folders for name in (f"{step}.h5", f"{step}-*.h5") for f in folder.glob(name)]
        key = key_in(max(files, key=lambda file: file.stat().st_mtime_ns))
        assert key is not None
        return key


def _clocks() -> tuple[float, float]:
    """Return wall time (s), and processor time (s), user and system, of this process and its finished children."""
    return time.perf_counter(), sum(os.times()[:4])


def keys_of(result: Result) -> Iterator[tuple[str, str]]:
    """Yield (step, key) of every hand-off of a result that a step made."""
    for field in dataclasses.fields(result):
        value = getattr(result, field.name)
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, HandOff) and (made := origin(item)):
                yield made


def _end_with_caller() -> None:
    """End this process when its caller has ended or closes standard input: its costs would not be entered."""
    with suppress(OSError):
        while os.read(0, 4096):
            pass
    processes.end_here()


def main() -> None:
    """Run, send events, and send the reason where the chain refuses."""
    signal(SIGINT, default_int_handler)  # background jobs of a script ignore it otherwise
    signal(SIGTERM, default_int_handler)
    case, fidelity, out, operators, file = pickle.load(sys.stdin.buffer)
    os.environ.pop("NVHCHAIN_CACHE", None)  # a step from there has no cost here
    with suppress(KeyboardInterrupt), file.open("w") as events:
        Thread(target=_end_with_caller, daemon=True).start()
        teller = EventWatcher(events, (out, operators))
        try:
            result = chain.run(case, fidelity=fidelity, out=out, operators=operators, watcher=teller)
        except (InputError, SolverError, MemoryError) as error:
            teller.send(event="refused", reason=" ".join(str(error).split()) or "out of memory")
            return
        teller.send(event="done", stages=list(keys_of(result)))


if __name__ == "__main__":
    main()
