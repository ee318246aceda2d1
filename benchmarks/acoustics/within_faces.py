"""Error of the pressure with velocities constant on every face, and varying within it (`velocity_within_faces`).

    python -m benchmarks within_faces

Writes docs/measured/acoustics/within_faces.md. Every motion has two errors: with velocities constant on every face, and
with their loss restored, as in the program. Sources are inside bodies at 8 and 12 elements per mean edge, at least four
of them from the surface. The largest error of sixteen counts, relative to the peak at 900 points 1.3 to 5 half
diagonals away. The surface of the gearbox and bending plates are compared with the same mesh with every triangle
divided into sixteen. The run takes five minutes.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.acoustics import solve_direct, sphere, transfer_vectors
from nvhchain.acoustics.surfaces._gmsh import remesh
from nvhchain.acoustics.surfaces.clearance import winding_numbers
from nvhchain.acoustics.surfaces.surface import SHARP_ANGLE, mean_edge
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT
from nvhchain.case import GearboxCase
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import ComplexArray, FloatArray, Surface, SurfaceVelocity
from nvhchain.housing import Casting
from nvhchain.housing.casting.mesh import radiating_surface
from nvhchain.testing.bodies import box, capsule, cells, cylinder, quartered, shell, source_field, turned

CASE = Path(__file__).parents[2] / "cases" / "gearbox" / "solid.toml"
AIR = Air()
FIDELITY = replace(nvh.STANDARD.acoustics, elements_per_wavelength=1.0, coarsest_elements_per_wavelength=1.0)
PER_WAVELENGTH = (8, 12)
SOURCES, AWAY = 16, 4.0
"""Number of sources, and their smallest distance from the surface in mean edges."""
PER_BENDING_WAVE = (16, 12, 8, 6, 4)
PER_AIR_WAVE = (24, 12, 6)
BENDINGS = ((1, 1, 0.0), (2, 2, 0.0), (3, 3, 0.0), (3, 1, 0.5), (5, 0, 0.5))
"""Half waves along the sides of the plate, and phase in units of π from the rims to the loudest place."""
PLACES = {0.0: "rims", 0.5: "between"}
Motion = Callable[[FloatArray, FloatArray], ComplexArray]
"""Normal velocity at points with normals there."""


def lidded(below: float, above: float, rows: int, around: int) -> Surface:
    """Return a cylinder or frustum 1.1 m high with these radii (m) and this many rows of triangles on its wall."""
    lids = [[(radius * i / 5, z) for i in range(5)] for radius, z in ((below, -0.55), (above, 0.55))]
    wall = [(below + (above - below) * i / rows, 1.1 * i / rows - 0.55) for i in range(rows + 1)]
    return turned([*lids[0], *wall, *lids[1][::-1]], around)


def meshed(body: Surface, edge: float) -> Surface:
    """Return the same body as triangulated by gmsh."""
    return Surface(*remesh(body.vertices, body.triangles, edge, SHARP_ANGLE))


def bodies() -> dict[str, Surface]:
    """Return the bodies with sources inside by name."""
    cube = (1.0, 1.0, 1.0)
    bracket = box((2.0, 2.0, 1.0), 0.5, lambda centre: centre[0] > 1.0 and centre[1] > 1.0)
    return {
        "cube, 12 halved squares along an edge, diagonals to and fro": cells((12,) * 3, cube),
        "cube, 10, diagonals alike": cells((10,) * 3, cube, alike=True),
        "cube, 12, diagonals alike": cells((12,) * 3, cube, alike=True),
        "cube, halved rectangles 2 : 1 on four walls": cells((10, 20, 20), cube, alike=True),
        "cube, halved rectangles 3 : 1 on four walls": cells((8, 24, 24), cube, alike=True),
        "cube, halved rectangles 4 : 1 on four walls": cells((7, 28, 28), cube, alike=True),
        "cube, gmsh": meshed(cells((4, 4, 4), cube), 0.09),
        "bracket, gmsh": meshed(bracket, 0.09),
        "sphere": sphere(0.5, 3),
        "cylinder 1 m long": cylinder(0.5, 0.5, 32),
        "cylinder 0.8 m long": cylinder(0.5, 0.4, 36),
        "cylinder, triangles twice as wide as high": lidded(0.6, 0.6, 7, 42),
        "cylinder, three times": lidded(0.6, 0.6, 6, 56),
        "frustum, triangles twice as wide as high": lidded(0.7, 0.5, 7, 46),
        "frustum, three times": lidded(0.7, 0.5, 6, 56),
        "capsule": capsule(0.5, 0.5, 32),
    }


def plates() -> dict[str, Surface]:
    """Return the bending plates and blocks by name."""
    plate, block = cells((8, 8, 1), (0.3, 0.3, 0.01)), cells((8, 8, 4), (0.3, 0.3, 0.15))
    alike = cells((8, 8, 4), (0.3, 0.3, 0.15), alike=True)
    return {
        "plate of 10 mm, halved squares": plate,
        "plate of 10 mm, gmsh": meshed(plate, 0.0375),
        "block of 150 mm, halved squares": block,
        "the same, diagonals alike": alike,
        "the same, sixteen along a side": cells((16, 16, 8), (0.3, 0.3, 0.15), alike=True),
        "block of 150 mm, gmsh": meshed(block, 0.0375),
    }


def gearbox(edge: float) -> Surface:
    """Return the radiating surface of the gearbox of the examples."""
    case = nvh.load_case(CASE)
    assert isinstance(case, GearboxCase)
    assert isinstance(case.housing, Casting)
    return radiating_surface(case.housing, edge)


def means(surface: Surface, motion: Motion) -> ComplexArray:
    """Return the mean over every face of a normal velocity."""
    corners = surface.vertices[surface.triangles]
    rule = zip(RULE_BARYCENTRIC, RULE_WEIGHT, strict=True)
    return np.asarray(
        sum(weight * motion(np.einsum("i,fij->fj", at, corners), surface.normals) for at, weight in rule), dtype=complex
    )


class Heard:
    """Pressure of motions at points, constant on every face and varying within faces."""

    def __init__(self, surface: Surface, points: FloatArray, frequency: FloatArray) -> None:
        order = np.argsort(frequency)
        solved = transfer_vectors(surface, points, frequency[order], air=AIR, fidelity=FIDELITY).vectors
        self.surface, self.vectors = surface, solved[np.argsort(order)]
        self._constant = splu(velocity_within_faces(surface).tocsc())

    def pressures(self, at: int, velocity: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return both pressures at one of the frequencies."""
        constant = self._constant.solve(velocity.real) + 1j * self._constant.solve(velocity.imag)
        return self.vectors[at] @ constant, self.vectors[at] @ velocity


