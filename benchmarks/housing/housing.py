"""Modes of the casting against CalculiX on the same mesh, and their cost.

    python -m benchmarks housing OUT [NAME ...]

Writes docs/measured/housing/housing.md. Measures what is named (all by default: see `MEASUREMENTS`) and is not yet in
OUT/<name>.json, each in its own process, then writes the tables of everything found in OUT. CalculiX (`ccx`, Debian
package calculix-ccx) is excluded where it is not installed. Seconds are wall time on an otherwise idle machine, memory
is the process's largest resident set; `frequencies`, `truncation`, `exchange` and `damping` hold errors only, `superlu`
and `default_order` state processor seconds: they may be measured on a busy one.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh, splu

import nvhchain as nvh
from benchmarks.housing.housing_tables import COMPARED, Record, tables
from benchmarks.publish import publish
from nvhchain.acoustics import required_element_size
from nvhchain.case import GearboxCase
from nvhchain.fem import factorize
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import ComplexArray, FloatArray, ReducedHousing, Surface
from nvhchain.housing import CraigBampton, DampingCurve, craig_bampton, reduce_housing
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.mesh import HousingMesh, mesh_casting, mounting_plane_faces, radiating_surface
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.modes.seat_modes import seat_modes, seat_unknowns
from nvhchain.housing.reduction import held_matrices, reduce_mesh
from nvhchain.housing.skin.normal_motion import normal_motion

ROOT = Path(__file__).parents[2]

TARGET_SIZE = 0.0142
"""m, elements of the mesh of 160 000 unknowns on which the cost of the modes is compared."""

ERROR_SIZE = 0.03
"""m, elements of the mesh on which errors are measured."""

BAND_RATIO = 1.25
"""Modes up to this multiple of the band's upper limit."""

COUNTED = 64
"""Modes that scipy is asked for, which takes their number instead of a limit: as many as there are in the draft."""

AGREEMENT = 1e-3
"""Relative difference of a natural frequency from CalculiX's beyond which the measurement fails."""


def case() -> GearboxCase:
    found = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    assert isinstance(found, GearboxCase)
    return found


def meshed(size: float) -> tuple[HousingMesh, Casting]:
    casting = case().housing
    return mesh_casting(casting, replace(nvh.DRAFT.housing, element_size=size)), casting


def deck(mesh: HousingMesh, casting: Casting, count: int) -> str:
    """CalculiX input: the same nodes and elements, bolt bores held, seats rigid about their reference points."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i},{x:.12e},{y:.12e},{z:.12e}" for i, (x, y, z) in enumerate(mesh.nodes, start=1)]
    first = len(mesh.nodes) + 1
    for number, bore in enumerate(casting.bores):
        # reference point and the node that carries its rotations
        lines += [f"{first + 2 * number + k},{bore.centre[0]},{bore.centre[1]},{bore.centre[2]}" for k in (0, 1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=CASTING")
    lines += [",".join(map(str, [i, *(element + 1)])) for i, element in enumerate(mesh.elements, start=1)]
    material = casting.material
    lines += ["*MATERIAL, NAME=METAL", "*ELASTIC", f"{material.young},{material.poisson}"]
    lines += ["*DENSITY", f"{material.density}", "*SOLID SECTION, ELSET=CASTING, MATERIAL=METAL"]
    lines.append("*NSET, NSET=BOLTS")
    lines += [f"{node + 1}," for node in np.concatenate(mesh.bolts)]
    for number, nodes in enumerate(mesh.seats):
        lines.append(f"*NSET, NSET=SEAT{number}")
        lines += [f"{node + 1}," for node in nodes]
        reference = first + 2 * number
        lines.append(f"*RIGID BODY, NSET=SEAT{number}, REF NODE={reference}, ROT NODE={reference + 1}")
    lines += ["*BOUNDARY", "BOLTS,1,3", "*STEP", "*FREQUENCY", f"{count}", "*END STEP", ""]
    return "\n".join(lines)


def calculix(mesh: HousingMesh, casting: Casting, folder: Path, count: int) -> tuple[FloatArray, Record]:
    """First `count` frequencies (Hz) by ccx and what they cost."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "casting.inp").write_text(deck(mesh, casting, count))
    threads = {"OMP_NUM_THREADS": str(os.cpu_count()), "CCX_NPROC_EQUATION_SOLVER": str(os.cpu_count())}
    start = time.perf_counter()
    child = subprocess.Popen(
        ["ccx", "casting"], cwd=folder, stdout=subprocess.PIPE, text=True, env={**os.environ, **threads}
    )
    assert child.stdout is not None
    log = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - start
    data = folder / "casting.dat"
    if os.waitstatus_to_exitcode(status) != 0 or not data.exists():
        sys.exit(log[-2000:])
    table = data.read_text().split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s+\d+((?:\s+[-+.\dE]+){4})\s*$", table, re.MULTILINE)
    frequency = np.array([float(row.split()[2]) for row in rows])
    cost = {"seconds": seconds, "processor": usage.ru_utime + usage.ru_stime, "megabytes": usage.ru_maxrss / 1024}
    return frequency[:count], cost


