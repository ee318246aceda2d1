"""Errors of the cheaper radiation levels and of coarser surfaces, time of stored operators.

    python -m benchmarks radiation OUT [levels operators]

Every part leaves OUT/<part>.json; docs/measured/acoustics/radiation.md and radiation.png contain the existing ones. The
bodies are a sphere with exact solutions (v_n = P_n(cos θ)), a box and the housing of cases/gearbox. The box carries
bending waves of random direction and phase on its walls. Unit forces at each bearing and axis excite the housing. A
level error is that of the mean square pressure over the points and excitations. The scatter is the standard deviation
of single points and excitations.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import spherical_jn, spherical_yn

import nvhchain as nvh
from benchmarks.publish import MEASURED, publish
from nvhchain import acoustics, housing
from nvhchain.conventions import Air
from nvhchain.files import hdf5
from nvhchain.handoff import ForceSpectrum, ReducedHousing, Surface, SurfaceVelocity
from nvhchain.testing import bodies

ROOT = Path(__file__).parents[2]
AIR = Air()
FINE = replace(nvh.STANDARD.acoustics, coarsest_elements_per_wavelength=1.0)
RADIUS = 1.0
"""Radius (m) of the array of 40 points about the body."""

LINES = 16
"""Frequencies at which the levels are compared."""

MASTERS = 10
"""Equally spaced masters of the comparison of surfaces."""

RNG_SEED = 11

LEVELS = {"rayleigh": "Rayleigh integral", "equivalent": "equivalent radiated power"}


def processor_time() -> float:
    """Return processor seconds of this process and its children; other programs do not count."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def decibel(ratio: Any) -> Any:
    """Return a power ratio in dB."""
    return 10 * np.log10(ratio)


def gearbox(out: Path, fidelity: nvh.Fidelity) -> ReducedHousing:
    """Return the reduced housing of a preset, built once."""
    path = out / f"housing-{fidelity.name}.h5"
    if not path.exists():
        case = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
        size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
        reduced = housing.reduce_housing(
            case.housing, surface_size=size, f_max=case.band.high, fidelity=fidelity.housing
        )
        hdf5.save(reduced, path)
    return hdf5.load(path, ReducedHousing)


def unit_forces(reduced: ReducedHousing, frequency: np.ndarray) -> list[SurfaceVelocity]:
    """Return the responses to a unit force at each bearing and axis."""
    count = len(reduced.names)
    cases = []
    for bearing in range(count):
        for axis in range(3):
            force = np.zeros((len(frequency), count, 3))
            force[:, bearing, axis] = 1.0
            cases.append(housing.respond(reduced, ForceSpectrum(frequency, force, reduced.names)))
    return cases


def bending_waves(surface: Surface, frequency: np.ndarray, cases: int = 12) -> list[SurfaceVelocity]:
    """Return bending waves of a 6 mm aluminium plate on every flat wall, of random direction, phase and amplitude."""
    rng = np.random.default_rng(RNG_SEED)
    stiffness = 70e9 * 0.006**3 / (12 * (1 - 0.33**2))
    k = np.sqrt(2 * np.pi * frequency) * (2700 * 0.006 / stiffness) ** 0.25
    walls = np.rint(surface.normals).astype(int)
    result = []
    for _ in range(cases):
        velocity = np.zeros((len(frequency), len(surface.triangles)), dtype=complex)
        for wall in np.unique(walls, axis=0):
            mine = (walls == wall).all(axis=1)
            across = rng.normal(size=(6, 3))
            across -= (across @ wall)[:, None] * wall
            across /= np.linalg.norm(across, axis=1, keepdims=True)
            amplitude = rng.normal(size=(6, 2)) @ [1, 1j]
            phase = np.einsum("fj,wj->fw", surface.centroids[mine], across)
            velocity[:, mine] = np.exp(1j * k[:, None, None] * phase) @ amplitude
        result.append(SurfaceVelocity(frequency, velocity, surface))
    return result


def sphere_modes(surface: Surface, frequency: np.ndarray) -> list[SurfaceVelocity]:
    """Return velocities of a sphere in the shapes P_0, P_1, P_2 (cos θ)."""
    cosine = surface.centroids[:, 2] / np.linalg.norm(surface.centroids, axis=1)
    shapes = [np.ones_like(cosine), cosine, 0.5 * (3 * cosine**2 - 1)]
    return [SurfaceVelocity(frequency, np.tile(shape, (len(frequency), 1)), surface) for shape in shapes]


def sphere_field(points: np.ndarray, frequency: np.ndarray, radius: float) -> np.ndarray:
    """Return the exact pressure (n_case, n_f, n_point) of `sphere_modes`."""
    r = np.linalg.norm(points, axis=1)
    cosine = points[:, 2] / r
    shapes = [np.ones_like(cosine), cosine, 0.5 * (3 * cosine**2 - 1)]
    k = 2 * np.pi * frequency[:, None] / AIR.speed_of_sound

    def hankel(n: int, x: np.ndarray, derivative: bool = False) -> np.ndarray:
        return spherical_jn(n, x, derivative) - 1j * spherical_yn(n, x, derivative)

    return np.array(
        [-1j * AIR.impedance * hankel(n, k * r) / hankel(n, k * radius, True) * s for n, s in enumerate(shapes)]
    )


