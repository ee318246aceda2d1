"""Operators of the fused boundary element engine against bempp-cl: time, memory, error of quadrature.

    python -m benchmarks boundary_elements OUT [--compare 1280 5120] [--grow 320 1280 5120 20480] [--opencl PYTHON]
                                           [--two-threads 1280]
    python -m benchmarks boundary_elements OUT --peers 320 1280 5120 20480 [--opencl PYTHON]

Writes docs/measured/acoustics/boundary_elements.md. Spheres have 20 · 4ⁿ triangles at six elements per wavelength.
Every figure is measured in a process of its own and kept in OUT, so that an interrupted run resumes. The error is that
of the surface pressure under a plane-wave velocity, relative, RMS. The reference is the same mesh at quadrature orders
past convergence, so that the error is quadrature alone. PYTHON is an interpreter whose bempp-cl finds Intel's OpenCL
runtime. Without it, those rows contain `not installed`. The option --two-threads selects meshes that are also compared
on two threads, which needs an idle machine. The option --peers measures the growth of the cost of all engines, on the
page boundary_elements_growth.md. It takes a quarter of an hour for 20480 triangles, on one thread.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish

ROOT = Path(__file__).parents[2]
FIDELITIES: dict[str, dict[str, Any]] = {
    "order 2": {},
    "order 2, single": {"precision": "single"},
    "order 4": {"quadrature_order": 4},
    "converged": {
        "quadrature_order": 8, "close_distances": (1.5, 3.0, 6.0), "close_orders": (14, 12, 10), "singular_order": 8
    },
}  # fmt: skip
PER_WAVELENGTH = 6.0
BATCH = 4
MOST_NUMBA = 6000
"""Triangles above which bempp-cl's numba kernels are excluded from the growth (over half an hour for 20480)."""
PEER_ORDER = 4
"""Default quadrature order of bempp-cl."""
FLOPS = 517
"""Multiplications and additions per pair of triangles and wavenumber at order 2. They are 9 point pairs at 38 (advance
6, F 8, integrand 6, sums 18), 54 for B, 60 into the three rows and 58 from rows to columns. Exponentials are
additional, once per batch."""


def body(n_face: int) -> nvh.handoff.Surface:
    """Return a sphere of about `n_face` triangles."""
    from nvhchain.acoustics import sphere  # compiles: part of a worker's time

    return sphere(0.1, round(np.log(n_face / 20) / np.log(4)))


def wavenumber(surface: nvh.handoff.Surface) -> float:
    """Return the wavenumber (rad/m) at `PER_WAVELENGTH` elements per wavelength."""
    return 2 * np.pi / (PER_WAVELENGTH * float(surface.longest_edges.mean()))


def wave_gradient(surface: nvh.handoff.Surface) -> nvh.handoff.ComplexArray:
    """Return the pressure gradient of a plane-wave velocity on the faces."""
    return np.asarray(np.exp(1j * wavenumber(surface) * surface.centroids @ np.array([0.6, 0.0, 0.8])))


def worker(task: dict[str, Any], target: Path) -> None:
    """Assemble twice, the first time from the compiler's cache, and solve if requested.

    With `cold`, the first time counts from before the import of the package, which compiles a part.
    """
    before, before_cpu = time.perf_counter(), time.process_time()
    from nvhchain.acoustics.fused import engine
    from nvhchain.acoustics.fused.kernels import COMPLEX

    surface = body(task["faces"])
    fidelity = replace(nvh.STANDARD.acoustics, **FIDELITIES[task["fidelity"]])
    k = wavenumber(surface) * np.linspace(0.5, 1.0, task["wavenumbers"] + 1)[1:]
    assembled = engine.systems if task["faces"] <= 6000 else engine.stripes
    wall, cpu = [], []
    for _ in range(1 if task["faces"] > 6000 else 2):
        start, spent = time.perf_counter(), time.process_time()
        if task["cold"] and not wall:
            start, spent = before, before_cpu
        last = None  # frees the matrices of the previous pass
        last = deque(assembled(surface, k, fidelity), maxlen=1).pop()
        wall.append(time.perf_counter() - start)
        cpu.append(time.process_time() - spent)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    pressure = np.empty(0)
    if task["solve"]:
        assert last is not None
        a, b = last if task["faces"] <= 6000 else next(engine.systems(surface, k[-1:], fidelity))
        pressure = np.linalg.solve(a, b @ wave_gradient(surface).astype(COMPLEX[fidelity.precision]))
    np.savez(target, seconds=wall, cpu=cpu, peak=peak, pressure=pressure)