def sources(body: Surface) -> FloatArray:
    """Return at most (SOURCES, 3) m inside the body, `AWAY` from its surface."""
    within = np.random.default_rng(1).uniform(body.vertices.min(axis=0), body.vertices.max(axis=0), (40_000, 3))
    beside = np.concatenate([body.vertices, body.centroids])
    far = within[cKDTree(beside).query(within)[0] > AWAY * mean_edge(body)]
    found = far[winding_numbers(body.vertices[body.triangles], far) > 0.5][:SOURCES]
    assert len(found) > 0
    return found


def source_errors(body: Surface) -> FloatArray:
    """Return errors (2, n_frequency, 2) relative to the peak: velocities at face centroids and means over faces."""
    frequency = AIR.speed_of_sound / (np.array(PER_WAVELENGTH) * mean_edge(body))
    reach = 0.5 * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    points = np.concatenate([shell(300, away * reach, seed=seed) for seed, away in enumerate((1.3, 2.5, 5.0))])
    heard, worst = Heard(body, points, frequency), np.zeros((2, len(frequency), 2))
    for source in sources(body):
        for at, k in enumerate(2 * np.pi * frequency / AIR.speed_of_sound):
            exact = source_field(points, source, k)[0]

            def motion(x: FloatArray, n: FloatArray, k: float = k, source: FloatArray = source) -> ComplexArray:
                gradient = np.einsum("fj,fj->f", source_field(x, source, k)[1], n)
                return np.asarray(gradient / (-1j * k * AIR.impedance))

            for row, velocity in enumerate((motion(body.centroids, body.normals), means(body, motion))):
                found = [np.abs(p - exact).max() / np.abs(exact).max() for p in heard.pressures(at, velocity)]
                worst[row, at] = np.maximum(worst[row, at], found)
    return worst


def decibels(coarse: Heard, fine: Heard, at: int, motion: Motion) -> FloatArray:
    """Return the errors (2,) dB of the coarse mesh for means over its faces."""
    exact = fine.pressures(at, means(fine.surface, motion))[1]
    found = coarse.pressures(at, means(coarse.surface, motion))
    return np.array([20 * np.log10(1 + np.abs(p - exact).max() / np.abs(exact).max()) for p in found])


