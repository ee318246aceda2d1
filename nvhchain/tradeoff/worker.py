"""One run of the chain in a process of its own, which tells its stages through a pipe: `python -m` this, by `measure`.

Standard input holds the pickled arguments of `chain.run`; the first argument is the file descriptor of the pipe, on
which one JSON object per line says what happens.
"""

from __future__ import annotations

import dataclasses
import json
import os
import pickle
import select
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
from nvhchain.files.shelf import Watcher, key_in
from nvhchain.handoff import HandOff
from nvhchain.runtime import processes


class Teller(Watcher):
    """Tells every stage with its seconds, and under which key its result lies in one of the folders."""

    def __init__(self, pipe: TextIO, folders: tuple[Path, ...]) -> None:
        self._pipe, self._folders, self._begun = pipe, folders, (0.0, 0.0)

    def tell(self, **event: Any) -> None:
        self._pipe.write(json.dumps(event) + "\n")
        self._pipe.flush()

    def begin(self, stage: str) -> None:
        self.tell(event="begin", stage=stage)
        self._begun = _clocks()

    def step(self, stage: str, done: int, total: int) -> None:
        pass

    def end(self, stage: str, how: str) -> None:
        if how == "computed":
            seconds, processor = (now - begun for now, begun in zip(_clocks(), self._begun, strict=True))
            self.tell(event="end", stage=stage, seconds=seconds, processor=processor, key=self._key(stage))

    def _key(self, stage: str) -> str:
        """Key of the file that has just been written."""
        files = [f for folder in self._folders for name in (f"{stage}.h5", f"{stage}-*.h5") for f in folder.glob(name)]
        key = key_in(max(files, key=lambda file: file.stat().st_mtime_ns))
        assert key is not None
        return key


def _clocks() -> tuple[float, float]:
    """s of wall time, and of all processors, user and system, this process and the children it has waited for."""
    return time.perf_counter(), sum(os.times()[:4])


def keys_of(result: Result) -> Iterator[tuple[str, str]]:
    """(stage, key) of every hand-off of a result that a stage made."""
    for field in dataclasses.fields(result):
        value = getattr(result, field.name)
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, HandOff) and "key" in item.provenance:
                yield item.provenance["stage"], item.provenance["key"]


def _end_with_listener(pipe: int) -> None:
    """Nobody listens any more: whoever asked is gone, and what this run took would not be entered."""
    listening = select.poll()
    listening.register(pipe, 0)
    listening.poll()
    processes.end_here()


def main() -> None:
    """Run, tell, and fail in words where the chain refuses."""
    signal(SIGINT, default_int_handler)  # what a script runs in the background ignores it otherwise
    signal(SIGTERM, default_int_handler)
    case, fidelity, out, operators = pickle.load(sys.stdin.buffer)
    with suppress(KeyboardInterrupt), os.fdopen(int(sys.argv[1]), "w") as pipe:
        Thread(target=_end_with_listener, args=(pipe.fileno(),), daemon=True).start()
        teller = Teller(pipe, (out, operators))
        try:
            result = chain.run(case, fidelity=fidelity, out=out, operators=operators, watcher=teller)
        except (InputError, SolverError, MemoryError) as error:
            teller.tell(event="refused", reason=" ".join(str(error).split()) or "out of memory")
            return
        teller.tell(event="done", stages=list(keys_of(result)))


if __name__ == "__main__":
    main()
