"""Change of the bearing forces by mesh levels and options of the dynamics, in dB.

    python -m benchmarks options OPERATORS [options speeds tilt ramp misaligned contact]

Writes docs/measured/dynamics/options.md. OPERATORS: folder `shared/operators` that
`python -m nvhchain.gallery 5.7 5.8 --fidelity draft` leaves. The sections named (all, if none is) are measured anew
and kept in OPERATORS/dynamics_options.json; the table is written from what is there.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.dynamics.contact import contact, misaligned
from benchmarks.dynamics.gears import solid_solvers, tilt_stiffness
from benchmarks.dynamics.models import (
    MODES,
    ROOT,
    SPEED,
    TORQUE,
    gearbox_of,
    one_step,
    operators,
    steady,
    with_modes,
    worst,
)
from benchmarks.publish import publish
from nvhchain import dynamics, gear
from nvhchain.case import GearboxCase
from nvhchain.dynamics.time_loop.simulation import simulation
from nvhchain.fidelity import DynamicsFidelity


def options(folder: Path) -> list[list[Any]]:
    """What single changes of the model do: dB, unknowns and ns per step."""
    laws, housing = operators(folder)
    box = gearbox_of("solid")
    usual = steady(box, laws["solid"], housing, TORQUE)
    rows = []
    for name, (changed, reduced, knobs) in changes(folder).items():
        found = steady(changed, laws["solid"], reduced, TORQUE, **knobs)
        fidelity = DynamicsFidelity(**({"time_step": 1e-5} | {k: v for k, v in knobs.items() if k != "time_step"}))
        model = simulation(changed, laws["solid"], reduced, input_torque=TORQUE, time_step=1e-5, fidelity=fidelity)
        rows.append([name, *worst(found, usual), len(model.assembly.mass), one_step(model, laws["solid"])])
    return rows


def changes(folder: Path) -> dict[str, tuple[dynamics.Gearbox, Any, dict[str, Any]]]:
    """By name: gearbox, housing and knobs that differ from the case in one thing."""
    _, housing = operators(folder)
    box, bare = gearbox_of("solid"), nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    assert isinstance(bare, GearboxCase)

    def damped(factor: float) -> dynamics.Gearbox:
        bearings = tuple(
            replace(b, radial_damping=factor * b.radial_damping, axial_damping=factor * b.axial_damping)
            for b in box.bearings
        )
        return replace(box, bearings=bearings)

    def undamped(**damping: Any) -> dynamics.Gearbox:
        bare = {"radial_damping": 0.0, "axial_damping": 0.0}
        return replace(box, bearings=tuple(replace(b, **(bare | damping)) for b in box.bearings))

    # how friction and the load's centre go with the angle needs no finite elements
    teeth = replace(nvh.DRAFT.gear, bodies="analytic", slices=64)
    tables = [
        gear.load_distribution(pair, nominal_force=force, fidelity=teeth)
        for pair, force in zip(bare.pairs, bare.mesh_forces, strict=True)
    ]
    rubbing = tuple(
        replace(mesh, friction=dynamics.MeshFriction(0.05, of.period, of.angle, of.sliding, of.arm))
        for mesh, of in zip(box.meshes, tables, strict=True)
    )
    moving = tuple(
        replace(mesh, load_centre=dynamics.LoadCentre(of.period, of.angle, of.offset))
        for mesh, of in zip(box.meshes, tables, strict=True)
    )
    stiffer = tuple(replace(mesh, tilt_ratio=1.65) for mesh in box.meshes)
    dragged = tuple(replace(shaft, drag_torque=drag) for shaft, drag in zip(box.shafts, (0.5, 0.7, 2.0), strict=True))
    bending, tilting = replace(box, flexible_shafts=True), replace(box, face_points=2)
    return {
        "as it is": (box, housing, {}),
        "half the step": (box, housing, {"time_step": 5e-6}),
        "gyroscopic terms": (replace(box, gyroscopic=True), housing, {}),
        "rigid housing": (box, None, {}),
        "gear bodies without mass": (bare.gearbox, housing, {}),
        "bearing damping halved": (damped(0.5), housing, {}),
        "bearing damping doubled": (damped(2.0), housing, {}),
        "bearing damping 10 µs × stiffness": (undamped(stiffness_damping=1e-5), housing, {}),
        "bearing loss factor 0.1 at 1 kHz": (undamped(loss_factor=0.1, loss_factor_frequency=1e3), housing, {}),
        "bearing loss factor 0.1 at 500 Hz": (undamped(loss_factor=0.1, loss_factor_frequency=500.0), housing, {}),
        "friction, 0.05": (replace(box, meshes=rubbing), housing, {}),
        "shuttling": (replace(box, meshes=moving), housing, {}),
        "drag 0.5, 0.7, 2 N m": (replace(box, shafts=dragged), housing, {}),
        "tilt, 2 points across the face": (tilting, housing, {}),
        "tilt, 3 points": (replace(box, face_points=3), housing, {}),
        "tilt, 2 points, tilt_ratio 1.65": (replace(tilting, meshes=stiffer), housing, {}),
        "flexible shafts": (bending, housing, {}),
        "flexible shafts, 5 mm elements": (bending, housing, {"shaft_element": 5e-3}),
        "flexible shafts, modes to 20 kHz": (bending, housing, {"shaft_frequency": 20e3}),
        "flexible shafts and tilt": (replace(bending, face_points=2), housing, {}),
    }


def speeds(folder: Path) -> list[list[Any]]:
    """Gyroscopic terms by speed: rpm of the input, widest split of a tilting frequency in %, deviation in dB.

    Harmonics up to the mesh frequency of stage 1 and twice that of stage 2 at least; fast steps, so that they fit.
    """
    laws, housing = operators(folder)
    box, rows = gearbox_of("solid"), []
    for rpm in (2500.0, 10_000.0, 20_000.0):
        speed = rpm * np.pi / 30.0
        highest = max(5000.0, 2.2 * 20.0 * rpm / 60.0)
        knobs = {"speed": speed, "highest": highest, "time_step": 0.1 / highest}
        plain = steady(box, laws["solid"], housing, TORQUE, **knobs)
        turning = steady(replace(box, gyroscopic=True), laws["solid"], housing, TORQUE, **knobs)
        rows.append([rpm, 100.0 * widest_split(box, speed), *worst(turning, plain)])
    return rows


def widest_split(box: dynamics.Gearbox, speed: float) -> float:
    """J_p Ω/√(k J) of the shafts' tilting on their bearings, the largest of all shafts; stages 20/50 and 30/82."""
    found = []
    for shaft, ratio in zip(box.shafts, (1.0, 0.4, 0.4 * 30.0 / 82.0), strict=True):
        body = shaft.inertia()
        stiffness = sum(b.radial_stiffness * (b.z - body.z) ** 2 for b in box.bearings if b.shaft == shaft.name)
        found.append(body.polar_inertia * speed * ratio / np.sqrt(stiffness * body.transverse_inertia))
    return float(max(found))


