"""Differences between micro-geometries of one gear body at `draft` against laws of `reference`.

    python -m benchmarks paired OUT             docs/measured/chain/paired.md

Single stage, six micro-geometries, five speeds: levels and differences of two at one speed, with their limits. The
other side has gears of `reference`; housing, transfer vectors and time loop are those of `draft` in both, so that
the errors are those of the mesh laws. What OUT/gears.json holds is not run again.
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
from benchmarks.publish import ROOT, publish
from nvhchain.study import measure
from nvhchain.study.responses import paired_offsets

PLACE = "gears.{}.geometry.micro.drive."
MICRO = {
    "none": "",
    "tip relief 10 µm": PLACE + "tip_relief = {{ amount_um = 10, length_mm = 2.5 }}",
    "tip relief 25 µm": PLACE + "tip_relief = {{ amount_um = 25, length_mm = 2.5 }}",
    "lead crowning 6 µm": PLACE + "lead_crowning_um = 6",
    "profile crowning 6 µm": PLACE + "profile_crowning_um = 6",
    "lead slope 10 µm": PLACE + "lead_slope_um = 10",
}
"""Name → change of a gear; the slope is the pinion's alone, all others are both gears'."""
SPEEDS = (1000, 1300, 1500, 1800, 2200)
Runs = dict[str, dict[str, Any]]


def measured(out: Path) -> tuple[Runs, Runs]:
    """Return "micro-geometry|speed" → outcome of a run, with gears of `draft` and of `reference`."""
    file, runs = out / "gears.json", dict[str, Runs]()
    if file.exists():
        runs = json.loads(file.read_text())
    for name, gears in (("draft", nvh.DRAFT.gear), ("reference", nvh.REFERENCE.gear)):
        found = runs.setdefault(name, {})
        for micro, change in MICRO.items():
            named = ("pinion",) if "slope" in micro else ("pinion", "wheel")
            changes = [change.format(gear) for gear in named if change]
            for speed in SPEEDS:
                if f"{micro}|{speed}" in found:
                    continue
                at = [*changes, f"operation.input_speed_rpm = {speed}"]
                case = nvh.load_case(ROOT / "cases/small/single_stage.toml", changes=at)
                found[f"{micro}|{speed}"] = measure(case, replace(nvh.DRAFT, gear=gears), out / "operators")
        file.write_text(json.dumps(runs))
    return runs["draft"], runs["reference"]


def level(run: dict[str, Any]) -> float:
    return float(run["responses"]["level"])


def level_rows(draft: Runs, fine: Runs) -> Iterator[str]:
    """Yield the rows of single levels."""
    for micro in MICRO:
        cells = []
        for speed in SPEEDS:
            run, exact = draft[f"{micro}|{speed}"], level(fine[f"{micro}|{speed}"])
            low, high = (None if limit is None else limit - level(run) for limit in run["limits"]["level"])
            held = (low is None or level(run) + low <= exact) and (high is None or exact <= level(run) + high)
            error = f"{exact - level(run):+.2f}" + ("" if held else " **out**")
            cells.append(f"{level(run):.1f} ({words(low)} … {words(high)}), {error}")
        yield f"| {micro} | " + " | ".join(cells) + " |"


def words(limit: float | None) -> str:
    return "none" if limit is None else f"{limit:+.1f}"


def pair_rows(draft: Runs, fine: Runs) -> Iterator[tuple[str, list[float]]]:
    """Yield rows of differences by pair of micro-geometries, and the errors over the limits on their side."""
    for first, second in combinations(MICRO, 2):
        cells, shares = [], []
        for speed in SPEEDS:
            keys = [f"{micro}|{speed}" for micro in (first, second)]
            change, exact = (level(runs[keys[1]]) - level(runs[keys[0]]) for runs in (draft, fine))
            low, high = paired_offsets(draft[keys[0]]["band"], draft[keys[1]]["band"])
            side = high if exact > change else low
            shares.append(0.0 if side is None else abs((exact - change) / side))
            finely = paired_offsets(fine[keys[0]]["band"], fine[keys[1]]["band"])
            cells.append(
                f"{change:+.1f} ({words(low)} … {words(high)}), {exact - change:+.2f}; "
                f"{words(finely[0])} … {words(finely[1])}"
            )
        yield f"| {first}, {second} | " + " | ".join(cells) + " |", shares


def main() -> None:
    """Measure and publish."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    draft, fine = measured(out)
    head = " | " + " | ".join(f"{speed} rpm" for speed in SPEEDS) + " |\n|---" + "|---" * len(SPEEDS) + "|\n"
    rows = list(pair_rows(draft, fine))
    shares = sorted(share for _, some in rows for share in some)
    publish(
        "chain/paired",
        "Level at `draft` (limits less the level); the level with gears of `reference` less that of `draft` / dB:\n\n"
        f"| micro-geometry{head}" + "\n".join(level_rows(draft, fine)) + "\n\n"
        "Second less first level at `draft` (limits less the difference), and its error; then the limits with gears of "
        f"`reference` / dB:\n\n| pair{head}" + "\n".join(row for row, _ in rows) + "\n\n"
        f"Limits hold {sum(share <= 1 for share in shares)} of {len(shares)} differences. Errors over limits: median "
        f"{shares[len(shares) // 2]:.2f}, 95 % below {shares[int(0.95 * len(shares))]:.2f}, largest "
        f"{shares[-1]:.2f}.\n",
    )


if __name__ == "__main__":
    main()
