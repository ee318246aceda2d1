"""The cheapest knobs that keep to a tolerance in a scene, chosen from a measured sweep."""

from __future__ import annotations

import dataclasses
import json
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, prod

from nvhchain.case import Case, GearboxCase, RadiatorCase
from nvhchain.errors import AccuracyWarning, InputError, require
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.kinds import check_arguments
from nvhchain.scene import check_knobs, plan
from nvhchain.tradeoff import elsewhere
from nvhchain.tradeoff.knobs import BEYOND, PRESET, Knob, knobs_by_stage, knobs_of, spoken
from nvhchain.tradeoff.shipped import shipped_sweep
from nvhchain.tradeoff.sweep import Measurement, Tradeoff, case_identity

SHARE = 0.7
"""Part of the tolerance that the expected errors of single knobs may use up together: the rest is for knobs that make
each other worse."""

SMALLEST_GAIN = 0.01
"""Part of the whole time that a knob must save to be turned."""

_MEASURED_AS = {
    "mesh law": "mesh_law",
    "load distribution": "mesh_law",
    "housing": "housing",
    "bearing forces": "bearing_forces",
    "transfer vectors": "transfer_vectors",
    "radiation resistance": "transfer_vectors",
    "sound power": "transfer_vectors",
    "velocity": "surface_velocity",
    "pressure": "pressure",
    "surface": "surface_velocity",
}
"""What a stage of the plan begins with → what the stage of a sweep begins with whose share of time it keeps."""


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
                *(settings or [f"  every knob as in {self.base}"]),
            ]
        )


@dataclass(frozen=True)
class _Offer:
    """A knob at a value, or a preset.  error: dB.  shares: stage of the sweep → what it leaves of the stage's time."""

    knob: Knob
    value: tuple[object, ...]
    error: float
    shares: Mapping[str, float]


def cheapest(case: Case | Iterable[Case], tolerance_db: float, sweep: Tradeoff | None = None) -> Choice:
    """The knobs that promise to run `case` soonest with errors of overall level and mesh harmonics within a tolerance.

    case: one, or several that are run alike.  tolerance_db: dB against the sweep's base.  sweep: measured on this or a
    similar case, around a preset (the shipped one by default).  The scene decides which of its knobs count, and how
    much of the time each stage takes (`plan`).  Where the case asks for forces or velocities alone, errors of the
    pressure stand for theirs.

    In another case than the swept one errors are larger: by the laws of the error band where they know it (width of
    gears, waves in the walls), and by the margin of `elsewhere`, which is that of the worst case that was held out.
    Errors of different knobs may go the same way: they are added up, to `SHARE` of the tolerance. Seconds of a stage
    are multiplied with what each knob leaves of them. Knobs are turned, or turned further, in the order of time saved
    per error; a preset that was measured to keep to the same share is taken where it is quicker.
    Raises InputError for no case, for a tolerance that is not positive or finer than the base is known, for a stage of
    which the sweep tells nothing, and for a base that is no preset, or no longer what the preset is.
    """
    check_arguments(cheapest, locals())
    require(
        0 < tolerance_db < 100,
        f"tolerance = {tolerance_db:g} dB is outside 0…100 dB: a model is never exact, ask for 1",
    )
    sweep, cases = sweep or shipped_sweep(), (case,) if isinstance(case, GearboxCase | RadiatorCase) else tuple(case)
    require(len(cases) > 0, "no case to plan for: give one or more")
    base = _base(sweep)
    known = base_error(sweep, *cases)
    require(
        tolerance_db >= known,
        f"tolerance = {tolerance_db:g} dB is not reached: the best there is, {sweep.base}, is itself known to "
        f"{known:.2g} dB only, by the last steps of its knobs ({sweep.case}): ask for {known:.2g} dB or more",
    )
    seconds, offers = _seconds_by_stage(cases, base, sweep), _offers(cases, base, sweep)
    turned: dict[str, _Offer] = {}
    while True:
        best: tuple[float, dict[str, _Offer]] | None = None
        for offer in offers:
            if _taken(offer.knob, turned):
                continue
            further = {**turned, offer.knob.name: offer}
            gain = _total(seconds, turned) - _total(seconds, further)
            if gain < SMALLEST_GAIN * _total(seconds) or _sum(further) > SHARE * tolerance_db:
                continue
            worth = gain / max(_sum(further) - _sum(turned), 1e-3 * tolerance_db)
            if (best is None or worth > best[0]) and _possible(cases, base, list(further.values())):
                best = worth, further
        if best is None:
            break
        turned = best[1]
    fidelity = _turned(base, list(turned.values()))
    for preset, offer in _presets(cases, sweep, SHARE * tolerance_db):
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
        is_swept(cases, sweep),
    )


