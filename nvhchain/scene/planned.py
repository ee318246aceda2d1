"""Costs of the steps of a run, and what is modelled in each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from nvhchain.scene.steps import Step

BASE_MEGABYTES = 390.0
"""Resident before a step begins."""
SECONDS_PER_STEP = 0.1
"""Of a step that computes next to nothing."""


@dataclass(frozen=True)
class PlannedStep:
    """One line of the plan; costs are estimates.

    Parameters
    ----------
    step
        Row of the step table.
    name
        Words for it, with the gear stage where it has one.
    models
        Size and kind of what is modelled.
    seconds
        Time of all processors, user and system.
    megabytes
        Resident memory at the peak.
    counts
        Numbers of what is modelled, as far as they are estimated.
    """

    step: Step[Any]
    name: str
    models: str
    seconds: float
    megabytes: float
    counts: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """Steps in their order, reasons for what is excluded, and options of the case that its gearbox would notice."""

    case: str
    fidelity: str
    steps: tuple[PlannedStep, ...]
    skipped: tuple[str, ...]
    advice: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """Estimated processor time of all steps when nothing is cached."""
        return sum(step.seconds for step in self.steps)

    @property
    def megabytes(self) -> float:
        """Estimated peak memory: of the largest step."""
        return max(step.megabytes for step in self.steps)

    def __str__(self) -> str:
        width = max(len(step.name) for step in self.steps)
        lines = [f"{self.case} at fidelity {self.fidelity}", "modelled:"]
        lines += [
            f"  {step.name:<{width}}  {step.seconds:6.0f} s {step.megabytes:7.0f} MB  {step.models}"
            for step in self.steps
        ]
        lines += ["skipped:", *(f"  {reason}" for reason in self.skipped)]
        lines += ["would be noticed:", *(f"  {why}" for why in self.advice)] if self.advice else []
        lines += [f"in all about {self.seconds:.0f} s of processor time, {self.megabytes:.0f} MB at the peak"]
        return "\n".join(lines)
