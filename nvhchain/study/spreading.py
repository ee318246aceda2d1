"""Spread of runs over this process or an executor: by memory, with one number of threads, beyond lost workers."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

from nvhchain.case import Case
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.result_cache import Watcher
from nvhchain.runtime.cluster import Room, room, share, worker_lost
from nvhchain.scene import plan
from nvhchain.study.measuring import measure, measure_drawn

LOSSES = 2
"""Number of lost workers after which a run is refused: its memory or a crash may be the cause."""

_PATIENCE = 1.0
"""s for which one wait lasts: Python may lose an interruption that comes on the way into a wait without an end."""

Outcome = dict[str, Any]


@dataclass(frozen=True)
class Task:
    """Run of one case for the rows that share it.

    key: fingerprint.
    rows: numbers of its rows.
    mean: case with the scatter of the case file, for one of many gearboxes that differ in their scatter alone.
    gearbox: number of such a gearbox: a worker runs all of its speeds, which share mesh law and load distribution.
    """

    key: str
    case: Case
    rows: tuple[int, ...]
    mean: Case | None = None
    gearbox: int = -1

    def work(self, *given: Any) -> tuple[Any, ...]:
        """Return the function that runs it and its arguments, of which `given` are the last."""
        return (measure, self.case, *given) if self.mean is None else (measure_drawn, self.case, self.mean, *given)


@dataclass(frozen=True)
class Spread:
    """Means of the runs.

    fidelity: fidelity of all runs.
    executor: executor; this process without one.
    operators: folder of shared operators.
    asked: responses on request.
    """

    fidelity: Fidelity
    executor: Executor | None
    operators: Path
    asked: tuple[str, ...] = ()

    def outcomes(self, tasks: Sequence[Task], watcher: Watcher | None = None) -> Iterator[tuple[Task, Outcome, str]]:
        """Yield every task with its outcome and a line of progress, in the order of their ends.

        tasks: runs; the first one has this process for itself, for the shared operators.
        watcher: receives begin, progress and end of the steps of the first one.
        Yields Task, dict, str: run, its outcome, and a line with the time that is left.
        """
        if not tasks:
            return
        writable_folder(self.operators, "operators")
        began, times = time.monotonic(), list[float]()
        for done, (task, found) in enumerate(self._done(tasks, watcher), 1):
            times.append(time.monotonic() - began)
            each = fmean([times[0]] if done == 1 else [(times[-1] - times[0]) / (done - 1)])  # operators come first
            left = f"; about {_duration(each * (len(tasks) - done))} left" if 1 < done < len(tasks) else ""
            yield task, found, f"{done} of {len(tasks)}: {_words(found)}{left}"

    def _done(self, tasks: Sequence[Task], watcher: Watcher | None) -> Iterator[tuple[Task, Outcome]]:
        first, rest = tasks[0], tasks[1:]
        yield first, self._run(first, watcher)
        if self.executor is None:
            yield from ((task, self._run(task)) for task in rest)
        elif rest:
            yield from self._spread(rest, self.executor)

    def _run(self, task: Task, watcher: Watcher | None = None) -> Outcome:
        function, *given = task.work(self.fidelity, self.operators, self.asked, watcher)
        found: Outcome = function(*given)
        return found

    def _spread(self, tasks: Sequence[Task], executor: Executor) -> Iterator[tuple[Task, Outcome]]:
        """Yield tasks from an executor, which never holds more of them than its memory permits."""
        memory = self._memory(tasks[0].case)
        waiting = list(reversed(_together(tasks)))
        running: dict[Future[list[Outcome]], tuple[Task, ...]] = {}
        lost: dict[str, int] = {}
        try:
            while waiting or running:
                space = room(executor, memory)  # workers come and go
                while waiting and len(running) < space.tasks:
                    group = waiting.pop()
                    running[self._submit(executor, group, space)] = group
                for future in wait(running, _PATIENCE, FIRST_COMPLETED).done:
                    group, error = running.pop(future), future.exception()
                    if error is None:
                        yield from zip(group, future.result(), strict=True)
                    elif not worker_lost(error):
                        raise error
                    elif (count := lost.get(group[0].key, 0) + 1) < LOSSES:
                        lost[group[0].key] = count
                        waiting.append(group)
                    else:
                        yield from ((task, _lost(count)) for task in group)
        finally:
            for future in running:
                future.cancel()

    def _submit(self, executor: Executor, group: Sequence[Task], space: Room) -> Future[list[Outcome]]:
        work = [task.work(self.fidelity, self.operators, self.asked) for task in group]
        return executor.submit(share, os.getpid(), space.neighbours, _one_by_one, work)

    def _memory(self, case: Case) -> int:
        """Return the estimated memory (bytes) of a run."""
        return int(2**20 * max(step.megabytes for step in plan(case, fidelity=self.fidelity).steps))


def _together(tasks: Sequence[Task]) -> list[tuple[Task, ...]]:
    """Return tasks in groups of one gearbox; tasks of no such gearbox stay alone."""
    groups: dict[tuple[int, str], list[Task]] = {}
    for task in tasks:
        groups.setdefault((task.gearbox, "" if task.gearbox >= 0 else task.key), []).append(task)
    return [tuple(group) for group in groups.values()]


def _one_by_one(work: Sequence[tuple[Any, ...]]) -> list[Outcome]:
    """Return the outcome of every function with its arguments."""
    return [function(*given) for function, *given in work]


def _lost(count: int) -> Outcome:
    reason = f"{count} workers were lost under this run: give workers more memory, or run without workers"
    return {"responses": {}, "limits": {}, "band": None, "refused": reason, "seconds": 0.0}


def _words(found: Outcome) -> str:
    if found["refused"]:
        return f"refused ({found['refused']:.80})"
    shown = [f"{name} {value:.4g}" for name, value in found["responses"].items()]
    return ", ".join(shown[:3]) + f" ({found['seconds']:.1f} s)"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
