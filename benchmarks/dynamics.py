"""Speed, limits and errors of the gearbox dynamics; writes docs/measured/dynamics.md and dynamics_scaling.png.

    python benchmarks/dynamics.py OPERATORS [speed scaling peers steps]

OPERATORS: folder with the mesh laws and the housing that cases/studies/run_up.py leaves. The sections named (all, if
none is) are measured anew and kept in OPERATORS/measured.json; the table is written from what is there.
Exudyn is timed as a peer where it is installed (`pip install exudyn`).
"""

from __future__ import annotations

import json
import os
import sys
import time
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from threadpoolctl import threadpool_limits

import nvhchain as nvh
from nvhchain import dynamics, gear, store
from nvhchain.dynamics.quasi_static import law_phases
from nvhchain.dynamics.simulation import Simulation, advance, at_rest, bearing_force, simulation
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, FloatArray, MeshLaw, ReducedHousing

ROOT = Path(__file__).parents[1]
MEASURED = ROOT / "docs" / "measured"
SPEED = 2500.0 * 2.0 * pi / 60.0
TORQUE = 250.0
MODES = 92
"""Housing modes that make 109 unknowns with 15 of the shafts and 2 torsional ones."""
FLOPS_PER_MODE = 36
"""8 for the decay and 2 for the load, 4 for each of four contact rows, 4 for each of two loaded flanks and 2 spare."""


def gearbox_of(name: str) -> dynamics.Gearbox:
    """The gearbox of a case with the inertia of its gears."""
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / f"{name}.toml")
    found = case.gearbox
    for item in case.gears:
        own = gear.mass_properties(item.body)
        body = dynamics.RigidBody(item.z + own.centre, own.mass, own.polar_inertia, own.transverse_inertia)
        found = found.with_bodies(item.shaft, [body])
    return found


def operators(folder: Path) -> tuple[dict[str, list[MeshLaw]], ReducedHousing]:
    """Mesh laws of both configurations and the housing."""
    first = sorted((store.load(p, MeshLaw) for p in folder.glob("mesh_law_stage1-*.h5")), key=lambda law: law.period)
    (second,) = (store.load(p, MeshLaw) for p in folder.glob("mesh_law_stage2-*.h5"))
    (housing,) = (store.load(p, ReducedHousing) for p in folder.glob("housing-*.h5"))
    return {"solid": [first[0], second], "slotted": [first[-1], second]}, housing


def with_modes(housing: ReducedHousing, count: int) -> ReducedHousing:
    """A housing of `count` modes: the first ones, and repetitions a little higher where there are fewer."""
    have = len(housing.natural_frequency)
    turn, index = np.divmod(np.arange(count), have)
    frequency = housing.natural_frequency[index] * (1.0 + 0.013 * turn) + turn * housing.natural_frequency[-1]
    order = np.argsort(frequency)
    shrink = 0.5 ** turn[order]
    return housing.replace(
        natural_frequency=frequency[order],
        modal_damping=housing.modal_damping[index[order]],
        seat_shapes=housing.seat_shapes[index[order]] * shrink[:, None, None],
        normal_shapes=housing.normal_shapes[index[order]],
    )


def run_up(laws: list[MeshLaw], housing: ReducedHousing, step: float, duration: float) -> BearingForces:
    return dynamics.run_up(
        gearbox_of("slotted"),
        laws,
        housing,
        start_speed=0.0,
        end_speed=SPEED,
        duration=duration,
        input_torque=TORQUE,
        f_max=5000.0,
        fidelity=DynamicsFidelity(step),
    )


def speed(folder: Path) -> dict[str, float]:
    """The run-up of ACCEPTANCE and its error against a tenth of the step."""
    laws, housing = operators(folder)
    housing = with_modes(housing, MODES)
    run_up(laws["slotted"], housing, 1e-5, 0.01)
    seconds, loop, both = [], [], []
    for _ in range(5):
        begin, thread, process = time.perf_counter(), time.thread_time(), time.process_time()
        record = run_up(laws["slotted"], housing, 1e-5, 20.0)
        seconds.append(time.perf_counter() - begin)
        loop.append(time.thread_time() - thread)
        both.append(time.process_time() - process)
    coarse, fine = (run_up(laws["slotted"], housing, step, 1.0) for step in (1e-5, 1e-6))
    n = min(len(coarse.time), len(fine.time))
    moving = fine.force - fine.force.mean(axis=0)
    difference = np.abs(coarse.force[:n] - fine.force[:n])
    return {
        "best": min(seconds),
        "waiting": os.getloadavg()[0],
        "loop": min(loop),
        "both": min(both),
        "samples": len(record.time),
        "of_peak": float(difference.max() / np.abs(fine.force).max()),
        "of_swing": float(difference.max() / np.abs(moving).max()),
    }


