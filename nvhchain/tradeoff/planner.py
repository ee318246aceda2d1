"""The cheapest knobs that keep to a tolerance, chosen from a measured sweep."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from nvhchain.case import Case
from nvhchain.errors import require
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.tradeoff.knobs import Knob, knobs_of, spoken
from nvhchain.tradeoff.sweep import Measurement, Tradeoff

SHARE = 0.7
"""Part of the tolerance that the measured errors of single knobs may use up together: the rest is for what the sweep's
case does not show, and for knobs that make each other worse."""

SMALLEST_GAIN = 0.01
"""Part of the whole time that a knob must save to be turned."""


@dataclass(frozen=True)
class Choice:
    """What a planner chose.

    fidelity: to run with.  turned: knob → value that is cheaper than the sweep's base.  expected_error_db: sum of the
    errors that were measured for each alone.  expected_seconds, base_seconds: of a run in which nothing is found, on
    the machine of the sweep.
    """

    fidelity: Fidelity
    turned: Mapping[str, str]
    expected_error_db: float
    expected_seconds: float
    base_seconds: float

    def __str__(self) -> str:
        settings = [f"  {knob} = {value}" for knob, value in self.turned.items()]
        return "\n".join(
            [
                f"{self.fidelity.name}: about {self.expected_error_db:.2g} dB, {self.expected_seconds:.3g} s instead "
                f"of {self.base_seconds:.3g} s at the base",
                *(settings or ["  every knob as in the base"]),
            ]
        )


def cheapest(case: Case, tolerance_db: float, sweep: Tradeoff) -> Choice:
    """The knobs that promise to run `case` soonest with errors of overall level and mesh harmonics within a tolerance.

    tolerance_db: dB against the sweep's base.  sweep: measured on this or a similar case, around a preset; the scene
    decides which of its knobs count.
    Errors of different knobs may go the same way: they are added up, to `SHARE` of the tolerance. Seconds of a stage
    are multiplied with what each knob leaves of them. Knobs are turned once, in the order of time saved per error.
    Raises InputError for a tolerance that is not positive or a base that is no preset.
    """
    require(
        tolerance_db > 0, f"tolerance = {tolerance_db:g} dB must be positive: a model is never exact; ask for 0.1 dB"
    )
    require(sweep.base in PRESETS, f"the sweep's base {sweep.base!r} is no preset: sweep around {', '.join(PRESETS)}")
    base, *rows = sweep.measurements
    offers = _offers(case, rows, PRESETS[sweep.base])
    left, turned, error = {stage: 1.0 for stage in base.stages}, dict[str, tuple[Knob, tuple[object, ...]]](), 0.0
    while True:
        best: tuple[float, Measurement, Knob, tuple[object, ...], float] | None = None
        for row, knob, value, size in offers:
            if _taken(knob, turned) or error + size > SHARE * tolerance_db:
                continue
            gain = _seconds(base, left) - _seconds(base, _after(left, base, row))
            if gain < SMALLEST_GAIN * base.seconds:
                continue
            worth = gain / max(size, 1e-3 * tolerance_db)
            if best is None or worth > best[0]:
                best = worth, row, knob, value, size
        if best is None:
            break
        _, row, knob, value, size = best
        left, error = _after(left, base, row), error + size
        turned[knob.name] = knob, value
    fidelity = PRESETS[sweep.base]
    for knob, value in turned.values():
        fidelity = knob.turned(fidelity, value)
    fidelity = dataclasses.replace(fidelity, name=f"within {tolerance_db:g} dB")
    settings = {name: spoken(value) for name, (_, value) in turned.items()}
    return Choice(fidelity, settings, error, _seconds(base, left), base.seconds)


def _offers(
    case: Case, rows: list[Measurement], base: Fidelity
) -> list[tuple[Measurement, Knob, tuple[object, ...], float]]:
    """Rows of single knobs that the case looks at, with the knob's value and the error that counts, dB."""
    known = {(knob.name, spoken(value)): (knob, value) for knob in knobs_of(case) for value in knob.values}
    found = []
    for row in rows:
        if row.deviation is None or (row.knob, row.value) not in known:
            continue
        knob, value = known[row.knob, row.value]
        found.append((row, knob, value, max(abs(row.deviation.overall), abs(row.deviation.worst_order))))
    return found


def _taken(knob: Knob, turned: Mapping[str, tuple[Knob, tuple[object, ...]]]) -> bool:
    """Whether one of its fields is turned already."""
    fields = {(other.stage, field) for other, _ in turned.values() for field in other.fields}
    return any((knob.stage, field) in fields for field in knob.fields)


def _after(left: Mapping[str, float], base: Measurement, row: Measurement) -> dict[str, float]:
    """Share of every stage's seconds that is left when this row's knob is turned too; a stage it drops takes none."""
    shares = {}
    for stage, share in left.items():
        before = base.stages[stage].seconds
        now = row.stages[stage].seconds if stage in row.stages else 0.0
        shares[stage] = share * now / before if before > 0 else share
    return shares


def _seconds(base: Measurement, left: Mapping[str, float]) -> float:
    return sum(share * base.stages[stage].seconds for stage, share in left.items())
