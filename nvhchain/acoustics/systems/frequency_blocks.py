"""Bands of frequencies: the unit of work for an executor, and for checkpoints from which an interrupted run resumes."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Generator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nvhchain.acoustics.systems.linear_system import SolverRecord
from nvhchain.conventions import Progress
from nvhchain.errors import InputError, SolverError, require, warn_caller
from nvhchain.files import hdf5
from nvhchain.files.result_cache import cached_result, code_version, fingerprint
from nvhchain.handoff import ComplexArray, FloatArray, SolvedBand
from nvhchain.runtime.cluster import is_gone, room, share, worker_lost, workers_at


@dataclass(frozen=True)
class BandCheckpoints:
    """Checkpoints of the bands of one step.

    folder : folder of the files.
    step : name of the step.
    inputs : all inputs of the values besides the frequencies of the band.

    A file is used only if its checksum is correct and its inputs, frequencies and code are those of this run.
    """

    folder: Path
    step: str
    inputs: tuple[Any, ...]

    def find(self, frequency: FloatArray) -> Solved | None:
        """Return the band of these frequencies; None if it has no checkpoint."""
        path, key = self._place(frequency)
        band = cached_result(path, SolvedBand, key)
        if band is None:
            return None
        values = band.values.reshape(len(band.frequency), *band.shape)
        return Solved(values, band.record)

    def keep(self, frequency: FloatArray, solved: Solved) -> None:
        """Save a band, whole or not at all; WriteError for a full disk or a folder in its place."""
        path, key = self._place(frequency)
        provenance = {"stage": f"acoustics.{self.step}", "key": key}
        shape = solved.values.shape[1:]
        rows = solved.values.reshape(len(frequency), -1)
        hdf5.save(SolvedBand(frequency, rows, np.array(shape), solved.record, provenance=provenance), path)

    def _place(self, frequency: FloatArray) -> tuple[Path, str]:
        """Return (file, key) of the band of these frequencies."""
        key = fingerprint("checkpoint", code_version("acoustics"), self.step, self.inputs, frequency)
        return self.folder / f"{self.step}-{key[:16]}.h5", key


def checkpoints_in_folder(folder: str | Path | None, step: str, *inputs: Any) -> BandCheckpoints | None:
    """Return the checkpoints of a step with these inputs; None without a folder.

    The folder is created and a file is tried in it. InputError before the solution if either fails.
    """
    if not folder:
        return None
    return BandCheckpoints(hdf5.writable_folder(folder, "checkpoints"), step, inputs)


BAND = 4
"""Frequencies per task: enough to share an engine's geometric work, few enough to spread and to report progress."""

_LOSSES = 3
"""Times a band may lose its worker before it counts as the cause."""

_PATIENCE = 5.0
"""Time (s) after which a wait checks that workers still exist."""

_TURNOVERS = 12.0
"""Largest number of complete losses of a cluster's workers since a band was finished, with one check per `_PATIENCE`. A
local cluster replaces a worker in a few seconds."""

Job = tuple[Any, ...]


class Solved(NamedTuple):
    """Values of a band, one row per frequency, and the record of its solver."""

    values: ComplexArray
    record: SolverRecord


Band = ComplexArray | Solved


def solve_bands(
    solve: Callable[..., Band],
    frequency: FloatArray,
    extra: tuple[Any, ...] = (),
    *,
    memory_per_task: int,
    executor: Executor | None,
    progress: Progress | None,
    checkpoints: BandCheckpoints | None = None,
    records: list[SolverRecord] | None = None,
) -> ComplexArray:
    """Return values of `solve(frequency band, *extra bands)` stacked over all frequencies.

    extra : arrays with one row per frequency, cut like the frequencies.
    memory_per_task : bytes. Running tasks never exceed the memory of the executor's machines.
    progress : function of the numbers of finished and of all frequencies.
    checkpoints : checkpoints. Bands in them are not solved; solved bands are saved at once.
    records : list to which the solver records are appended.

    The first exception of a task ends the call and cancels tasks that have not begun. If a band loses its worker,
    another one solves it. If no worker is left, this process solves the rest, with a RuntimeWarning. InputError for an
    executor that accepts no more tasks. ResourceError if no worker can hold a task. SolverError if a band loses one
    worker after the other.
    """
    require(
        executor is None or hasattr(executor, "submit"),
        f"executor = {executor!r} takes no tasks: hand in one of concurrent.futures, or None to solve in this process",
    )
    bands = [slice(start, start + BAND) for start in range(0, len(frequency), BAND)]
    values: ComplexArray | None = None
    done = 0

    def store(band: slice, solved: Band) -> None:
        nonlocal values, done
        part = solved.values if isinstance(solved, Solved) else solved
        if records is not None and isinstance(solved, Solved):
            records.append(solved.record)
        if values is None:
            values = np.empty((len(frequency), *part.shape[1:]), dtype=part.dtype)
        values[band] = part
        done += len(part)
        if progress:
            progress(done, len(frequency))

    if progress:
        progress(0, len(frequency))
    jobs = []
    for band in bands:
        kept = checkpoints.find(frequency[band]) if checkpoints else None
        if kept is None:
            jobs.append((band, (frequency[band], *(rows[band] for rows in extra))))
        else:
            store(band, kept)
    if executor is None:
        solved = ((number, solve(*job)) for number, (_, job) in enumerate(jobs))
    else:
        solved = _spread(solve, [job for _, job in jobs], memory_per_task, executor)
    with closing(solved):
        for number, part in solved:
            band = jobs[number][0]
            if checkpoints and isinstance(part, Solved):
                checkpoints.keep(frequency[band], part)
            store(band, part)
    assert values is not None
    return values


