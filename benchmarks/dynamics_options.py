"""What mesh levels and options of the dynamics change, in dB; writes docs/measured/dynamics_options.md.

    python benchmarks/dynamics_options.py OPERATORS [options tilt ramp levels contact]

OPERATORS: folder with the mesh laws and the housing that cases/studies/run_up.py leaves. The sections named (all, if
none is) are measured anew and kept in OPERATORS/dynamics_options.json; the table is written from what is there.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from dynamics_gears import mesh_friction, solid_solvers, tilt_stiffness
from dynamics_models import MODES, ROOT, SPEED, TORQUE, gearbox_of, one_step, operators, with_modes
from publish import publish

import nvhchain as nvh
from nvhchain import dynamics, gear
from nvhchain.case import GearboxCase
from nvhchain.dynamics.simulation import Motion, Simulation, advance, at_rest, bearing_force, simulation
from nvhchain.fidelity import DynamicsFidelity, GearFidelity
from nvhchain.gear.blank import SOLID
from nvhchain.handoff import FloatArray

MESH_ORDERS = (20.0, 12.0)
PERIODS = 10
"""Common periods of the solid gears, 60 ms, in which what differs between the levels settles to a few percent."""


def order_levels(force: FloatArray, turns: float) -> dict[float, float]:
    """dB of the mesh harmonics up to 5 kHz of a steady record (n, 3 n_bearing) N over so many turns of the input."""
    lines = np.abs(np.fft.rfft(force, axis=0)) * 2.0 / len(force)
    energy = (lines**2).sum(axis=1)
    orders = {k * base for base in MESH_ORDERS for k in range(1, 12)}
    return {
        order: float(10.0 * np.log10(max(energy[round(order * turns)], 1e-30)))
        for order in sorted(orders)
        if order * SPEED / (2.0 * pi) <= 5000.0
    }


def worst(found: dict[float, float], wanted: dict[float, float]) -> list[float]:
    """Largest and RMS deviation in dB over harmonics within 30 dB of the strongest, and the order of the largest."""
    loud = [order for order, level in wanted.items() if level > max(wanted.values()) - 30.0]
    off = np.array([found[order] - wanted[order] for order in loud])
    at = int(np.argmax(np.abs(off)))
    return [float(off[at]), float(np.sqrt((off**2).mean())), loud[at]]


def steady(gearbox: dynamics.Gearbox, laws: Any, housing: Any, torque: float, **knobs: Any) -> dict[float, float]:
    """Levels of the mesh harmonics of the solid gearbox at 2500 rpm."""
    record = dynamics.bearing_forces(
        gearbox,
        laws,
        housing,
        input_speed=SPEED,
        input_torque=torque,
        f_max=5000.0,
        fidelity=DynamicsFidelity(**({"time_step": 1e-5, "settle_level": 1e-4} | knobs)),
    )
    return order_levels(record.force.reshape(len(record.time), -1), 10.25)


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
    laws, housing = operators(folder)
    box, bare = gearbox_of("solid"), nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    assert isinstance(bare, GearboxCase)

    def damped(factor: float) -> dynamics.Gearbox:
        bearings = tuple(
            replace(b, radial_damping=factor * b.radial_damping, axial_damping=factor * b.axial_damping)
            for b in box.bearings
        )
        return replace(box, bearings=bearings)

    solvers = solid_solvers(bare, nvh.DRAFT.gear)
    rubbing = tuple(
        replace(mesh, friction=mesh_friction(solver, law, force, 0.05))
        for mesh, solver, law, force in zip(box.meshes, solvers, laws["solid"], bare.mesh_forces, strict=True)
    )
    stiffer = tuple(replace(mesh, tilt_ratio=1.65) for mesh in box.meshes)
    dragged = tuple(replace(shaft, drag_torque=drag) for shaft, drag in zip(box.shafts, (0.5, 0.7, 2.0), strict=True))
    flexible = {"flexible_shafts": True}
    return {
        "as it is": (box, housing, {}),
        "half the step": (box, housing, {"time_step": 5e-6}),
        "gyroscopic terms": (box, housing, {"gyroscopic": True}),
        "rigid housing": (box, None, {}),
        "gear bodies without mass": (bare.gearbox, housing, {}),
        "bearing damping halved": (damped(0.5), housing, {}),
        "bearing damping doubled": (damped(2.0), housing, {}),
        "friction, 0.05": (replace(box, meshes=rubbing), housing, {}),
        "drag 0.5, 0.7, 2 N m": (replace(box, shafts=dragged), housing, {}),
        "tilt, 2 points across the face": (box, housing, {"face_points": 2}),
        "tilt, 3 points": (box, housing, {"face_points": 3}),
        "tilt, 2 points, tilt_ratio 1.65": (replace(box, meshes=stiffer), housing, {"face_points": 2}),
        "flexible shafts": (box, housing, flexible),
        "flexible shafts, 5 mm elements": (box, housing, flexible | {"shaft_element": 5e-3}),
        "flexible shafts, modes to 20 kHz": (box, housing, flexible | {"shaft_frequency": 20e3}),
        "flexible shafts and tilt": (box, housing, flexible | {"face_points": 2}),
    }


def tilt(folder: Path) -> list[list[Any]]:
    """By stage: N m/rad of slices side by side, of the contact problem, mm of swing of the load's centre."""
    laws, _ = operators(folder)
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    solvers = solid_solvers(case, nvh.DRAFT.gear)
    rows = []
    for number, (solver, law, force) in enumerate(zip(solvers, laws["solid"], case.mesh_forces, strict=True), 1):
        found = tilt_stiffness(solver, law, force)
        rows.append([number, found["slices"], found["contact"], 1e3 * found["centre"]])
    return rows


