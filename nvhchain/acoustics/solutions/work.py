"""Settings of a call: the frequencies to solve, executor, progress and checkpoints."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from nvhchain.conventions import Progress
from nvhchain.kinds import check_fields


@dataclass(frozen=True)
class Work:
    """Executor, progress and checkpoints of a call.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        Executor for bands of four frequencies, as many at once as memory permits. None: this process.
    progress : callable, optional
        Function of the numbers of finished and of all frequencies.
    checkpoints : path, optional
        Folder of checkpoints: every finished band is saved, and an interrupted run resumes from them.
    """

    executor: Executor | None = None
    progress: Progress | None = None
    checkpoints: str | Path | None = None

    def __post_init__(self) -> None:
        check_fields(self)


HERE = Work()
"""Work in this process, without progress and checkpoints."""


@dataclass(frozen=True)
class Adaptive:
    """Band in which master frequencies are chosen: as few as `fidelity.master_tolerance_db` permits.

    low, high: limits of the band (Hz).
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        check_fields(self)