def frequencies(out: Path) -> Record | None:
    """The first 40 frequencies against CalculiX on the same mesh."""
    found = peer(out, ERROR_SIZE)
    return None if found is None else {name: value for name, value in found.items() if name not in ("own", "calculix")}


def check_frequencies(found: Record) -> None:
    """Exit with a message when frequencies are missing or differ by more than AGREEMENT."""
    own, theirs = np.array(found["frequency"]), np.array(found["theirs"])
    if not len(own) == len(theirs) == COMPARED:
        sys.exit(f"{len(own)} own and {len(theirs)} frequencies of CalculiX, {COMPARED} are compared")
    off = np.abs(own / theirs - 1)
    if not off.max() <= AGREEMENT:
        worst = int(off.argmax())
        sys.exit(
            f"frequency {worst + 1}: {own[worst]:.6g} Hz, CalculiX {theirs[worst]:.6g} Hz: off by {off[worst]:.2g}, "
            f"{AGREEMENT:g} are tolerated"
        )


def peer(out: Path, size: float) -> Record | None:
    """The same and what it costs; fails where a frequency is off."""
    if shutil.which("ccx") is None:
        return None
    mesh, casting = meshed(size)
    # first theirs: the largest resident set of a child counts what this process has when it starts it
    theirs, cost = calculix(mesh, casting, out / "calculix", COMPARED)
    shutil.rmtree(out / "calculix")
    start, used = time.perf_counter(), time.process_time()
    K, M, _ = held_matrices(mesh, casting)
    modes = seat_modes(K, M, len(casting.bores), BAND_RATIO * case().band.high)
    own = {
        "seconds": time.perf_counter() - start,
        "processor": time.process_time() - used,
        "megabytes": peak(),
    }
    found: Record = {
        "unknowns": K.shape[0],
        "elements": len(mesh.elements),
        "modes": len(modes.frequency),
        "own": own,
        "calculix": cost,
        "frequency": modes.frequency[:COMPARED].tolist(),
        "theirs": theirs.tolist(),
    }
    check_frequencies(found)
    return found


def peak() -> float:
    """Largest resident set so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def superlu(out: Path) -> Record:
    """The same modes and residual vectors by scipy alone: SuperLU in symmetric mode, eigsh about 0 Hz."""
    mesh, casting = meshed(TARGET_SIZE)
    seats = len(casting.bores)
    start, used = time.perf_counter(), time.process_time()
    K, M, _ = held_matrices(mesh, casting)
    lu = splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    factored = time.perf_counter() - start
    inverse = LinearOperator(K.shape, matvec=lu.solve, dtype=float)
    omega2, shapes = eigsh(K, k=COUNTED, M=M, sigma=0.0, OPinv=inverse)
    load = np.zeros((K.shape[0], 3 * seats))
    at = seat_unknowns(K.shape[0], seats)
    load[at, np.arange(len(at))] = 1.0
    residual = lu.solve(load) - shapes @ (shapes[at].T / omega2[:, None])
    assert np.isfinite(residual).all()
    return {
        "unknowns": K.shape[0],
        "frequency": (np.sqrt(np.sort(omega2))[:COMPARED] / (2 * np.pi)).tolist(),
        "modes": COUNTED,
        "factor": factored,
        "seconds": time.perf_counter() - start,
        "processor": time.process_time() - used,
        "megabytes": peak(),
    }


def default_order(out: Path) -> Record:
    """One factorisation of the smaller matrix by SuperLU as scipy calls it by default, and by PARDISO."""
    mesh, casting = meshed(ERROR_SIZE)
    K, M, _ = held_matrices(mesh, casting)
    del M
    used = time.process_time()
    with factorize(K) as factor:
        own, memory = time.process_time() - used, factor.memory
    used = time.process_time()
    lu = splu(K.tocsc())
    return {
        "unknowns": K.shape[0],
        "own": {"processor": own, "megabytes": memory / 2**20},
        "superlu": {"processor": time.process_time() - used, "megabytes": 12 * lu.nnz / 2**20},
    }


def reduction(preset: str, out: Path) -> Record:
    """Cost of a preset's reduction, step by step, and the truncation error it expects of itself."""
    found, fidelity = case(), nvh.fidelity.PRESETS[preset]
    size = required_element_size(found.band.high, found.air, fidelity.acoustics)
    times: list[float] = []
    reduced = reduce_housing(
        found.housing,
        f_max=found.band.high,
        surface_size=size,
        fidelity=fidelity.housing,
        progress=lambda done, total: times.append(time.perf_counter()),
    )
    megabytes = peak()
    mesh = mesh_casting(found.housing, fidelity.housing)
    held = np.unique(np.concatenate([*mesh.bolts, *mesh.seats]))
    return {
        "unknowns": 3 * (len(mesh.nodes) - len(held)) + 6 * len(mesh.seats),
        "modes": len(reduced.natural_frequency),
        "ratio": fidelity.housing.mode_ratio,
        "faces": reduced.normal_shapes.shape[1],
        "steps": np.diff(times).tolist(),
        "megabytes": megabytes,
        "skin": stated_error(reduced),
        "lines": lines_per_second(reduced, found.band.high),
    }


