"""Errors of sound power and cost of the radiation resistance.

    python -m benchmarks sound_power OUT [power cancellation coarser mapped resistance]

`power` compares with closed forms, `cancellation` takes motions whose parts cancel, `coarser` and `mapped` other
surfaces. Every part leaves OUT/<part>.json; docs/measured/acoustics/sound_power.md is written from those that are
there.
"""

from __future__ import annotations

import itertools
import json
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import spherical_jn, spherical_yn

import nvhchain as nvh
from benchmarks.acoustics.radiation import AIR, RNG_SEED, bodies, decibel, gearbox, processor_time, sphere_modes
from benchmarks.publish import publish
from nvhchain import acoustics, housing
from nvhchain.acoustics.accuracy.cancellation import CANCELLATION
from nvhchain.acoustics.surfaces.coarsening import coarsen, velocity_map
from nvhchain.acoustics.surfaces.surface import mean_edge, width_to_length
from nvhchain.acoustics.surfaces.velocity_in_faces import within_faces
from nvhchain.acoustics.systems.engines import check_memory, systems
from nvhchain.acoustics.waves.multipoles import multipole_amplitudes
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ForceSpectrum, Surface, SurfaceVelocity

MASTERS = (12, 17, 24)
"""Masters of radiation resistance between 50 and 4000 Hz."""

COARSE_LINES = np.array([50.0, 100.0, 200.0, 400.0, 600.0])
"""Hz; the last has six elements per wavelength on the surface with edges twice as long, of 50 mm."""

LINES = 12
"""Lines whose sound power is solved one by one to compare with."""


def power(_: Path) -> dict[str, Any]:
    """Sound power by surface and by array: spheres and a moving cube in free field, a monopole on and above a plane.

    cube: added mass 0.638 of the displaced, converged (tests/acoustics/test_power.py).
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
    """Thrust that rotating bodies have by their mesh alone, over S p times h²/(a²w): what CANCELLATION bounds.

    Box, cube and ellipsoids turn about an axis of symmetry, about which a true one has no thrust; S area, p root mean
    square pressure, h mean edge, a half of the diagonal, w width over length.
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
            body = coarsen(fine, ratio)
            shapes = np.cross(np.eye(3)[:, None], body.centroids[None])
            moving = within_faces(body) @ np.einsum("afx,fx->fa", shapes, body.normals)
            gradient = -1j * k * AIR.impedance * moving
            ((system,),) = systems("fused", body, np.array([k]), fidelity, None, check_memory(body, 1, 0, 0, "fused"))
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
                moves[2] = False  # about its own axis the facets alone move the air
            rows.setdefault(name, []).append([len(body.triangles), [float(x) for x in share[moves]]])
    return rows


def coarser(_: Path) -> dict[str, Any]:
    """Sound power of a box on a surface with edges twice as long, velocities mapped with all their flux, in dB over
    that on its own surface."""
    fidelity = AcousticsFidelity(elements_per_wavelength=3.0, masters=20)
    box = bodies.box((0.45, 0.35, 0.25), 0.025)
    rough = coarsen(box, 2.0)
    x, normal = box.centroids, box.normals
    lid = np.abs(normal[:, 2]) > 0.9
    motions = {
        "pulsating": np.ones(len(normal)),
        "moving to and fro": normal[:, 0],
        "rotating": np.einsum("fx,fx->f", np.cross([0.0, 0.0, 1.0], x), normal),
    }
    for waves in (1, 2, 3):
        motions[f"lid and bottom bend in {waves} × {waves} waves"] = np.where(
            lid, np.cos(2 * np.pi * waves * x[:, 0] / 0.45) * np.cos(2 * np.pi * waves * x[:, 1] / 0.35), 0.0
        )
    shapes = np.stack(list(motions.values()), axis=1)
    found = [
        acoustics.radiation_resistance(acoustics.SurfaceShapes(body, moved), COARSE_LINES, air=AIR, fidelity=fidelity)
        for body, moved in ((box, shapes), (rough, velocity_map(box, rough) @ shapes))
    ]
    fine, other = ((np.abs(one.waves) ** 2).sum(axis=1) for one in found)
    sizes = {"faces": [len(box.triangles), len(rough.triangles)]}
    return sizes | {"rows": {name: decibel(other[:, i] / fine[:, i]).tolist() for i, name in enumerate(motions)}}


