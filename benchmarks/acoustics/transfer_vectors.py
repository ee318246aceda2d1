"""Time, memory and error of complete sets of transfer vectors.

    python -m benchmarks transfer_vectors OUT set growth masters threads cold large peer1 peer2 opencl=PYTHON

Writes docs/measured/acoustics/transfer_vectors.md and transfer_vectors_peers.md. Each named part is measured, every row
in a process of its own, unless its record is in OUT. The tables contain all records in OUT; that of the peers has a
page of its own. Sizes can be given: `growth=500,2000,23000`, `masters=1,128`, `set=6500`, `large=34000`.

Growth, masters, cold, peer1 and large take one thread, so that two of them can run side by side. Set, peer2 and the
second row of threads take two threads and need an idle machine.

Peers are measured twice in one process. The first set counts from before the imports, with no part of the fused engine
compiled; bempp-cl compiles in every process. The second set stands for every further one. PYTHON is an additional
interpreter whose pyopencl finds Intel's runtime; it shares all other packages with this one.

Seconds are elapsed and of all processors; on a busy machine, only the latter compare. Memory is the peak of the process
above its memory before the call. One error is that of an interior point source at the upper frequency, relative to the
peak over the field points. At 4.5 elements per wavelength, the mesh itself errs by a few percent. The other one is the
largest difference from LU factors, relative to the largest entry of a transfer vector, where both were measured.
"""

from __future__ import annotations

import json
import os
import resource
import site
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from benchmarks.processes import measured
from benchmarks.publish import publish

ROOT = Path(__file__).parents[2]
LOW, C, DENSITY = 50.0, 343.0, 1.21
SIZES = {
    "set": [6500],
    "growth": [500, 1000, 2000, 5000, 10000, 23000],
    "masters": [1, 8, 32, 128],
    "threads": [5000],
    "cold": [2000],
    "large": [34000],
    "peer1": [700, 2000],
    "peer2": [700],
}
POINTS = 10
PEERS = {"fused": "fused", "bempp": "bempp-cl, numba", "opencl": "bempp-cl, Intel OpenCL"}


def body(faces: int):
    """Return the gearbox of the demonstration case with about `faces` triangles, and a source inside it."""
    import numpy as np

    import nvhchain as nvh
    from nvhchain.housing.casting.mesh import radiating_surface

    casting = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml").housing
    surface = radiating_surface(casting, 0.0152 * (5404 / faces) ** 0.5)
    return surface, np.asarray(surface.vertices.mean(axis=0))


def points_around(centre):
    """Return field points on a sphere of 1 m."""
    import numpy as np

    x = np.random.default_rng(7).normal(size=(POINTS, 3))
    return centre + x / np.linalg.norm(x, axis=1, keepdims=True)


def measure(job: dict) -> dict:
    """Measure one row: a complete set of transfer vectors in this process."""
    start, used = time.perf_counter(), time.process_time()
    import numpy as np

    from nvhchain.acoustics import estimate_memory, transfer_vectors

    imported = time.perf_counter() - start, time.process_time() - used
    from nvhchain.conventions import Air
    from nvhchain.fidelity import STANDARD

    surface, source = body(job["faces"])
    points = points_around(source)
    corners = surface.vertices[surface.triangles]
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    high = min(5000.0, C / (4.5 * edge))
    frequency = np.linspace(LOW, high, job["masters"]) if job["masters"] > 1 else np.array([high])
    fidelity = replace(STANDARD.acoustics, solver=job["solver"])
    air = Air(C, DENSITY)
    if not job["cold"] and job["engine"] == "fused":
        from nvhchain.acoustics import sphere

        transfer_vectors(sphere(0.1, 1), [[0, 0, 1.0]], [100.0], air=air)
    engine = use_opencl() if job["engine"] == "opencl" else job["engine"]
    before, times = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, []
    for _ in range(job["sets"]):
        start, used = time.perf_counter(), time.process_time()
        atv = transfer_vectors(surface, points, frequency, air=air, fidelity=fidelity, engine=engine)
        times.append((time.perf_counter() - start, time.process_time() - used))
    seconds, processor = times[0]
    if job["sets"] > 1:
        seconds, processor = seconds + imported[0], processor + imported[1]
    peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    k = 2 * np.pi * high / C
    offset, to_point = surface.centroids - source, np.linalg.norm(points - source, axis=1)
    r = np.linalg.norm(offset, axis=1)
    slope = (
        -(1j * k + 1 / r) * np.exp(-1j * k * r) / (4 * np.pi * r**2) * np.einsum("ij,ij->i", offset, surface.normals)
    )
    exact = np.exp(-1j * k * to_point) / (4 * np.pi * to_point)
    error = np.abs(atv.vectors[-1] @ slope / (-2j * np.pi * high * DENSITY) - exact).max() / np.abs(exact).max()
    np.save(job["vectors"], atv.vectors[-1])
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    counts = {"points": POINTS, "frequencies": len(frequency)}
    estimated = estimate_memory(n_vertex, n_face, engine, fidelity, **counts) / 2**20
    return {
        "again": times[-1],
        "n_face": n_face, "high": high, "seconds": seconds, "processor": processor, "peak": peak, "error": float(error),
        "estimate": estimated,
    }  # fmt: skip


def use_opencl() -> str:
    """Switch bempp-cl to OpenCL in this process and return the name of its engine."""
    from nvhchain.acoustics.systems import _bempp

    _bempp._DEVICE["device_interface"] = "opencl"
    return "bempp"


