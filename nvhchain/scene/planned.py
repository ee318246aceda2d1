"""Costs and models of the steps of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from nvhchain.errors import counted
from nvhchain.scene.steps import Step

BASE_MEGABYTES = 390.0
"""Resident memory (MB) before a step begins."""
SECONDS_PER_STEP = 0.1
"""Processor time (s) of a step that computes next to nothing."""


@dataclass(frozen=True)
class PlannedStep:
    """One line of the plan; costs are estimates.

    step: row of the step table.
    name: step in words, with the gear stage where it has one.
    models: size and kind of the model.
    seconds: time (s) of all processors, user and system.
    megabytes: peak resident memory (MB).
    counts: estimated numbers of parts of the model.
    result: name of its result in the cache; empty for the name of the step.
    """

    step: Step[Any]
    name: str
    models: str
    seconds: float
    megabytes: float
    counts: Mapping[str, float] = field(default_factory=dict)
    result: str = ""

    def __post_init__(self) -> None:
        if not self.result:
            object.__setattr__(self, "result", self.step.file_of())


@dataclass(frozen=True)
class Plan:
    """Steps in their order, reasons for exclusions, and options to consider.

    case: name of the case.
    fidelity: name of the fidelity.
    steps: steps in their order.
    skipped: reasons for exclusions.
    options: options that are modelled or excluded, with their estimated decibels and seconds.
    bearings: loads and stiffness of bearings with a model, on rigid seats, and default damping.
    assumptions: assumptions of the case.
    deviations: manufacturing deviations of the stages, and the lines that they ask for.
    inputs: effects of inputs that are rarely known, the largest first.
    limits: parts of the limits to expect, the largest first.
    cached: names of results in the cache (`chain.cached_results`); their steps take no time.
    """

    case: str
    fidelity: str
    steps: tuple[PlannedStep, ...]
    skipped: tuple[str, ...]
    options: tuple[str, ...] = ()
    bearings: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    deviations: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    cached: frozenset[str] = frozenset()

    def __repr__(self) -> str:
        open_ = f"{len(self.remaining)} of {counted(len(self.steps), 'step')} to be computed"
        return f"Plan({self.case} at {self.fidelity}; {open_}, {self.seconds:.3g} s, {self.megabytes:.4g} MB)"

    @property
    def remaining(self) -> tuple[PlannedStep, ...]:
        """Steps whose results are not cached."""
        return tuple(step for step in self.steps if step.result not in self.cached)

    @property
    def seconds(self) -> float:
        """Estimated processor time (s) of the steps without cached results."""
        return sum(step.seconds for step in self.remaining)

    @property
    def megabytes(self) -> float:
        """Estimated peak memory (MB) of the largest step."""
        return max((step.megabytes for step in self.remaining), default=BASE_MEGABYTES)

    def __str__(self) -> str:
        width = max(len(step.name) for step in self.steps)
        lines = [f"{self.case} at fidelity {self.fidelity}", "modelled:"]
        lines += [
            f"  {step.name:<{width}}  "
            + (f"{step.seconds:6.0f} s {step.megabytes:7.0f} MB" if step in self.remaining else f"{'cached':>19}")
            + f"  {step.models}"
            for step in self.steps
        ]
        lines += (
            ["bearings, at static load on rigid seats:", *(f"  {line}" for line in self.bearings)]
            if self.bearings
            else []
        )
        lines += ["deviations:", *(f"  {line}" for line in self.deviations)] if self.deviations else []
        lines += ["skipped:", *(f"  {reason}" for reason in self.skipped)]
        lines += ["assumed:", *(f"  {sentence}" for sentence in self.assumptions)] if self.assumptions else []
        lines += ["options, by the gearbox linearised at its mean load:"] if self.options else []
        lines += [f"  {line}" for line in self.options]
        lines += ["uncertain inputs, over their spread:"] if self.inputs else []
        lines += [f"  {line}" for line in self.inputs]
        lines += ["95 % limits to expect, the largest part first:"] if self.limits else []
        lines += [f"  {line}" for line in self.limits]
        lines += [f"in all about {self.seconds:.0f} s of processor time, {self.megabytes:.0f} MB at the peak"]
        return "\n".join(lines)