def along_ramp(folder: Path) -> dict[str, Any]:
    """Run-up of 20 s with and without gyroscopic terms and flexible shafts: seconds, and dB of overall force."""
    laws, housing = operators(folder)
    housing = with_modes(housing, MODES)
    found: dict[str, Any] = {}
    for name, knobs in (
        ("off", {}),
        ("gyroscopic, 16 speeds", {"gyroscopic": True}),
        ("flexible shafts", {"flexible_shafts": True}),
        ("2 points across the face", {"face_points": 2}),
    ):
        begin = time.perf_counter()
        record = dynamics.run_up(
            gearbox_of("slotted"), laws["slotted"], housing, start_speed=0.0, end_speed=SPEED, duration=20.0,
            input_torque=TORQUE, f_max=5000.0, fidelity=DynamicsFidelity(1e-5, **knobs),
        )  # fmt: skip
        seconds = time.perf_counter() - begin
        moving = record.force - record.force.mean(axis=0)
        found[name] = [seconds, float(10.0 * np.log10((moving**2).mean()))]
    return found


def levels(folder: Path) -> list[list[Any]]:
    """Mesh level `stiffness` against `table`: torque in N m, whether flanks part, deviation in dB, at 2500 rpm."""
    laws, housing = operators(folder)
    rows = []
    for torque in (250.0, 100.0, 25.0):
        table = steady(gearbox_of("solid"), laws["solid"], housing, torque)
        for gap in (False, True):
            knobs = {"mesh_level": "stiffness", "contact_loss": gap}
            found = steady(gearbox_of("solid"), laws["solid"], housing, torque, **knobs)
            rows.append([torque, "yes" if gap else "no", *worst(found, table)])
    return rows


