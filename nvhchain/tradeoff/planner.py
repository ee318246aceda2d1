"""The cheapest knobs that keep to a tolerance in a scene, chosen from a measured sweep."""

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
from nvhchain.tradeoff import elsewhere
from nvhchain.tradeoff.knobs import PRESET, Knob, spoken
from nvhchain.tradeoff.offers import (
    Offer,
    Task,
    base_of,
    error_of,
    is_swept,
    offers_for,
    possible,
    presets_for,
    rows_of,
    turned_to,
    warnings_of,
)
from nvhchain.tradeoff.shipped import shipped_sweep
from nvhchain.tradeoff.sweep import Tradeoff

SHARE = 0.7
"""Part of the tolerance that the expected errors of single knobs may use up together: the rest is for knobs that make
each other worse."""

SMALLEST_GAIN = 0.01
"""Part of the whole time that a knob must save to be turned."""

WIDEST = 100.0
"""dB: a tolerance is less."""

NOTHING_OFFERED = f"no other setting saves {100 * SMALLEST_GAIN:g} % of the time within {SHARE:g} of the tolerance"
"""Why nothing is turned, in words."""


@dataclass(frozen=True)
class Choice:
    """What a planner chose.

    fidelity: to run with.  turned: knob → value that is cheaper than the sweep's base, or `preset` → its name.
    expected_error_db: sum of the errors of the sound pressure that were measured for each, against the base; in another
    case than the swept one times what they grew to in cases that were held out (`elsewhere`).
    expected_seconds, base_seconds: of what is run when nothing is found on disk, as `plan` estimates them.
    base_error_db: what the base itself leaves open.  sweep, base: names of the case that was swept and of the preset.
    errors: knob → dB of its setting.  same_case: whether it was planned for the very case that was swept.
    """

    fidelity: Fidelity
    turned: Mapping[str, str]
    expected_error_db: float
    expected_seconds: float
    base_seconds: float
    base_error_db: float
    sweep: str
    base: str
    errors: Mapping[str, float]
    same_case: bool = True

    def __str__(self) -> str:
        settings = [f"  {knob} = {value} ({self.errors[knob]:.2g} dB)" for knob, value in self.turned.items()]
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
    given: Collection[str] | Mapping[str, object] = (),
) -> Choice:
    """The knobs that promise to run `case` soonest with errors of overall level and mesh harmonics within a tolerance.

    case: one, or several that are run alike.  tolerance_db: dB against the sweep's base.  sweep: measured on this or a
    similar case, around a preset (the shipped one by default).  given: names of the hand-offs that the run will find
    ready-made, or these by name, as `run` calls them.  The scene decides which of its knobs count, and how much of the
    time each stage takes (`plan`).  Where the case asks for forces or velocities alone, errors of the pressure stand
    for theirs.

    In another case than the swept one errors are larger: by the laws of the error band where they know it (width of
    gears, waves in the walls), and by the margin of `elsewhere`, which is that of the worst case that was held out.
    Errors of different knobs may go the same way: they are added up, to `SHARE` of the tolerance. Seconds of a stage
    are multiplied with what each knob leaves of them. Knobs are turned, or turned further, in the order of time saved
    per error, where they are not refused, warn of nothing that the base does not, and leave the error band of the
    mesh's harmonics of use; a preset that was measured to keep to the same share is taken where it is quicker.
    Raises InputError for no case, for names that `run` does not know, for a tolerance that is not positive or finer
    than the base is known, for a stage of which the sweep tells nothing, for a base that is no preset, or no longer
    what the preset is, and for what is refused at the base.
    """
    require(
        0 < tolerance_db < WIDEST,
        f"tolerance = {tolerance_db:g} dB is outside 0…{WIDEST:g} dB: a model is never exact, ask for 1",
    )
    check_argument_names(given)
    sweep, cases = sweep or shipped_sweep(), (case,) if isinstance(case, GearboxCase | RadiatorCase) else tuple(case)
    require(len(cases) > 0, "no case to plan for: give one or more")
    base = base_of(sweep)
    known = base_error(sweep, *cases, given=given)
    least = _two_digits_above(known)
    remedy = f"ask for {least:g} dB or more" if least < WIDEST else "choose a preset"
    require(
        tolerance_db >= known,
        f"tolerance = {tolerance_db:g} dB is not reached: the best there is, {sweep.base}, is itself known to "
        f"{least:g} dB only, by the last steps of its knobs ({sweep.case}): {remedy}",
    )
    task = Task(cases, given, sweep, base, tolerance_db, warnings_of(cases, base, given), is_swept(cases, sweep))
    seconds, offers = _seconds_by_stage(task), offers_for(task)
    turned: dict[str, Offer] = {}
    while True:
        best: tuple[float, dict[str, Offer]] | None = None
        for offer in offers:
            if _taken(offer.knob, turned):
                continue
            further = {**turned, offer.knob.name: offer}
            gain = _total(seconds, turned) - _total(seconds, further)
            if gain < SMALLEST_GAIN * _total(seconds) or _sum(further) > SHARE * tolerance_db:
                continue
            worth = gain / max(_sum(further) - _sum(turned), 1e-3 * tolerance_db)
            if (best is None or worth > best[0]) and possible(task, turned_to(base, list(further.values()))):
                best = worth, further
        if best is None:
            break
        turned = best[1]
    fidelity = turned_to(base, list(turned.values()))
    for preset, offer in presets_for(task, SHARE * tolerance_db):
        if _total(seconds, {PRESET: offer}) < _total(seconds, turned):
            fidelity, turned = preset, {PRESET: offer}
    return Choice(
        dataclasses.replace(fidelity, name=f"within {tolerance_db:g} dB"),
        {name: spoken(offer.value) for name, offer in turned.items()},
        _sum(turned),
        _total(seconds, turned),
        _total(seconds),
        known,
        sweep.case,
        sweep.base,
        {name: offer.error for name, offer in turned.items()},
        task.same,
    )