def tilt(folder: Path) -> list[list[Any]]:
    """By stage: N m/rad of slices side by side, of the contact problem, mm of swing of the load's centre."""
    laws, _ = operators(folder)
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    solvers = solid_solvers(case, nvh.DRAFT.gear, folder)
    rows = []
    for number, (solver, law, force) in enumerate(zip(solvers, laws["solid"], case.mesh_forces, strict=True), 1):
        found = tilt_stiffness(solver, law, force)
        rows.append([number, found["slices"], found["contact"], 1e3 * found["centre"]])
    return rows


def along_ramp(folder: Path) -> dict[str, Any]:
    """Run-up of 20 s with and without options: processor seconds, and dB of the moving bearing force."""
    laws, housing = operators(folder)
    housing = with_modes(housing, MODES)
    found: dict[str, Any] = {}
    for name, options in (
        ("off", {}),
        ("gyroscopic, 16 speeds", {"gyroscopic": True}),
        ("flexible shafts", {"flexible_shafts": True}),
        ("2 points across the face", {"face_points": 2}),
    ):
        begin = time.process_time()
        record = dynamics.run_up(
            replace(gearbox_of("slotted"), **options), laws["slotted"], housing, start_speed=0.0, end_speed=SPEED,
            duration=20.0, input_torque=TORQUE, f_max=5000.0, fidelity=DynamicsFidelity(1e-5),
        )  # fmt: skip
        seconds = time.process_time() - begin
        moving = record.force - record.force.mean(axis=0)
        found[name] = [seconds, float(10.0 * np.log10((moving**2).mean()))]
    return found


SECTIONS = {
    "options": options,
    "speeds": speeds,
    "tilt": tilt,
    "ramp": along_ramp,
    "misaligned": misaligned,
    "contact": contact,
}


