"""The contact problem inside the time loop, and laws of gears that tilt under their load."""

from __future__ import annotations

import time
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.dynamics.gears import solid_solvers
from benchmarks.dynamics.models import ROOT, SPEED, TORQUE, gearbox_of, operators, order_levels, steady, worst
from nvhchain import dynamics, gear
from nvhchain.dynamics.time_loop.simulation import (
    Motion,
    Simulation,
    advance,
    bearing_force,
    quasi_static_state,
    simulation,
)
from nvhchain.fidelity import DynamicsFidelity, GearFidelity
from nvhchain.handoff import FloatArray

PERIODS = 10
"""Common periods of the solid gears, 60 ms, in which what differs between the levels settles to a few percent."""


def misaligned(folder: Path) -> dict[str, Any]:
    """What the tilt of loaded gears does to the laws of solid gears, teeth as slices: angles in mrad, and dB."""
    _, housing = operators(folder)
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    fidelity, box = replace(nvh.DRAFT.gear, bodies="analytic"), gearbox_of("solid")
    solvers = solid_solvers(case, fidelity, folder)

    def laws(tilts: Any) -> list[Any]:
        return [
            gear.mesh_law(
                replace(solver.pair, misalignment=gear.Misalignment(*map(float, tilt))),
                nominal_force=force, fidelity=fidelity, compliances=solver.compliances,
            )
            for solver, force, tilt in zip(solvers, case.mesh_forces, tilts, strict=True)
        ]  # fmt: skip

    aligned = laws([(0.0, 0.0)] * 2)
    usual = steady(box, aligned, housing, TORQUE, turns=0.25)
    found = {}
    for name, flexible in (("rigid shafts", False), ("flexible shafts", True)):
        tilts = dynamics.static_misalignment(
            replace(box, flexible_shafts=flexible), aligned, housing, input_torque=TORQUE,
            fidelity=DynamicsFidelity(1e-5),
        )  # fmt: skip
        off = worst(steady(box, laws(tilts), housing, TORQUE, turns=0.25), usual)
        found[name] = [(1e3 * tilts).tolist(), off]
    return found


def contact(folder: Path) -> dict[str, Any]:
    """Mesh level `table` against `contact`: solid gears in both stages, so that ¼ turn of the input is the period.

    Both start from the settled motion of the table; the last of PERIODS common periods is compared.
    """
    _, housing = operators(folder)
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    fidelity = nvh.DRAFT.gear
    solvers = solid_solvers(case, fidelity, folder)
    count = round(pi / 2.0 / SPEED / 1e-5)
    phases = (np.arange(count)[:, None] + 0.5) / count * [5, 3]

    def model(detail: GearFidelity, level: str) -> Simulation:
        laws = [
            gear.mesh_law(solver.pair, nominal_force=force, fidelity=detail, compliances=solver.compliances)
            for force, solver in zip(case.mesh_forces, solvers, strict=True)
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
        motion = quasi_static_state(of, phases[0])
        for _ in range(400):
            motion, _, _ = advance(of, motion, phases, stride=count)
        return motion

    coarse = model(fidelity, "table")
    start, begin = settled(coarse), time.perf_counter()
    reference = order_levels(*last_period(model(fidelity, "contact"), start, phases))
    cost = (time.perf_counter() - begin) / (PERIODS * count)
    rows = []
    for angles, steps in ((24, 3), (48, 3), (96, 4), (192, 8)):
        detail = replace(fidelity, angles_per_mesh=angles, deflections_per_doubling=steps)
        of = model(detail, "table")
        found = order_levels(*last_period(of, start_of(of, coarse, start), phases))
        rows.append([angles, detail.deflections, *worst(found, reference)])
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
