"""What is modelled, stage by stage, and what it takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

BASE_MEGABYTES = 390.0
"""Resident before a stage begins."""
SECONDS_PER_STAGE = 0.1
"""Of a stage that computes next to nothing."""


@dataclass(frozen=True)
class Stage:
    """One stage of the plan.

    seconds: of all processors, user and system.  megabytes: resident at the peak.  Both are estimates.
    counts: how much of what is modelled, as far as it is estimated.
    """

    name: str
    models: str
    seconds: float
    megabytes: float
    counts: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """Stages in order, what is left out with the reason, and options of the case that its gearbox would notice."""

    case: str
    fidelity: str
    stages: tuple[Stage, ...]
    skipped: tuple[str, ...]
    advice: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """Estimated processor time of all stages when nothing is found on disk."""
        return sum(stage.seconds for stage in self.stages)

    @property
    def megabytes(self) -> float:
        """Estimated peak memory: of the largest stage."""
        return max(stage.megabytes for stage in self.stages)

    def __str__(self) -> str:
        width = max(len(stage.name) for stage in self.stages)
        lines = [f"{self.case} at fidelity {self.fidelity}", "modelled:"]
        lines += [
            f"  {stage.name:<{width}}  {stage.seconds:6.0f} s {stage.megabytes:7.0f} MB  {stage.models}"
            for stage in self.stages
        ]
        lines += ["skipped:", *(f"  {reason}" for reason in self.skipped)]
        lines += ["would be noticed:", *(f"  {why}" for why in self.advice)] if self.advice else []
        lines += [f"in all about {self.seconds:.0f} s of processor time, {self.megabytes:.0f} MB at the peak"]
        return "\n".join(lines)