def waves(surface: Surface, per_wave: float, chance: np.random.Generator) -> Motion:
    """Return six waves of this many mean edges, in random directions along and across."""
    direction, amplitude = chance.normal(size=(2, 6, 3))
    direction *= 2 * np.pi / (per_wave * mean_edge(surface) * np.linalg.norm(direction, axis=1, keepdims=True))
    phase = chance.uniform(0.0, 2 * np.pi, 6)
    return lambda x, n: np.asarray(np.einsum("pw,wk,pk->p", np.cos(x @ direction.T + phase), amplitude, n) + 0j)


def bending(along: int, across: int, turned: float) -> Motion:
    """Return bending in half waves along both sides of the plate."""

    def motion(x: FloatArray, n: FloatArray) -> ComplexArray:
        u, v, _ = np.pi * (x.T / 0.3 + 0.5)
        start = turned * np.pi
        return np.asarray(np.cos(along * u - start) * np.cos(across * v - (across > 0) * start) * n[:, 2] + 0j)

    return motion


def cell(errors: FloatArray, digits: int = 2) -> str:
    """Return errors as text."""
    return ", ".join(f"{error:.{digits}f}" for error in errors)


def main() -> None:
    """Measure all motions and publish the page."""
    warnings.simplefilter("ignore", AccuracyWarning)  # stated errors are the subject here
    heads = [f"{n} per mean edge, {what}" for what in ("middles", "means") for n in PER_WAVELENGTH]
    lines = [
        "Errors with velocities constant on every face, and varying within faces. Sources inside bodies, % of the "
        "peak, velocities at the middles of the faces and means over them:",
        "",
        f"| mesh | triangles | {' | '.join(heads)} |",
        "|---|---:|" + "---:|" * len(heads),
    ]
    for name, body in bodies().items():
        percent = 100 * source_errors(body).reshape(-1, 2)
        lines.append(f"| {name} | {len(body.triangles)} | {' | '.join(map(cell, percent))} |")

    surface, points, chance = gearbox(0.042), shell(30, 1.2), np.random.default_rng(0)
    frequency = AIR.speed_of_sound / (np.array(PER_AIR_WAVE) * mean_edge(surface))
    coarse, fine = (Heard(s, points, frequency) for s in (surface, quartered(quartered(surface))))
    lines += [
        "",
        f"Surface of the gearbox, {len(surface.triangles)} triangles, twelve motions of random waves for every line, "
        "median error in dB of means over the faces:",
        "",
        f"| elements per wave on the walls | {' | '.join(f'{n} per wave in air' for n in PER_AIR_WAVE)} |",
        "|---:|" + "---:|" * len(PER_AIR_WAVE),
    ]
    for per_wave in PER_BENDING_WAVE:
        motions = [waves(surface, per_wave, chance) for _ in range(12)]
        found = [
            np.median([decibels(coarse, fine, at, motion) for motion in motions], axis=0)
            for at in range(len(frequency))
        ]
        lines.append(f"| {per_wave} | {' | '.join(map(cell, found))} |")

    lines += [
        "",
        "Lids and bottoms of 0.3 × 0.3 m, eight elements along a side, that bend in half waves at 300 Hz, loudest at "
        "their rims or between, dB likewise, and what `solve_direct` states (`cancellation_error_db`):",
        "",
        f"| body | triangles | {' | '.join(f'{a} × {b}, {PLACES[turned]}' for a, b, turned in BENDINGS)} |",
        "|---|---:|" + "---:|" * len(BENDINGS),
    ]
    for name, body in plates().items():
        finer = quartered(body) if len(body.triangles) > 1000 else quartered(quartered(body))
        coarse, fine = (Heard(s, shell(30, 1.0), np.array([300.0])) for s in (body, finer))
        found = []
        for halves in BENDINGS:
            motion = bending(*halves)
            told = solve_direct(SurfaceVelocity([300.0], means(body, motion)[None], body), shell(30, 1.0), air=AIR)
            stated = told.accuracy.cancellation_error_db
            found.append(np.append(decibels(coarse, fine, 0, motion), stated))
        lines.append(f"| {name} | {len(body.triangles)} | {' | '.join(map(cell, found))} |")
    publish("acoustics/within_faces", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