def stated_error(reduced: ReducedHousing) -> float:
    """Truncation error of the faces (RMS over three octaves) that a housing states, relative."""
    level = reduced.accuracy.truncation_error_db
    assert level is not None
    return float(10 ** (level / 20) - 1)


def lines_per_second(reduced: ReducedHousing, f_max: float) -> float:
    """Lines of face displacement per second, 4000 of them at once."""
    frequency = np.linspace(50.0, f_max, 4000)
    force = np.random.default_rng(1).standard_normal((4000, 3 * len(reduced.names))) + 0j
    face_displacement(reduced, frequency[:10], force[:10])
    start = time.perf_counter()
    face_displacement(reduced, frequency, force)
    return 4000 / (time.perf_counter() - start)


def on_error_mesh() -> tuple[HousingMesh, Casting, Surface, sp.csr_matrix, float]:
    """A coarse mesh, its casting, a radiating surface, the map onto it, and the upper band limit (Hz)."""
    mesh, casting = meshed(ERROR_SIZE)
    surface = radiating_surface(casting, 0.03)
    motion = normal_motion(mesh.nodes, mesh.skin, surface, mounting_plane_faces(surface), 6.0)
    return mesh, casting, surface, motion, case().band.high


def modes_to(ratio: float) -> HousingFidelity:
    """Fidelity with natural modes to a multiple of the band, with frequencies as the elements have them."""
    return HousingFidelity(element_size=ERROR_SIZE, mode_ratio=ratio, corrected_frequencies=False)


def unit_forces(seats: int, f_max: float) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """60 lines (Hz) of the band's upper three octaves; each as often as there are unit forces, and these forces."""
    lines = f_max * (1 / 8 + 7 / 8 * (np.arange(60) + 0.5) / 60)
    return lines, np.repeat(lines, 3 * seats), np.tile(np.eye(3 * seats, dtype=complex), (len(lines), 1))


def truncation(out: Path) -> Record:
    """Estimated and true error against the number of modes, on a coarse mesh; the truth has modes to 2.5 f_max."""
    mesh, casting, surface, motion, f_max = on_error_mesh()
    rich = reduce_mesh(mesh, casting, surface, lambda: motion, f_max, modes_to(2.5))
    _, frequency, force = unit_forces(len(rich.names), f_max)
    rows = []
    exact = frequency[:, None] * face_displacement(rich, frequency, force)
    weight = surface.areas
    for ratio in (1.0, 1.1, 1.25, 1.4, 1.6):
        few = reduce_mesh(mesh, casting, surface, lambda: motion, f_max, modes_to(ratio))
        got = frequency[:, None] * face_displacement(few, frequency, force)
        modes = f"{few.mode_count} + {few.ritz_vectors or 0}"
        rows.append([ratio, modes, relative(got, exact, weight), stated_error(few)])
    return {"rows": rows}


