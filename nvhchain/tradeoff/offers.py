"""Settings of a sweep for the cases of a plan: expected errors and shares of time."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from nvhchain.case import Case
from nvhchain.errors import AccuracyWarning, InputError, require
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.scene import check_knobs
from nvhchain.tradeoff import extrapolation
from nvhchain.tradeoff.knobs import FINER_SETTINGS, PRESET, UNSWEPT, Knob, knobs_by_package, knobs_of, setting_text
from nvhchain.tradeoff.sweep import Measurement, Tradeoff, case_identity

_WARNED_OF = frozenset({"acoustics.radiation"})
"""Knobs whose cheaper values make a run warn.

In the mean of the worst body, the Rayleigh integral is off by more than 3 dB at every wavenumber. The equivalent
radiated power is off by more than 3 dB below a wavenumber of 4/a, where a is half the size of the body
(docs/measured/acoustics/radiation.md).
"""


@dataclass(frozen=True)
class Task:
    """Cases to plan for, and the sweep to plan from.

    cases: cases that are run alike.
    supplied: names of the supplied hand-offs, or these by name.
    sweep: measured sweep.
    base: base of the sweep.
    tolerance: tolerance (dB).
    warnings: warnings at the base.
    same: True if all cases are the swept one.
    """

    cases: tuple[Case, ...]
    supplied: Collection[str]
    sweep: Tradeoff
    base: Fidelity
    tolerance: float
    warnings: frozenset[str] = frozenset()
    same: bool = False

    @property
    def knobs(self) -> list[Knob]:
        """Knobs that at least one case uses."""
        return [knob for case in self.cases for knob in knobs_of(case, supplied=self.supplied)]

    @property
    def swept_extent(self) -> Mapping[str, object] | None:
        """`extent` of the swept case; None if unknown."""
        return self.sweep.origin.extent

    @property
    def swept_points(self) -> int:
        """Number of field points at which errors were measured."""
        return 1 if self.sweep.yardstick is None else len(self.sweep.yardstick.points)


@dataclass(frozen=True)
class Offer:
    """Knob at a value, or a preset.

    knob: knob, or the name `preset`.
    value: setting of its fields.
    error: expected error (dB).
    shares: step of the sweep → remaining share of its processor time.
    """

    knob: Knob
    value: tuple[object, ...]
    error: float
    shares: Mapping[str, float]


def is_swept(cases: Sequence[Case], sweep: Tradeoff) -> bool:
    """Return True if all cases are the swept one."""
    return all(case_identity(case) == sweep.origin.identity for case in cases)


def base_of(sweep: Tradeoff) -> Fidelity:
    """Return the preset around which the sweep was measured; InputError if its knobs have changed since.

    Limits beyond which a run is refused change no result.
    """
    require(sweep.base in PRESETS, f"the sweep's base {sweep.base!r} is no preset: sweep around {', '.join(PRESETS)}")
    base, then = PRESETS[sweep.base], sweep.origin.knobs
    now = json.loads(json.dumps(knobs_by_package(base)))
    changed = [
        f"{stage}.{name}"
        for stage, knobs in then.items()
        for name, value in knobs.items()
        if now.get(stage, {}).get(name) != value and not UNSWEPT.get(f"{stage}.{name}", "").startswith("a limit")
    ]
    require(
        not changed,
        f"the sweep of {sweep.case} was measured when {sweep.base} had other {', '.join(changed)}: measure it again "
        "with `nvhchain tradeoff`",
    )
    return base


def rows_of(task: Task) -> list[tuple[Measurement, Knob, tuple[object, ...]]]:
    """Return the rows of single knobs that some case uses and that were not refused, with knob and value.

    Models beyond that of the yardstick (`FINER_SETTINGS`) are excluded: the yardstick is no truth for them.
    """
    known = {(knob.name, setting_text(value)): (knob, value) for knob in task.knobs for value in knob.values}
    return [
        (row, *known[row.knob, row.value])
        for row in task.sweep.measurements[1:]
        if row.deviation is not None and (row.knob, row.value) in known and (row.knob, row.value) not in FINER_SETTINGS
    ]


def error_of(row: Measurement) -> float:
    """Return the larger error (dB) of the overall level and the worst mesh harmonic."""
    assert row.deviation is not None
    return max(abs(row.deviation.overall), abs(row.deviation.worst_order))


def _expectation(task: Task) -> Callable[[Measurement, Fidelity], float]:
    """Return the function of a row and its fidelity that gives the expected error (dB) in these cases."""
    same, base, cases = task.same, task.base, task.cases

    def expected(row: Measurement, setting: Fidelity) -> float:
        error = error_of(row)
        if row.knob == PRESET:
            return error if same else error * extrapolation.MARGIN * extrapolation.preset_growth(setting, base, cases)
        error *= extrapolation.growth(setting, base, cases, task.swept_extent)
        if row.knob.startswith("acoustics."):
            error *= extrapolation.quiet_points(cases, task.swept_points)
        return error if same else error * extrapolation.MARGIN

    return expected


def offers_for(task: Task) -> list[Offer]:
    """Return the single settings of the sweep that are possible in these cases."""
    expected = _expectation(task)
    return [
        Offer(knob, value, expected(row, knob.apply(task.base, value)), _shares(row, task.sweep))
        for row, knob, value in rows_of(task)
        if knob.name not in _WARNED_OF and possible(task, knob.apply(task.base, value))
    ]


def presets_for(task: Task, tolerance: float) -> list[tuple[Fidelity, Offer]]:
    """Return the joint presets that are possible in all cases, with an error of `tolerance` (dB) at most."""
    found, expected = [], _expectation(task)
    if "transfer_vectors" in task.supplied:  # they belong to the surface of one fidelity
        return []
    for row in task.sweep.measurements[1:]:
        if row.knob == PRESET and row.value in PRESETS and row.deviation is not None:
            preset = PRESETS[row.value]
            error = expected(row, preset)
            if error <= tolerance and possible(task, preset):
                found.append((preset, Offer(Knob(PRESET, (), ()), (row.value,), error, _shares(row, task.sweep))))
    return found


def _shares(row: Measurement, sweep: Tradeoff) -> dict[str, float]:
    """Return the share of every step's processor time that remains with a row; 0 for a step that it drops."""
    before = sweep.measurements[0].stages
    return {
        stage: (row.stages[stage].processor / cost.processor if stage in row.stages else 0.0)
        for stage, cost in before.items()
        if cost.processor > 0
    }


