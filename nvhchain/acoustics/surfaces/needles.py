"""Remeshing of surfaces with long needles, as written by CAD programs, before a solution."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.acoustics.surfaces._gmsh import remesh
from nvhchain.acoustics.surfaces.bodies import split_bodies
from nvhchain.acoustics.surfaces.surface import NEEDLE_SHARE, SHARP_ANGLE, aspects, needle_share
from nvhchain.errors import InputError, SolverError, require
from nvhchain.fem.triangles import squared_distance
from nvhchain.handoff import FloatArray, IntArray, Surface, SurfaceAccuracy
from nvhchain.handoff.surface import body_numbers
from nvhchain.kinds import checked

LONGEST_NEEDLE = 100.0
"""Ratio of longest edge to height above which a single needle causes remeshing."""

LONGEST_SOLVED = 1000.0
"""Ratio of longest edge to height above which boundary elements refuse a surface. One layer of needles round a box with
a point source inside was measured. The error is up to 0.52 of the stated one at 1000, 2.6 at 3000 and 21 at 1e5."""

VOLUME_CHANGE = 0.01
"""Largest relative change of the enclosed volume, which scaling of each body compensates. Without scaling, 0.8 % makes
0.07 dB for a cylinder that shakes along its axis."""

AREA_CHANGE = 0.02
"""Largest relative change of the area."""

DISTANCE = 0.1
"""Largest distance between both surfaces, in requested edges, at corners of both and centroids of the new triangles. It
is less than a fortieth of a wavelength at 4.5 elements per wavelength."""

MOST_TRIANGLES = 20_000
"""Largest number of triangles of a remeshed surface; matrices of more take minutes a frequency."""

SECONDS = 4.0
"""Time of remeshing (s). One or two runs of the mesher take 1.1 to 1.8 s each for up to 12 000 triangles, and the
distances take as long."""

_TRIES = 4
_CUT = 4.0
"""Length, in requested edges, to which given edges are cut if the mesher fails or leaves needles. The mesher divides no
edge of a flat face that has no vertices but its corners. Elsewhere, it takes ten times as long to map needles that are
cut."""

_TRIANGLES_PER_AREA = 2.5
"""Number of triangles times the squared requested edge, over the area."""


@dataclass(frozen=True, eq=False)
class Remeshed:
    """Remeshed surface with its deviations from the given one.

    surface: surface for the solution.
    original_triangles: number of triangles of the replaced surface.
    aspect: ratio of longest edge to height of its longest needle.
    volume_change: relative change of the volume before scaling to the given volume.
    area_change: relative change of the area.
    distance: largest distance between both surfaces (m).
    """

    surface: Surface
    original_triangles: int
    aspect: float
    volume_change: float
    area_change: float
    distance: float

    def __str__(self) -> str:
        return (
            f"surface remeshed: {self.original_triangles} triangles up to {self.aspect:.3g} times as long as high -> "
            f"{len(self.surface.triangles)}, volume {100 * self.volume_change:+.2g} % and scaled "
            f"back, area {100 * self.area_change:+.2g} %, at most {1e3 * self.distance:.2g} mm apart"
        )


def has_needles(surface: Surface) -> bool:
    """Return True if needles take more than `NEEDLE_SHARE` of the area, or one is longer than `LONGEST_NEEDLE`."""
    return needle_share(surface) > NEEDLE_SHARE or bool(aspects(surface).max() > LONGEST_NEEDLE)


def check_needles(surface: Surface) -> None:
    """Raise `InputError` for a triangle more than `LONGEST_SOLVED` times as long as high."""
    aspect = aspects(surface)
    worst = int(aspect.argmax())
    require(
        aspect[worst] <= LONGEST_SOLVED,
        f"surface: triangle {worst} is {aspect[worst]:.3g} times as long as high, {LONGEST_SOLVED:g} times at most "
        "keep to the stated errors: mesh it anew with nvhchain.acoustics.remesh_needles(surface, element_size) and "
        "bring velocities to its faces with nvhchain.acoustics.map_velocity(velocity, new surface)",
    )


@checked
def remesh_needles(surface: Surface, element_size: float) -> Remeshed | None:
    """Remesh a surface of long needles, so that it can be solved.

    element_size: longest edge of the new surface (m), about; `required_element_size` gives that of a band.
    Returns new surface with its deviations; None for a surface without needles.

    Edges are halved until these limits are met. Every body is then scaled to the given volume. The provenance of the
    new surface states the remaining error, which `expected_error_dB` includes. Velocities belong to faces:
    `map_velocity` brings them to the new ones.
    """
    if not has_needles(surface):
        return None
    radius = float(np.sqrt(surface.areas.sum() / (4.0 * np.pi)))
    return _remeshed(_Key(surface.content_hash, surface), min(element_size, radius / 4.0))


@dataclass(frozen=True)
class _Key:
    """Surface that equals any other of the same content."""

    content_hash: str
    surface: Surface = field(compare=False)


@lru_cache(maxsize=4)
def _remeshed(key: _Key, size: float) -> Remeshed:
    given, why, cut = key.surface, "", np.inf
    for _try in range(_TRIES):
        if _TRIANGLES_PER_AREA * given.areas.sum() / size**2 > MOST_TRIANGLES:
            why += f"; more than {MOST_TRIANGLES} triangles would be needed"
            break
        try:
            found = _compared(given, size, cut)
        except (InputError, SolverError) as error:
            size = size if np.isinf(cut) else 0.5 * size
            why, cut = f": {error}", _CUT * size
            continue
        worst = max(
            abs(found.volume_change) / VOLUME_CHANGE,
            abs(found.area_change) / AREA_CHANGE,
            found.distance / (DISTANCE * size),
        )
        longest = float(aspects(found.surface).max())
        if worst <= 1.0 and not has_needles(found.surface):
            return found
        why = (
            f": with edges of {1e3 * size:.3g} mm the volume changes by {100 * found.volume_change:+.2g} % "
            f"(±{100 * VOLUME_CHANGE:g} % admitted), the area by {100 * found.area_change:+.2g} % "
            f"(±{100 * AREA_CHANGE:g} %), the surfaces are {1e3 * found.distance:.2g} mm apart "
            f"({1e3 * DISTANCE * size:.2g} mm), the longest triangle is {longest:.3g} times as long as high"
        )
        if worst > 1.0:
            size *= float(np.clip(0.9 / np.sqrt(worst), 0.25, 0.7))  # all three fall with the square of the edge
        elif np.isfinite(cut):
            size, cut = 0.5 * size, 0.5 * cut
        else:
            cut = _CUT * size
    raise InputError(
        f"surface of {len(given.triangles)} triangles up to {aspects(given).max():.3g} times as long as high "
        f"could not be meshed anew{why}: export it with triangles of even shape"
    )


def _compared(original: Surface, size: float, cut: float) -> Remeshed:
    vertices, triangles = remesh(*cut_edges(original.vertices, original.triangles, cut)[:2], size, SHARP_ANGLE)
    made = Surface(vertices, _outward(vertices, triangles))
    change = made.volume / original.volume - 1.0
    made = made.replace(vertices=_restored(made, original))
    distance = max(
        _distance(np.concatenate([made.vertices, made.centroids]), original, size),
        _distance(original.vertices, made, size),
    )
    area = float(made.areas.sum() / original.areas.sum()) - 1.0
    return Remeshed(
        # 0.012 for a cylinder, of which parts that radiate by themselves err by two thirds
        made.replace(accuracy=SurfaceAccuracy(abs(change) + abs(area))),
        len(original.triangles),
        float(aspects(original).max()),
        change,
        area,
        distance,
    )


def _outward(vertices: FloatArray, triangles: IntArray) -> IntArray:
    """Return triangles with every connected body oriented to enclose a positive volume."""
    body = body_numbers(triangles)
    a, b, c = (vertices[triangles[:, i]] - vertices.mean(axis=0) for i in range(3))
    inward = np.bincount(body, np.einsum("ij,ij->i", a, np.cross(b, c))) < 0
    return np.where(inward[body][:, None], triangles[:, ::-1], triangles)


def _restored(made: Surface, original: Surface) -> FloatArray:
    """Return vertices of `made` with every body scaled to the volume of the given one.

    The centre of scaling is the middle of the body's bounding box.
    """
    vertices = made.vertices.copy()
    bodies = _bodies(original)
    for corners, middle, volume in _bodies(made):
        _, _, whole = min(bodies, key=lambda body: float(np.linalg.norm(body[1] - middle)))
        vertices[corners] = middle + np.cbrt(whole / volume) * (vertices[corners] - middle)
    return vertices


def _bodies(surface: Surface) -> list[tuple[IntArray, FloatArray, float]]:
    """Return the vertices of every body, the middle of its bounding box (m) and its volume (m³)."""
    found = []
    for _, body in split_bodies(surface):
        corners = cKDTree(surface.vertices).query(body.vertices)[1]
        middle = 0.5 * (body.vertices.min(axis=0) + body.vertices.max(axis=0))
        found.append((np.asarray(corners), middle, body.volume))
    return found


def _distance(points: FloatArray, surface: Surface, longest: float) -> float:
    """Return the largest distance (m) of points (n, 3) from a surface, cut to edges of `longest`; inf if far away.

    Points farther than the longest edge count as far away.
    """
    vertices, triangles, _ = cut_edges(surface.vertices, surface.triangles, longest)
    corners = vertices[triangles]
    reach = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
    # a triangle reaches two thirds of its longest edge from its middle
    near = cKDTree(corners.mean(axis=1)).query_ball_point(points, (2.0 / 3.0 + 2.0 * DISTANCE) * reach)
    least = [
        squared_distance(point, corners[some]).min() if some else np.inf
        for point, some in zip(points, near, strict=True)
    ]
    return float(np.sqrt(max(least)))


def cut_edges(vertices: FloatArray, triangles: IntArray, longest: float) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the same surface with every edge longer than `longest` (m) halved repeatedly; it remains closed.

    Returns vertices (n, 3), triangles (k, 3) and the given triangle (k,) that each of them is a part of.
    """
    origin = np.arange(len(triangles))
    while True:
        ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, edge_numbers = np.unique(ends, axis=0, return_inverse=True)
        long = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1) > longest
        if not long.any():
            return vertices, triangles, origin
        middle = np.full(len(edges), -1)
        middle[long] = len(vertices) + np.arange(np.count_nonzero(long))
        vertices = np.concatenate([vertices, vertices[edges[long]].mean(axis=1)])
        halved = middle[edge_numbers.reshape(-1, 3)]  # sides from corner 0, 1 and 2; -1 for a side that stays
        count = (halved >= 0).sum(axis=1)
        first = np.where(count == 1, (halved >= 0).argmax(axis=1), ((halved < 0).argmax(axis=1) + 1) % 3)
        turn = (np.arange(3) + first[:, None]) % 3  # moves a lone halved side to the front, a lone whole one to the end
        a, b, c = np.take_along_axis(triangles, turn, axis=1).T
        p, q, r = np.take_along_axis(halved, turn, axis=1).T
        pieces = {
            0: [(a, b, c)],
            1: [(a, p, c), (p, b, c)],
            2: [(p, b, q), (a, p, q), (a, q, c)],
            3: [(a, p, r), (p, b, q), (r, q, c), (p, q, r)],
        }
        triangles = np.concatenate(
            [np.stack(piece, axis=1)[count == kind] for kind, some in pieces.items() for piece in some]
        )
        origin = np.concatenate([origin[count == kind] for kind, some in pieces.items() for _ in some])
