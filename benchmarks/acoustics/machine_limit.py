"""Speed of the boundary element steps against the limits of the machine.

    python -m benchmarks machine_limit OUT threads=1 [faces=2000,5000]
    python -m benchmarks machine_limit OUT threads=2

Writes docs/measured/acoustics/machine_limit.md. Every step of a transfer vector is timed by itself, on the gearbox of
transfer_vectors.py. Each measurement has a process of its own, whose records stay in OUT. The table contains all
records there. One thread counts processor seconds and may run beside other work. Two threads count elapsed seconds and
need an idle machine.

The limits are measured in the same process. Operations per second are those of a product of two square matrices: real
for the assembly, which is real arithmetic, complex otherwise. Bytes per second are those that all threads together read
from an array larger than any cache. Operations per pair of triangles and wavenumber are FLOPS of boundary_elements.py.
LU factors count 8/3 n³, and every column multiplied by a matrix (n, m) counts 8 n m. Bytes count each entry of a matrix
once.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.acoustics.boundary_elements import BATCH, FLOPS
from benchmarks.acoustics.transfer_vectors import POINTS, body
from benchmarks.processes import measured
from benchmarks.publish import publish

FACES = [2000, 5000]
TIMES = 3


def seconds(work: Callable[[], Any], threads: int) -> float:
    """Return the smallest of several times: processor seconds on one thread, elapsed seconds on more."""
    clock = time.process_time if threads == 1 else time.perf_counter
    taken = []
    for _ in range(TIMES):
        start = clock()
        work()
        taken.append(clock() - start)
    return min(taken)


def machine(threads: int) -> dict[str, float]:
    """Return the operations and bytes per second that this machine reaches."""
    rng = np.random.default_rng(0)
    real = rng.normal(size=(2000, 2000))
    whole = real + 1j
    many = np.ones(2**27)
    parts = np.array_split(many, threads)

    def read() -> None:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(np.sum, parts))

    return {
        "real": 2 * 2000**3 / seconds(lambda: real @ real, threads),
        "complex": 8 * 2000**3 / seconds(lambda: whole @ whole, threads),
        "read": many.nbytes / seconds(read, threads),
    }


def measure(faces: int, threads: int) -> dict[str, Any]:
    """Return the limits, and for every step (name, seconds, operations, bytes, name of its limit)."""
    import nvhchain as nvh
    from nvhchain.acoustics import sphere
    from nvhchain.acoustics.fused import engine
    from nvhchain.acoustics.systems.iterative import iterated
    from nvhchain.acoustics.systems.linear_system import DenseMatrix, DirectSystem
    from nvhchain.acoustics.waves.layer_potentials import layer_potentials

    knobs = nvh.STANDARD.acoustics
    list(engine.systems(sphere(0.1, 1), [1.0], knobs))  # compiled
    surface, centre = body(faces)
    n, m = len(surface.vertices), len(surface.triangles)
    k = 2 * np.pi / (6 * float(surface.longest_edges.mean())) * np.linspace(0.7, 1.0, BATCH)
    steps = []
    for count in (BATCH, 1):
        taken = seconds(lambda count=count: list(engine.systems(surface, k[:count], knobs)), threads)
        what = f"matrices, {count} wavenumber{'s together' if count > 1 else ''}, each"
        steps.append((what, taken / count, FLOPS * float(m) ** 2, 16.0 * n * (n + m), "real"))
    a, b = next(engine.systems(surface, k[-1:], knobs))
    points = centre + np.random.default_rng(7).normal(size=(POINTS, 3))
    rhs = layer_potentials(surface, points, float(k[-1]), knobs.field_near_ratio)[0].T
    for what, matrix in (("A", a), ("B", b)):
        taken = seconds(lambda matrix=matrix: DenseMatrix(matrix).apply_transposed(rhs), threads)
        operations = 8.0 * matrix.size * POINTS
        steps.append((f"{what}ᵀ times {POINTS} columns", taken, operations, 16.0 * matrix.size, "complex"))
    products, system = [], iterated(a, b, surface.vertices, knobs)
    apply = system._a.apply_transposed
    system._a.apply_transposed = lambda x: products.append(x.shape[1]) or apply(x)  # type: ignore[method-assign]
    taken = seconds(lambda: system.adjoint(rhs), threads)
    count, columns = len(products) // TIMES, sum(products) // TIMES
    operations = 8.0 * (n * n * columns + n * m * POINTS)
    steps.append(
        (f"GMRES for {POINTS} columns, {count} products", taken, operations, 16.0 * n * (n * count + m), "complex")
    )
    steps.append(
        (
            "LU factors",
            seconds(lambda: DirectSystem(a.copy(), b).factors, threads),
            8 / 3 * n**3,
            16.0 * n * n,
            "complex",
        )
    )
    return {"faces": m, "threads": threads, "machine": machine(threads), "steps": steps}


def table(records: list[dict[str, Any]]) -> str:
    """Return the records as Markdown."""
    lines = []
    for threads in sorted({record["threads"] for record in records}):
        most = [record["machine"] for record in records if record["threads"] == threads]
        real, whole, read = (max(one[name] for one in most) / 1e9 for name in ("real", "complex", "read"))
        lines.append(
            f"Limits, {threads} thread{'s' if threads > 1 else ''}: {real:.0f} and {whole:.0f} GFlop/s (real and "
            f"complex product of matrices), {read:.1f} GB/s read."
        )
    lines += [
        "",
        "| faces | threads | step | s | GFlop/s | of the limit | GB/s | of the limit |",
        "|---:|---:|---|---:|---:|---:|---:|---:|",
    ]
    for record in sorted(records, key=lambda one: (one["faces"], one["threads"])):
        limits = record["machine"]
        for what, taken, operations, size, limit in record["steps"]:
            lines.append(
                f"| {record['faces']} | {record['threads']} | {what} | {taken:.3g} | {operations / taken / 1e9:.3g} | "
                f"{100 * operations / taken / limits[limit]:.0f} % | {size / taken / 1e9:.2g} | "
                f"{100 * size / taken / limits['read']:.0f} % |"
            )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure missing records and publish the page."""
    if sys.argv[1] == "--measure":
        print(json.dumps(measure(int(sys.argv[2]), int(sys.argv[3]))))
        return
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    arguments = dict(argument.split("=") for argument in sys.argv[2:])
    for faces in [int(size) for size in arguments.get("faces", ",".join(map(str, FACES))).split(",")]:
        target = out / f"limit-{faces}-{arguments['threads']}.json"
        if not target.exists():
            command = [
                sys.executable,
                "-m",
                "benchmarks.acoustics.machine_limit",
                "--measure",
                str(faces),
                arguments["threads"],
            ]
            target.write_text(json.dumps(measured(command, int(arguments["threads"]))))
    publish(
        "acoustics/machine_limit", table([json.loads(path.read_text()) for path in sorted(out.glob("limit-*.json"))])
    )


if __name__ == "__main__":
    main()