def measure(out: Path, name: str, command: list[str], environment: dict[str, str]) -> dict[str, Any] | None:
    """Return the results of a process in OUT/name.npz, which runs if they are missing; None if it fails."""
    target = out / f"{name}.npz"
    if not target.exists():
        done = subprocess.run(
            [*command, str(target)], env={**os.environ, **environment}, capture_output=True, text=True
        )
        if done.returncode != 0:
            (out / f"{name}.log").write_text(done.stderr)
            return None
    return dict(np.load(target))


def own(out: Path, faces: int, fidelity: str, wavenumbers: int, threads: int, **more: Any) -> dict[str, Any]:
    """Return time, memory and pressure of the fused engine; cold=True: with an empty compiler cache."""
    cold = more.get("cold", False)
    task = {"faces": faces, "fidelity": fidelity, "wavenumbers": wavenumbers, "solve": more.get("solve", False)}
    task["cold"] = cold
    kind = f"{'-solved' if task['solve'] else ''}{'-from-import' if cold else ''}"
    name = f"own-{faces}-{fidelity}-{wavenumbers}-{threads}{kind}".replace(", ", "-")
    with tempfile.TemporaryDirectory() as cache:
        environment = {"NUMBA_NUM_THREADS": str(threads), **({"NUMBA_CACHE_DIR": cache} if cold else {})}
        result = measure(
            out,
            name,
            [sys.executable, "-m", "benchmarks.acoustics.boundary_elements", "--worker", json.dumps(task)],
            environment,
        )
    if result is None:
        sys.exit((out / f"{name}.log").read_text())
    return result


def peer(out: Path, faces: int, order: int, threads: int, interpreter: str, interface: str) -> dict[str, Any] | None:
    """Return time, memory and pressure of bempp-cl at one wavenumber."""
    from nvhchain.acoustics.surfaces.burton_miller import coupling

    surface, mesh = body(faces), out / f"mesh-{faces}.npz"
    k = wavenumber(surface)
    alpha, gradient = np.conj(coupling(surface, k)), wave_gradient(surface)
    np.savez(mesh, vertices=surface.vertices, triangles=surface.triangles, gradient=gradient, wavenumber=k, alpha=alpha)
    command = [interpreter, str(Path(__file__).with_name("bempp_operators.py")), interface, str(order), str(mesh)]
    variables = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "CL_CONFIG_CPU_TBB_NUM_WORKERS")
    environment = dict.fromkeys(variables, str(threads))
    return measure(out, f"bempp-from-import-{interface}-{faces}-{order}-{threads}", command, environment)


def comparison(out: Path, faces: int, opencl: str | None, counts: tuple[int, ...]) -> list[str]:
    """Return the rows of one mesh.

    Columns are engine, threads (of `counts`), processor seconds cold and warm, and their ratio to ours at order 2.
    Elapsed times follow where two threads had an idle machine, then peak memory and error.
    """
    truth = own(out, faces, "converged", 1, 1, solve=True)["pressure"]
    found: dict[tuple[str, int], tuple[dict[str, Any], dict[str, Any] | None, int] | None] = {}
    for fidelity in ("order 2", "order 4", "order 2, single"):
        for threads in counts:
            cold = own(out, faces, fidelity, BATCH, threads, cold=True) if fidelity == "order 2" else None
            done = own(out, faces, fidelity, BATCH, threads, solve=True)
            found[f"fused, {fidelity}", threads] = done, cold, BATCH
    for interface, interpreter in (("numba", sys.executable), ("opencl", opencl)):
        label = {"numba": "bempp-cl, numba", "opencl": "bempp-cl, Intel OpenCL"}[interface] + f", order {PEER_ORDER}"
        for threads in counts:
            peers = peer(out, faces, PEER_ORDER, threads, interpreter, interface) if interpreter else None
            found[label, threads] = None if peers is None else (peers, peers, 1)
    lines = []
    for (label, threads), row in found.items():
        start = f"| {faces} | {label} | {threads} | "
        if row is None:
            lines.append(start + "not installed" + " |" * 8)
            continue
        done, cold, wavenumbers = row
        cells = []
        for clock in ("cpu", "seconds"):
            if clock == "seconds" and threads == 1:
                cells += [""] * 3
                continue
            base = found["fused, order 2", threads]
            assert base is not None
            warm = done[clock][-1] / wavenumbers
            cells += [
                "" if cold is None else f"{cold[clock][0]:.1f}",
                f"{warm:.3g}",
                f"{warm / (base[0][clock][-1] / BATCH):.3g}",
            ]
        lines.append(start + " | ".join([*cells, f"{done['peak'] / 1e6:.0f}", f"{error(done, truth):.1e}"]) + " |")
    return lines


