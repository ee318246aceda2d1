"""What a sweep has to offer to the cases that are planned for: settings, what they err by there and what they save."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from nvhchain.case import Case
from nvhchain.errors import AccuracyWarning, InputError, require
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.scene import check_knobs
from nvhchain.tradeoff import elsewhere
from nvhchain.tradeoff.knobs import BEYOND, PRESET, Knob, knobs_by_stage, knobs_of, spoken
from nvhchain.tradeoff.sweep import Measurement, Tradeoff, case_identity

_WARNED_OF = frozenset({"acoustics.radiation"})
"""Knobs of which a run warns at their cheaper values: the Rayleigh integral is more than 3 dB off in the mean of the
worst body at every wavenumber, the equivalent radiated power below 4 over half the size of the body
(docs/measured/acoustics/radiation.md)."""


@dataclass(frozen=True)
class Task:
    """What is planned for, from what.

    given: names of ready-made hand-offs, or these by name.  tolerance: dB.  warnings: those that the base gives of
    itself.  same: whether the cases are the one that was swept.
    """

    cases: tuple[Case, ...]
    given: Collection[str]
    sweep: Tradeoff
    base: Fidelity
    tolerance: float
    warnings: frozenset[str] = frozenset()
    same: bool = False

    @property
    def knobs(self) -> list[Knob]:
        """Those that some case looks at."""
        return [knob for case in self.cases for knob in knobs_of(case, given=self.given)]

    @property
    def swept_extent(self) -> Mapping[str, object] | None:
        return self.sweep.provenance.get("extent")

    @property
    def swept_points(self) -> int:
        """Field points at which errors were measured."""
        return 1 if self.sweep.yardstick is None else len(self.sweep.yardstick.points)


@dataclass(frozen=True)
class Offer:
    """A knob at a value, or a preset.  error: dB.  shares: stage of the sweep → what it leaves of the stage's time."""

    knob: Knob
    value: tuple[object, ...]
    error: float
    shares: Mapping[str, float]


def is_swept(cases: Sequence[Case], sweep: Tradeoff) -> bool:
    """Whether all these cases are the one that was swept."""
    return all(case_identity(case) == sweep.provenance.get("case") for case in cases)


def base_of(sweep: Tradeoff) -> Fidelity:
    """The preset around which the sweep was measured, as it still is."""
    require(sweep.base in PRESETS, f"the sweep's base {sweep.base!r} is no preset: sweep around {', '.join(PRESETS)}")
    base, then = PRESETS[sweep.base], sweep.provenance.get("fidelity", {})
    now = json.loads(json.dumps(knobs_by_stage(base)))
    changed = [
        f"{stage}.{name}"
        for stage, knobs in then.items()
        for name, value in knobs.items()
        if now.get(stage, {}).get(name) != value
    ]
    require(
        not changed,
        f"the sweep of {sweep.case} was measured when {sweep.base} had other {', '.join(changed)}: measure it again "
        "with `nvhchain tradeoff`",
    )
    return base


def rows_of(task: Task) -> list[tuple[Measurement, Knob, tuple[object, ...]]]:
    """Rows of single knobs that some case looks at and that were not refused, with the knob and its value.

    Those of models beyond the yardstick's own (`BEYOND`) are left out: the yardstick is not their truth.
    """
    known = {(knob.name, spoken(value)): (knob, value) for knob in task.knobs for value in knob.values}
    return [
        (row, *known[row.knob, row.value])
        for row in task.sweep.measurements[1:]
        if row.deviation is not None and (row.knob, row.value) in known and (row.knob, row.value) not in BEYOND
    ]


def error_of(row: Measurement) -> float:
    """dB of the overall level or of the worst mesh harmonic, whichever is larger."""
    assert row.deviation is not None
    return max(abs(row.deviation.overall), abs(row.deviation.worst_order))


def _expectation(task: Task) -> Callable[[Measurement, Fidelity], float]:
    """dB that a row's error becomes in these cases, from the row and what was turned for it."""
    same, base, cases = task.same, task.base, task.cases

    def expected(row: Measurement, turned: Fidelity) -> float:
        error = error_of(row)
        if row.knob == PRESET:
            return error if same else error * elsewhere.MARGIN * elsewhere.beyond_held_out(turned, base, cases)
        error *= elsewhere.growth(turned, base, cases, task.swept_extent)
        if row.knob.startswith("acoustics."):
            error *= elsewhere.quiet_points(cases, task.swept_points)
        return error if same else error * elsewhere.MARGIN

    return expected


def offers_for(task: Task) -> list[Offer]:
    """What the sweep has to offer to these cases: settings that are possible by themselves."""
    expected = _expectation(task)
    return [
        Offer(knob, value, expected(row, knob.turned(task.base, value)), _shares(row, task.sweep))
        for row, knob, value in rows_of(task)
        if knob.name not in _WARNED_OF and possible(task, knob.turned(task.base, value))
    ]


def presets_for(task: Task, most: float) -> list[tuple[Fidelity, Offer]]:
    """Joint presets with an error of `most` dB at most that the chain takes for all cases."""
    found, expected = [], _expectation(task)
    if "transfer_vectors" in task.given:  # which belong to the surface that one fidelity made
        return []
    for row in task.sweep.measurements[1:]:
        if row.knob == PRESET and row.value in PRESETS and row.deviation is not None:
            preset = PRESETS[row.value]
            error = expected(row, preset)
            if error <= most and possible(task, preset):
                found.append((preset, Offer(Knob(PRESET, (), ()), (row.value,), error, _shares(row, task.sweep))))
    return found


def _shares(row: Measurement, sweep: Tradeoff) -> dict[str, float]:
    """What a row leaves of every stage's processor time; of a stage that it drops, nothing."""
    before = sweep.measurements[0].stages
    return {
        stage: (row.stages[stage].processor / cost.processor if stage in row.stages else 0.0)
        for stage, cost in before.items()
        if cost.processor > 0
    }


def possible(task: Task, fidelity: Fidelity) -> bool:
    """Whether the chain takes this for all cases, warns of nothing that it does not warn of at the base, and is vouched
    for by an error band that is of use (`_vouched_for`)."""
    try:
        told = warnings_of(task.cases, fidelity, task.given)
    except InputError:
        return False
    return told <= task.warnings and all(_vouched_for(task, case, fidelity) for case in task.cases)


def _vouched_for(task: Task, case: Case, fidelity: Fidelity) -> bool:
    """Whether the error band of mesh harmonics grows by the tolerance at most, where the base's own keeps to it."""
    if not any(knob.stage == "gear" for knob in knobs_of(case, given=task.given)):
        return True
    limits = zip(elsewhere.open_below(fidelity, case), elsewhere.open_below(task.base, case), strict=True)
    return all(below <= least + task.tolerance for below, least in limits if least <= task.tolerance)


def warnings_of(cases: Sequence[Case], fidelity: Fidelity, given: Collection[str]) -> frozenset[str]:
    """What is warned of before any work starts.  Raises InputError for what is refused then."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", AccuracyWarning)
        for case in cases:
            check_knobs(case, fidelity, given)
    return frozenset(str(one.message) for one in told)


def turned_to(base: Fidelity, offers: list[Offer]) -> Fidelity:
    for offer in offers:
        base = offer.knob.turned(base, offer.value)
    return base
