"""Steps where flanks part and strike: shorter throughout, cut only there, or corrected (`path_correction`).

    python -m benchmarks cuts OPERATORS

OPERATORS: folder `shared/operators` that `python -m nvhchain.gallery 5.7 5.8 --fidelity draft` leaves. Writes
docs/measured/dynamics/cuts.md.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from math import pi
from pathlib import Path

import numpy as np

from benchmarks.dynamics.models import SPEED, gearbox_of, one_step, operators
from benchmarks.publish import publish
from nvhchain.dynamics.time_loop.law_table import force_at, row_at
from nvhchain.dynamics.time_loop.quasi_static import law_phases
from nvhchain.dynamics.time_loop.simulation import Motion, Simulation, advance, quasi_static_state, simulation
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray

STEP, PARTS, FINE, DURATION = 1e-5, 8, 2.5e-7, 0.02
"""s of a step, parts that it is cut into, s of the reference, s of all."""
STORED = 2e-5
"""s between compared samples."""

Cut = Callable[[FloatArray, FloatArray, FloatArray], bool]
"""Whether a step is cut, by the flanks' forces at both its ends and what the linear system holds of their change, N."""


def parts_or_strikes(before: FloatArray, after: FloatArray, linear: FloatArray) -> bool:
    return bool(((before > 0.0) != (after > 0.0)).any())


def moves_by(limit: float) -> Cut:
    return lambda before, after, linear: bool((np.abs(after - before - linear) > limit).any())


CUTS: dict[str, Cut] = {
    "10 µs, cut where a flank parts or strikes": parts_or_strikes,
    "10 µs, cut where a force leaves its straight line by 100 N": moves_by(100.0),
    "10 µs, cut where a force leaves its straight line by 10 N": moves_by(10.0),
    "10 µs, all cut": lambda *_: True,
}
STEPS = (1e-5, 5e-6, 2e-6, 1e-6, 5e-7, 2.5e-7)
"""s, throughout."""
BENT = (2e-5, 1e-5, 5e-6, 2e-6, 1e-6)
"""s, with path_correction."""
RELEASES = ((60.0, 2.5), (60.0, 6.0), (20.0, 10.0))
"""N m at the input, and times the static deflection: drive flanks part; back flanks strike too; flanks fly far."""


def measure(folder: Path) -> tuple[dict[str, list[float]], list[float]]:
    """For every release: error of the bearing forces over 20 ms, of the peak, and steps solved over those of 10 µs; ns
    per step without and with path_correction, in mesh throughout, and the number of unknowns."""
    laws, housing = operators(folder)

    def model(torque: float, step: float, bent: bool = False) -> Simulation:
        return simulation(
            gearbox_of("slotted"), laws["slotted"], housing, input_torque=torque, time_step=step,
            fidelity=DynamicsFidelity(step, path_correction=bent),
        )  # fmt: skip

    rows: dict[str, list[float]] = {}
    for torque, release in RELEASES:
        models = {step: model(torque, step) for step in (*STEPS, STEP / PARTS)}
        reference = model(torque, FINE, bent=True)
        start = quasi_static_state(reference, law_phases(reference.assembly, laws["slotted"]))
        motion = Motion(release * start.state, start.excess)
        true = _run(reference, motion)
        peak = np.abs(true).max()
        for step in STEPS:
            error = float(np.abs(_run(models[step], motion) - true).max() / peak)
            rows.setdefault(f"{1e6 * step:g} µs throughout", []).extend([error, STEP / step])
        for name, cut in CUTS.items():
            found, share = _cut_run(models[STEP], models[STEP / PARTS], motion, cut)
            rows.setdefault(name, []).extend([float(np.abs(found - true).max() / peak), 1.0 + share * PARTS])
        for step in BENT:
            error = float(np.abs(_run(model(torque, step, bent=True), motion) - true).max() / peak)
            rows.setdefault(f"{1e6 * step:g} µs, path_correction", []).extend([error, STEP / step])
    # in turns, since others on the machine slow both
    costs = [[one_step(model(60.0, STEP, bent), laws["slotted"]) for bent in (False, True)] for _ in range(5)]
    return rows, [*(min(each) for each in zip(*costs, strict=True)), float(len(reference.assembly.mass))]


def _run(model: Simulation, motion: Motion) -> FloatArray:
    """Bearing forces."""
    step = model.step.step
    _, states, _ = advance(model, motion, _phases(model, 0, round(DURATION / step)), stride=round(STORED / step))
    return np.asarray(states @ model.bearing_output.T)


