"""Operators of gearboxes on two cores: mesh laws in a separate process, all operators in this one.

This module is the separate process (`python -m`). It computes the mesh laws with their load distributions, the longest
first, and then what the estimates of options take from the gears. This process computes housings and transfer vectors,
and then laws, the shortest first, until both meet. A second thread speeds up the finite elements of either little.

Gears and housings are independent, unless the housing tilts the gears under load. The other process then computes the
flank compliances, which are most of the work, and waits for the housing.
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
from typing import IO, Any

from nvhchain import gear
from nvhchain.case import Case, GearboxCase
from nvhchain.chain import steps
from nvhchain.chain.cached import cached_results
from nvhchain.chain.loaded import gear_bodies
from nvhchain.chain.running import Run
from nvhchain.errors import InputError, SolverError, concerning
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.result_cache import AheadWatcher, ResultCache, Unwatched, Watcher, fingerprint
from nvhchain.runtime import processes
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import blas_threads, cores, granted
from nvhchain.scene import Scene, modelled, modelled_alike, planned_steps, preflight
from nvhchain.scene.kept import estimates_kept
from nvhchain.scene.mechanics import law_knobs
from nvhchain.scene.planned import PlannedStep
from nvhchain.scene.steps import HOUSING, LOAD_DISTRIBUTIONS, MESH_LAWS, TRANSFER_VECTORS

_LEAST_SECONDS = 5.0
"""Smallest processor time (s) of the work of each of two processes for which the second one saves time."""

_Law = tuple[int, int]
"""Numbers of a case and of its gear stage, from 0."""

_ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "MKL", "OPENBLAS", "NUMBA")}


class _OnlyComputed(Unwatched):
    """Watcher that passes on the progress of computed steps; the run itself reports cached ones.

    case: name of the case, which the names of its steps get; empty for one case alone.
    """

    def __init__(self, watcher: Watcher | None, case: str) -> None:
        self._watcher, self._suffix = watcher or Unwatched(), f" of {case}" if case else ""

    def begin(self, step: str) -> None:
        self._watcher.begin(step + self._suffix)

    def step(self, step: str, done: int, total: int) -> None:
        self._watcher.step(step + self._suffix, done, total)

    def end(self, step: str, outcome: str) -> None:
        if outcome == "computed":
            self._watcher.end(step + self._suffix, outcome)


@contextmanager
def operators_ahead(
    cases: Sequence[Case],
    fidelity: Fidelity,
    operators: Path,
    watcher: Watcher | None = None,
    states: tuple[Sequence[float] | None, Sequence[float] | None] = (None, None),
) -> Iterator[None]:
    """Compute housings, mesh laws and transfer vectors of `cases` in advance, and compile the code of the next steps.

    cases: cases that will run with the same operators.
    operators: folder of the shared operators.
    watcher: receives the progress of what is computed in this process.
    states: further steady speeds of the input (rad/s) and torques (N m), for which open options are decided, too.

    A law that the other process has begun is waited for. If that process fails, this one computes its laws. Nothing is
    done in advance with one core, where too little work is left, or memory, for two processes, or where threads of this
    process save more.
    """
    asked, cases = cases, _decided_alike(cases, fidelity, states)
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    laws = _laws_ahead(gearboxes, fidelity, operators) if len(gearboxes) == len(cases) else []
    if not laws:
        yield
        return
    for case in cases:
        preflight(case, fidelity, {})
    writable_folder(operators, "operators")
    unestimated = [gearbox for case, gearbox in zip(asked, gearboxes, strict=True) if case is gearbox]
    with _mesh_law_process((gearboxes, fidelity, operators, laws, unestimated), watcher):
        runs = []
        for case in gearboxes:
            watching = _OnlyComputed(watcher, case.name if len(gearboxes) > 1 else "")
            runs.append(Run(Scene(case, fidelity), shared=ResultCache(operators, watching)))
        with blas_threads(1):
            for run in (run for run in runs if HOUSING in run.scene.steps):
                with concerning(run.case.name):
                    run.hand_offs[HOUSING] = steps.reduced_housing(run)
        for run in runs:
            steps.compile_kernels(run.gearbox, fidelity)
            with concerning(run.case.name):  # while the other process is at the mesh laws
                steps.transfer_vectors_ahead(run)
        with blas_threads(1), granted(1):
            for number, stage in reversed(laws):
                with concerning(runs[number].case.name):
                    steps.stage_ahead(runs[number], stage)
        yield


def _decided_alike(cases: Sequence[Case], fidelity: Fidelity, states: Any) -> list[Case]:
    """Return the cases without `auto`, as a comparison decides them; those that leave nothing open as they are."""
    if not any(isinstance(case, GearboxCase) and case.options.undecided for case in cases):
        return list(cases)
    decisions = modelled_alike(cases, fidelity, *states)
    return [decisions[case.name].case if case.name in decisions else case for case in cases]


_Task = tuple[Sequence[GearboxCase], Fidelity, Path, Sequence[_Law], Sequence[GearboxCase]]
"""Work of the other process: cases, fidelity, folder of operators, laws, and cases whose estimates are not made yet."""


@contextmanager
def _mesh_law_process(task: _Task, watcher: Watcher | None = None) -> Iterator[None]:
    """Let another process work; errors there are silent and recur where the result is needed."""
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
                pickle.dump(task, process.stdin)
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


def _laws_ahead(cases: Sequence[GearboxCase], fidelity: Fidelity, operators: Path) -> list[_Law]:
    """Return the mesh laws to compute, the longest first; none where a second process saves no time, or lacks memory.

    The other process takes all laws, this one the housings and all laws but the longest: the shorter work is saved.
    Where laws alone are missing and one of them is longer than all others, threads of this process save more.
    """
    laws, others, found = dict[_Law, PlannedStep](), list[PlannedStep](), set[str]()
    for number, case in enumerate(cases):
        cached = cached_results(case, fidelity=fidelity, out=operators, only=(HOUSING, MESH_LAWS, TRANSFER_VECTORS))
        if cached.issuperset(MESH_LAWS.file_of(stage.name) for stage in case.stages):
            continue
        scene = Scene(case, fidelity)
        tilted = number if case.options.models("loaded_misalignment") else None  # cases tilt the same gears differently
        spread = LOAD_DISTRIBUTIONS in scene.steps
        planned = {one.result: one for one in planned_steps(scene) if one.result not in cached}
        others += [one for one in planned.values() if one.step in (HOUSING, TRANSFER_VECTORS)]
        for stage, (drawn, pair, force) in enumerate(zip(case.stages, case.pairs, case.mesh_forces, strict=True)):
            knobs = law_knobs(case, stage, fidelity.gear)
            result, load = MESH_LAWS.file_of(drawn.name), gear.law_load(force)
            inputs = fingerprint(drawn.name, pair, load, knobs, tilted, spread)
            if result in planned and inputs not in found:  # cases have laws in common
                laws[number, stage] = planned[result]
                found.add(inputs)
    ordered = sorted(laws, key=lambda law: -laws[law].seconds)
    if not laws or (not others and 2.0 * laws[ordered[0]].seconds > sum(one.seconds for one in laws.values())):
        return []  # threads share the longest law, processes cannot
    here = [*(laws[law] for law in ordered[1:]), *others]
    seconds = min(
        sum(one.seconds for one in laws.values()), sum(one.seconds for one in here if one.step is not TRANSFER_VECTORS)
    )
    megabytes = sum(max((one.megabytes for one in some), default=0.0) for some in (laws.values(), here))
    enough = cores() > 1 and seconds > _LEAST_SECONDS and 1e6 * megabytes < free_memory()
    return ordered if enough else []


def _tilted(scene: Scene) -> bool:
    """Return True where the housing tilts the gears under load, and so must be known before their laws."""
    return HOUSING in MESH_LAWS.needs(scene)


def _end_with_caller() -> None:
    """End this process when the caller closes its end of the pipe or has ended.

    A thread that holds the lock of `sys.stdin` would abort Python at its end.
    """
    os.read(sys.stdin.fileno(), 1)
    processes.end_here()


def main() -> None:
    """Compute mesh laws, in their order, and what the estimates of options take from the gears."""
    signal(SIGINT, default_int_handler)  # background jobs of a script ignore it otherwise
    signal(SIGTERM, default_int_handler)
    cases, fidelity, operators, laws, unestimated = pickle.load(sys.stdin.buffer)
    with suppress(KeyboardInterrupt):
        Thread(target=_end_with_caller, daemon=True).start()
        runs = [Run(Scene(case, fidelity), shared=ResultCache(operators, _Telling(case.name))) for case in cases]
        tilted = [_tilted(run.scene) for run in runs]
        for number, stage in laws:
            if tilted[number]:
                runs[number].compliances[stage](lambda done, total: None)
            else:
                steps.stage_ahead(runs[number], stage)
        for run in runs:
            if run.gearbox.options.models("gear_body_modes"):
                gear_bodies(run.gearbox, fidelity.gear, run.shared)
        # an error recurs where the estimates are needed
        with suppress(InputError, SolverError), estimates_kept(operators):
            for case in unestimated:
                modelled(case, fidelity)
        for number in sorted({number for number, _ in laws if tilted[number]}):  # the caller makes them in this order
            runs[number].hand_offs[HOUSING] = steps.reduced_housing(runs[number])
        for number, stage in laws:
            if tilted[number]:
                steps.stage_ahead(runs[number], stage)


if __name__ == "__main__":
    main()
