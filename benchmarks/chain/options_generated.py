"""Estimated effects of the options on generated gearboxes against switching each of them on at `draft`.

    python -m benchmarks options_generated OUT [N] [SEED]

Writes docs/measured/chain/options_generated.md: N scenes (2000), each one switch of one gearbox. Pairs of gears are
drawn at random, four gearboxes of each: other shafts, bearings, speeds and torques. OUT/scenes.json keeps what is
measured; another call goes on there, and estimates all of it anew. OUT keeps compliances of flanks, too.
"""

from __future__ import annotations

import json
import random
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.chain.options_decided import BELOW, BENT, ROOT, force_level, right
from benchmarks.publish import publish
from nvhchain.case import PLAIN, GearboxCase, Options
from nvhchain.errors import AccuracyWarning, InputError, SolverError
from nvhchain.scene.linear_level import LinearGearbox, level_change

PER_PAIR = 4
"""Gearboxes of one pair of gears."""

RIGID = replace(PLAIN, rigid_housing=True)
BENT_RIGID = replace(BENT, rigid_housing=True)
SMALL = (ROOT / "cases" / "small" / "single_stage.toml").read_text(encoding="utf-8")


def switches(friction: float) -> dict[str, tuple[Options, Options]]:
    """By name: options before and after a switch."""
    return {
        "friction": (RIGID, replace(RIGID, friction=friction)),
        "shuttling": (RIGID, replace(RIGID, shuttling=True)),
        "tilt": (RIGID, replace(RIGID, tilt=True)),
        "loaded_misalignment": (RIGID, replace(RIGID, loaded_misalignment=True)),
        "gyroscopic": (RIGID, replace(RIGID, gyroscopic=True)),
        "flexible_shafts": (RIGID, BENT_RIGID),
        "friction on flexible shafts": (BENT_RIGID, replace(BENT_RIGID, friction=friction)),
        "shuttling on flexible shafts": (BENT_RIGID, replace(BENT_RIGID, shuttling=True)),
        "tilt on flexible shafts": (BENT_RIGID, replace(BENT_RIGID, tilt=True)),
    }


def pair(rng: random.Random) -> dict[str, float]:
    """Draw a pair of gears."""
    teeth = rng.randint(17, 36)
    return {
        "pinion": teeth,
        "wheel": round(teeth * rng.uniform(1.0, 3.0)),
        "module": rng.choice((1.5, 2.0, 2.5, 3.0, 4.0)),
        "helix": rng.choice((0.0, rng.uniform(5.0, 30.0), rng.uniform(5.0, 30.0))),
        "width": round(rng.uniform(6.0, 14.0), 1),  # over the module
    }


