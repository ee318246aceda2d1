"""Sources inside bodies of any mesh at 8 and 12 elements per wavelength; writes docs/measured/interior_sources.md.

    python benchmarks/interior_sources.py

Largest error over sixteen sources at least four mean edges from the surface, relative to the peak at 1200 points two
to seven half diagonals away. The elements are counted three ways: by the mean edge; by what long triangles lose beside
(`skewness`), as everything that is stated of a mesh does; and by the longest edge of the mesh. Takes three minutes.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from publish import publish
from scipy.spatial import cKDTree

import nvhchain as nvh
from nvhchain.acoustics import sphere, transfer_vectors
from nvhchain.acoustics._gmsh import remesh
from nvhchain.acoustics.bodies import winding_number
from nvhchain.acoustics.surface import SHARP_ANGLE, mean_edge, skewness
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import FloatArray, Surface

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "acoustics"))
from acoustics_bodies import box, capsule, cylinder, shell, source_field, source_velocity

AIR = Air()
FIDELITY = replace(nvh.STANDARD.acoustics, elements_per_wavelength=1.0, coarsest_elements_per_wavelength=1.0)
PER_WAVELENGTH = (8, 12)
SOURCES, AWAY = 16, 4.0
"""Sources, and mean edges that they keep from the surface."""


def cells(counts: tuple[int, int, int], size: tuple[float, float, float], alike: bool = False) -> Surface:
    """A box of so many cells along its axes, m, the quadrangles on its walls halved."""
    body = box(counts, 1.0, alike=alike)
    return Surface(body.vertices * np.asarray(size) / counts, body.triangles)


def meshed(body: Surface, edge: float) -> Surface:
    """The same body as gmsh triangulates it."""
    return Surface(*remesh(body.vertices, body.triangles, edge, SHARP_ANGLE))


def bodies() -> dict[str, Surface]:
    cube = (1.0, 1.0, 1.0)
    bracket = box((2.0, 2.0, 1.0), 0.5, lambda centre: centre[0] > 1.0 and centre[1] > 1.0)
    squares = {
        f"cube, {count} halved squares along an edge, diagonals {way}": cells((count,) * 3, cube, way == "alike")
        for way in ("to and fro", "alike")
        for count in (10, 12, 16)
    }
    return squares | {
        "cube, halved rectangles 2 : 1 on four walls": cells((10, 20, 20), cube, alike=True),
        "cube, halved rectangles 3 : 1 on four walls": cells((8, 24, 24), cube, alike=True),
        "cube, gmsh": meshed(cells((4, 4, 4), cube), 0.09),
        "box 3 : 2 : 2, gmsh": meshed(cells((6, 4, 4), (1.5, 1.0, 1.0)), 0.1),
        "bracket, gmsh": meshed(bracket, 0.09),
        "sphere": sphere(0.5, 3),
        "cylinder": cylinder(0.5, 0.5, 32),
        "capsule": capsule(0.5, 0.5, 32),
    }


def sources(body: Surface) -> FloatArray:
    """(SOURCES, 3) m inside the body, `AWAY` from its surface."""
    chance, corners = np.random.default_rng(1), body.vertices[body.triangles]
    within = chance.uniform(body.vertices.min(axis=0), body.vertices.max(axis=0), (20_000, 3))
    beside = np.concatenate([body.vertices, body.centroids])
    far = within[cKDTree(beside).query(within)[0] > AWAY * mean_edge(body)]
    inside = (point for point in far if winding_number(corners, point) > 0.5)
    found = np.array([point for _, point in zip(range(SOURCES), inside, strict=False)])
    assert len(found) == SOURCES, f"{len(found)} sources fit"
    return found


def errors(body: Surface, edges: tuple[float, ...]) -> FloatArray:
    """(n_edge, 2) largest error over the sources, with elements of these sizes, m."""
    frequency = AIR.speed_of_sound / np.multiply.outer(edges, PER_WAVELENGTH)
    lines, where = np.unique(frequency, return_inverse=True)
    reach = 0.5 * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    points = np.concatenate([shell(400, away * reach, seed=seed) for seed, away in enumerate((2.0, 3.5, 7.0))])
    vectors = transfer_vectors(body, points, lines, air=AIR, fidelity=FIDELITY).vectors
    worst = np.zeros(len(lines))
    for source in sources(body):
        velocity = source_velocity(body, source, lines, AIR).normal_velocity
        for at, line in enumerate(lines):
            exact = source_field(points, source, 2 * np.pi * line / AIR.speed_of_sound)[0]
            error = np.abs(vectors[at] @ velocity[at] - exact).max() / np.abs(exact).max()
            worst[at] = max(worst[at], error)
    return worst[where].reshape(frequency.shape)


def main() -> None:
    warnings.simplefilter("ignore", AccuracyWarning)  # the errors are what is measured
    heads = [f"{n} by {count}" for count in ("the mean edge", "`skewness`", "the longest edge") for n in PER_WAVELENGTH]
    lines = ["Error in %:", "", f"| mesh | triangles | {' | '.join(heads)} |", "|---|---:|" + "---:|" * len(heads)]
    for name, body in bodies().items():
        mean = mean_edge(body)
        found = errors(body, (mean, mean * float(np.sqrt(skewness(body))), float(body.longest_edges.max())))
        lines.append(f"| {name} | {len(body.triangles)} | {' | '.join(f'{100 * e:.2f}' for e in found.ravel())} |")
    publish("interior_sources", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