def applied(vectors: np.ndarray, velocities: list[SurfaceVelocity]) -> np.ndarray:
    """Return the pressure (n_case, n_f, n_point) of velocities."""
    return np.array([np.einsum("fpn,fn->fp", vectors, v.normal_velocity) for v in velocities])


def errors(pressure: np.ndarray, true: np.ndarray) -> dict[str, list[float]]:
    """Return the level error of the mean square and the scatter of single levels, per frequency, dB."""
    energy, right = np.abs(pressure) ** 2, np.abs(true) ** 2
    # every excitation has the same weight
    weight = 1.0 / right.mean(axis=2, keepdims=True)
    mean = decibel((energy * weight).mean(axis=(0, 2)) / (right * weight).mean(axis=(0, 2)))
    single = decibel(energy / right)
    return {"mean": mean.tolist(), "scatter": single.std(axis=(0, 2)).tolist()}


def levels(out: Path) -> dict[str, Any]:
    """Compare Rayleigh integral and equivalent radiated power with boundary elements or, for the sphere, exactly."""
    result: dict[str, Any] = {}
    ball = acoustics.sphere(0.1, 4)
    box = bodies.box((0.3, 0.24, 0.18), 0.02)
    reduced = gearbox(out, nvh.DRAFT)  # sufficient for errors of decibels
    frequency = np.geomspace(60.0, 5000.0, LINES)
    for name, surface, excite in (
        ("sphere", ball, sphere_modes),
        ("box", box, bending_waves),
        ("gearbox", reduced.surface, lambda _, f: unit_forces(reduced, f)),
    ):
        middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
        points = acoustics.array_points(RADIUS, middle)
        velocities = excite(surface, frequency)
        start = processor_time()
        if name == "sphere":
            true, seconds = sphere_field(points, frequency, 0.1), 0.0
        else:
            exact = acoustics.transfer_vectors(surface, points, frequency, air=AIR, fidelity=FINE)
            seconds = processor_time() - start
            true = applied(exact.vectors, velocities)
        start = processor_time()
        knobs = replace(FINE, radiation="rayleigh")
        rayleigh = acoustics.transfer_vectors(surface, points, frequency, air=AIR, fidelity=knobs)
        quick = processor_time() - start
        start = processor_time()
        equivalent = np.array([acoustics.equivalent_pressure(v, points, AIR).pressure for v in velocities])
        quickest = (processor_time() - start) / len(velocities)
        result[name] = {
            "frequency": frequency.tolist(),
            "faces": len(surface.triangles),
            "half_size": float(0.5 * np.linalg.norm(np.ptp(surface.vertices, axis=0)) / np.sqrt(3)),
            "seconds": {"boundary elements": seconds, "rayleigh": quick, "equivalent": quickest},
            "rayleigh": errors(applied(rayleigh.vectors, velocities), true),
            "equivalent": errors(equivalent, true),
        }
    return result


def operators(out: Path) -> dict[str, Any]:
    """Measure the pressure of 4000 lines at 10 points from modal transfer vectors, and a run-up of 20 s."""
    reduced = gearbox(out, nvh.DRAFT)
    surface = reduced.surface
    points = acoustics.array_points(RADIUS, surface.centroids.mean(axis=0))[:10]
    masters = np.linspace(0.0, 5000.0, 33)
    quick = replace(FINE, radiation="rayleigh")  # the time does not depend on the vectors
    atv = acoustics.transfer_vectors(surface, points, masters, air=AIR, fidelity=quick)
    lines = np.arange(1, 4001) * 1.25
    modal = acoustics.modal_transfer_vectors(atv, reduced, lines, fidelity=quick)
    rng = np.random.default_rng(RNG_SEED)
    shape = (len(lines), len(reduced.names), 3)
    load = ForceSpectrum(lines, rng.normal(size=shape) + 1j * rng.normal(size=shape), reduced.names)
    some = slice(None, None, 250)
    part = ForceSpectrum(lines[some], load.force[some], reduced.names)
    long_way = acoustics.radiate(atv, housing.respond(reduced, part), fidelity=quick).pressure
    functions = acoustics.noise_transfer_functions(modal, reduced)
    result: dict[str, Any] = {"modes": len(reduced.natural_frequency)}
    for name, call in (
        ("modal", lambda: acoustics.modal_pressure(modal, reduced, load)),
        ("bearing", lambda: acoustics.transfer_pressure(functions, load)),
    ):
        seconds = []
        for _ in range(5):
            start = time.perf_counter()
            pressure = call().pressure
            seconds.append(time.perf_counter() - start)
        error = float(np.abs(pressure[some] - long_way).max() / np.abs(long_way).max())
        result[name] = {"seconds": min(seconds), "error": error}
    start = time.perf_counter()
    float(modal.modes.view(float).sum())
    result["read"] = time.perf_counter() - start

    rate, duration = 25_000.0, 20.0
    wanted = acoustics.convolution_lines(rate, 5000.0, 0.2)
    responses = acoustics.noise_transfer_functions(
        acoustics.modal_transfer_vectors(atv, reduced, wanted, fidelity=quick), reduced
    )
    clock = np.arange(int(rate * duration)) / rate
    sweep = np.sin(np.pi * (100.0 + 2400.0 * clock / duration) * clock)
    forces = nvh.handoff.BearingForces(
        clock, sweep[:, None, None] * rng.normal(size=(1, len(reduced.names), 3)), reduced.names, reduced.positions, 0.0
    )
    start = time.perf_counter()
    acoustics.run_up_pressure(responses, forces)
    result["run_up"] = time.perf_counter() - start
    return result


