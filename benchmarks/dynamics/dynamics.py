"""Speed, limits and errors of the gearbox dynamics.

    python -m benchmarks dynamics OPERATORS [speed scaling peers steps impacts hour]

Writes docs/measured/dynamics/dynamics.md and scaling.png. OPERATORS: folder `shared/operators` that
`python -m nvhchain.gallery 5.7 5.8 --fidelity draft` leaves. The sections named (all, if none is) are measured anew
and kept in OPERATORS/measured.json; the table is written from what is there. Exudyn is timed as a peer
where it is installed (extra `benchmark`: `pip install -e .[benchmark]`).

The errors under `steps` are those of flanks that stay in contact; every impact costs accuracy, as `impacts` says.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.dynamics.models import MODES, SPEED, TORQUE, gearbox_of, one_step, operators, with_modes
from benchmarks.dynamics.peers import peers
from benchmarks.publish import MEASURED, publish
from nvhchain import dynamics
from nvhchain.dynamics.time_loop.quasi_static import law_phases
from nvhchain.dynamics.time_loop.simulation import Motion, advance, bearing_force, quasi_static_state, simulation
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, MeshLaw, ReducedHousing

FLOPS_PER_MODE = 36
"""8 for the decay and 2 for the load, 4 for each of four contact rows, 4 for each of two loaded flanks and 2 spare."""


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
        motion = quasi_static_state(model, law_phases(model.assembly, laws["slotted"]))
        _, states, excesses = advance(model, motion, turns / period)
        every = bearing_force(model, states, motion.excess, excesses)
        force[step] = every[:: max(1, round(1e-3 / step))]
        error = np.abs(force[step] - force[2e-7])[1:].max() / np.abs(force[2e-7]).max()
        rows.append([1e6 * step, float(error), float(np.abs(every).max())])
    return rows


def impacts(folder: Path) -> list[list[float]]:
    """Step in µs, then for two releases, from 2.5 and from 6 times the static deflection under 60 N m at 2500 rpm:
    error of the bearing forces over 20 ms against 0.25 µs, of the peak, and the lowest mesh deflection in µm."""
    laws, housing = operators(folder)
    force, rows = {}, []
    for step in (2.5e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5):
        model = simulation(
            gearbox_of("slotted"), laws["slotted"], housing, input_torque=60.0, time_step=step,
            fidelity=DynamicsFidelity(step),
        )  # fmt: skip
        period = np.array([float(p) for p in model.assembly.train.law_period])
        turns = (np.arange(round(0.02 / step))[:, None] + 0.5) * step * SPEED / (2.0 * pi)
        rest, row = quasi_static_state(model, law_phases(model.assembly, laws["slotted"])), [1e6 * step]
        for release in (2.5, 6.0):
            motion = Motion(release * rest.state, rest.excess)
            _, states, _ = advance(model, motion, turns / period, stride=round(2e-5 / step))
            force[release, step] = states @ model.bearing_output.T
            fine = force[release, 2.5e-7]
            error = np.abs(force[release, step] - fine).max() / np.abs(fine).max()
            row += [float(error), 1e6 * float((states @ model.deflection_output.T).min())]
        rows.append(row)
    return rows


def hour(folder: Path) -> list[list[float]]:
    """Records in files, ten minutes and an hour: their s, seconds to make, MB on disk, MB of the process at most."""
    spawn = multiprocessing.get_context("spawn")  # a process of its own for each, whose peak is the record's
    with ProcessPoolExecutor(1, mp_context=spawn, max_tasks_per_child=1) as alone:
        return list(alone.map(long_record, [folder] * 2, (600.0, 3600.0)))


def long_record(folder: Path, duration: float) -> list[float]:
    """A row of `hour`."""
    laws, housing = operators(folder)
    with tempfile.TemporaryDirectory() as place:
        begin = time.perf_counter()
        made = dynamics.record_run_up(
            gearbox_of("solid"), laws["solid"], housing, start_speed=0.0, end_speed=SPEED, duration=duration,
            input_torque=TORQUE, f_max=100.0, fidelity=DynamicsFidelity(1e-4), folder=place,
        )  # fmt: skip
        seconds = time.perf_counter() - begin
        size = 1e-6 * sum(path.stat().st_size for path in made.paths)
    return [duration, seconds, size, 1e-3 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]


SECTIONS = {
    "speed": speed,
    "scaling": scaling,
    "peers": peers,
    "steps": steps,
    "impacts": impacts,
    "hour": hour,
}


def table(found: dict[str, Any]) -> list[str]:
    """What has been measured, in Markdown."""
    lines = [
        "# Gearbox dynamics",
        "",
        "Draft mesh laws and housing.",
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
            f"Processes that wanted the cores: {of['waiting']:.0f}; more than there are stretch the first figure only;",
            "set-up, filtering and the hand-off are part of the times.",
            f"Error against steps of 1 µs, of a run-up within 1 s: {of['of_peak']:.1e} of the peak force,",
            f"{of['of_swing']:.1e} of the moving part's peak.",
            "",
        ]
    if "scaling" in found:
        lines += [
            "## Time loop over unknowns",
            "",
            "![ns per step over unknowns](scaling.png)",
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
            "## Step sizes: bounded with damping at every one, accurate where the meshes are resolved",
            "",
            "| step / µs | error of the bearing forces over 20 ms, of the peak | largest bearing force / N |",
            "|---:|---:|---:|",
            *(f"| {step:g} | {error:.1e} | {force:.0f} |" for step, error, force in found["steps"]),
            "",
            "The flanks stay in contact here; where they part and strike, errors are larger (below). Steps longer than",
            "25 µs do not cover a band of 5 kHz and are refused for a record.",
            "",
        ]
    if "impacts" in found:
        lines += [
            "## Step sizes where flanks part and strike",
            "",
            "Released from a multiple of the static deflection under 60 N m; errors of the bearing forces over 20 ms,",
            "of the peak, and the lowest deflection of a mesh, which tells whether only the drive flanks part or the",
            "back flanks strike.",
            "",
            "| step / µs | error, from 2.5 times | lowest / µm | error, from 6 times | lowest / µm |",
            "|---:|---:|---:|---:|---:|",
            *(f"| {h:g} | {one:.1e} | {d1:.0f} | {two:.1e} | {d2:.0f} |" for h, one, d1, two, d2 in found["impacts"]),
            "",
        ]
    if "hour" in found:
        lines += [
            "## Long records, 0 → 2500 rpm at 100 µs, band of 100 Hz, in files",
            "",
            "| record / s | time to make / s | on disk / MB | process at most / MB |",
            "|---:|---:|---:|---:|",
            *(f"| {long:.0f} | {took:.1f} | {disk:.0f} | {peak:.0f} |" for long, took, disk, peak in found["hour"]),
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
        plot_scaling(found["scaling"], MEASURED / "dynamics" / "scaling.png")
    publish("dynamics/dynamics", "\n".join(table(found)))


if __name__ == "__main__":
    main()