def base_error(sweep: Tradeoff, *cases: Case, given: Collection[str] = ()) -> float:
    """dB that the base of a sweep leaves open, independent knobs in quadrature, grown to these cases by the laws of the
    error band: below it errors against the base say nothing of those against the truth.

    A knob that converges moves the result with every step less: what is left after its last measured step, to the base,
    is at most about that step. Of knobs with one measured value it is not known whether they converge.
    given: as `cheapest` takes it.  Raises InputError where a stage of the cases has no knob with two measured values.
    """
    last: dict[Knob, list[float]] = {}
    task = Task(cases, given, sweep, base_of(sweep), 0.0)
    for row, knob, value in rows_of(task):
        if isinstance(knob.values[-1][0], float | int) and not isinstance(knob.values[-1][0], bool):
            grown = error_of(row) * elsewhere.growth(knob.turned(task.base, value), task.base, cases, task.swept_extent)
            last.setdefault(knob, []).append(grown)
    steps = {knob: errors[-1] for knob, errors in last.items() if len(errors) > 1}
    unknown = {knob.stage for knob in task.knobs} - {knob.stage for knob in steps}
    require(
        not unknown,
        f"the sweep of {sweep.case} has no converging knob of {', '.join(sorted(unknown))}: how well {sweep.base} is "
        "known there cannot be said; measure two values of one with `nvhchain tradeoff`, or choose a preset",
    )
    return hypot(*steps.values())


def _two_digits_above(value: float) -> float:
    """The next number of two digits that is not less."""
    if value <= 0:
        return 0.0
    unit = 10.0 ** (floor(log10(value)) - 1)
    return next(number for n in range(3) if (number := float(f"{value + n * unit:.2g}")) >= value)


def _taken(knob: Knob, turned: Mapping[str, Offer]) -> bool:
    """Whether one of its fields is turned already, by another knob."""
    others = [offer.knob for name, offer in turned.items() if name != knob.name]
    return any(other.stage == knob.stage and not set(other.fields).isdisjoint(knob.fields) for other in others)


def _sum(turned: Mapping[str, Offer]) -> float:
    """dB of all settings together."""
    return sum(offer.error for offer in turned.values())


def _seconds_by_stage(task: Task) -> dict[str, float]:
    """s that the cases take at the base by stage of the sweep."""
    seconds: dict[str, float] = {}
    swept = task.sweep.measurements[0].stages
    for planned in [one for case in task.cases for one in planned_steps(Scene(case, task.base, task.given))]:
        alike = [planned.step, *([planned.step.timed_as] if planned.step.timed_as else [])]
        measured = next((file for step in alike for file in swept if step.makes(file)), alike[-1].file_of())
        seconds[measured] = seconds.get(measured, 0.0) + planned.seconds
    return seconds


def _total(seconds: Mapping[str, float], turned: Mapping[str, Offer] | None = None) -> float:
    """s of all stages when these settings are turned."""
    return sum(
        value * prod(offer.shares.get(stage, 1.0) for offer in (turned or {}).values())
        for stage, value in seconds.items()
    )
