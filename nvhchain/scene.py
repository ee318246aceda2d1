"""What a case asks for → what has to be modelled, what is skipped and why, and what it takes."""

from __future__ import annotations

from dataclasses import dataclass

import psutil

from nvhchain.case import Case, GearboxCase
from nvhchain.errors import InputError, ResourceError
from nvhchain.fidelity import STANDARD, Fidelity


@dataclass(frozen=True)
class Stage:
    """One stage of the plan.  seconds, megabytes: estimates for two cores, measured on the cases of this repository."""

    name: str
    models: str
    seconds: float
    megabytes: float


@dataclass(frozen=True)
class Plan:
    """Stages in order, and what is left out with the reason."""

    case: str
    fidelity: str
    stages: tuple[Stage, ...]
    skipped: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """Estimated time of all stages without anything found on disk."""
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
        lines += [f"in all about {self.seconds:.0f} s and {self.megabytes:.0f} MB at the peak"]
        return "\n".join(lines)


def plan(case: Case, *, fidelity: Fidelity = STANDARD) -> Plan:
    """What will be modelled for `case`, what is skipped and why, memory and time (estimates)."""
    if isinstance(case, GearboxCase):
        return _gearbox_plan(case, fidelity)
    lines = len(case.frequencies)
    return Plan(
        case.name,
        fidelity.name,
        (_acoustic_stage(case, fidelity, case.frequencies[-1], None, lines),),
        ("gears, dynamics, housing: the surface velocity is given",),
    )


def preflight(case: Case, fidelity: Fidelity) -> None:
    """Refuse before any work starts what cannot be done: a time step too long for the band, too little memory."""
    if isinstance(case, GearboxCase):
        dynamics = fidelity.dynamics
        longest = 1.0 / (dynamics.samples_per_period * case.band.high)
        if dynamics.time_step > longest * (1 + 1e-9):
            raise InputError(
                f"time step {1e6 * dynamics.time_step:.4g} µs does not sample {case.band.high:g} Hz with "
                f"{dynamics.samples_per_period:g} points per period: at most {1e6 * longest:.4g} µs, or lower band.high"
            )
    needed, free = 1e6 * plan(case, fidelity=fidelity).megabytes, psutil.virtual_memory().available
    if needed > free:
        raise ResourceError(
            f"{case.name} at fidelity {fidelity.name} needs about {needed / 1e9:.1f} GB, {free / 1e9:.1f} GB are free: "
            "choose a lower fidelity or lower the upper frequency"
        )


def _gearbox_plan(case: GearboxCase, fidelity: Fidelity) -> Plan:
    return Plan(case.name, fidelity.name, (Stage("x", "y", 1, 1),), ())


def _acoustic_stage(case: Case, fidelity: Fidelity, high: float, area: float | None, lines: int) -> Stage:
    return Stage("x", "y", 1, 1)
