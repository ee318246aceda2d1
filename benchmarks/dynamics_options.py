"""What mesh levels and options of the dynamics change, in dB; writes docs/measured/dynamics_options.md.

    python benchmarks/dynamics_options.py OPERATORS [options levels contact]

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
from dynamics import MEASURED, ROOT, SPEED, TORQUE, gearbox_of, operators

import nvhchain as nvh
from nvhchain import dynamics, gear
from nvhchain.dynamics.simulation import Motion, Simulation, advance, at_rest, bearing_force, simulation
from nvhchain.fidelity import DynamicsFidelity, GearFidelity
from nvhchain.gear.blank import SOLID
from nvhchain.gear.compliance import flank_compliance
from nvhchain.gear.engagement import Engagement, engaged_reach
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
    """What single changes of the model do, in dB."""
    laws, housing = operators(folder)
    box = gearbox_of("solid")
    halved, doubled = (
        replace(
            box,
            bearings=tuple(
                replace(b, radial_damping=factor * b.radial_damping, axial_damping=factor * b.axial_damping)
                for b in box.bearings
            ),
        )
        for factor in (0.5, 2.0)
    )
    usual = steady(box, laws["solid"], housing, TORQUE)
    changed = {
        "gyroscopic terms": steady(box, laws["solid"], housing, TORQUE, gyroscopic=True),
        "rigid housing": steady(box, laws["solid"], None, TORQUE),
        "bearing damping halved": steady(halved, laws["solid"], housing, TORQUE),
        "bearing damping doubled": steady(doubled, laws["solid"], housing, TORQUE),
        "half the step": steady(box, laws["solid"], housing, TORQUE, time_step=5e-6),
    }
    return [[name, *worst(found, usual)] for name, found in changed.items()]


def levels(folder: Path) -> list[list[Any]]:
    """Mesh level `stiffness` against `table`: torque in N m and deviation in dB, steady at 2500 rpm."""
    laws, housing = operators(folder)
    rows = []
    for torque in (250.0, 100.0, 25.0):
        found = {
            level: steady(gearbox_of("solid"), laws["solid"], housing, torque, mesh_level=level)
            for level in ("table", "stiffness")
        }
        rows.append([torque, *worst(found["stiffness"], found["table"])])
    return rows


def contact(folder: Path) -> dict[str, Any]:
    """Mesh level `table` against `contact`: solid gears in both stages, so that ¼ turn of the input is the period.

    Both start from the settled motion of the table; the last of PERIODS common periods is compared.
    """
    _, housing = operators(folder)
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    pairs = [replace(pair, wheel=replace(pair.wheel, blank=SOLID)) for pair in case.pairs]
    fidelity = nvh.DRAFT.gear
    solvers = [contact_solver(pair, fidelity) for pair in pairs]
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


def contact_solver(pair: gear.GearPair, fidelity: GearFidelity) -> Engagement:
    """The contact problem of a pair at any angle."""
    reach = engaged_reach(pair)
    pinion, wheel = (flank_compliance(body, fidelity, reach=reach) for body in (pair.pinion, pair.wheel))
    return Engagement(pair, (pinion, wheel), fidelity)


def last_period(model: Simulation, motion: Motion, phases: FloatArray) -> tuple[FloatArray, float]:
    """Bearing forces (n, 3 n_bearing) N of the last of PERIODS common periods from `motion`, and its turns."""
    for _ in range(PERIODS - 1):
        motion, _, _ = advance(model, motion, phases, stride=len(phases))
    _, states, excesses = advance(model, motion, phases)
    return bearing_force(model, states, motion.excess, excesses), 0.25


SECTIONS = {"options": options, "levels": levels, "contact": contact}


def table(found: dict[str, Any]) -> list[str]:
    """What has been measured, in Markdown."""
    lines = ["# Mesh levels and options of the dynamics", ""]
    lines += ["Written by `benchmarks/dynamics_options.py`; bearing forces at 2500 rpm, draft laws and housing.", ""]
    lines += ["Harmonics within 30 dB of the strongest, all bearings and directions together.", ""]
    if "options" in found:
        lines += [
            "## Options, solid, 250 N m, against the case as it is",
            "",
            "| change | worst mesh harmonic / dB | RMS / dB |",
            "|---|---:|---:|",
            *(f"| {name} | {off:+.3f} (order {order:g}) | {rms:.3f} |" for name, off, rms, order in found["options"]),
            "",
        ]
    if "levels" in found:
        lines += [
            "## `stiffness` against `table`, solid",
            "",
            "| input torque / N m | worst mesh harmonic / dB | RMS / dB |",
            "|---:|---:|---:|",
            *(f"| {load:g} | {off:+.2f} (order {order:g}) | {rms:.2f} |" for load, off, rms, order in found["levels"]),
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
    (MEASURED / "dynamics_options.md").write_text("\n".join(table(found)))


if __name__ == "__main__":
    main()