def table(found: dict[str, Any]) -> list[str]:
    """What has been measured, in Markdown."""
    lines = ["# Mesh levels and options of the dynamics", ""]
    lines += ["Bearing forces at 2500 rpm, draft laws and housing.", ""]
    lines += ["Harmonics within 30 dB of the strongest, all bearings and directions together.", ""]
    if "options" in found:
        lines += [
            "## Options, solid, 250 N m, against the case as it is",
            "",
            "| change | worst mesh harmonic / dB | RMS / dB | unknowns | ns per step |",
            "|---|---:|---:|---:|---:|",
            *(
                f"| {name} | {off:+.3f} (order {order:g}) | {rms:.3f} | {unknowns} | {ns:.0f} |"
                for name, off, rms, order, unknowns, ns in found["options"]
            ),
            "",
            "Friction (0.05) and shuttling act under the nominal mesh force; elastic modes are damped by 0.5 %.",
            "",
        ]
    if "speeds" in found:
        lines += [
            "## Gyroscopic terms by speed, solid",
            "",
            "| input speed / rpm | widest split of a tilting frequency / % | worst mesh harmonic / dB | RMS / dB |",
            "|---:|---:|---:|---:|",
            *(
                f"| {rpm:.0f} | {split:.2f} | {off:+.3f} (order {order:g}) | {rms:.3f} |"
                for rpm, split, off, rms, order in found["speeds"]
            ),
            "",
        ]
    if "tilt" in found:
        lines += [
            "## Tilt: slices side by side against the contact problem, nominal load, mean over a mesh period",
            "",
            "| stage | slices / N m/rad | contact problem / N m/rad | slices are off by | load's centre swings / mm |",
            "|---:|---:|---:|---:|---:|",
            *(
                f"| {stage} | {slices:.3g} | {real:.3g} | {100 * (slices / real - 1):+.0f} % | {centre:.2f} |"
                for stage, slices, real, centre in found["tilt"]
            ),
            "",
        ]
    if "ramp" in found:
        lines += [
            "## Run-up 0 → 2500 rpm in 20 s, slotted, 109 unknowns without options",
            "",
            "The seconds compare the options with each other: one run each, on a machine shared with other work. The",
            "time of a run without options, best of five, is that of `benchmarks/dynamics/dynamics.py`.",
            "",
            "| option | processor s, all threads | moving bearing force / dB |",
            "|---|---:|---:|",
            *(
                f"| {name} | {seconds:.2f} | {level - found['ramp']['off'][1]:+.3f} |"
                for name, (seconds, level) in found["ramp"].items()
            ),
            "",
        ]
    if "misaligned" in found:
        lines += [
            "## Laws of solid gears that tilt under their load, against laws of parallel axes (teeth as slices)",
            "",
            "| | stage 1, in plane, across / mrad | stage 2 / mrad | worst harmonic / dB | RMS / dB |",
            "|---|---:|---:|---:|---:|",
            *(
                f"| {name} | {a[0]:.3f}, {a[1]:.3f} | {b[0]:.3f}, {b[1]:.3f} | {off:+.2f} ({order:g}) | {rms:.2f} |"
                for name, ((a, b), (off, rms, order)) in found["misaligned"].items()
            ),
            "",
        ]
    if "contact" in found:
        cost = found["contact"]["cost"]
        lines += [
            "## `table` against `contact`, solid gears in both stages",
            "",
            "| angles per mesh | deflections | worst mesh harmonic / dB | RMS / dB |",
            "|---:|---:|---:|---:|",
            *(
                f"| {angles} | {deflections} | {off:+.3f} (order {order:g}) | {rms:.3f} |"
                for angles, deflections, off, rms, order in found["contact"]["rows"]
            ),
            "",
            f"A step with the contact problem costs {1e3 * cost:.0f} ms. Both levels use the same 16 slices.",
            "",
        ]
    return lines


def main() -> None:
    folder = Path(sys.argv[1])
    kept = folder / "dynamics_options.json"
    found: dict[str, Any] = json.loads(kept.read_text()) if kept.exists() else {}
    for name in sys.argv[2:] or list(SECTIONS):
        found[name] = SECTIONS[name](folder)
        kept.write_text(json.dumps(found))
    publish("dynamics/options", "\n".join(table(found)))


if __name__ == "__main__":
    main()
