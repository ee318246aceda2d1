"""Differences between run-ups of designs at `draft` against a finer fidelity, with their paired limits.

    python -m benchmarks paired_run_ups OUT     docs/measured/chain/paired_run_ups.md

Single stage, micro-geometries and bodies of the wheel, two run-ups. The other side is `standard` with gears of
`reference`: housing, transfer vectors, time step and mesh laws are all finer. What OUT/runs.json holds is not run again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import nvhchain as nvh
from benchmarks.chain.paired import MICRO, Runs, level, words
from benchmarks.publish import ROOT, publish
from nvhchain.study import measure
from nvhchain.study.responses import paired_offsets

HOLES = "gears.wheel.blank = { type = 'holes', count = 6, hole_radius_mm = 5, pitch_radius_mm = 26 }"
DESIGNS = {
    name: [change.format(gear) for gear in (("pinion",) if "slope" in name else ("pinion", "wheel")) if change]
    for name, change in MICRO.items()
} | {"6 holes": [HOLES]}
"""Name → changes of the case."""
RAMPS = {"800 to 1600 rpm": (800, 1600), "1600 to 2400 rpm": (1600, 2400)}
"""Name → first and last speed; each in 2 s."""
FINE = replace(nvh.STANDARD, gear=nvh.REFERENCE.gear)


def measured(out: Path) -> tuple[Runs, Runs]:
    """Return "design|ramp" → outcome of a run, at `draft` and at the finer fidelity."""
    file, runs = out / "runs.json", dict[str, Runs]()
    if file.exists():
        runs = json.loads(file.read_text())
    for name, fidelity in (("draft", nvh.DRAFT), ("fine", FINE)):
        found = runs.setdefault(name, {})
        for design, changes in DESIGNS.items():
            for ramp, (first, last) in RAMPS.items():
                if f"{design}|{ramp}" in found:
                    continue
                at = f"operation.input_speed_rpm = {first}"
                up = f"operation.ramp = {{ end_speed_rpm = {last}, duration = 2 }}"
                case = nvh.load_case(ROOT / "cases/small/single_stage.toml", changes=[*changes, at, up])
                outcome = measure(case, fidelity, out / "operators")
                if outcome["refused"]:
                    sys.exit(f"{design}, {ramp}: {outcome['refused']}")
                print(f"{name}: {design}, {ramp}: {level(outcome):.2f} in {outcome['seconds']:.0f} s", flush=True)
                found[f"{design}|{ramp}"] = outcome
                file.write_text(json.dumps(runs))
    return runs["draft"], runs["fine"]


def level_rows(draft: Runs, fine: Runs) -> Iterator[tuple[str, list[float]]]:
    """Yield rows of single levels, and their errors over the limits on their side."""
    for design in DESIGNS:
        cells, shares = [], []
        for ramp in RAMPS:
            run = draft[f"{design}|{ramp}"]
            error = level(fine[f"{design}|{ramp}"]) - level(run)
            low, high = (None if limit is None else limit - level(run) for limit in run["limits"]["level"])
            shares.append(_share(error, low, high))
            cells.append(f"{level(run):.1f} ({words(low)} … {words(high)}), {error:+.2f}")
        yield f"| {design} | " + " | ".join(cells) + " |", shares


def pair_rows(draft: Runs, fine: Runs) -> Iterator[tuple[str, list[float]]]:
    """Yield rows of differences by pair of designs, and their errors over the limits on their side."""
    for first, second in combinations(DESIGNS, 2):
        cells, shares = [], []
        for ramp in RAMPS:
            keys = [f"{design}|{ramp}" for design in (first, second)]
            change, exact = (level(runs[keys[1]]) - level(runs[keys[0]]) for runs in (draft, fine))
            low, high = paired_offsets(draft[keys[0]]["band"], draft[keys[1]]["band"])
            shares.append(_share(exact - change, low, high))
            cells.append(f"{change:+.1f} ({words(low)} … {words(high)}), {exact - change:+.2f}")
        yield f"| {first}, {second} | " + " | ".join(cells) + " |", shares


def _share(error: float, low: float | None, high: float | None) -> float:
    side: Any = high if error > 0 else low
    return 0.0 if side is None else abs(error / side) if side else float("inf") * abs(error)


def _summary(name: str, shares: list[float]) -> str:
    some = sorted(shares)
    return (
        f"Limits hold {sum(share <= 1 for share in some)} of {len(some)} {name}. Errors over limits: median "
        f"{some[len(some) // 2]:.2f}, 95 % below {some[int(0.95 * len(some))]:.2f}, largest {some[-1]:.2f}."
    )


def main() -> None:
    """Measure and publish."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    draft, fine = measured(out)
    head = " | " + " | ".join(RAMPS) + " |\n|---" + "|---" * len(RAMPS) + "|\n"
    parts = []
    for title, name, first, rows in (
        ("Level of the run-up at `draft` (limits less the level), and its error", "levels", "design", level_rows),
        (
            "Second less first level at `draft` (limits less the difference), and its error",
            "differences",
            "pair",
            pair_rows,
        ),
    ):
        found = list(rows(draft, fine))
        lines = "\n".join(row for row, _ in found)
        shares = [share for _, some in found for share in some]
        parts.append(f"{title} / dB:\n\n| {first}{head}{lines}\n\n{_summary(name, shares)}\n")
    publish("chain/paired_run_ups", "\n".join(parts))


if __name__ == "__main__":
    main()
