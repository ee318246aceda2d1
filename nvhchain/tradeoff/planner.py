"""Choice of the cheapest knobs that keep to a tolerance in a scene, from a measured sweep."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from math import floor, hypot, log10, prod

from nvhchain.case import Case, GearboxCase, RadiatorCase
from nvhchain.chain.supplied import check_argument_names
from nvhchain.errors import require
from nvhchain.fidelity import Fidelity
from nvhchain.kinds import checked
from nvhchain.scene import Scene, planned_steps
from nvhchain.tradeoff import extrapolation
from nvhchain.tradeoff.knobs import PRESET, Knob, setting_text
from nvhchain.tradeoff.offers import (
    Offer,
    Task,
    apply_offers,
    base_of,
    error_of,
    is_swept,
    offers_for,
    possible,
    presets_for,
    rows_of,
    warnings_of,
)
from nvhchain.tradeoff.shipped import shipped_sweep
from nvhchain.tradeoff.sweep import Tradeoff

SHARE = 0.7
"""Part of the tolerance available to the summed errors of single knobs. The rest is a reserve for their interaction."""

SMALLEST_GAIN = 0.01
"""Smallest part of the whole time that a turned knob must save."""

_NO_ERROR = 1e-3
"""Error (dB) below which settings count as equally good: their order then does not depend on the tolerance."""

WIDEST = 100.0
"""Upper limit (dB) of tolerances."""

NOTHING_OFFERED = f"no other setting saves {100 * SMALLEST_GAIN:g} % of the time within {SHARE:g} of the tolerance"
"""Reason in words for an unchanged fidelity."""


@dataclass(frozen=True)
class Choice:
    """Fidelity chosen by the planner.

    fidelity: fidelity of the run.
    settings: knob → value that is cheaper than the sweep's base, or `preset` → its name.
    expected_error_db: sum of the errors of sound pressure measured for each setting against the base (dB). Other cases
        than the swept one have a margin from held-out cases (`elsewhere`).
    expected_seconds, base_seconds: processor time (s) of a run without cached results, as estimated by `plan`, of the
        choice and of the base.
    base_error_db: error that the base itself leaves open (dB).
    sweep, base: names of the swept case and of the preset.
    errors: knob → error of its setting (dB).
    same_case: True if the planned cases are the swept one.
    """

    fidelity: Fidelity
    settings: Mapping[str, str]
    expected_error_db: float
    expected_seconds: float
    base_seconds: float
    base_error_db: float
    sweep: str
    base: str
    errors: Mapping[str, float]
    same_case: bool = True

    def __str__(self) -> str:
        settings = [f"  {knob} = {value} ({self.errors[knob]:.2g} dB)" for knob, value in self.settings.items()]
        return "\n".join(
            [
                f"{self.fidelity.name}: about {self.expected_error_db:.2g} dB from {self.base}, itself known to "
                f"{self.base_error_db:.2g} dB; {self.expected_seconds:.3g} s instead of {self.base_seconds:.3g} s "
                f"(by the sweep of {self.sweep}{'' if self.same_case else ', errors with the margin for other cases'})",
                *(settings or [f"  every knob as in {self.base}: {NOTHING_OFFERED}"]),
            ]
        )


@checked
def cheapest(
    case: Case | Iterable[Case],
    tolerance_db: float,
    sweep: Tradeoff | None = None,
    *,
    supplied: Collection[str] | Mapping[str, object] = (),
) -> Choice:
    """Choose the knobs that run `case` soonest with errors of overall level and mesh harmonics within a tolerance.

    Parameters
    ----------
    case : Case or iterable of Case
        One case, or several that are run alike.
    tolerance_db : float
        Tolerance against the sweep's base (dB).
    sweep : Tradeoff, optional
        Sweep around a preset on this case or a similar one. By default the shipped one.
    supplied : collection of str, or mapping of str to hand-off
        Names of the supplied hand-offs, or these by name, as for `run`.

    Returns
    -------
    Choice
        Fidelity with its expected error and time.

    Raises
    ------
    InputError
        If there is no case, or `run` takes no hand-off of such a name. If the tolerance is not positive, or finer than
        the error of the base. If the sweep has no rows for a step. If the base is no preset, or its preset has changed.
        If the base is refused.

    Notes
    -----
    The scene decides which knobs count, and the share of each step in the time (`plan`). For a case of forces or
    velocities alone, errors of the pressure stand for theirs.

    Errors in other cases than the swept one are larger. The laws of the error band extrapolate them where they apply
    (width of gears, waves in the walls). The margin of `elsewhere` multiplies them by the ratio of the worst held-out
    case.

    Errors of different knobs may have the same sign: they are summed, up to `SHARE` of the tolerance. The seconds of a
    step are multiplied by the share that each knob leaves. Knobs are turned, or turned further, in the order of time
    saved per error. A setting must not be refused and must add no warning to those of the base. It must keep the
    confidence limits of the mesh harmonics useful. A preset with a measured error within the same share is taken where
    it is quicker.
    """
    require(
        0 < tolerance_db < WIDEST,
        f"tolerance = {tolerance_db:g} dB is outside 0…{WIDEST:g} dB: a model is never exact, ask for 1",
    )
    check_argument_names(supplied)
    sweep, cases = sweep or shipped_sweep(), (case,) if isinstance(case, GearboxCase | RadiatorCase) else tuple(case)
    require(len(cases) > 0, "no case to plan for: give one or more")
    base = base_of(sweep)
    known = base_error(sweep, *cases, supplied=supplied)
    least = _two_digits_above(known)
    remedy = f"ask for {least:g} dB or more" if least < WIDEST else "choose a preset"
    require(
        tolerance_db >= known,
        f"tolerance = {tolerance_db:g} dB is not reached: the best there is, {sweep.base}, is itself known to "
        f"{least:g} dB only, by the last steps of its knobs ({sweep.case}): {remedy}",
    )
    task = Task(cases, supplied, sweep, base, tolerance_db, warnings_of(cases, base, supplied), is_swept(cases, sweep))
    seconds, offers = _seconds_by_step(task), offers_for(task)
    turned: dict[str, Offer] = {}
    while True:
        best: tuple[float, dict[str, Offer]] | None = None
        for offer in offers:
            if _is_decided(offer.knob, turned):
                continue
            further = {**turned, offer.knob.name: offer}
            gain = _seconds(seconds, turned) - _seconds(seconds, further)
            if gain < SMALLEST_GAIN * _seconds(seconds) or _error_sum(further) > SHARE * tolerance_db:
                continue
            worth = gain / max(_error_sum(further) - _error_sum(turned), _NO_ERROR)
            if (best is None or worth > best[0]) and possible(task, apply_offers(base, list(further.values()))):
                best = worth, further
        if best is None:
            break
        turned = best[1]
    fidelity = apply_offers(base, list(turned.values()))
    for preset, offer in presets_for(task, SHARE * tolerance_db):
        if _seconds(seconds, {PRESET: offer}) < _seconds(seconds, turned):
            fidelity, turned = preset, {PRESET: offer}
    return Choice(
        dataclasses.replace(fidelity, name=f"within {tolerance_db:g} dB"),
        {name: setting_text(offer.value) for name, offer in turned.items()},
        _error_sum(turned),
        _seconds(seconds, turned),
        _seconds(seconds),
        known,
        sweep.case,
        sweep.base,
        {name: offer.error for name, offer in turned.items()},
        task.same,
    )


def base_error(sweep: Tradeoff, *cases: Case, supplied: Collection[str] = ()) -> float:
    """Return the error (dB) that the base of a sweep leaves open: its independent knobs in quadrature.

    *cases: cases to which the laws of the error band extrapolate the errors.
    Returns error (dB). Smaller errors against the base are no measure of the error against the truth.

    The steps of a converging knob change the result less and less. The error left after the last measured step, to the
    base, is at most about the size of that step. Convergence is unknown for knobs with one measured value.
    """
    last: dict[Knob, list[float]] = {}
    task = Task(cases, supplied, sweep, base_of(sweep), 0.0)
    for row, knob, value in rows_of(task):
        if isinstance(knob.values[-1][0], float | int) and not isinstance(knob.values[-1][0], bool):
            grown = error_of(row) * extrapolation.growth(
                knob.apply(task.base, value), task.base, cases, task.swept_extent
            )
            last.setdefault(knob, []).append(grown)
    steps = {knob: errors[-1] for knob, errors in last.items() if len(errors) > 1}
    unknown = {knob.package for knob in task.knobs} - {knob.package for knob in steps}
    require(
        not unknown,
        f"the sweep of {sweep.case} has no converging knob of {', '.join(sorted(unknown))}: how well {sweep.base} is "
        "known there cannot be said; measure two values of one with `nvhchain tradeoff`, or choose a preset",
    )
    return hypot(*steps.values())


def _two_digits_above(value: float) -> float:
    """Return the smallest number of two digits that is not less than `value`."""
    if value <= 0:
        return 0.0
    unit = 10.0 ** (floor(log10(value)) - 1)
    return next(number for n in range(3) if (number := float(f"{value + n * unit:.2g}")) >= value)


def _is_decided(knob: Knob, settings: Mapping[str, Offer]) -> bool:
    """Return True if another turned knob uses one of the same fields."""
    others = [offer.knob for name, offer in settings.items() if name != knob.name]
    return any(other.package == knob.package and not set(other.fields).isdisjoint(knob.fields) for other in others)


def _error_sum(settings: Mapping[str, Offer]) -> float:
    """Sum of the errors of all settings (dB)."""
    return sum(offer.error for offer in settings.values())


def _seconds_by_step(task: Task) -> dict[str, float]:
    """Return the processor time (s) of the cases at the base, by step of the sweep."""
    seconds: dict[str, float] = {}
    swept = task.sweep.measurements[0].stages
    for planned in [one for case in task.cases for one in planned_steps(Scene(case, task.base, task.supplied))]:
        alike = [planned.step, *([planned.step.timed_as] if planned.step.timed_as else [])]
        measured = next((file for step in alike for file in swept if step.makes(file)), alike[-1].file_of())
        seconds[measured] = seconds.get(measured, 0.0) + planned.seconds
    return seconds


def _seconds(seconds: Mapping[str, float], settings: Mapping[str, Offer] | None = None) -> float:
    """Return the processor time (s) of all steps with these settings."""
    return sum(
        value * prod(offer.shares.get(stage, 1.0) for offer in (settings or {}).values())
        for stage, value in seconds.items()
    )