def picture(data: dict[str, Any], path: Path) -> None:
    """Plot the level error over frequency times size."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharex=True, layout="constrained")
    for ax, (level, title) in zip(axes, LEVELS.items(), strict=True):
        for name, body in data.items():
            ka = 2 * np.pi * np.array(body["frequency"]) / AIR.speed_of_sound * body["half_size"]
            mean, scatter = (np.array(body[level][key]) for key in ("mean", "scatter"))
            line = ax.semilogx(ka, mean, marker=".", label=name)[0]
            ax.fill_between(ka, mean - scatter, mean + scatter, color=line.get_color(), alpha=0.15, lw=0)
        ax.axhline(0.0, color="black", lw=0.8)
        ax.set(title=title, xlabel="wavenumber × half size of the body")
        ax.grid(alpha=0.3)
        ax.set_ylim(-15, 30)
    axes[0].set_ylabel("level error / dB (band: scatter)")
    axes[0].legend()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def band(body: dict[str, Any], level: str, key: str, low: float, high: float) -> float:
    """Return the mean over the frequencies with low ≤ ka < high."""
    ka = 2 * np.pi * np.array(body["frequency"]) / AIR.speed_of_sound * body["half_size"]
    chosen = (ka >= low) & (ka < high)
    return float(np.mean(np.array(body[level][key])[chosen])) if chosen.any() else float("nan")


def report(out: Path) -> str:
    """Return the tables of all measured parts."""
    parts = {name: json.loads((out / f"{name}.json").read_text()) for name in PARTS if (out / f"{name}.json").exists()}
    lines: list[str] = []
    if "levels" in parts:
        edges = (0.0, 0.5, 1.0, 2.0, 4.0, 100.0)
        lines += [
            "Cheaper levels, mean error ± scatter in dB, over wavenumber × half size of the body (ka);",
            "processor time:", "",
            f"| level | body | ka < 0.5 | 0.5 … 1 | 1 … 2 | 2 … 4 | > 4 | s for {LINES} lines | exactly, s |",
            "|---|---|---:|---:|---:|---:|---:|---:|---:|",
        ]  # fmt: skip
        for level, title in LEVELS.items():
            for name, body in parts["levels"].items():
                cells = []
                for low, high in pairwise(edges):
                    mean, scatter = (band(body, level, key, low, high) for key in ("mean", "scatter"))
                    cells.append(f"{mean:+.1f} ± {scatter:.1f}" if np.isfinite(mean) else "")
                seconds, full = body["seconds"][level], body["seconds"]["boundary elements"]
                quick = f"{seconds:.2g}" if seconds >= 0.01 else "< 0.01"
                lines.append(
                    f"| {title} | {name} | {' | '.join(cells)} | {quick} | {f'{full:.0f}' if full else 'exact'} |"
                )
        lines += ["", "![level error over frequency](radiation.png)", ""]
    if "operators" in parts:
        data = parts["operators"]
        lines += [
            f"Stored operators, 4000 lines × 10 points, {data['modes']} modes and 18 bearing forces:", "",
            "| pressure from | s | error against response and radiation |", "|---|---:|---:|",
            f"| modal transfer vectors | {data['modal']['seconds']:.3f} | {data['modal']['error']:.0e} |",
            f"| noise transfer functions | {data['bearing']['seconds']:.3f} | {data['bearing']['error']:.0e} |",
            f"| reading the modal transfer vectors once (the limit) | {data['read']:.3f} | |",
            f"| run-up of 20 s at 25 kHz, 10 points, in time | {data['run_up']:.1f} | |", "",
        ]  # fmt: skip
    if "levels" in parts:
        picture(parts["levels"], MEASURED / "acoustics" / "radiation.png")
    return "\n".join(lines)


PARTS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "levels": levels,
    "operators": operators,
}


def main() -> None:
    """Measure the requested parts and publish the page."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[2:] or PARTS:
        (out / f"{name}.json").write_text(json.dumps(PARTS[name](out), indent=1))
    publish("acoustics/radiation", report(out))


if __name__ == "__main__":
    main()