def possible(task: Task, fidelity: Fidelity) -> bool:
    """Return True if a fidelity is possible for all cases.

    The chain must accept it without warnings other than those at the base. The confidence limits must stay useful
    (`_vouched_for`).
    """
    try:
        told = warnings_of(task.cases, fidelity, task.supplied)
    except InputError:
        return False
    return told <= task.warnings and all(_vouched_for(task, case, fidelity) for case in task.cases)


def _vouched_for(task: Task, case: Case, fidelity: Fidelity) -> bool:
    """Return True if the lower limits of mesh harmonics widen by the tolerance at most, compared with the base.

    Stages whose limit at the base exceeds the tolerance are excluded.
    """
    if not any(knob.package == "gear" for knob in knobs_of(case, supplied=task.supplied)):
        return True
    limits = zip(extrapolation.open_below(fidelity, case), extrapolation.open_below(task.base, case), strict=True)
    return all(below <= least + task.tolerance for below, least in limits if least <= task.tolerance)


def warnings_of(cases: Sequence[Case], fidelity: Fidelity, supplied: Collection[str]) -> frozenset[str]:
    """Return the warnings before a run; InputError where the run is refused."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", AccuracyWarning)
        for case in cases:
            check_knobs(case, fidelity, supplied)
    return frozenset(str(one.message) for one in told)


def apply_offers(base: Fidelity, offers: list[Offer]) -> Fidelity:
    """Return `base` with all offers turned."""
    for offer in offers:
        base = offer.knob.apply(base, offer.value)
    return base
