"""Differences between designs at `draft` against a finer fidelity: micro-geometries, run-ups, and one mesh law.

    python -m benchmarks paired OUT [PAGE]      docs/measured/chain/paired.md, paired_designs.md

Single stage. Micro-geometries of one gear body, and designs of one mesh law that differ in damping and inertia, are
compared with gears of `reference`: housing, transfer vectors and time loop are those of `draft` in both, so that the
errors are those of the mesh laws. Run-ups of micro-geometries and wheel bodies are compared with `standard` with gears
of `reference`, finer in all steps. What OUT/runs.json holds is not run again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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

GEARS = {
    name: [change.format(gear) for gear in (("pinion",) if "slope" in name else ("pinion", "wheel")) if change]
    for name, change in MICRO.items()
}
HOLES = "gears.wheel.blank = { type = 'holes', count = 6, hole_radius_mm = 5, pitch_radius_mm = 26 }"
BEARINGS = ("A1", "A2", "B1", "B2")
SPEEDS = {f"{speed} rpm": [f"operation.input_speed_rpm = {speed}"] for speed in (1000, 1300, 1500, 1800, 2200)}
Runs = dict[str, dict[str, Any]]


def ramp(first: int, last: int) -> list[str]:
    """Return the changes of a run-up of 2 s."""
    up = f"operation.ramp = {{ end_speed_rpm = {last}, duration = 2 }}"
    return [f"operation.input_speed_rpm = {first}", up]


def damping(field: str, value: float) -> list[str]:
    """Return the changes of the damping of all bearings."""
    return [f"bearings.{name}.{field} = {value}" for name in BEARINGS]


@dataclass(frozen=True)
class Group:
    """Designs and operating points by name, each with its changes of the case, and the finer fidelity.

    fine_limits: True for pairs with their limits at the finer fidelity, too.
    """

    title: str
    designs: Mapping[str, list[str]]
    points: Mapping[str, list[str]]
    fine: nvh.Fidelity
    fine_limits: bool = False


FINE_GEARS = replace(nvh.DRAFT, gear=nvh.REFERENCE.gear)
PAGES = {
    "paired": [Group("Micro-geometries", GEARS, SPEEDS, FINE_GEARS, fine_limits=True)],
    "paired_designs": [
        Group(
            "Run-ups in 2 s",
            GEARS | {"6 holes": [HOLES]},
            {"800 to 1600 rpm": ramp(800, 1600), "1600 to 2400 rpm": ramp(1600, 2400)},
            replace(nvh.STANDARD, gear=nvh.REFERENCE.gear),
        ),
        Group(
            "One mesh law",
            {
                "as drawn": [],
                "radial damping 2400": damping("radial_damping", 2400),
                "radial damping 600": damping("radial_damping", 600),
                "axial damping 1200": damping("axial_damping", 1200),
                "inertia of B 0.004": ["shafts.B.coupled_inertia = 0.004"],
                "inertia of A 0.03": ["shafts.A.coupled_inertia = 0.03"],
                "shaft A of 16 mm": [
                    "shafts.A.segments = [{ start_mm = -20, end_mm = 130, outer_diameter_mm = 16 }]",
                ],
            },
            SPEEDS,
            FINE_GEARS,
        ),
    ],
}
"""Page → its groups."""


def measured(out: Path, group: Group) -> tuple[Runs, Runs]:
    """Return "design|point" → outcome of a run, at `draft` and at the finer fidelity."""
    file, runs = out / "runs.json", dict[str, Runs]()
    if file.exists():
        runs = json.loads(file.read_text())
    for name, fidelity in (("draft", nvh.DRAFT), ("fine", group.fine)):
        found = runs.setdefault(f"{group.title}, {name}", {})
        for design, changes in group.designs.items():
            for point, at in group.points.items():
                if f"{design}|{point}" in found:
                    continue
                case = nvh.load_case(ROOT / "cases/small/single_stage.toml", changes=[*changes, *at])
                outcome = measure(case, fidelity, out / "operators")
                if outcome["refused"]:
                    sys.exit(f"{design}, {point}: {outcome['refused']}")
                print(f"{name}: {design}, {point}: {level(outcome):.2f} in {outcome['seconds']:.0f} s", flush=True)
                found[f"{design}|{point}"] = outcome
                file.write_text(json.dumps(runs))
    return runs[f"{group.title}, draft"], runs[f"{group.title}, fine"]


def level(run: dict[str, Any]) -> float:
    return float(run["responses"]["level"])


def level_rows(group: Group, draft: Runs, fine: Runs) -> Iterator[tuple[str, list[float]]]:
    """Yield rows of single levels, and their errors over the limits on their side."""
    for design in group.designs:
        cells, shares = [], []
        for point in group.points:
            run = draft[f"{design}|{point}"]
            error = level(fine[f"{design}|{point}"]) - level(run)
            low, high = (None if limit is None else limit - level(run) for limit in run["limits"]["level"])
            shares.append(_share(error, low, high))
            cells.append(f"{level(run):.1f} ({_words(low)} … {_words(high)}), {error:+.2f}")
        yield f"| {design} | " + " | ".join(cells) + " |", shares


def pair_rows(group: Group, draft: Runs, fine: Runs) -> Iterator[tuple[str, list[float]]]:
    """Yield rows of differences by pair of designs, and their errors over the limits on their side."""
    for first, second in combinations(group.designs, 2):
        cells, shares = [], []
        for point in group.points:
            keys = [f"{design}|{point}" for design in (first, second)]
            change, exact = (level(runs[keys[1]]) - level(runs[keys[0]]) for runs in (draft, fine))
            (low, high), finely = (paired_offsets(*(runs[key]["band"] for key in keys)) for runs in (draft, fine))
            shares.append(_share(exact - change, low, high))
            cells.append(f"{change:+.1f} ({_words(low)} … {_words(high)}), {exact - change:+.2f}")
            if group.fine_limits:
                cells[-1] += "; " + " … ".join(map(_words, finely))
        yield f"| {first}, {second} | " + " | ".join(cells) + " |", shares


def _words(limit: float | None) -> str:
    return "none" if limit is None else f"{limit:+.1f}"


def _share(error: float, low: float | None, high: float | None) -> float:
    side = high if error > 0 else low
    return 0.0 if side is None or error == 0 else abs(error / side) if side else float("inf")


def _held(name: str, shares: Sequence[float]) -> str:
    some = sorted(shares)
    return (
        f"Limits hold {sum(share <= 1 for share in some)} of {len(some)} {name}. Errors over limits: median "
        f"{some[len(some) // 2]:.2f}, 95 % below {some[int(0.95 * len(some))]:.2f}, largest {some[-1]:.2f}."
    )


def section(group: Group, draft: Runs, fine: Runs) -> str:
    """Return the tables of a group."""
    head = " | " + " | ".join(group.points) + " |\n|---" + "|---" * len(group.points) + "|\n"
    finely = "; then the limits at the finer fidelity" if group.fine_limits else ""
    parts = []
    for words, name, first, rows in (
        ("level at `draft` (limits less the level), and its error", "levels", "design", level_rows),
        (
            f"second less first level (limits less the difference), and its error{finely}",
            "differences",
            "pair",
            pair_rows,
        ),
    ):
        found = list(rows(group, draft, fine))
        lines = "\n".join(row for row, _ in found)
        shares = [share for _, some in found for share in some]
        parts.append(f"{group.title}: {words} / dB\n\n| {first}{head}{lines}\n\n{_held(name, shares)}\n")
    return "\n".join(parts)


def main() -> None:
    """Measure and publish."""
    out, pages = Path(sys.argv[1]), sys.argv[2:] or list(PAGES)
    out.mkdir(parents=True, exist_ok=True)
    for page in pages:
        publish(f"chain/{page}", "\n".join(section(group, *measured(out, group)) for group in PAGES[page]))


if __name__ == "__main__":
    main()