def error(found: dict[str, Any], truth: nvh.handoff.ComplexArray) -> float:
    """Return the relative error of the pressure in the 2-norm."""
    return float(np.linalg.norm(found["pressure"] - truth) / np.linalg.norm(truth))


def peers_growth(out: Path, faces: int, opencl: str | None) -> str:
    """Return a row: processor seconds per wavenumber of every engine at equal error, peak memory, differences."""
    ours = own(out, faces, "order 4", BATCH, 1, solve=True)
    base, cells = ours["cpu"][-1] / BATCH, [f"{ours['cpu'][-1] / BATCH:.3g} | {ours['peak'] / 1e6:.0f}"]
    for interface, interpreter in (("numba", sys.executable), ("opencl", opencl)):
        slow = interface == "numba" and faces > MOST_NUMBA
        found = peer(out, faces, PEER_ORDER, 1, interpreter, interface) if interpreter and not slow else None
        if found is None:
            cells.append(f"{'excluded' if slow else 'not installed'} | | | ")
            continue
        cells.append(
            f"{found['cpu'][-1]:.3g} | {found['cpu'][-1] / base:.3g} | {found['peak'] / 1e6:.0f} | "
            f"{error(found, ours['pressure']):.0e}"
        )
    return f"| {faces} | {' | '.join(cells)} |"


def equal_error(out: Path, faces: int, opencl: str | None) -> list[str]:
    """Return a sentence: processor time of bempp-cl over that of the fused engine at the order of equal error."""
    ours = own(out, faces, "order 4", BATCH, 1, solve=True)["cpu"][-1] / BATCH
    told = []
    for interface, interpreter in (("numba", sys.executable), ("opencl", opencl)):
        found = peer(out, faces, PEER_ORDER, 1, interpreter, interface) if interpreter else None
        if found is not None:
            told.append(f"{interface} {found['cpu'][-1] / ours:.3g}")
    return [f"At equal error (order 4) on {faces} triangles bempp-cl takes times as long: {', '.join(told)}.", ""]


def limit(out: Path, faces: int, flops: float, copied: float) -> str:
    """Return a sentence: speed of the engine relative to the limits of the core."""
    done = own(out, faces, "order 2", BATCH, 1, solve=True)
    pairs = float(faces) ** 2 * BATCH / done["cpu"][-1]
    written = 16 * (faces / 2 + 2) * (1.5 * faces + 2) * BATCH / done["cpu"][-1]
    return (
        f"Arithmetic is the limit, not memory: on {faces} triangles {100 * FLOPS * pairs / 1e9 / flops:.0f} % of a "
        "matrix product's operations per second, without the exponentials and the close pairs, and "
        f"{100 * written / 1e9 / copied:.0f} % of the bandwidth."
    )


def growth(out: Path, faces: int, wavenumbers: int) -> str:
    """Return a row: seconds, nanoseconds per pair and wavenumber, operations and matrix bytes per second, error."""
    done = own(out, faces, "order 2", wavenumbers, 1, solve=True)
    truth = own(out, faces, "order 4", 1, 1, solve=True)["pressure"]
    cpu, pairs = done["cpu"][-1], float(faces) ** 2 * wavenumbers
    entries = 16 * (faces / 2 + 2) * (1.5 * faces + 2) * wavenumbers
    return (
        f"| {faces} | {wavenumbers} | {cpu:.2f} | {cpu / wavenumbers:.3f} | {1e9 * cpu / pairs:.0f} | "
        f"{FLOPS * pairs / cpu / 1e9:.1f} | {entries / cpu / 1e9:.2f} | {done['peak'] / 1e6:.0f} | "
        f"{error(done, truth):.1e} |"
    )