def record(out: Path, part: str, interpreter: str = sys.executable, **job) -> None:
    """Measure one row in a fresh process, unless its record exists."""
    job = {"engine": "fused", "solver": "auto", "threads": 1, "masters": 4, "cold": False, "sets": 1, **job}
    name = "-".join([part, *(f"{job[key]}" for key in ("faces", "engine", "solver", "masters", "threads"))])
    name += "-cold" if job["cold"] else ""
    target = out / f"{name}.json"
    if target.exists():
        return
    job["vectors"] = str(out / f"{name}.npy")
    packages = os.pathsep.join([str(ROOT), *site.getsitepackages()])
    environment = {"CL_CONFIG_CPU_TBB_NUM_WORKERS": str(job["threads"]), "PYTHONPATH": packages}
    with tempfile.TemporaryDirectory() as empty:
        if job["cold"]:
            environment["NUMBA_CACHE_DIR"] = empty
        found = measured(
            [interpreter, "-m", "benchmarks.acoustics.transfer_vectors", "--measure", json.dumps(job)],
            job["threads"],
            **environment,
        )
    target.write_text(json.dumps({"part": part, **job, **found}))


def run(out: Path, part: str, sizes: list[int], opencl: str | None) -> None:
    """Measure all rows of one part; opencl: the interpreter with Intel's runtime."""
    for size in sizes:
        if part == "set":
            for solver in ("auto", "direct"):
                record(out, part, faces=size, masters=32, solver=solver, threads=2)
        elif part == "growth":
            for solver in ("direct", "iterative", "compressed"):
                record(out, part, faces=size, masters=1, solver=solver)
        elif part == "masters":
            record(out, part, faces=1000, masters=size)
        elif part == "threads":
            for threads in (1, 2):
                record(out, part, faces=size, threads=threads)
        elif part == "cold":
            for cold in (True, False):
                record(out, part, faces=size, masters=1, cold=cold)
        elif part == "large":
            record(out, part, faces=size, masters=1, solver="compressed")
        elif part in ("peer1", "peer2"):
            for engine in PEERS:
                interpreter = opencl if engine == "opencl" else sys.executable
                if interpreter is not None:
                    record(
                        out, part, interpreter, faces=size, engine=engine, solver="direct", sets=2,
                        threads=int(part[-1]), cold=engine == "fused",
                    )  # fmt: skip


def apart(row: dict, others: list[dict]) -> str:
    """Return the largest difference of the vectors from the first of `others`, relative to the largest entry."""
    import numpy as np

    if not others or others[0]["vectors"] == row["vectors"]:
        return ""
    left, right = np.load(row["vectors"]), np.load(others[0]["vectors"])
    return f"{np.abs(left - right).max() / np.abs(right).max():.0e}"


def peers(rows: list[dict]) -> str:
    """Return the table of complete sets against bempp-cl as Markdown."""
    lines = [
        f"Complete sets of {rows[0]['masters']} masters and {POINTS} points by LU factors, the first "
        "of a process with imports and compilation (the fused engine's cache on disk empty) and a further one; times "
        "the fused engine's in brackets. Each engine at the orders of quadrature it has by default. One thread was "
        "measured beside other work, in processor seconds.",
        "",
        "| faces | engine | threads | first / s | first / CPU s | further / s | further / CPU s | MB | error | "
        "from fused |",
        "|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in sorted(rows, key=lambda r: (r["faces"], r["threads"], list(PEERS).index(r["engine"]))):
        same = [r for r in rows if (r["faces"], r["threads"], r["engine"]) == (row["faces"], row["threads"], "fused")]
        base = [same[0]["seconds"], same[0]["processor"], *same[0]["again"]]
        cells = [
            f"{value:.3g} ({value / ours:.2g})"
            for value, ours in zip([row["seconds"], row["processor"], *row["again"]], base, strict=True)
        ]
        if row["threads"] == 1:
            cells[0] = cells[2] = ""
        lines.append(
            f"| {row['n_face']} | {PEERS[row['engine']]} | {row['threads']} | " + " | ".join(cells) + f" | "
            f"{row['peak']:.0f} | {100 * row['error']:.2g} % | {apart(row, same)} |"
        )
    return "\n".join(lines) + "\n"


def table(rows: list[dict]) -> str:
    """Return the table of all other records as Markdown."""
    lines = [
        "| part | faces | engine, solver | masters | threads | s | processor s | MB | estimated MB | error | from LU |",
        "|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in sorted(rows, key=lambda r: (list(SIZES).index(r["part"]), r["faces"], r["masters"], r["threads"])):
        others = [
            r for r in rows if (r["faces"], r["masters"], r["solver"]) == (row["faces"], row["masters"], "direct")
        ]
        part = f"{row['part']}, cold" if row["cold"] else row["part"]
        lines.append(
            f"| {part} | {row['n_face']} | {row['engine']}, {row['solver']} | {row['masters']} | {row['threads']} | "
            f"{row['seconds']:.3g} | {row['processor']:.3g} | {row['peak']:.0f} | {row['estimate']:.0f} | "
            f"{100 * row['error']:.2g} % | {apart(row, others)} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure the requested parts and publish the pages."""
    if sys.argv[1] == "--measure":
        print(json.dumps(measure(json.loads(sys.argv[2]))))
        return
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    arguments = dict(argument.partition("=")[::2] for argument in sys.argv[2:])
    opencl = arguments.pop("opencl", None)
    for part, sizes in arguments.items():
        run(out, part, [int(size) for size in sizes.split(",")] if sizes else SIZES[part], opencl)
    records = [json.loads(path.read_text()) for path in out.glob("*.json")]
    of_peers = [row for row in records if row["part"].startswith("peer")]
    if of_peers:
        publish("acoustics/transfer_vectors_peers", peers(of_peers))
    if len(of_peers) < len(records):
        publish("acoustics/transfer_vectors", table([row for row in records if row not in of_peers]))


if __name__ == "__main__":
    main()
