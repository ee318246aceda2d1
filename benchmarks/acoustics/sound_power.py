"""Errors of sound power and cost of the radiation resistance.

    python -m benchmarks sound_power OUT [power cancellation resistance]

`power` compares with closed forms, `cancellation` uses motions whose parts cancel. Every part leaves OUT/<part>.json;
docs/measured/acoustics/sound_power.md contains the existing ones.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import spherical_jn, spherical_yn

import nvhchain as nvh
from benchmarks.acoustics.radiation import AIR, RNG_SEED, bodies, decibel, gearbox, processor_time, sphere_modes
from benchmarks.publish import publish
from nvhchain import acoustics, housing
from nvhchain.acoustics.accuracy.cancellation import CANCELLATION
from nvhchain.acoustics.surfaces._gmsh import remesh
from nvhchain.acoustics.surfaces.surface import SHARP_ANGLE, mean_edge, width_to_length
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.acoustics.systems.engines import FUSED, check_memory, systems
from nvhchain.acoustics.waves.multipoles import multipole_amplitudes
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ForceSpectrum, Surface, SurfaceVelocity

MASTERS = (12, 17, 24)
"""Masters of radiation resistance between 50 and 4000 Hz."""

LINES = 12
"""Number of lines whose sound power is solved one by one for comparison."""


def power(_: Path) -> dict[str, Any]:
    """Measure sound power by surface and by array: spheres and a moving cube in free field, a monopole at a plane.

    The cube's added mass is 0.638 of the displaced mass, converged (tests/acoustics/test_power.py).
    """
    fidelity = AcousticsFidelity(elements_per_wavelength=3.0, masters=20)
    result: dict[str, Any] = {}

    def error(velocity: SurfaceVelocity, exact: np.ndarray, **how: Any) -> float:
        got = acoustics.sound_power(velocity, air=AIR, fidelity=fidelity, **how)
        return float(np.abs(decibel(got.power / exact)).max())

    ball, low = acoustics.sphere(0.1, 3), np.array([1.0, 5.0, 20.0, 50.0, 100.0, 300.0, 1000.0])
    ka = 2 * np.pi * low * 0.1 / AIR.speed_of_sound
    names = ("pulsating sphere", "oscillating sphere (dipole)", "sphere, quadrupole")
    for n, (name, velocity) in enumerate(zip(names, sphere_modes(ball, low), strict=True)):
        slope = spherical_jn(n, ka, True) - 1j * spherical_yn(n, ka, True)
        exact = 0.5 * AIR.impedance * 4 * np.pi * 0.1**2 / (2 * n + 1) / np.abs(ka * slope) ** 2
        result[f"{name}, 1 … 1000 Hz, surface"] = error(velocity, exact)
    cube = bodies.box((0.4, 0.4, 0.4), 0.05)
    moving = SurfaceVelocity(low[:3], np.tile(cube.normals[:, 0], (3, 1)), cube)
    omega = 2 * np.pi * low[:3]
    dipole = omega * AIR.density * 0.4**3 * 1.638
    exact = (omega / AIR.speed_of_sound * dipole) ** 2 / (24 * np.pi * AIR.impedance)
    result["cube moving to and fro, 1 … 20 Hz, surface"] = error(moving, exact)

    def pulsating(body: Surface, frequency: np.ndarray) -> SurfaceVelocity:
        return SurfaceVelocity(frequency, np.ones((len(frequency), len(body.triangles))), body)

    frequency = np.array([200.0, 1000.0, 1715.0])
    ka = 2 * np.pi * frequency * 0.1 / AIR.speed_of_sound
    exact = 0.5 * AIR.impedance * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2)
    for standard in ("ISO 3744", "ISO 3745"):
        result[f"pulsating sphere, 200 … 1715 Hz, {standard}"] = error(
            pulsating(ball, frequency), exact, array_radius=2.0, array_standard=standard
        )
    plane = acoustics.RigidPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    frequency = np.array([100.0, 300.0])
    k = 2 * np.pi * frequency / AIR.speed_of_sound
    for height in (0.0202, 0.2):
        exact = (1 + np.sinc(2 * k * height / np.pi)) * AIR.impedance * k**2 * (4 * np.pi * 0.02**2) ** 2 / (8 * np.pi)
        where = "on" if height < 0.1 else "0.2 m above"
        for name, array in (("surface", None), ("ISO 3744", 2.0)):
            small = pulsating(acoustics.sphere(0.02, 3, (0, 0, height)), frequency)
            result[f"monopole {where} a rigid plane, {name}"] = error(small, exact, plane=plane, array_radius=array)
    return result


def cancellation(_: Path) -> dict[str, Any]:
    """Measure the thrust of rotating bodies due to their mesh alone, over S p times h²/(a²w).

    CANCELLATION bounds this value. Box, cube and ellipsoids turn about an axis of symmetry, about which a true body has
    no thrust. S is the area, p the root mean square pressure, h the mean edge, a half of the diagonal and w width over
    length.
    """
    fidelity, k = AcousticsFidelity(elements_per_wavelength=3.0, masters=20), 0.4
    ball = acoustics.sphere(0.1, 4)
    whole = {
        "box 0.3 × 0.2 × 0.12 m": bodies.box((0.3, 0.2, 0.12), 0.01),
        "cube 0.2 m": bodies.box((0.2, 0.2, 0.2), 0.0125),
        "ellipsoid 1 : 0.7 : 0.5": Surface(ball.vertices * [1.0, 0.7, 0.5], ball.triangles),
        "ellipsoid 1 : 1 : 0.5": Surface(ball.vertices * [1.0, 1.0, 0.5], ball.triangles),
    }
    rows: dict[str, Any] = {}
    for name, fine in whole.items():
        for ratio in (4.0, 3.0, 2.0):
            body = Surface(*remesh(fine.vertices, fine.triangles, ratio * mean_edge(fine), SHARP_ANGLE))
            shapes = np.cross(np.eye(3)[:, None], body.centroids[None])
            moving = velocity_within_faces(body) @ np.einsum("afx,fx->fa", shapes, body.normals)
            gradient = -1j * k * AIR.impedance * moving
            ((system,),) = systems(FUSED, body, np.array([k]), fidelity, None, check_memory(body, 1, 0, 0, FUSED))
            pressure = system.solve(system.apply_b(gradient))
            waves = multipole_amplitudes(body, k, pressure, gradient, 1)[1:]
            thrust = np.sqrt(12 * np.pi * (np.abs(waves) ** 2).sum(axis=0)) / k
            on_faces = pressure[body.triangles].mean(axis=1)
            pushed = np.sqrt(body.areas.sum() * (body.areas @ np.abs(on_faces) ** 2))
            half = 0.5 * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
            slender = width_to_length(body.centroids, body.areas[:, None] / body.areas.sum())
            share = thrust / pushed * (half / mean_edge(body)) ** 2 * slender
            moves = np.abs(gradient).max(axis=0) > 0.05 * np.abs(gradient).max()
            if name.startswith("ellipsoid 1 : 1"):
                moves[2] = False  # about its own axis, only the facets move the air
            rows.setdefault(name, []).append([len(body.triangles), [float(x) for x in share[moves]]])
    return rows


def resistance(out: Path) -> dict[str, Any]:
    """Measure the radiation resistance of the gearbox at draft: construction, 4000 lines of power, error."""
    reduced, knobs = gearbox(out, nvh.DRAFT), nvh.DRAFT.acoustics
    lines = np.linspace(50.0, 4000.0, 4000)
    shapes = acoustics.housing_shapes(reduced)
    rng = np.random.default_rng(RNG_SEED)
    load = ForceSpectrum(lines, rng.normal(size=(4000, len(reduced.names), 3)), reduced.names)
    some = np.linspace(3, 3996, LINES).astype(int)
    part = ForceSpectrum(lines[some], load.force[some], reduced.names)
    start = processor_time()
    exact = acoustics.sound_power(housing.respond(reduced, part), air=AIR, fidelity=knobs).power
    result: dict[str, Any] = {"line": (processor_time() - start) / LINES, "rows": {}}
    for masters in MASTERS:
        start = processor_time()
        found = acoustics.radiation_resistance(shapes, np.linspace(50.0, 4000.0, masters), air=AIR, fidelity=knobs)
        built = processor_time() - start
        start, wall = processor_time(), time.perf_counter()
        power = acoustics.modal_power(found, reduced, load, fidelity=knobs)
        result["columns"] = found.waves.shape[2]
        result["rows"][str(masters)] = {
            "built": built,
            "power": processor_time() - start,
            "wall": time.perf_counter() - wall,
            "error": float(np.abs(decibel(power.power[some] / exact)).max()),
            "estimate": power.accuracy.interpolation_error_db,
            "size": found.waves.nbytes / 2**20,
        }
    return result


def report(out: Path) -> str:
    """Return the tables of all measured parts."""
    parts = {name: json.loads((out / f"{name}.json").read_text()) for name in PARTS if (out / f"{name}.json").exists()}
    lines: list[str] = []
    if "power" in parts:
        lines += ["| sound power | largest error / dB |", "|---|---:|"]
        lines += [f"| {name} | {value:.3f} |" for name, value in parts["power"].items()]
        lines.append("")
    if "cancellation" in parts:
        lines += [
            "Thrust that the mesh leaves to rotating bodies, over area times root mean square pressure times h²/(a²w)",
            "(h mean edge, a half of the diagonal, w width over length), for each axis; `cancellation_error_db` rests "
            f"on {CANCELLATION:g}:",
            "",
            "| body | triangles | thrust |",
            "|---|---:|---|",
        ]
        for name, cells in parts["cancellation"].items():
            lines += [f"| {name} | {faces} | {', '.join(f'{x:.2g}' for x in share)} |" for faces, share in cells]
        lines.append("")
    if "resistance" in parts:
        data = parts["resistance"]
        lines += [
            "Sound power of 4000 lines, 50 … 4000 Hz, from the radiation resistance of the gearbox at draft in",
            f"{data['columns']} modal coordinates, against {LINES} lines solved one by one",
            f"({data['line']:.1f} s each); processor time:",
            "",
            "| masters | built, s | MB | 4000 lines, s | error / dB | estimated / dB |",
            "|---:|---:|---:|---:|---:|---:|",
        ]
        for name, row in data["rows"].items():
            seconds = f"{row['built']:.0f} | {row['size']:.0f} | {row['power']:.1f}"
            lines.append(f"| {name} | {seconds} | {row['error']:.4f} | {row['estimate']:.4f} |")
        lines.append("")
    return "\n".join(lines)


PARTS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "power": power,
    "cancellation": cancellation,
    "resistance": resistance,
}


def main() -> None:
    """Measure the requested parts and publish the page."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", AccuracyWarning)  # stated errors are the subject here
    for name in sys.argv[2:] or PARTS:
        (out / f"{name}.json").write_text(json.dumps(PARTS[name](out), indent=1))
    publish("acoustics/sound_power", report(out))


if __name__ == "__main__":
    main()