def _spread(
    solve: Callable[..., Band], jobs: list[Job], memory_per_task: int, executor: Executor
) -> Generator[tuple[int, Band]]:
    """Yield (number of the job, its values) in the order of completion; jobs are cancelled when the caller stops."""
    place = room(executor, memory_per_task)
    common = (code_version("acoustics"), place.neighbours, os.getpid(), solve)
    waiting, running, losses = list(range(len(jobs))), dict[Future[Band], int](), Counter[int]()
    seen, turnovers = workers_at(executor), 0.0
    try:
        while waiting or running:
            while waiting and len(running) < place.tasks:
                running[_submitted(executor, *common, *jobs[waiting[0]])] = waiting[0]
                del waiting[0]
            finished, _ = wait(running, timeout=_PATIENCE, return_when=FIRST_COMPLETED)
            finished |= {future for future in running if future.cancelled()}  # `wait` may never return these
            if not finished and is_gone(executor):
                raise BrokenExecutor("its scheduler is gone")
            if not finished:
                before, seen = seen, workers_at(executor)
                turnovers += _turnover(before, seen)
                if turnovers >= _TURNOVERS:
                    raise BrokenExecutor(f"its workers are lost as fast as they come, all {turnovers:.3g} times")
            for future in finished:
                number = running[future]
                error = _lost(future)
                if isinstance(error, BrokenExecutor):
                    raise error
                del running[future]
                if error is None:
                    turnovers = 0.0
                    yield number, _result(future, executor)
                    continue
                losses[number] += 1
                if losses[number] == _LOSSES:
                    reason = str(error) or type(error).__name__
                    raise SolverError(
                        f"{_LOSSES} workers were lost, or their tasks cancelled, one after the other under the same "
                        f"band of frequencies ({reason}): it needs {memory_per_task / 2**30:.3g} GiB; give workers "
                        "more memory, and let nobody else cancel"
                    ) from error
                waiting.insert(0, number)
    except BrokenExecutor as error:
        left = sorted([*running.values(), *waiting])
        warn_caller(
            f"the executor is broken ({error}): {len(left)} bands of frequencies are solved in this process",
            RuntimeWarning,
        )
        for future in running:
            future.cancel()
        running.clear()
        for number in left:
            yield number, _task(*common, *jobs[number])
    finally:
        for future in running:
            future.cancel()


def _turnover(previous: frozenset[Any] | None, now: frozenset[Any] | None) -> float:
    """Return the share of a cluster's workers lost between two checks; 1 if none are left."""
    if now is None or previous is None:
        return 0.0
    return len(previous - now) / len(previous) if previous else float(not now)


def _submitted(executor: Executor, *task: Any) -> Future[Band]:
    """Submit a task; InputError for an object that is no executor or was shut down, other errors pass."""
    try:
        future = executor.submit(_task, *task)
    except BrokenExecutor:
        raise
    except RuntimeError as error:
        # errors of concurrent.futures and dask about shutdown have no type of their own
        if "shutdown" not in str(error) and "closed" not in str(error):
            raise
        raise InputError(
            f"the executor takes no tasks any more ({error}): hand in one that is open until the call returns"
        ) from None
    require(
        isinstance(future, Future),
        f"executor = {executor!r:.60} is none of concurrent.futures: hand in one, of a dask client its get_executor()",
    )
    return future


def _lost(future: Future[Band]) -> BaseException | None:
    """Return the error that reveals a lost worker of a finished task; raise errors of the task itself."""
    try:
        future.result()
    except BaseException as error:
        if not worker_lost(error):
            raise
        return error
    return None


def _result(future: Future[Band], executor: Executor) -> Band:
    found = future.result()
    require(
        isinstance(found, Solved | np.ndarray),
        f"a future of executor = {executor!r:.60} gives {found!r:.40} instead of what its task returned: hand in one "
        "of concurrent.futures",
    )
    return found


def _task(version: str, neighbours: int, home: int, solve: Callable[..., Band], *job: Any) -> Band:
    """Solve one band on a worker, which must run the same code as its caller."""
    require(
        code_version("acoustics") == version,
        f"a worker runs nvhchain {code_version('acoustics')}, its caller {version}: install the same on all machines "
        "and restart the workers",
    )
    return share(home, neighbours, solve, *job)