def exchange(out: Path) -> Record:
    """Error of Craig–Bampton matrices against the same truth, with structural damping on both sides."""
    mesh, casting, surface, motion, f_max = on_error_mesh()
    rich = reduce_mesh(mesh, casting, surface, lambda: motion, f_max, modes_to(2.5))
    lines, frequency, force = unit_forces(len(rich.names), f_max)
    K, M, T = held_matrices(mesh, casting)
    to_faces = sp.csr_matrix(motion @ T)
    matrices = craig_bampton(K, M, to_faces, 2.5 * f_max, names=rich.names, positions=rich.positions)
    exact = frequency[:, None] * face_displacement(rich, frequency, force, structural=True)
    rows = []
    for ratio in (1.25, 1.6, 2.5):
        keep = int((matrices.interface_frequency < ratio * f_max).sum())
        got = frequency[:, None] * exchange_displacement(matrices, keep, lines, 2 * float(rich.modal_damping[0]))
        rows.append([ratio, keep, relative(got, exact, surface.areas)])
    return {"rows": rows}


def relative(got: ComplexArray, exact: ComplexArray, weight: FloatArray) -> float:
    """RMS of a difference over that of the exact values, faces weighted."""
    return float(np.sqrt((np.abs(got - exact) ** 2 * weight).sum() / (np.abs(exact) ** 2 * weight).sum()))


def exchange_displacement(model: CraigBampton, keep: int, lines: FloatArray, loss: float) -> ComplexArray:
    """Displacement (n_line · 3 n_seat, n_face) m of the faces under unit seat forces, by the lowest `keep` modes."""
    count = model.seats.stop + keep
    K, M, motion = model.stiffness[:count, :count], model.mass[:count, :count], model.motion[:, :count]
    load = np.zeros((count, 3 * len(model.names)))
    at = np.concatenate([6 * seat + np.arange(3) for seat in range(len(model.names))])
    load[at, np.arange(len(at))] = 1.0
    return np.concatenate(
        [(motion @ np.linalg.solve((1 + 1j * loss) * K - (2 * np.pi * f) ** 2 * M, load)).T for f in lines]
    )


def damping(out: Path) -> Record:
    """What the kind of damping changes in the level of the surface, dB: kind, largest and RMS difference over lines."""
    mesh, casting, surface, motion, f_max = on_error_mesh()
    housing = reduce_mesh(mesh, casting, surface, lambda: motion, f_max, modes_to(1.25))
    count, lines = 3 * len(housing.names), np.linspace(50.0, f_max, 1000)
    curve = DampingCurve((500.0, f_max), (0.01, 0.03))
    by_mode = housing.replace(modal_damping=curve.at(housing.natural_frequency))

    def level(of: ReducedHousing, **how: Any) -> FloatArray:
        frequency, force = np.repeat(lines, count), np.tile(np.eye(count, dtype=complex), (len(lines), 1))
        squares = (np.abs(face_displacement(of, frequency, force, **how)) ** 2) @ surface.areas
        return np.asarray(10 * np.log10(squares.reshape(len(lines), count).sum(axis=1)))

    pairs = {
        "loss factor 2ζ instead of ζ, ζ = 2 %": (level(housing, structural=True), level(housing)),
        "ζ from 1 to 3 % over the band, read at modes instead of lines": (
            level(by_mode),
            level(housing, damping=curve),
        ),
    }
    rows = []
    for name, (one, other) in pairs.items():
        rows.append([name, float(np.abs(one - other).max()), float(np.sqrt(((one - other) ** 2).mean()))])
    return {"rows": rows}


MEASUREMENTS: dict[str, Callable[[Path], Record | None]] = {
    "draft": partial(reduction, "draft"),
    "standard": partial(reduction, "standard"),
    "frequencies": frequencies,
    "peer": partial(peer, size=TARGET_SIZE),
    "superlu": superlu,
    "default_order": default_order,
    "truncation": truncation,
    "exchange": exchange,
    "damping": damping,
}


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    names = sys.argv[2:] or list(MEASUREMENTS)
    if names[0] == "--measure":
        (out / f"{names[1]}.json").write_text(json.dumps(MEASUREMENTS[names[1]](out)))
        return
    for name in names:
        if not (out / f"{name}.json").exists():
            subprocess.run(
                [sys.executable, "-m", "benchmarks.housing.housing", str(out), "--measure", name], check=True
            )
    records = {name: json.loads(path.read_text()) for name in MEASUREMENTS if (path := out / f"{name}.json").exists()}
    publish("housing/housing", "\n".join(tables(records)).rstrip() + "\n")


if __name__ == "__main__":
    main()