def contact(folder: Path) -> dict[str, Any]:
    """Mesh level `table` against `contact`: solid gears in both stages, so that ¼ turn of the input is the period.

    Both start from the settled motion of the table; the last of PERIODS common periods is compared.
    """
    _, housing = operators(folder)
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    pairs = [replace(pair, wheel=replace(pair.wheel, blank=SOLID)) for pair in case.pairs]
    fidelity = nvh.DRAFT.gear
    solvers = solid_solvers(case, fidelity)
    count = round(pi / 2.0 / SPEED / 1e-5)
    phases = (np.arange(count)[:, None] + 0.5) / count * [5, 3]

    def model(detail: GearFidelity, level: str) -> Simulation:
        laws = [
            gear.mesh_law(pair, nominal_force=force, fidelity=detail, compliances=solver.compliances)
            for pair, force, solver in zip(pairs, case.mesh_forces, solvers, strict=True)
        ]
        return simulation(
            gearbox_of("solid"),
            laws,
            housing,
            input_torque=TORQUE,
            time_step=pi / 2.0 / SPEED / count,
            fidelity=DynamicsFidelity(1e-5, mesh_level=level, contact_residual=1e-9),
            contact_forces=[solver.mesh_force for solver in solvers],
        )

    def settled(of: Simulation) -> Motion:
        motion = at_rest(of, phases[0])
        for _ in range(400):
            motion, _, _ = advance(of, motion, phases, stride=count)
        return motion

    coarse = model(fidelity, "table")
    start, begin = settled(coarse), time.perf_counter()
    reference = order_levels(*last_period(model(fidelity, "contact"), start, phases))
    cost = (time.perf_counter() - begin) / (PERIODS * count)
    rows = []
    for angles, deflections in ((24, 16), (48, 16), (96, 24), (192, 40)):
        detail = replace(fidelity, angles_per_mesh=angles, deflections=deflections)
        of = model(detail, "table")
        found = order_levels(*last_period(of, start_of(of, coarse, start), phases))
        rows.append([angles, deflections, *worst(found, reference)])
    return {"rows": rows, "cost": cost}


def start_of(of: Simulation, like: Simulation, motion: Motion) -> Motion:
    """The motion of one model in the modes of another, which differs in the stiffness that its linear part holds."""
    modes = like.modes
    z = motion.state.reshape(2, -1)
    z = z[0] + 1j * z[1]
    x, v = (modes.displacement @ z).real, (modes.velocity @ z).real
    both = np.vstack([of.modes.displacement, of.modes.velocity])
    found = np.linalg.lstsq(np.hstack([both.real, -both.imag]), np.concatenate([x, v]), rcond=None)[0]
    return Motion(found, np.zeros_like(motion.excess))


def last_period(model: Simulation, motion: Motion, phases: FloatArray) -> tuple[FloatArray, float]:
    """Bearing forces (n, 3 n_bearing) N of the last of PERIODS common periods from `motion`, and its turns."""
    for _ in range(PERIODS - 1):
        motion, _, _ = advance(model, motion, phases, stride=len(phases))
    _, states, excesses = advance(model, motion, phases)
    return bearing_force(model, states, motion.excess, excesses), 0.25


SECTIONS = {"options": options, "tilt": tilt, "ramp": along_ramp, "levels": levels, "contact": contact}


def table(found: dict[str, Any]) -> list[str]:
    """What has been measured, in Markdown."""
    lines = ["# Mesh levels and options of the dynamics", ""]
    lines += ["Written by `benchmarks/dynamics_options.py`; bearing forces at 2500 rpm, draft laws and housing.", ""]
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
            "Friction 0.05 acts under the nominal mesh force; elastic modes of the shafts are damped by 0.5 %.",
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
            "The swing of the load's centre (shuttling) is not in the dynamics: a mesh spreads its force evenly.",
            "",
        ]
    if "ramp" in found:
        lines += [
            "## Run-up 0 → 2500 rpm in 20 s, slotted, 109 unknowns without options",
            "",
            "| option | s | moving bearing force / dB |",
            "|---|---:|---:|",
            *(
                f"| {name} | {seconds:.2f} | {level - found['ramp']['off'][1]:+.3f} |"
                for name, (seconds, level) in found["ramp"].items()
            ),
            "",
        ]
    if "levels" in found:
        lines += [
            "## `stiffness` against `table`, solid",
            "",
            "| input torque / N m | flanks part | worst mesh harmonic / dB | RMS / dB |",
            "|---:|---|---:|---:|",
            *(
                f"| {load:g} | {gap} | {off:+.2f} (order {order:g}) | {rms:.2f} |"
                for load, gap, off, rms, order in found["levels"]
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
    publish("dynamics_options", "\n".join(table(found)))


if __name__ == "__main__":
    main()
