"""Convergence and cost of the gear stage; writes docs/measured/gear.md.

    python benchmarks/gear.py OUT [NAME ...]

Measures what is named (all by default: see `MEASUREMENTS`) and is not yet in OUT/<name>.json, each in its own process,
then writes the tables of everything found in OUT. A deflection δ is that of the loaded mesh at the case's nominal
force, at 48 angles per mesh over one body period unless the table says otherwise. Seconds are processor time.
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

import nvhchain as nvh
from nvhchain.case import GearboxCase
from nvhchain.fidelity import STANDARD, GearFidelity
from nvhchain.gear import (
    SOLID,
    Blank,
    Engagement,
    FlankCompliance,
    GearBody,
    GearPair,
    ThinRim,
    deflection_at_force,
    engaged_reach,
    flank_compliance,
    iso_stiffness,
    loaded_mesh,
    mesh_law,
    slice_compliance,
)
from nvhchain.handoff import FloatArray

ROOT = Path(__file__).parents[1]
TABLE = ROOT / "docs" / "measured" / "gear.md"
Record = dict[str, Any]


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
GRIDS = ((48, 16), (96, 24), (192, 40))
"""Angles per mesh and deflections of the presets."""


def grids() -> Record:
    """What slices, angles and deflections of the law do to the slotted stage, on the same compliances."""
    pair, force = stage("slotted", 1)
    both = compliances(pair, STANDARD.gear)
    record: Record = {"meshes": pair.meshes_per_body_period, "slices": {}, "laws": {}}
    for slices in SLICES:
        engagement = Engagement(pair, both, replace(STANDARD.gear, slices=slices))
        record["slices"][slices] = deflection(engagement, force, 48).tolist()
    for angles, deflections in GRIDS:
        fidelity = replace(STANDARD.gear, angles_per_mesh=angles, deflections=deflections)
        law = mesh_law(pair, nominal_force=force, fidelity=fidelity, compliances=both)
        direct = deflection(Engagement(pair, both, fidelity), force, angles)
        record["laws"][f"{angles} × {deflections}"] = float(np.abs(deflection_at_force(law, force) - direct).max())
    return record


def corners() -> Record:
    """What contact of tip edges does to the slotted stage, up to several unloaded gaps."""
    pair, force = stage("slotted", 1)
    both = compliances(pair, replace(STANDARD.gear, corner_gap=max(CORNER_GAPS)))
    record: Record = {"meshes": pair.meshes_per_body_period, "gaps": {}}
    for gap in CORNER_GAPS:
        fidelity = replace(STANDARD.gear, corner_gap=gap)
        record["gaps"][f"{1e6 * gap:g}"] = deflection(Engagement(pair, both, fidelity), force, 48).tolist()
    return record


def analytic() -> Record:
    """Mean and swing of δ: analytic level and ISO 6336-1 Method B against elements, for three blanks of stage 1."""
    pair, force = stage("slotted", 1)
    gear = pair.wheel.geometry
    blanks: dict[str, Blank] = {
        "solid": SOLID,
        "thin rim": ThinRim(7e-3, 30e-3, 55e-3),
        "slotted": pair.wheel.blank,
    }
    record: Record = {}
    for name, blank in blanks.items():
        pair = replace(pair, wheel=replace(pair.wheel, blank=blank))
        levels: dict[str, Any] = {
            "elements": compliances(pair, STANDARD.gear),
            "analytic": (slice_compliance(pair.pinion), slice_compliance(pair.wheel)),
        }
        rows: Record = {}
        for level, both in levels.items():
            engagement = Engagement(pair, both, STANDARD.gear)
            start = time.process_time()
            delta = deflection(engagement, force, 24)
            angles = np.arange(24) / 24 * pair.mesh_period
            tangent = [loaded_mesh(engagement, a, force, guess=delta.mean()).tangent_stiffness for a in angles]
            rows[level] = {
                "mean": delta.mean(),
                "swing": float(np.ptp(delta)),
                "stiffness": float(np.mean(tangent)),
                "seconds": time.process_time() - start,
            }
        if blank.cutouts is None:  # Method B knows no openings
            # per width in the transverse plane → of the whole mesh along the normal
            iso = iso_stiffness(pair).mesh * gear.face_width / np.cos(pair.base_helix_angle) ** 2
            rows["iso"] = {"stiffness": iso}
        record[name] = rows
    return record


CORNER_GAPS = (0.0, 10e-6, 30e-6, 100e-6)
"""m, `GearFidelity.corner_gap`."""

LAYERS = {"stage2": (5, 8, 12), "slotted": (5, 8, 12)}
PLANE = replace(STANDARD.gear, width_layers=4)
HALVED = replace(PLANE, profile_elements=2 * PLANE.profile_elements, transverse_refinement=2)

MEASUREMENTS: dict[str, Callable[[], Record]] = {
    **{
        f"{name}-layers{n}": partial(converged, *which, replace(STANDARD.gear, width_layers=n))
        for name, which in (("stage2", ("solid", 2)), ("slotted", ("slotted", 1)))
        for n in LAYERS[name]
    },
    "slotted-plane": partial(converged, "slotted", 1, PLANE),
    "slotted-halved": partial(converged, "slotted", 1, HALVED),
    "slotted-grids": grids,
    "slotted-corners": corners,
    "analytic": analytic,
    "law-slotted": partial(timed_law, "slotted", 1, 24),
    "law-differential": partial(timed_law, "solid", 2, 96),
}


def harmonics(record: Record, count: int = 10) -> FloatArray:
    """Amplitudes (count,) m of the mesh harmonics of δ."""
    delta = np.array(record["delta"])
    lines = 2 * np.abs(np.fft.rfft(delta)) / len(delta)
    return np.asarray(lines[record["meshes"] :: record["meshes"]][:count])


def layers_table(title: str, records: dict[str, Record]) -> list[str]:
    """Mesh harmonics against those of the finest."""
    *_, last = records
    fine = harmonics(records[last])
    delta = np.array(records[last]["delta"])
    head = " | ".join(str(n) for n in range(1, 11))
    lines = [f"**{title}**", "", f"| layers | s | peak MB | mean δ / % | swing of δ / % | {head} |"]
    lines.append("|" + "---:|" * 15)
    for name, record in records.items():
        mine, own = harmonics(record), np.array(record["delta"])
        cells = [f"{record['seconds']:.0f}", f"{record['megabytes']:.0f}"]
        if name == last:
            cells += [f"{1e6 * own.mean():.3f} µm", f"{1e6 * np.ptp(own):.3f} µm"]
            cells += [f"{1e9 * h:.1f} nm" for h in mine]
        else:
            cells += [
                f"{100 * (own.mean() / delta.mean() - 1):+.2f}",
                f"{100 * (np.ptp(own) / np.ptp(delta) - 1):+.2f}",
            ]
            cells += [f"{20 * np.log10(a / b):+.1f}" for a, b in zip(mine, fine, strict=True)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def against_last(title: str, what: str, meshes: int, curves: dict[str, list[float]]) -> list[str]:
    """Mean, swing and mesh harmonics of curves of δ against the last one."""
    rows: dict[str, Record] = {n: {"delta": d, "meshes": meshes} for n, d in curves.items()}
    *_, last = rows
    fine, most = harmonics(rows[last]), np.array(rows[last]["delta"])
    head = " | ".join(str(n) for n in range(1, 11))
    lines = [f"**{title}**", "", f"| {what} | mean δ / % | swing of δ / % | {head} |"]
    lines.append("|" + "---:|" * 13)
    for name, row in rows.items():
        own = np.array(row["delta"])
        cells = [f"{100 * (own.mean() / most.mean() - 1):+.3f}", f"{100 * (np.ptp(own) / np.ptp(most) - 1):+.2f}"]
        cells += [f"{20 * np.log10(a / b):+.2f}" for a, b in zip(harmonics(row), fine, strict=True)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def grids_table(record: Record) -> list[str]:
    """Slices against the most; laws against the deflection solved directly."""
    lines = against_last("Slices, stage 1 slotted, 8 layers", "slices", record["meshes"], record["slices"])
    lines += ["**Law against the deflection solved directly, stage 1 slotted**", ""]
    lines += ["| angles per mesh × deflections | largest difference / nm |", "|---|---:|"]
    lines += [f"| {name} | {1e9 * value:.2f} |" for name, value in record["laws"].items()]
    return [*lines, ""]


def analytic_table(record: Record) -> list[str]:
    """Cheap levels against elements."""
    lines = ["**Analytic level and ISO 6336-1 Method B against elements, stage 1 (steel, nominal force)**", ""]
    lines += [
        "| wheel | level | mean δ / µm | swing / µm | mean stiffness / (N/µm) | error of δ / % | of stiffness / % |"
    ]
    lines += ["|---|---|---:|---:|---:|---:|---:|"]
    for name, rows in record.items():
        true = rows["elements"]
        for level, row in rows.items():
            mean, swing = (f"{1e6 * row[k]:.2f}" if k in row else "" for k in ("mean", "swing"))
            error = f"{100 * (row['mean'] / true['mean'] - 1):+.1f}" if "mean" in row else ""
            stiff = 100 * (row["stiffness"] / true["stiffness"] - 1)
            lines.append(
                f"| {name} | {level} | {mean} | {swing} | {1e-6 * row['stiffness']:.0f} | {error} | {stiff:+.1f} |"
            )
    return [*lines, ""]


def written(records: dict[str, Record]) -> str:
    """The page."""
    lines = [
        "Measured by `benchmarks/gear.py`. δ: deflection along the flank normal at the nominal force of the gearbox "
        "cases; mesh harmonics 1 to 10 of δ in dB against the last row, which gives them in nm.",
        "",
    ]
    for key, title in (
        ("stage2", "Layers over the face width, stage 2 (30/82, 40 mm, differential)"),
        ("slotted", "Layers over the face width, stage 1 (20/50, 22 mm, slotted)"),
    ):
        rows = {str(n): records[f"{key}-layers{n}"] for n in LAYERS[key] if f"{key}-layers{n}" in records}
        if len(rows) > 1:
            lines += layers_table(title, rows)
    if {"slotted-plane", "slotted-halved"} <= records.keys():
        rows = {"standard": records["slotted-plane"], "halved": records["slotted-halved"]}
        lines += layers_table("Elements halved in the transverse plane, stage 1 slotted, 4 layers", rows)
    if "slotted-grids" in records:
        lines += grids_table(records["slotted-grids"])
    if "slotted-corners" in records:
        record = records["slotted-corners"]
        title = "Tip edges beyond the path of contact up to an unloaded gap, stage 1 slotted"
        lines += against_last(title, "gap / µm", record["meshes"], record["gaps"])
    if "analytic" in records:
        lines += analytic_table(records["analytic"])
    laws = {"law-slotted": "slotted, 10 teeth", "law-differential": "differential, 41 teeth"}
    if laws.keys() & records.keys():
        lines += ["**A whole law at standard, finite elements included**", ""]
        lines += [
            "| law | angles × deflections | wall s | of it elements | processor s | peak MB |",
            "|---|---|---:|---:|---:|---:|",
        ]
        for name, title in laws.items():
            if name in records:
                r = records[name]
                lines.append(
                    f"| {title} | {r['shape'][0]} × {r['shape'][1]} | {r['wall']:.0f} | {r['elements']:.0f} | "
                    f"{r['seconds']:.0f} | {r['megabytes']:.0f} |"
                )
        lines.append("")
    return "\n".join(lines)


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
            subprocess.run([sys.executable, __file__, str(out), name + "!"], check=True)
    records = {n: json.loads((out / f"{n}.json").read_text()) for n in MEASUREMENTS if (out / f"{n}.json").exists()}
    TABLE.write_text(written(records))


if __name__ == "__main__":
    main()