def peak_flops() -> float:
    """Return GFlop/s of one core in a product of real matrices, the practical limit of arithmetic."""
    from threadpoolctl import threadpool_limits

    a = np.random.default_rng(0).normal(size=(1500, 1500))
    with threadpool_limits(1):
        best = min(_timed(lambda: a @ a) for _ in range(5))
    return float(2 * 1500**3 / best / 1e9)


def bandwidth() -> float:
    """Return GB/s of one core in a copy of memory."""
    a = np.ones(2**27 // 8)
    b = np.empty_like(a)
    return float(a.nbytes / min(_timed(lambda: np.copyto(b, a)) for _ in range(5)) / 1e9)


def _timed(work: Any) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def main() -> None:
    """Run the benchmark of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", nargs="?", type=Path)
    parser.add_argument("--compare", nargs="*", type=int, default=[1280, 5120])
    parser.add_argument("--grow", nargs="*", type=int, default=[320, 1280, 5120, 20480])
    parser.add_argument("--opencl")
    parser.add_argument("--two-threads", nargs="*", type=int, default=[1280])
    parser.add_argument("--peers", nargs="+", type=int)
    parser.add_argument("--worker", nargs="+")
    arguments = parser.parse_args()
    if arguments.worker:
        worker(json.loads(arguments.worker[0]), Path(arguments.worker[1]))
        return
    out = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    if arguments.peers:
        lines = [
            "Operators at quadrature order 4, where all err alike, per wavenumber, on one thread beside other work: "
            f"processor seconds (the fused engine's of a batch of {BATCH}), times the fused engine's, peak MB, and the "
            "difference of the surface pressure from the fused engine's. Once compiled; above 6000 triangles bempp-cl "
            "runs once, with its compilation, and the fused engine in stripes of 1 GiB.",
            "",
            "| triangles | fused / CPU s | MB | bempp-cl, numba / CPU s | times | MB | difference | "
            "bempp-cl, Intel OpenCL / CPU s | times | MB | difference |",
            "|" + "---:|" * 11,
            *(peers_growth(out, faces, arguments.opencl) for faces in arguments.peers),
        ]
        publish("acoustics/boundary_elements_growth", "\n".join(lines) + "\n")
        return
    grown = [growth(out, faces, BATCH) for faces in arguments.grow]
    grown += [growth(out, 1280, count) for count in (1, 2, 8, 16, 32, 64, 128)]
    compared = []
    for faces in arguments.compare:
        threads = (1, 2) if faces in arguments.two_threads else (1,)
        compared += comparison(out, faces, arguments.opencl, threads)
    flops, copied = peak_flops(), bandwidth()
    lines = [
        "Operators (S, K, K′, W combined into A and B) per wavenumber; cold: import and first call of a process "
        "with nothing compiled, for the fused engine four wavenumbers. Ratios: to the fused engine at order 2 with "
        "as many threads. Error: quadrature alone, of the surface pressure. One thread was measured beside other work, "
        "in processor seconds.",
        "",
        "| triangles | engine | threads | cold / CPU s | warm / CPU s | CPU ratio | cold / s | warm / s | ratio | "
        "peak MB | error |",
        "|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        *compared,
        "",
        *(line for faces in arguments.compare for line in equal_error(out, faces, arguments.opencl)),
        "Growth at order 2, double precision, in stripes of 1 GiB, one thread; processor seconds per wavenumber, "
        f"nanoseconds per pair of triangles and wavenumber, GFlop/s of {FLOPS} operations per pair against "
        f"{flops:.0f} GFlop/s of a core in a matrix product, and GB/s of matrix entries written against "
        f"{copied:.1f} GB/s of a core in a copy. Error: of the last wavenumber's surface pressure, against order 4.",
        "",
        "| triangles | wavenumbers | CPU s | CPU s / wavenumber | ns / pair | GFlop/s | GB/s | peak MB | error |",
        "|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        *grown,
        "",
        limit(out, max(arguments.grow), flops, copied),
    ]
    publish("acoustics/boundary_elements", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