def _cut_run(whole: Simulation, part: Simulation, motion: Motion, cut: Cut) -> tuple[FloatArray, float]:
    """Bearing forces, and the share of steps that were cut."""
    count, found, done = round(DURATION / STEP), [], 0
    for n in range(count):
        if n % round(STORED / STEP) == 0:
            found.append(motion.state @ whole.bearing_output.T)
        phases = _phases(whole, n, 1)
        after, _, _ = advance(whole, motion, phases)
        deflections = [whole.contact_output @ of.state for of in (motion, after)]
        forces = [_forces(whole, phases[0], of) for of in deflections]
        if cut(*forces, whole.contact_stiffness * (deflections[1] - deflections[0])):
            done += 1
            after, _, _ = advance(part, motion, _phases(part, n * PARTS, PARTS))
        motion = after
    return np.array(found), done / count


def _phases(model: Simulation, first: int, count: int) -> FloatArray:
    turns = (np.arange(first, first + count)[:, None] + 0.5) * model.step.step * SPEED / (2.0 * pi)
    return turns / np.array([float(period) for period in model.assembly.train.law_period])


def _forces(model: Simulation, phases: FloatArray, deflections: FloatArray) -> FloatArray:
    """Of drive and back flank of every mesh, N."""
    found = []
    for mesh, phase in enumerate(phases):
        grid, row = model.table.deflection[mesh, : model.table.cells[mesh]], row_at(model.table, mesh, float(phase))
        drive, back = deflections[2 * mesh], -deflections[2 * mesh + 1]
        found += [max(float(force_at(grid, row, drive)), 0.0), max(-float(force_at(grid, row, back)), 0.0)]
    return np.array(found)


def longest(rows: dict[str, list[float]], column: int, bent: bool) -> str:
    """Of the steps throughout, with or without path_correction."""
    names = [f"{1e6 * step:g} µs" for step in (BENT if bent else STEPS)]
    kind = "path_correction" if bent else "throughout"
    sep = ", " if bent else " "
    held = [name for name in names if rows[f"{name}{sep}{kind}"][2 * column] <= 1e-4]
    return held[0] if held else f"below {names[-1]}"


def main() -> None:
    rows, cost = measure(Path(sys.argv[1]))
    lines = [
        "# Steps where flanks part and strike",
        "",
        "Slotted gearbox, draft mesh laws and housing, 2500 rpm,",
        "released from a multiple of the static deflection: under 60 N m from 2.5 times the drive flanks part and",
        "from 6 times the back flanks strike too; under 20 N m from 10 times they fly far under little load. Error",
        f"of the bearing forces over 20 ms against {1e6 * FINE:g} µs with path_correction, of the peak; work: steps "
        "solved,",
        "over those of 10 µs.",
        f"A step that is cut is solved whole, to see that it must be cut, and in {PARTS} parts.",
        "",
        "| steps |" + "".join(f" {torque:g} N m, {release:g} times | work |" for torque, release in RELEASES),
        "|---|" + "---:|---:|" * len(RELEASES),
        *(
            f"| {name} |" + "".join(f" {a:.1e} | {b:.2f} |" for a, b in zip(of[::2], of[1::2], strict=True))
            for name, of in rows.items()
        ),
        "",
        "The error comes from all the time in which a force is off the straight line that the propagator holds",
        "exactly, not from the instants at which flanks part and strike: what is left of the force is constant",
        "within a step, which is right to second order. Where both flanks strike, steps cut where forces leave their",
        "straight line take less work than short steps throughout; where one flank parts they take more.",
        "`path_correction` takes less than either, so the time loop keeps one step.",
        "",
        "`path_correction` adds to the mean force of a step what the bend of its way and its rise within the step "
        "leave out",
        f"(`nvhchain/dynamics/time_loop/_correction.py`). A step at 10 µs with {cost[2]:.0f} unknowns then takes",
        f"{cost[1]:.0f} ns instead of {cost[0]:.0f}, both on the day of this page. It is off by default: the mean",
        "along a straight way alone keeps energy exactly at a fixed angle, bounded at every step. With path_correction "
        "steps",
        "are refused that are long against the meshes, or in which small motions, with flanks open or closed, would",
        "grow by more than 0.1 1/s for want of damping.",
        "",
        "Longest steps of the table within 1e-4 of the peak:",
        "",
        "| | without | with path_correction |",
        "|---|---:|---:|",
        *(
            f"| {torque:g} N m, {release:g} times | {longest(rows, column, False)} | {longest(rows, column, True)} |"
            for column, (torque, release) in enumerate(RELEASES)
        ),
        "",
    ]
    publish("dynamics/cuts", "\n".join(lines))


if __name__ == "__main__":
    main()