def base_error(sweep: Tradeoff, *cases: Case) -> float:
    """dB that the base of a sweep leaves open, independent knobs in quadrature, grown to these cases by the laws of the
    error band: below it errors against the base say nothing of those against the truth.

    A knob that converges moves the result with every step less: what is left after its last measured step, to the base,
    is at most about that step. Of knobs with one measured value it is not known whether they converge.
    Raises InputError where a stage of the cases has no knob with two measured values.
    """
    last: dict[Knob, list[float]] = {}
    base, swept = _base(sweep), sweep.provenance.get("extent")
    for row, knob, value in _rows(cases, sweep):
        if isinstance(knob.values[-1][0], float | int) and not isinstance(knob.values[-1][0], bool):
            grown = _error(row) * elsewhere.growth(knob.turned(base, value), base, cases, swept)
            last.setdefault(knob, []).append(grown)
    steps = {knob: errors[-1] for knob, errors in last.items() if len(errors) > 1}
    unknown = {knob.stage for case in cases for knob in knobs_of(case)} - {knob.stage for knob in steps}
    require(
        not unknown,
        f"the sweep of {sweep.case} has no converging knob of {', '.join(sorted(unknown))}: how well {sweep.base} is "
        "known there cannot be said; measure two values of one with `nvhchain tradeoff`, or choose a preset",
    )
    return hypot(*steps.values())


def is_swept(cases: Sequence[Case], sweep: Tradeoff) -> bool:
    """Whether all these cases are the one that was swept."""
    return all(case_identity(case) == sweep.provenance.get("case") for case in cases)


def _base(sweep: Tradeoff) -> Fidelity:
    """The preset around which the sweep was measured, as it still is."""
    require(sweep.base in PRESETS, f"the sweep's base {sweep.base!r} is no preset: sweep around {', '.join(PRESETS)}")
    base, then = PRESETS[sweep.base], sweep.provenance.get("fidelity", {})
    now = json.loads(json.dumps(knobs_by_stage(base)))
    changed = [
        f"{stage}.{name}"
        for stage, knobs in then.items()
        for name, value in knobs.items()
        if now[stage].get(name) != value
    ]
    require(
        not changed,
        f"the sweep of {sweep.case} was measured when {sweep.base} had other {', '.join(changed)}: measure it again "
        "with `nvhchain tradeoff`",
    )
    return base


def _rows(cases: Sequence[Case], sweep: Tradeoff) -> list[tuple[Measurement, Knob, tuple[object, ...]]]:
    """Rows of single knobs that some case looks at and that were not refused, with the knob and its value.

    Those of models beyond the yardstick's own (`BEYOND`) are left out: the yardstick is not their truth.
    """
    knobs = [knob for case in cases for knob in knobs_of(case)]
    known = {(knob.name, spoken(value)): (knob, value) for knob in knobs for value in knob.values}
    return [
        (row, *known[row.knob, row.value])
        for row in sweep.measurements[1:]
        if row.deviation is not None and (row.knob, row.value) in known and (row.knob, row.value) not in BEYOND
    ]


def _error(row: Measurement) -> float:
    """dB of the overall level or of the worst mesh harmonic, whichever is larger."""
    assert row.deviation is not None
    return max(abs(row.deviation.overall), abs(row.deviation.worst_order))