def gearbox(of: dict[str, float], rng: random.Random) -> tuple[GearboxCase, float]:
    """Draw a gearbox with a pair of gears; returns the coefficient of friction, too."""
    transverse = of["module"] / cos(radians(of["helix"]))
    pitch = [0.5 * of[gear] * transverse for gear in ("pinion", "wheel")]
    width, distance = of["width"] * of["module"], sum(pitch)
    face_stress = rng.uniform(0.5, 8.0)  # N/mm² of tangential force over face width and module
    torque = face_stress * width * of["module"] * pitch[0] * 1e-3
    shafts = [round(share * rng.uniform(0.7, 1.0), 1) for share in (1.1 * pitch[0], min(1.1 * pitch[0], pitch[1]))]
    span, place = width + rng.uniform(30.0, 120.0), rng.uniform(0.3, 0.7)
    stiffness, damping = 10 ** rng.uniform(7.7, 8.9), rng.uniform(300.0, 3000.0)
    half, middle = 0.5 * width, place * span
    middle = min(max(middle, half + 12.0), span - half - 12.0)
    first, depth = 33.0, span + 36.0  # the bell and half a wall lie before the first bearing
    head, tail = SMALL.split("[[gears]]", 1)[0], SMALL.split("[housing]", 1)[1]
    lines = [head, ""]
    for number, (gear, axis) in enumerate((("pinion", "A"), ("wheel", "B"))):
        lines += [
            f'[[gears]]\nname = "{gear}"\nshaft = "{axis}"\nz_mm = {first + middle:.3f}\n[gears.geometry]',
            f"teeth = {of[gear]}\nnormal_module_mm = {of['module']}\nnormal_pressure_angle_deg = 20",
            f"helix_angle_deg = {(1 - 2 * number) * of['helix']}\nface_width_mm = {width}",
            f"bore_radius_mm = {0.5 * shafts[number]}\nthickness_allowance_um = 40",
        ]
    lines += [f'[[stages]]\nname = "stage"\npinion = "pinion"\nwheel = "wheel"\ncentre_distance_mm = {distance:.6f}']
    for number, axis in enumerate("AB"):
        inertia = 10 ** rng.uniform(-3.0, -1.0)
        lines += [
            f'[[shafts]]\nname = "{axis}"\naxis_mm = [{number * distance:.6f}, 0]\ncoupled_inertia = {inertia:.3g}',
            f"segments = [{{ start_mm = 13, end_mm = {depth:.3f}, outer_diameter_mm = {shafts[number]} }}]",
        ]
    for axis in "AB":
        for number, z in enumerate((first, first + span)):
            lines += [
                f'[[bearings]]\nname = "{axis}{number + 1}"\nshaft = "{axis}"\nz_mm = {z:.3f}',
                f"radial_stiffness = {stiffness:.3g}\naxial_stiffness = {0.3 * stiffness:.3g}",
                f"radial_damping = {damping:.0f}\naxial_damping = {damping / 3:.0f}",
            ]
    lines.append("[housing]" + tail)
    values = {"gear_spaces": [], "bores": []}
    for number, axis in enumerate("AB"):
        at = f"[{number * distance:.6f}, 0"
        values["gear_spaces"].append(f"{{ centre_mm = {at}], radius_mm = {pitch[number] + 2 * of['module'] + 6:.3f} }}")
        values["bores"] += [
            f'{{ name = "{axis}{n + 1}", centre_mm = {at}, {z:.3f}], radius_mm = {0.5 * shafts[number] + 6:.3f} }}'
            for n, z in enumerate((first, first + span))
        ]
    changes = [
        f"operation.input_speed_rpm = {round(rng.uniform(600.0, 6000.0))}",
        f"operation.input_torque = {torque:.4g}",
        f"housing.depth_mm = {depth:.3f}",
        "housing.chamfer_mm = 4",
        *(f"housing.{name} = [{', '.join(entries)}]" for name, entries in values.items()),
        'quantities = ["bearing_forces"]',
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "generated.toml"
        file.write_text("\n".join(lines), encoding="utf-8")
        case = nvh.load_case(file, changes=changes)
    assert isinstance(case, GearboxCase)
    return case, round(rng.uniform(0.03, 0.1), 3)


def gearboxes(seed: int) -> Iterator[tuple[str, GearboxCase, float]]:
    """Draw gearboxes that `check` accepts, each with its name and coefficient of friction."""
    number = 0
    while True:
        of = pair(random.Random(f"{seed} {number}"))
        for each in range(PER_PAIR):
            try:
                case, friction = gearbox(of, random.Random(f"{seed} {number} {each}"))
            except InputError:
                continue  # such as teeth that do not reach each other
            yield f"{number} {each}", case, friction
        number += 1


def walls_level(result: Any, linear: LinearGearbox) -> float:
    """A-weighted level of the bearing forces in the band, weighted by the walls as the estimate is (dB)."""
    spectrum, band = result.force_spectrum, result.case.band
    inside = (spectrum.frequency >= band.low) & (spectrum.frequency <= band.high)
    frequency = spectrum.frequency[inside]
    power = (np.abs(spectrum.force[inside]) ** 2).sum(axis=(1, 2)) * linear._walls(frequency)
    return float(10 * np.log10(power @ 10 ** (0.1 * nvh.levels.a_weighting(frequency))))


def measured(case: GearboxCase, friction: float, out: Path) -> list[dict[str, Any]]:
    """What every switch of a gearbox does at `draft`, or why it is refused."""
    linear, runs, rows = LinearGearbox(case), dict[Options, tuple[float, float]](), []

    def run(options: Options) -> tuple[float, float]:
        if options not in runs:
            result = nvh.run(replace(case, options=options), fidelity=nvh.DRAFT, operators=out / "operators")
            runs[options] = force_level(result), walls_level(result, linear)
        return runs[options]

    for switch, (before, after) in switches(friction).items():
        try:
            changes = [b - a for a, b in zip(run(before), run(after), strict=True)]
        except (InputError, SolverError) as error:
            rows.append({"switch": switch, "refused": str(error)[:120]})
            continue
        rows.append({"switch": switch, "force": changes[0], "walls": changes[1]})
    return rows


def judged(case: GearboxCase, friction: float, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Add the estimate to the rows of a gearbox."""
    linear, switched = LinearGearbox(case), switches(friction)
    powers = {
        options: linear.power(options) for row in rows if "refused" not in row for options in switched[row["switch"]]
    }
    return [
        row if "refused" in row else row | {"estimate": level_change(*(powers[of] for of in switched[row["switch"]]))}
        for row in rows
    ]


def page(rows: list[dict[str, Any]], boxes: int, seed: int) -> str:
    """Return the page."""
    tried = [row for row in rows if "refused" not in row]
    lines = [
        "# Options that decide themselves: generated gearboxes",
        "",
        f"{len(tried)} switches on {boxes} gearboxes, seed {seed}; {len(rows) - len(tried)} refused by a run.",
        "Pairs of 17 to 36 teeth, ratios of 1 to 3, modules of 1.5 to 4 mm, helix angles of 0 to 30°, 600 to 6000 rpm,",
        "on rigid seats.",
        "Change of the level of all bearing forces in dB(A), weighted as walls radiate: linear estimate against",
        "finite element teeth and contact in time at `draft`.",
        "",
        f"*Right*: the sign of `draft` and half to twice its size, or within {BELOW} dB.",
        "",
        f"| switched on | tries | right | above {BELOW} dB | right | right sign | worst estimate | its `draft` |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for name in [*Counter(row["switch"] for row in tried), "all"]:
        of = [row for row in tried if name in (row["switch"], "all")]
        big = [row for row in of if max(abs(row["estimate"]), abs(row["walls"])) > BELOW]
        hits, great = (sum(right(row["estimate"], row["walls"]) for row in each) for each in (of, big))
        sign = sum(row["estimate"] * row["walls"] > 0.0 for row in big)
        worst = max(of, key=lambda row: abs(row["estimate"] - row["walls"]))
        shares = [f"{100 * part / max(whole, 1):.0f} %" for part, whole in ((hits, len(of)), (great, len(big)))]
        signs = f"{100 * sign / max(len(big), 1):.0f} %"
        cells = (name, str(len(of)), shares[0], str(len(big)), shares[1], signs)
        lines.append(f"| {' | '.join(cells)} | {worst['estimate']:+.1f} | {worst['walls']:+.1f} |")
    return "\n".join([*lines, ""])


def main() -> None:
    """Measure gearboxes until there are enough scenes, and write the page."""
    out, count, seed = Path(sys.argv[1]), *(list(map(int, sys.argv[2:])) + [2000, 1][len(sys.argv) - 2 :])
    kept = out / "scenes.json"
    out.mkdir(parents=True, exist_ok=True)
    found = json.loads(kept.read_text()) if kept.is_file() else {}
    warnings.simplefilter("ignore", AccuracyWarning)  # differences of levels are the subject here
    rows, boxes = list[dict[str, Any]](), 0
    for name, case, friction in gearboxes(seed):
        if sum("refused" not in row for row in rows) >= count:
            break
        if name not in found:
            found[name] = measured(case, friction, out)
            kept.write_text(json.dumps(found, indent=1))
        rows += judged(case, friction, found[name])
        boxes += 1
    publish("chain/options_generated", page(rows, boxes, seed))


if __name__ == "__main__":
    main()
