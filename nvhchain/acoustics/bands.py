"""Frequencies in bands: the unit of work that goes to an executor."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import Any

import numpy as np
import psutil

from nvhchain.conventions import Progress
from nvhchain.handoff import ComplexArray, FloatArray

BAND = 4
"""Frequencies per task: enough to share an engine's geometric work, few enough to spread and to report progress."""


def over_bands(
    solve: Callable[..., ComplexArray],
    frequency: FloatArray,
    extra: tuple[Any, ...],
    arguments: tuple[Any, ...],
    *,
    memory_per_task: int,
    executor: Executor | None,
    progress: Progress | None,
) -> ComplexArray:
    """Values of `solve(frequency band, *extra bands, *arguments)` stacked over all frequencies.

    extra: arrays with one row per frequency, cut like the frequencies.  memory_per_task: bytes; no more tasks are under
    way at once than fit into the memory that is free now.  progress: called with (frequencies done, in all).
    """
    starts = range(0, len(frequency), BAND)
    report = progress or (lambda done, total: None)
    parts: dict[int, ComplexArray] = {}

    def job(start: int) -> tuple[Any, ...]:
        cut = slice(start, start + BAND)
        return (frequency[cut], *(rows[cut] for rows in extra), *arguments)

    done = 0
    report(0, len(frequency))
    if executor is None:
        for start in starts:
            parts[start] = solve(*job(start))
            done += len(parts[start])
            report(done, len(frequency))
    else:
        limit = max(1, int(psutil.virtual_memory().available // memory_per_task))
        waiting, running = list(starts), dict[Future[ComplexArray], int]()
        while waiting or running:
            while waiting and len(running) < limit:
                start = waiting.pop(0)
                running[executor.submit(solve, *job(start))] = start
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                start = running.pop(future)
                parts[start] = future.result()
                done += len(parts[start])
                report(done, len(frequency))
    return np.concatenate([parts[start] for start in starts])