def mapped(_: Path) -> list[list[Any]]:
    """What `radiate` states of motions on coarser surfaces, against the truth, both of the loudest pressure; of every
    body and ratio [body, ratio, triangles there, [[true, stated], …]].

    Truth: boundary elements on the body's own surface.  Walls bend in up to 4 × 3 half waves, one alone or two that
    face each other, the body moves to and fro, twists or shakes at random; at 30 points in the far field.
    """
    whole = {
        "housing 0.45 × 0.35 × 0.25 m": bodies.box((0.45, 0.35, 0.25), 0.025),
        "plate 0.4 × 0.3 × 0.05 m": bodies.box((0.4, 0.3, 0.05), 0.02),
        "cube 0.2 m": bodies.box((0.2, 0.2, 0.2), 0.0125),
        "L 0.2 × 0.2 × 0.1 m": bodies.box((0.2, 0.2, 0.1), 0.0125, remove=lambda c: c[0] > 0.1 and c[1] > 0.1),
    }
    rows = []
    for (name, body), ratio in itertools.product(whole.items(), (2.0, 3.0, 4.0)):
        half = 0.5 * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
        points, motions, pairs = bodies.shell(30, 3.0 * half), _wall_motions(body), []
        knobs = replace(nvh.STANDARD.acoustics, coarse_edge_ratios=(ratio,))
        for frequency in np.array([0.8, 1.5, 3.0]) * AIR.speed_of_sound / (2 * np.pi * half):
            atv = acoustics.transfer_vectors(body, points, [frequency], air=AIR, fidelity=knobs)
            if "coarse_bands" not in atv.provenance:
                continue
            own = acoustics.transfer_vectors(body, points, [frequency], air=AIR).vectors[0]
            for motion in motions:
                found = acoustics.radiate(atv, SurfaceVelocity([frequency], motion[None].astype(complex), body))
                exact = own @ motion
                told = found.provenance.get("cancellation_error_dB", 0.0)
                wrong = np.abs(found.pressure[0] - exact).max() / np.abs(exact).max()
                pairs.append([float(20 * np.log10(1 + wrong)), told + atv.provenance["coarse_error_dB"]])
        rows.append([name, ratio, len(coarsen(body, ratio).triangles), pairs])
    return rows


def _wall_motions(body: Surface) -> np.ndarray:
    size, normal = np.ptp(body.vertices, axis=0), body.normals
    x, y, _ = np.pi * ((body.centroids - body.vertices.min(axis=0)) / size).T
    lid = normal[:, 2] > 0.5
    along = np.outer(body.centroids[:, 0], [1.0, 0.0, 0.0])
    return np.array(
        [
            *(np.sin(m * x) * np.sin(n * y) * lid for m, n in ((1, 1), (2, 1), (2, 2), (3, 2))),
            *(np.cos(m * x) * np.cos(n * y) * normal[:, 2] for m, n in ((2, 2), (3, 3), (4, 3))),
            normal[:, 2],
            np.einsum("ij,ij->i", np.cross(along, body.centroids), normal),
            np.random.default_rng(RNG_SEED).standard_normal(len(normal)),
        ]
    )


def resistance(out: Path) -> dict[str, Any]:
    """Radiation resistance of the gearbox at draft: building it, 4000 lines of power, error against line by line."""
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
            "estimate": power.provenance["interpolation_error_dB"],
            "size": found.waves.nbytes / 2**20,
        }
    return result


def report(out: Path) -> str:
    """The tables of every part that has been measured."""
    parts = {name: json.loads((out / f"{name}.json").read_text()) for name in PARTS if (out / f"{name}.json").exists()}
    lines: list[str] = []
    if "power" in parts:
        lines += ["| sound power | largest error / dB |", "|---|---:|"]
        lines += [f"| {name} | {value:.3f} |" for name, value in parts["power"].items()]
        lines.append("")
    if "cancellation" in parts:
        lines += [
            "Thrust that the mesh leaves to rotating bodies, over area times root mean square pressure times h²/(a²w)",
            "(h mean edge, a half of the diagonal, w width over length), for each axis; `cancellation_error_dB` rests "
            f"on {CANCELLATION:g}:",
            "",
            "| body | triangles | thrust |",
            "|---|---:|---|",
        ]
        for name, cells in parts["cancellation"].items():
            lines += [f"| {name} | {faces} | {', '.join(f'{x:.2g}' for x in share)} |" for faces, share in cells]
        lines.append("")
    if "coarser" in parts:
        data = parts["coarser"]
        lines += [
            f"Sound power of a box of 0.45 × 0.35 × 0.25 m on a surface of {data['faces'][1]} triangles instead of",
            f"{data['faces'][0]}, velocities mapped with all their flux: dB too much. For that reason sound power and",
            "radiation resistance leave `coarse_edge_ratios` alone:",
            "",
            "| motion | " + " | ".join(f"{f:g} Hz" for f in COARSE_LINES) + " |",
            "|---|" + "---:|" * len(COARSE_LINES),
        ]
        for name, errors in data["rows"].items():
            lines.append(f"| {name} | " + " | ".join(f"{error:.2f}" for error in errors) + " |")
        lines.append("")
    if "mapped" in parts:
        lines += [
            "What `radiate` states on coarser surfaces (`coarse_error_dB` and `cancellation_error_dB` together),",
            "against the loudest pressure on the body's own surface, of motions that err by more than 0.3 dB; stated",
            "over true as amplitudes:",
            "",
            "| body | edge ratio | triangles | motions | true / dB | stated over true |",
            "|---|---:|---:|---:|---:|---:|",
        ]
        for name, ratio, faces, pairs in parts["mapped"]:
            wrong = np.array([pair for pair in pairs if pair[0] > 0.3]).reshape(-1, 2)
            cells = "| |"
            if len(wrong):
                over = np.divide(*(10 ** (wrong[:, ::-1].T / 20) - 1))
                cells = f"| {wrong[:, 0].min():.1f} … {wrong[:, 0].max():.1f} | {over.min():.2g} … {over.max():.2g} |"
            lines.append(f"| {name} | {ratio:g} | {faces} | {len(wrong)} of {len(pairs)} {cells}")
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
    "coarser": coarser,
    "mapped": mapped,
    "resistance": resistance,
}


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", AccuracyWarning)  # the stated errors are what is measured
    for name in sys.argv[2:] or PARTS:
        (out / f"{name}.json").write_text(json.dumps(PARTS[name](out), indent=1))
    publish("acoustics/sound_power", report(out))


if __name__ == "__main__":
    main()
