"""Convergence and cost of the gear stage.

    python -m benchmarks gear OUT [NAME ...]

Writes docs/measured/gear/gear.md and gear.png. Measures what is named (all by default: see `MEASUREMENTS`) and is not
yet in OUT/<name>.json, each in its own process, then writes the tables of everything found in OUT. A deflection δ is
that of the loaded mesh at the case's nominal force, at 48 angles per mesh over one body period unless the table says
otherwise. Seconds are processor time.
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

import numpy as np
from scipy.interpolate import CubicSpline

import nvhchain as nvh
from benchmarks.gear.gear_figure import draw
from benchmarks.gear.gear_tables import FINE_ANGLES, LAW_ANGLES, LAYERS, Record, written
from benchmarks.publish import MEASURED, publish
from nvhchain.case import GearboxCase
from nvhchain.fidelity import PRESETS, STANDARD, GearFidelity
from nvhchain.gear import (
    Engagement,
    FlankCompliance,
    GearBody,
    GearPair,
    deflection_at_force,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
    mesh_law,
    quasi_static_transmission_error,
)
from nvhchain.handoff import FloatArray

ROOT = Path(__file__).parents[2]


def stage(configuration: str, number: int) -> tuple[GearPair, float]:
    """Pair and nominal force (N) of a stage of cases/gearbox, counted from 1."""
    case = nvh.load_case(ROOT / "cases" / "gearbox" / f"{configuration}.toml")
    assert isinstance(case, GearboxCase)
    return case.pairs[number - 1], case.mesh_forces[number - 1]


def compliances(pair: GearPair, fidelity: GearFidelity) -> tuple[FlankCompliance, FlankCompliance]:
    """Of pinion and wheel."""

    def of(body: GearBody) -> FlankCompliance:
        return flank_compliance(body, fidelity, reach=engaged_reach(pair, fidelity.corner_gap))

    return of(pair.pinion), of(pair.wheel)


def deflection(engagement: Engagement, force: float, per_mesh: int) -> FloatArray:
    """δ (n,), m, over one body period."""
    pair, guess, found = engagement.pair, 20e-6, []
    for i in range(pair.meshes_per_body_period * per_mesh):
        guess = loaded_mesh(engagement, i * pair.mesh_period / per_mesh, force, guess=guess).deflection
        found.append(guess)
    return np.array(found)


def converged(configuration: str, number: int, fidelity: GearFidelity, per_mesh: int = 48) -> Record:
    """δ over the body period with its cost."""
    pair, force = stage(configuration, number)
    start = time.process_time()
    both = compliances(pair, fidelity)
    seconds = time.process_time() - start
    delta = deflection(Engagement(pair, both, replace(fidelity, slices=48)), force, per_mesh)
    return {
        "seconds": seconds,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "meshes": pair.meshes_per_body_period,
        "delta": delta.tolist(),
    }


def timed_law(configuration: str, number: int, angles_per_mesh: int) -> Record:
    """Seconds of wall clock for a whole law at standard, finite elements included."""
    pair, force = stage(configuration, number)
    fidelity = replace(STANDARD.gear, angles_per_mesh=angles_per_mesh)
    start, used = time.perf_counter(), time.process_time()
    both = compliances(pair, fidelity)
    elements = time.perf_counter() - start
    law = mesh_law(pair, nominal_force=force, fidelity=fidelity, compliances=both)
    return {
        "wall": time.perf_counter() - start,
        "elements": elements,
        "seconds": time.process_time() - used,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "shape": list(law.force.shape),
    }


SLICES = (4, 8, 16, 32, 64, 128)
ANGLES = (12, 24, 48, 96)
"""Per mesh, against `FINE_ANGLES`; between them by the periodic cubic spline."""
DEFLECTIONS = (1, 2, 3, 4, 8)
"""Per doubling of the deflection, at `LAW_ANGLES` per mesh."""


def grids() -> Record:
    """What slices, angles and deflections of the law do to the slotted stage, on the same compliances."""
    pair, force = stage("slotted", 1)
    both = compliances(pair, STANDARD.gear)
    record: Record = {"meshes": pair.meshes_per_body_period, "slices": {}, "angles": {}, "deflections": {}}
    for slices in SLICES:
        engagement = Engagement(pair, both, replace(STANDARD.gear, slices=slices))
        record["slices"][slices] = deflection(engagement, force, 48).tolist()
    fine = deflection(Engagement(pair, both, STANDARD.gear), force, FINE_ANGLES)
    for count in ANGLES:
        known = fine[:: FINE_ANGLES // count]
        spline = CubicSpline(np.linspace(0, 1, len(known) + 1), np.append(known, known[0]), bc_type="periodic")
        record["angles"][count] = largest(spline(np.arange(len(fine)) / len(fine)), fine)
    direct = fine[:: FINE_ANGLES // LAW_ANGLES]
    for count in DEFLECTIONS:
        fidelity = replace(STANDARD.gear, angles_per_mesh=LAW_ANGLES, deflections_per_doubling=count)
        law = mesh_law(pair, nominal_force=force, fidelity=fidelity, compliances=both)
        record["deflections"][count] = largest(deflection_at_force(law, force), direct)
    return record


def largest(found: FloatArray, true: FloatArray) -> float:
    """Largest difference, m."""
    return float(np.abs(found - true).max())


def preset(name: str) -> Record:
    """Transmission error of the slotted stage from the law of a preset, as the chain makes it."""
    pair, force = stage("slotted", 1)
    start = time.process_time()
    law = mesh_law(pair, nominal_force=force, fidelity=PRESETS[name].gear)
    seconds = time.process_time() - start
    return {
        "seconds": seconds,
        "meshes": pair.meshes_per_body_period,
        "delta": quasi_static_transmission_error(law, force)[1].tolist(),
    }


def corners() -> Record:
    """What contact of tip edges does to the slotted stage, up to several unloaded gaps."""
    pair, force = stage("slotted", 1)
    both = compliances(pair, replace(STANDARD.gear, corner_gap=max(CORNER_GAPS)))
    record: Record = {"meshes": pair.meshes_per_body_period, "gaps": {}}
    for gap in CORNER_GAPS:
        fidelity = replace(STANDARD.gear, corner_gap=gap)
        record["gaps"][f"{1e6 * gap:g}"] = deflection(Engagement(pair, both, fidelity), force, 48).tolist()
    return record


CORNER_GAPS = (0.0, 10e-6, 30e-6, 100e-6)
"""m, `GearFidelity.corner_gap`."""

PLANE = STANDARD.gear.even_layers(4)
HALVED = replace(PLANE, profile_elements=2 * PLANE.profile_elements, transverse_refinement=2)

MEASUREMENTS: dict[str, Callable[[], Record]] = {
    **{
        f"{name}-layers{n}": partial(converged, *which, STANDARD.gear.even_layers(n))
        for name, which in (("stage2", ("solid", 2)), ("slotted", ("slotted", 1)))
        for n in LAYERS[name]
    },
    "slotted-plane": partial(converged, "slotted", 1, PLANE),
    "slotted-halved": partial(converged, "slotted", 1, HALVED),
    "slotted-grids": grids,
    "slotted-corners": corners,
    **{f"preset-{name}": partial(preset, name) for name in PRESETS},
    "law-slotted": partial(timed_law, "slotted", 1, 24),
    "law-differential": partial(timed_law, "solid", 2, 96),
}


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    names = sys.argv[2:] or list(MEASUREMENTS)
    if len(sys.argv) == 3 and names[0].endswith("!"):  # the child
        name, start = names[0][:-1], time.perf_counter()
        (out / f"{name}.json").write_text(json.dumps(MEASUREMENTS[name]()))
        print(f"{name}: {time.perf_counter() - start:.0f} s")
        return
    for name in names:
        if not (out / f"{name}.json").exists():
            subprocess.run([sys.executable, "-m", "benchmarks.gear.gear", str(out), name + "!"], check=True)
    records = {n: json.loads((out / f"{n}.json").read_text()) for n in MEASUREMENTS if (out / f"{n}.json").exists()}
    publish("gear/gear", written(records))
    draw(records, LAYERS["slotted"], MEASURED / "gear" / "gear.png")


if __name__ == "__main__":
    main()