def one_step(model: Simulation, laws: list[MeshLaw], steps: int = 32_768) -> float:
    """ns per step of the time loop, every fourth state stored; best of several."""
    turns = (np.arange(steps)[:, None] + 0.5) * 1e-5 * SPEED / (2.0 * pi)
    phases = turns / np.array([float(p) for p in model.assembly.train.law_period])
    motion = at_rest(model, phases[0])
    best = np.inf
    for _ in range(7):
        begin = time.thread_time()  # the same on a busy machine
        advance(model, motion, phases, stride=4)
        best = min(best, time.thread_time() - begin)
    return 1e9 * best / steps


def scaling(folder: Path) -> list[list[float]]:
    """Unknowns, complex modes and ns per step."""
    laws, housing = operators(folder)
    rows = []
    for unknowns in (20, 40, 60, 80, 109, 150, 200, 300, 400):
        model = simulation(
            gearbox_of("slotted"),
            laws["slotted"],
            with_modes(housing, unknowns - 17),
            input_torque=TORQUE,
            time_step=1e-5,
            fidelity=DynamicsFidelity(1e-5),
        )
        rows.append([len(model.assembly.mass), len(model.modes.eigenvalue), one_step(model, laws["slotted"])])
    return rows


def plot_scaling(rows: list[list[float]], path: Path) -> None:
    unknowns, modes, nanoseconds = np.array(rows).T
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    ax = figure.subplots()
    ax.plot(unknowns, nanoseconds, "o-", color="#0072B2", label="time loop, every fourth state stored")
    slope, base = np.polyfit(modes, nanoseconds, 1)
    ax.plot(
        unknowns,
        base + slope * modes,
        color="#8C8C8C",
        linestyle=(0, (4, 2)),
        label=f"{base:.0f} ns + {slope:.2f} ns per mode",
    )
    ax.set_xlabel("unknowns")
    ax.set_ylabel("ns per step")
    ax.set_ylim(0.0)
    ax.grid(True, color="#E5E5E5")
    ax.legend()
    figure.savefig(path, dpi=130)


def peers(folder: Path) -> dict[str, float | None]:
    """Processor seconds per simulated second of the same equations in other integrators, in this run."""
    laws, housing = operators(folder)
    model = simulation(
        gearbox_of("slotted"),
        laws["slotted"],
        with_modes(housing, MODES),
        input_torque=TORQUE,
        time_step=1e-5,
        fidelity=DynamicsFidelity(1e-5),
    )
    a, load = model.assembly, model.assembly.load(model.torque)
    stiffness = a.stiffness + (a.contact.T * model.contact_stiffness) @ a.contact
    n = len(a.mass)
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness / a.mass[:, None], -a.damping / a.mass[:, None]]])
    push = np.concatenate([np.zeros(n), load / a.mass])
    with threadpool_limits(1):
        begin = time.process_time()
        solve_ivp(
            lambda t, x: system @ x + push * (1 + 0.1 * np.sin(20 * SPEED * t)), (0, 0.01), np.zeros(2 * n), "Radau",
            jac=system, rtol=1e-6, atol=1e-10, max_step=2e-5,
        )  # fmt: skip
        radau = (time.process_time() - begin) / 0.01
    return {
        "own": one_step(model, laws["slotted"]) * 1e-9 / 1e-5,
        "radau": radau,
        "exudyn": exudyn_seconds(a.mass, stiffness, a.damping, load),
    }


def exudyn_seconds(mass: FloatArray, stiffness: FloatArray, damping: FloatArray, load: FloatArray) -> float | None:
    """s per simulated second of Exudyn's generalised-α on the linear system, no contact, 10 µs; None without it."""
    try:
        import exudyn
        from exudyn.itemInterface import NodeGenericODE2, ObjectGenericODE2
    except ImportError:
        return None
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    n, zeros = len(mass), np.zeros(len(mass))
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=zeros, initialCoordinates=zeros, initialCoordinates_t=zeros, numberOfODE2Coordinates=n
        )
    )
    system.AddObject(
        ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=np.diag(mass),
            stiffnessMatrix=stiffness,
            dampingMatrix=damping,
            forceVector=load,
        )
    )
    system.Assemble()
    settings = exudyn.SimulationSettings()
    duration = 0.02
    settings.timeIntegration.numberOfSteps = round(duration / 1e-5)
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    begin = time.process_time()
    system.SolveDynamic(settings)
    return (time.process_time() - begin) / duration


