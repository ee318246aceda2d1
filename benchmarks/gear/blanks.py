"""Light blanks: their mesh halved, and the levels without elements.

    python -m benchmarks blanks OUT [NAME ...]

Writes docs/measured/gear/blanks.md. Measures what is named (all by default: see `measurements`) and is not yet in
OUT/<name>.json, each in its own process, then writes the tables of everything found in OUT. Seconds are processor time.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.gear.gear import deflection, stage
from benchmarks.gear.iso6336 import iso_stiffness
from benchmarks.publish import publish
from nvhchain.fidelity import DRAFT, STANDARD, GearFidelity
from nvhchain.gear import (
    SOLID,
    Blank,
    Engagement,
    FlankCompliance,
    GearBody,
    GearGeometry,
    GearPair,
    SliceCompliance,
    ThinRim,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
    nominal_centre_distance,
    slice_compliance,
)

Record = dict[str, Any]
Compliance = FlankCompliance | SliceCompliance

MODULE, TEETH, BORES, HUB, WIDTH = 2.7e-3, (18, 28), (8e-3, 12e-3), 17e-3, 22e-3
TORQUE = 150.0
"""N m, of the pinion."""

MESHES = {
    "standard": STANDARD.gear,
    "halved across": replace(STANDARD.gear, profile_elements=8, transverse_refinement=2),
    "20 layers": STANDARD.gear.even_layers(20),
    "both": replace(STANDARD.gear.even_layers(20), profile_elements=8, transverse_refinement=2),
}
TOO_LARGE = {"3 mm web, both"}
"""Some 20 GB, by the ratios of the others."""
LIGHT = {
    "3 mm web": (30.0, 3e-3, 2.5),
    "6 mm web": (30.0, 6e-3, 2.5),
    "8 mm web, rim of 1.2 modules": (10.0, 8e-3, 1.2),
}
"""Helix, degrees; thickness of the web, m; rim below the root circle, modules."""

COARSE = DRAFT.gear.even_layers(4)
"""For what errs by tens of per cent."""


def light(name: str) -> GearPair:
    """A small pair whose wheel has a thin web."""
    helix, thickness, rim = LIGHT[name]
    pinion, wheel = (
        GearGeometry(z, MODULE, np.radians(20.0), np.radians(beta), WIDTH, bore, thickness_allowance=30e-6)
        for z, beta, bore in zip(TEETH, (helix, -helix), BORES, strict=True)
    )
    blank = ThinRim(thickness, HUB, wheel.root_radius - rim * MODULE)
    return GearPair(GearBody(pinion), GearBody(wheel, blank), nominal_centre_distance(pinion, wheel))


def meshed(name: str, fidelity: GearFidelity) -> Record:
    """Mean and swing of δ, m, with the wheel meshed so."""
    pair = light(name)
    reach = engaged_reach(pair, fidelity.corner_gap)
    pinion = flank_compliance(pair.pinion, STANDARD.gear, reach=reach)
    start = time.process_time()
    wheel = flank_compliance(pair.wheel, fidelity, reach=reach)
    seconds = time.process_time() - start
    delta = deflection(Engagement(pair, (pinion, wheel), STANDARD.gear), pair.normal_force(TORQUE), 12)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"mean": delta.mean(), "swing": float(np.ptp(delta)), "seconds": seconds, "megabytes": peak}


def levels() -> Record:
    """Stage 1 of the gearbox with several wheels: elements, the analytic level, ISO 6336-1 Method B."""
    drawn, force = stage("slotted", 1)
    blanks: dict[str, Blank] = {
        "solid": SOLID,
        "7 mm web": ThinRim(7e-3, 30e-3, 55e-3),
        "slotted": drawn.wheel.blank,
    }
    record: Record = {}
    for name, blank in blanks.items():
        pair = replace(drawn, wheel=replace(drawn.wheel, blank=blank))
        reach = engaged_reach(pair, COARSE.corner_gap)
        both: dict[str, tuple[Compliance, Compliance]] = {
            "elements": (
                flank_compliance(pair.pinion, COARSE, reach=reach),
                flank_compliance(pair.wheel, COARSE, reach=reach),
            ),
            "analytic": (slice_compliance(pair.pinion), slice_compliance(pair.wheel)),
        }
        rows = {level: loaded(Engagement(pair, of, STANDARD.gear), force) for level, of in both.items()}
        if blank.cutouts is None:  # Method B knows no openings
            # per width in the transverse plane → of the whole mesh along the normal
            width = pair.wheel.geometry.face_width / np.cos(pair.base_helix_angle) ** 2
            rows["iso"] = {"stiffness": iso_stiffness(pair).mesh * width}
        record[name] = rows
    return record


def loaded(engagement: Engagement, force: float) -> Record:
    """Mean, swing and first mesh harmonic of δ, m; mean tangent stiffness, N/m."""
    pair, delta = engagement.pair, deflection(engagement, force, 24)
    angles = np.arange(24) / 24 * pair.mesh_period
    tangent = [loaded_mesh(engagement, a, force, guess=delta.mean()).tangent_stiffness for a in angles]
    lines = 2 * np.abs(np.fft.rfft(delta)) / len(delta)
    return {
        "mean": delta.mean(),
        "swing": float(np.ptp(delta)),
        "first": lines[pair.meshes_per_body_period],
        "stiffness": float(np.mean(tangent)),
    }


def measurements() -> dict[str, Callable[[], Record]]:
    """What can be named."""
    webs = {f"{name}, {mesh}": partial(meshed, name, fidelity) for name in LIGHT for mesh, fidelity in MESHES.items()}
    return {name: measure for name, measure in webs.items() if name not in TOO_LARGE} | {"levels": levels}


def mesh_table(records: dict[str, Record]) -> list[str]:
    """What finer meshes do to δ."""
    lines = [
        f"**Mesh of light wheels** ({TEETH[0]} and {TEETH[1]} teeth, module 2.7 mm, 22 mm wide, {TORQUE:g} N m)",
        "",
        "| wheel | helix | its mesh | mean δ / µm | % | swing / µm | % | s | peak MB |",
        "|---|---:|---|---:|---:|---:|---:|---:|---:|",
    ]
    for name, (helix, *_) in LIGHT.items():
        usual = records.get(f"{name}, standard")
        for mesh in MESHES:
            row = records.get(f"{name}, {mesh}")
            if row and usual:
                cells = [f"{1e6 * row[k]:.2f} | {100 * (row[k] / usual[k] - 1):+.2f}" for k in ("mean", "swing")]
                cost = f"{row['seconds']:.0f} | {row['megabytes']:.0f}"
                lines.append(f"| {name} | {helix:g}° | {mesh} | {' | '.join(cells)} | {cost} |")
    return [*lines, ""]


def levels_table(record: Record) -> list[str]:
    """Levels without elements against elements."""
    lines = [
        "**Analytic level and ISO 6336-1 Method B against elements, stage 1 of the gearbox (steel, nominal force)**",
        "",
        "| wheel | level | mean δ / µm | swing / µm | mean stiffness / (N/µm) | error of δ / % | of stiffness / % "
        "| of mesh harmonic 1 / dB |",
        "|---|---|" + "---:|" * 6,
    ]
    for name, rows in record.items():
        true = rows["elements"]
        for level, row in rows.items():
            mean, swing = (f"{1e6 * row[k]:.2f}" if k in row else "" for k in ("mean", "swing"))
            error = f"{100 * (row['mean'] / true['mean'] - 1):+.1f}" if "mean" in row else ""
            first = f"{20 * np.log10(row['first'] / true['first']):+.1f}" if "first" in row else ""
            stiff = 100 * (row["stiffness"] / true["stiffness"] - 1)
            cells = [name, level, mean, swing, f"{1e-6 * row['stiffness']:.0f}", error, f"{stiff:+.1f}", first]
            lines.append("| " + " | ".join(cells) + " |")
    return [*lines, ""]


def main() -> None:
    out, every = Path(sys.argv[1]), measurements()
    out.mkdir(parents=True, exist_ok=True)
    if len(sys.argv) == 4 and sys.argv[3] == "!":  # the child
        (out / f"{sys.argv[2]}.json").write_text(json.dumps(every[sys.argv[2]]()))
        return
    for name in sys.argv[2:] or list(every):
        if not (out / f"{name}.json").exists():
            subprocess.run([sys.executable, "-m", "benchmarks.gear.blanks", str(out), name, "!"], check=True)
    records = {n: json.loads((out / f"{n}.json").read_text()) for n in every if (out / f"{n}.json").exists()}
    lines = ["δ: deflection along the flank normal over the body period.", ""]
    lines += mesh_table(records)
    if "levels" in records:
        lines += levels_table(records["levels"])
    publish("gear/blanks", "\n".join(lines))


if __name__ == "__main__":
    main()
