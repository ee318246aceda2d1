"""Choices of a call: which frequencies are solved, and how they are worked off."""

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
        Takes bands of four frequencies, as many at once as memory allows.  None: this process.
    progress : callable, optional
        Called with (frequencies done, frequencies in all).
    checkpoints : path, optional
        Folder in which every finished band is saved, and from which a run that was killed takes them again.
    """

    executor: Executor | None = None
    progress: Progress | None = None
    checkpoints: str | Path | None = None

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Adaptive:
    """Band in which master frequencies are chosen: as few as `fidelity.master_tolerance_db` allows.

    Parameters
    ----------
    low, high : float
        Limits of the band, Hz.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        check_fields(self)
