"""Error and saving of every accuracy knob on a case.

    python -m benchmarks tradeoff OUT CASE [KNOB ...] [--today] [--changed=STEP]

Writes docs/measured/chain/tradeoff_CASE.md and .png. Sweeps the knobs named (as in gear.slices, or a stage, or preset;
all by default) around `reference`; OUT keeps operators and finished rows, from which an interrupted sweep goes on. The
sweep of cases/small/single_stage.toml is what tolerances are planned from: its numbers go into the package, where rows
of other knobs stay as long as the yardstick is what it was. Its times are brought to the day of the shipped ones, stage
by stage, by those of the yardstick in both; with `--today` they stay as they are. Where the code of a step was changed,
`--changed` takes the ratio of its times from the other steps, and multiplies its costs in kept rows by those of the
yardstick now over before. Leave the machine alone meanwhile.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import nvhchain as nvh
from benchmarks.publish import MEASURED, publish
from nvhchain.case import Case
from nvhchain.tradeoff import (
    Measurement,
    Tradeoff,
    as_json,
    markdown,
    records,
    save_tradeoff,
    shipped_sweep,
    tradeoff,
    variants,
)
from nvhchain.tradeoff.measure import Cost
from nvhchain.tradeoff.shipped import SHIPPED

SAME = 2.5e-4
"""Difference of two yardsticks over their peak, up to which rows of both, each against its own, stand in one table:
0.002 dB, of which an error, a difference, hardly feels anything."""

OF_THAT_DAY = (
    "All times are those of the day from which `plan` knows its seconds: measured ones times the ratio of the two "
    "yardsticks' times in each step."
)


def with_shipped_rows(sweep: Tradeoff, case: Case, *, today: bool, changed: str = "") -> Tradeoff:
    """`sweep` with the shipped rows of settings that it leaves out, and with times of the day of the shipped ones.

    today: times of a sweep of all settings stay as they are.
    changed: step whose code was changed.

    `earlier` in the provenance tells the code of the shipped rows.
    """
    shipped, known = shipped_sweep(), {(knob, value) for knob, value, _ in variants(case, nvh.REFERENCE)}
    rest = [row for row in shipped.measurements[1:] if (row.knob, row.value) in known]  # settings of today
    shipped = replace(shipped, measurements=(shipped.measurements[0], *rest))
    base, *made = sweep.measurements
    day = {name: of_that(cost, base.stages[name]) for name, cost in shipped.measurements[0].stages.items()}
    if changed:
        if changed not in day:
            sys.exit(f"--changed={changed}: the steps are {', '.join(day)}")
        others = [ratio for name, ratio in day.items() if name != changed and ratio != (1.0, 1.0)]
        day[changed] = tuple(np.median(others, axis=0).tolist())
        shipped = replace(shipped, measurements=tuple(with_changed(shipped.measurements, base, changed, day[changed])))
    if {(row.knob, row.value) for row in shipped.measurements} <= {(row.knob, row.value) for row in sweep.measurements}:
        rows = sweep.measurements if today else tuple(as_on(row, day) for row in sweep.measurements)
        return replace(sweep, measurements=rows, provenance={**sweep.provenance, "earlier": []})
    assert sweep.yardstick is not None
    assert shipped.yardstick is not None
    now, then = sweep.yardstick.pressure, shipped.yardstick.pressure
    apart = np.abs(now - then).max() / np.abs(then).max()
    if apart > SAME:
        sys.exit(f"the yardstick has moved by {apart:.2g} of its peak, {SAME:g} is allowed: sweep all knobs anew")
    rows = {(row.knob, row.value): row for row in shipped.measurements}
    rows |= {(row.knob, row.value): as_on(row, day) for row in made}
    settings = [("base", sweep.base), *(s[:2] for s in variants(case, nvh.REFERENCE)), *(s[:2] for s in records(case))]
    measured = {f"{row.knob} = {row.value}" for row in made}
    told = {name for run in shipped.provenance["earlier"] for name in run["settings"]}
    last = [name for name in (f"{row.knob} = {row.value}" for row in shipped.measurements) if name not in told]
    runs = [*shipped.provenance["earlier"], {"settings": last, "code": shipped.provenance["code"]}]
    kept = [run | {"settings": [name for name in run["settings"] if name not in measured]} for run in runs]
    earlier = [run for run in kept if run["settings"] and run["code"] != sweep.provenance["code"]]
    table = tuple(rows[setting] for setting in settings if setting in rows)
    return replace(sweep, measurements=table, provenance={**sweep.provenance, "earlier": earlier})


def with_changed(
    rows: Sequence[Measurement], base: Measurement, step: str, day: tuple[float, float]
) -> Iterator[Measurement]:
    """Yield the rows with the costs of a step multiplied by those of the yardstick now, on that day, over before."""
    before, now = rows[0].stages[step], as_on(base, dict.fromkeys(base.stages, day)).stages[step]
    for row in rows:
        if (old := row.stages.get(step)) is not None:
            cost = Cost(
                old.seconds * now.seconds / before.seconds,
                old.processor * now.processor / before.processor,
                old.megabytes * now.megabytes / before.megabytes,
            )
            row = replace(row, stages={**row.stages, step: cost})
        yield row


def of_that(then: Cost, now: Cost) -> tuple[float, float]:
    """Seconds and processor seconds of the one over those of the other; stages of less than a second tell nothing."""
    return (then.seconds / now.seconds, then.processor / now.processor) if now.processor >= 1.0 else (1.0, 1.0)


def as_on(row: Measurement, day: dict[str, tuple[float, float]]) -> Measurement:
    """The row with its times multiplied stage by stage."""
    costs = {
        name: Cost(cost.seconds * day[name][0], cost.processor * day[name][1], cost.megabytes)
        for name, cost in row.stages.items()
    }
    return replace(row, stages=costs)


def main() -> None:
    """Sweep and publish."""
    out, case = Path(sys.argv[1]), nvh.load_case(sys.argv[2])

    def report(done: int, total: int) -> None:
        print(f"{done} of {total}", file=sys.stderr, flush=True)

    knobs, today = [each for each in sys.argv[3:] if not each.startswith("--")], "--today" in sys.argv
    changed = next((each.removeprefix("--changed=") for each in sys.argv if each.startswith("--changed=")), "")
    sweep = tradeoff(case, out=out, knobs=knobs or None, progress=report)
    note = ""
    if SHIPPED.stem == case.name:
        sweep = with_shipped_rows(sweep, case, today=today, changed=changed)
        if not today:
            note = f"\n{OF_THAT_DAY}\n"
        older = sum(len(run["settings"]) for run in sweep.provenance["earlier"])
        if older:
            note += (
                f"\n{older} rows are of earlier code, each against its own yardstick, whose pressure was the same "
                f"within {SAME:g} of its peak.\n"
            )
    save_tradeoff(sweep, out)
    name = f"tradeoff_{case.name}"
    publish(f"chain/{name}", f"{markdown(sweep)}{note}\n![Error over time]({name}.png)\n")
    if SHIPPED.stem == case.name:  # after the page, which states whether the code was changed
        SHIPPED.write_text(as_json(sweep), encoding="utf-8")
    shutil.copy(out / "tradeoff.png", MEASURED / "chain" / f"{name}.png")


if __name__ == "__main__":
    main()