def steps(folder: Path) -> list[list[float]]:
    """Step in µs, error of the bearing forces over 20 ms at 2500 rpm against 0.2 µs, and their largest value."""
    laws, housing = operators(folder)
    rows, force = [], {}
    for step in (2e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 5e-4, 1e-3):
        model = simulation(
            gearbox_of("slotted"),
            laws["slotted"],
            housing,
            input_torque=TORQUE,
            time_step=step,
            fidelity=DynamicsFidelity(step),
        )
        period = np.array([float(p) for p in model.assembly.train.law_period])
        turns = (np.arange(round(0.02 / step))[:, None] + 0.5) * step * SPEED / (2.0 * pi)
        motion = at_rest(model, law_phases(model.assembly, laws["slotted"]))
        _, states, excesses = advance(model, motion, turns / period)
        every = bearing_force(model, states, motion.excess, excesses)
        force[step] = every[:: max(1, round(1e-3 / step))]
        error = np.abs(force[step] - force[2e-7])[1:].max() / np.abs(force[2e-7]).max()
        rows.append([1e6 * step, float(error), float(np.abs(every).max())])
    return rows


SECTIONS = {
    "speed": speed,
    "scaling": scaling,
    "peers": peers,
    "steps": steps,
}


def table(found: dict[str, Any]) -> list[str]:
    """What has been measured, in Markdown."""
    lines = [
        "# Gearbox dynamics",
        "",
        "Written by `benchmarks/dynamics.py`; two cores, draft mesh laws and housing.",
        "",
    ]
    if "speed" in found:
        of = found["speed"]
        lines += [
            "## Run-up 0 → 2500 rpm, 20 s at 10 µs, 109 unknowns, slotted, every fourth step stored",
            "",
            "| s, best of 5 | processor s, time loop's thread | processor s, both threads | bar / s |",
            "|---:|---:|---:|---:|",
            f"| {of['best']:.2f} | {of['loop']:.2f} | {of['both']:.2f} | 2 |",
            "",
            f"Measured while {of['waiting']:.0f} processes wanted the cores, which stretches the first figure only;",
            "set-up, filtering and the hand-off are part of the times.",
            f"Error against steps of 1 µs, of a run-up within 1 s: {of['of_peak']:.1e} of the peak force,",
            f"{of['of_swing']:.1e} of the moving part's peak.",
            "",
        ]
    if "scaling" in found:
        lines += [
            "## Time loop over unknowns",
            "",
            "![ns per step over unknowns](dynamics_scaling.png)",
            "",
            "| unknowns | modes | ns per step | GFlop/s of the linear part | kB touched per step |",
            "|---:|---:|---:|---:|---:|",
        ]
        lines += [
            f"| {unknowns:.0f} | {modes:.0f} | {ns:.0f} | {FLOPS_PER_MODE * modes / ns:.1f} | {19 * 8e-3 * modes:.0f} |"
            for unknowns, modes, ns in found["scaling"]
        ]
        lines += [
            "",
            "The linear part reads and writes 19 numbers per mode, from the first-level cache (32 kB) up to 200 modes;",
            "a core adds and multiplies at most 16 numbers per cycle. What is left at few unknowns is the contact",
            "solution, one after the other by nature.",
            "",
        ]
    if "peers" in found:
        of = found["peers"]
        exudyn = f"{of['exudyn']:.2f} | {of['exudyn'] / of['own']:.0f}" if of["exudyn"] else "not installed |"
        lines += [
            "## Other integrators on the same 109 unknowns, in the same run",
            "",
            "| integrator | processor s per simulated s | times the time loop's |",
            "|---|---:|---:|",
            f"| time loop, with contact, 10 µs | {of['own']:.3f} | 1 |",
            f"| Exudyn, generalised-α, linear, no contact, 10 µs | {exudyn} |",
            f"| scipy Radau, linear, no contact, at most 20 µs | {of['radau']:.1f} | {of['radau'] / of['own']:.0f} |",
            "",
        ]
    if "steps" in found:
        lines += [
            "## Step sizes: bounded at every one, accurate where the meshes are resolved",
            "",
            "| step / µs | error of the bearing forces over 20 ms, of the peak | largest bearing force / N |",
            "|---:|---:|---:|",
            *(f"| {step:g} | {error:.1e} | {force:.0f} |" for step, error, force in found["steps"]),
            "",
            "Steps longer than 25 µs do not cover a band of 5 kHz and are refused for a record.",
            "",
        ]
    return lines


def main() -> None:
    folder = Path(sys.argv[1])
    kept = folder / "measured.json"
    found: dict[str, Any] = json.loads(kept.read_text()) if kept.exists() else {}
    for name in sys.argv[2:] or list(SECTIONS):
        found[name] = SECTIONS[name](folder)
        kept.write_text(json.dumps(found))
    if "scaling" in found:
        plot_scaling(found["scaling"], MEASURED / "dynamics_scaling.png")
    (MEASURED / "dynamics.md").write_text("\n".join(table(found)))


if __name__ == "__main__":
    main()