def _expectation(cases: Sequence[Case], base: Fidelity, sweep: Tradeoff) -> Callable[[Measurement, Fidelity], float]:
    """dB that a row's error becomes in these cases, from the row and what was turned for it."""
    same, swept = is_swept(cases, sweep), sweep.provenance.get("extent")

    def expected(row: Measurement, turned: Fidelity) -> float:
        error = _error(row)
        if row.knob == PRESET:
            return error if same else error * elsewhere.MARGIN * elsewhere.beyond_held_out(turned, base, cases)
        error *= elsewhere.growth(turned, base, cases, swept)
        return error if same else error * elsewhere.MARGIN

    return expected


def _offers(cases: Sequence[Case], base: Fidelity, sweep: Tradeoff) -> list[_Offer]:
    """What the sweep has to offer to these cases: settings that are not refused by themselves."""
    expected = _expectation(cases, base, sweep)
    offers = [
        _Offer(knob, value, expected(row, knob.turned(base, value)), _shares(row, sweep))
        for row, knob, value in _rows(cases, sweep)
    ]
    return [offer for offer in offers if _possible(cases, base, [offer])]


def _presets(cases: Sequence[Case], sweep: Tradeoff, most: float) -> list[tuple[Fidelity, _Offer]]:
    """Joint presets with an error of `most` dB at most that the chain takes for all cases."""
    found, expected = [], _expectation(cases, PRESETS[sweep.base], sweep)
    for row in sweep.measurements[1:]:
        if row.knob == PRESET and row.deviation is not None:
            preset = PRESETS[row.value]
            error = expected(row, preset)
            if error <= most and _possible(cases, preset, []):
                found.append((preset, _Offer(Knob(PRESET, (), ()), (row.value,), error, _shares(row, sweep))))
    return found


def _shares(row: Measurement, sweep: Tradeoff) -> dict[str, float]:
    """What a row leaves of every stage's processor time; of a stage that it drops, nothing."""
    before = sweep.measurements[0].stages
    return {
        stage: (row.stages[stage].processor / cost.processor if stage in row.stages else 0.0)
        for stage, cost in before.items()
        if cost.processor > 0
    }


def _possible(cases: Sequence[Case], base: Fidelity, offers: list[_Offer]) -> bool:
    """Whether the chain takes these settings for all cases, without a warning."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", AccuracyWarning)
            for case in cases:
                check_knobs(case, _turned(base, offers))
    except (InputError, AccuracyWarning):
        return False
    return True


def _turned(base: Fidelity, offers: list[_Offer]) -> Fidelity:
    for offer in offers:
        base = offer.knob.turned(base, offer.value)
    return base


def _taken(knob: Knob, turned: Mapping[str, _Offer]) -> bool:
    """Whether one of its fields is turned already, by another knob."""
    others = [offer.knob for name, offer in turned.items() if name != knob.name]
    return any(other.stage == knob.stage and not set(other.fields).isdisjoint(knob.fields) for other in others)


def _sum(turned: Mapping[str, _Offer]) -> float:
    """dB of all settings together."""
    return sum(offer.error for offer in turned.values())


def _seconds_by_stage(cases: Sequence[Case], base: Fidelity, sweep: Tradeoff) -> dict[str, float]:
    """s that the cases take at the base by stage of the sweep."""
    seconds: dict[str, float] = {}
    for stage in [stage for case in cases for stage in plan(case, fidelity=base).stages]:
        like = next(name for start, name in _MEASURED_AS.items() if stage.name.startswith(start))
        measured = next((name for name in sweep.measurements[0].stages if name.startswith(like)), like)
        seconds[measured] = seconds.get(measured, 0.0) + stage.seconds
    return seconds


def _total(seconds: Mapping[str, float], turned: Mapping[str, _Offer] | None = None) -> float:
    """s of all stages when these settings are turned."""
    return sum(
        value * prod(offer.shares.get(stage, 1.0) for offer in (turned or {}).values())
        for stage, value in seconds.items()
    )
