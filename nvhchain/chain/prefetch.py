"""Operators of gearboxes on two cores: mesh laws in a separate process, housings and transfer vectors in this one.

This module is the separate process (`python -m`). Mesh laws and housing are independent, and a second thread speeds up
neither much.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from signal import SIGINT, SIGTERM, default_int_handler, signal
from tempfile import TemporaryFile
from threading import Thread
from time import perf_counter
from typing import IO

from nvhchain.case import Case, GearboxCase
from nvhchain.chain import steps
from nvhchain.chain.cached import cached_results
from nvhchain.chain.running import Run
from nvhchain.errors import concerning
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.result_cache import AheadWatcher, ResultCache, Unwatched, Watcher
from nvhchain.runtime import processes
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import blas_threads, cores
from nvhchain.scene import Scene, decided, planned_steps, preflight
from nvhchain.scene.planned import PlannedStep
from nvhchain.scene.steps import HOUSING, MESH_LAWS, TRANSFER_VECTORS

_LEAST_SECONDS = 5.0
"""Smallest processor time (s) of laws and of housings for which a second process saves time."""

_ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "MKL", "OPENBLAS", "NUMBA")}


class _OnlyComputed(Unwatched):
    """Watcher that passes on the progress of computed steps; the run itself reports cached ones."""

    def __init__(self, watcher: Watcher | None) -> None:
        self._watcher = watcher or Unwatched()

    def begin(self, step: str) -> None:
        self._watcher.begin(step)

    def step(self, step: str, done: int, total: int) -> None:
        self._watcher.step(step, done, total)

    def end(self, step: str, outcome: str) -> None:
        if outcome == "computed":
            self._watcher.end(step, outcome)


@contextmanager
def operators_ahead(
    cases: Sequence[Case], fidelity: Fidelity, operators: Path, watcher: Watcher | None = None
) -> Iterator[None]:
    """Compute housings, mesh laws and transfer vectors of `cases` in advance, and compile the code of the next steps.

    cases: cases that will run with the same operators.
    operators: folder of the shared operators.
    watcher: receives the progress of the housings and transfer vectors.

    A run inside this context waits at the cache for a law that the other process has begun. It computes the others
    itself. Nothing is done in advance with one core, or where too little work is left, or memory, for two processes.
    The same holds for options whose laws need more than the gears.
    """
    cases = [decided(case, fidelity) for case in cases]
    gearboxes = [case for case in cases if isinstance(case, GearboxCase) and _laws_need_gears_alone(case)]
    if len(gearboxes) < len(cases) or not _second_process_pays(gearboxes, fidelity, operators):
        yield
        return
    for case in cases:
        preflight(case, fidelity, {})
    writable_folder(operators, "operators")
    with _mesh_law_process(gearboxes, fidelity, operators, watcher):
        runs = [Run(Scene(case, fidelity), shared=ResultCache(operators, _OnlyComputed(watcher))) for case in gearboxes]
        with blas_threads(1):
            for run in runs:
                with concerning(run.case.name):
                    run.hand_offs[HOUSING] = steps.reduced_housing(run)
        for run in runs:
            steps.compile_kernels(run.gearbox, fidelity)
            with concerning(run.case.name):  # while the other process is at the mesh laws
                steps.transfer_vectors_ahead(run)
        yield


@contextmanager
def _mesh_law_process(
    cases: Sequence[GearboxCase], fidelity: Fidelity, operators: Path, watcher: Watcher | None = None
) -> Iterator[None]:
    """Compute the mesh laws in another process; errors there are silent and recur where the law is needed."""
    with (
        TemporaryFile() as told,
        processes.start_python(
            "-m", "nvhchain.chain.prefetch", stdin=processes.PIPE, stderr=told, environment=_ONE_THREAD
        ) as process,
    ):
        if isinstance(watcher, AheadWatcher):
            watcher.ahead(partial(_finished, told))
        assert process.stdin is not None
        try:
            with suppress(BrokenPipeError):
                pickle.dump((cases, fidelity, operators), process.stdin)
                process.stdin.flush()
            yield
        finally:
            with suppress(BrokenPipeError):
                process.stdin.close()  # this ends the process


def _finished(told: IO[bytes]) -> dict[tuple[str, str], float]:
    """Return (case, step) → seconds of the steps that the other process has told of in its standard error."""
    if told.closed:
        return {}
    text = os.pread(told.fileno(), 1 << 20, 0) if hasattr(os, "pread") else b""
    lines = [line.split("\t") for line in text.decode(errors="replace").splitlines()]
    return {(line[1], line[2]): float(line[3]) for line in lines if len(line) == 5 and line[0] == line[4] == _COMPUTED}


_COMPUTED = "computed"
"""First and last word of a line of the other process about a step."""


class _Telling(Unwatched):
    """Watcher of the other process: it tells of every step that it has computed."""

    def __init__(self, case: str) -> None:
        self._case, self._began = case, 0.0

    def begin(self, step: str) -> None:
        self._began = perf_counter()

    def end(self, step: str, outcome: str) -> None:
        if outcome == "computed":
            told = (_COMPUTED, self._case, step, f"{perf_counter() - self._began:.3f}", _COMPUTED)
            print("\t".join(told), file=sys.stderr, flush=True)


def _laws_need_gears_alone(case: GearboxCase) -> bool:
    """Return True where the mesh laws need only the gears, and no other step needs the gears' compliance."""
    options = case.options
    return not (options.tilt or options.load_distribution or options.loaded_misalignment)


def _second_process_pays(cases: Sequence[GearboxCase], fidelity: Fidelity, operators: Path) -> bool:
    """Return True if a second process saves time and the memory is enough for both."""
    planned, kinds = list[PlannedStep](), (HOUSING, MESH_LAWS, TRANSFER_VECTORS)
    for case in cases:
        cached = cached_results(case, fidelity=fidelity, out=operators, only=kinds)
        planned += [one for one in planned_steps(Scene(case, fidelity)) if one.result not in cached]
    housings, laws, vectors = ([one for one in planned if one.step is kind] for kind in kinds)
    seconds = min(sum(one.seconds for one in kind) for kind in (housings, laws))
    megabytes = sum(max((one.megabytes for one in kind), default=0.0) for kind in (laws, housings + vectors))
    return cores() > 1 and seconds > _LEAST_SECONDS and 1e6 * megabytes < free_memory()


def _end_with_caller() -> None:
    """End this process when the caller closes its end of the pipe or has ended."""
    sys.stdin.buffer.read()
    processes.end_here()


def main() -> None:
    """Compute the mesh laws of all cases."""
    signal(SIGINT, default_int_handler)  # background jobs of a script ignore it otherwise
    signal(SIGTERM, default_int_handler)
    cases, fidelity, operators = pickle.load(sys.stdin.buffer)
    with suppress(KeyboardInterrupt):
        Thread(target=_end_with_caller, daemon=True).start()
        for case in cases:
            steps.mesh_laws(Run(Scene(case, fidelity), shared=ResultCache(operators, _Telling(case.name))))


if __name__ == "__main__":
    main()
