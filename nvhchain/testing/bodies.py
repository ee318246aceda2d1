"""Closed bodies for boundary elements, and exact fields of a point source, of pulsating and of rigid spheres."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import spherical_jn, spherical_yn

from nvhchain.acoustics import sphere
from nvhchain.conventions import Air
from nvhchain.handoff import ComplexArray, FloatArray, Surface, SurfaceVelocity
from nvhchain.housing import Bore, Casting, GearSpace


def reference_casting() -> Casting:
    """Return the casting of the two-stage example, with centre distances of 95.958 and 152.395 mm."""
    axes = {"A": (0.0, 0.0), "B": (0.0831021, -0.0479790), "C": (0.2309714, -0.0111114)}
    seats, spaces = {"A": 0.031, "B": 0.036, "C": 0.055}, {"A": 0.050, "B": 0.080, "C": 0.123}
    return Casting(
        bores=tuple(
            Bore(f"{name}{end}", (*axes[name], z), seats[name]) for name in axes for end, z in ((1, 0.039), (2, 0.221))
        ),
        gear_spaces=tuple(GearSpace(axes[name], spaces[name]) for name in axes),
        wall=0.0055,
        end_wall=0.006,
        depth=0.222,
        bell_depth=0.036,
    )


def box(
    size: ArrayLike, edge: float, remove: Callable[[FloatArray], bool] | None = None, alike: bool = False
) -> Surface:
    """Build the closed surface of cubes that fill a box.

    size : (3,) edges of the box, m, centred on the origin.
    """
    counts = np.round(np.asarray(size) / edge).astype(int)
    filled = np.zeros(counts + 2, dtype=bool)
    for place in itertools.product(*(range(n) for n in counts)):
        centre = (np.array(place) + 0.5) * edge
        filled[tuple(np.array(place) + 1)] = remove is None or not remove(centre)
    quads = []
    for cell in np.argwhere(filled):
        for axis, side in itertools.product(range(3), (0, 1)):
            neighbour = cell.copy()
            neighbour[axis] += 2 * side - 1
            if filled[tuple(neighbour)]:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.tile(cell, (4, 1))
            corners[:, axis] += side
            corners[[1, 2], u] += 1
            corners[[2, 3], v] += 1
            quad = corners if side else corners[::-1]
            quads.append(quad if alike or cell.sum() % 2 else np.roll(quad, 1, axis=0))
    points = np.array(quads).reshape(-1, 3)
    vertices, index = np.unique(points, axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    return Surface((vertices - 1) * edge - 0.5 * np.asarray(size), triangles)


def cells(counts: Sequence[int], size: ArrayLike, alike: bool = False) -> Surface:
    """Build a `box` of `size` (3,) m, with `counts` (3,) rectangles along its axes, each halved."""
    body = box(counts, 1.0, alike=alike)
    return Surface(body.vertices * np.asarray(size) / counts, body.triangles)


def notched_box() -> Surface:
    """Build three cubes of 0.1 m in an L, the small body that is not convex: 28 triangles, 16 vertices."""
    return box((0.2, 0.2, 0.1), 0.1, remove=lambda centre: bool((centre[:2] > 0.1).all()))


def united(*parts: Surface) -> Surface:
    """Join several bodies into one surface."""
    first = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    triangles = [part.triangles + offset for part, offset in zip(parts, first, strict=True)]
    return Surface(np.vstack([part.vertices for part in parts]), np.vstack(triangles))


def twice(body: Surface, shift: ArrayLike) -> Surface:
    """Join a body and its copy, `shift` (3,) m apart."""
    return united(body, Surface(body.vertices + np.asarray(shift), body.triangles))


def resonator(cell: float = 0.02) -> Surface:
    """Build a cube of 120 mm with a cavity of 80 mm behind a neck of 20 × 20 mm.

    It resonates at 257 Hz with a Q of 210.
    """

    def hollow(centre: FloatArray) -> bool:
        place = np.round(np.asarray(centre) / cell - 0.5).astype(int)
        return bool(((place >= 1) & (place <= 4)).all()) or place.tolist() == [2, 2, 5]

    return box((6 * cell,) * 3, cell, remove=hollow)


def source_field(points: FloatArray, position: ArrayLike, k: float) -> tuple[ComplexArray, ComplexArray]:
    """Compute pressure (n,) and gradient (n, 3) of a point source at points (n, 3).

    G = e^{−jkr} / (4πr).
    """
    offset = points - np.asarray(position)
    r = np.linalg.norm(offset, axis=1)
    pressure = np.exp(-1j * k * r) / (4 * np.pi * r)
    return pressure, -((1j * k + 1 / r) * pressure / r)[:, None] * offset


def source_velocity(surface: Surface, position: ArrayLike, frequency: ArrayLike, air: Air) -> SurfaceVelocity:
    """Compute the normal velocity of the faces in the field of a point source inside the body."""
    omega = 2 * np.pi * np.atleast_1d(frequency)
    velocity = [
        np.einsum("fj,fj->f", source_field(surface.centroids, position, w / air.speed_of_sound)[1], surface.normals)
        / (-1j * w * air.density)
        for w in omega
    ]
    return SurfaceVelocity(np.atleast_1d(frequency), np.array(velocity), surface)


def quartered(surface: Surface) -> Surface:
    """Split every triangle into four, in the order of the triangles."""
    a, b, c = (surface.vertices[surface.triangles[:, i]] for i in range(3))
    corners = np.stack([[a, (a + b) / 2, (c + a) / 2], [(a + b) / 2, b, (b + c) / 2], [(c + a) / 2, (b + c) / 2, c],
                        [(a + b) / 2, (b + c) / 2, (c + a) / 2]])  # fmt: skip
    points = corners.transpose(2, 0, 1, 3).reshape(-1, 3)
    _, first, triangles = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return Surface(points[first], triangles.reshape(-1, 3))


def shell(count: int, radius: float, seed: int = 7) -> FloatArray:
    """Spread points (n, 3) over a sphere at random."""
    x = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(radius * x / np.linalg.norm(x, axis=1, keepdims=True))


def turned(profile: Sequence[tuple[float, float]], circumferential: int) -> Surface:
    """Build a surface of revolution about z."""
    rings, vertices = [], [np.array([[0.0, 0.0, profile[0][1]]])]
    for number, (r, z) in enumerate(profile[1:-1]):
        angle = 2 * np.pi * (np.arange(circumferential) + 0.5 * (number % 2)) / circumferential
        rings.append(1 + number * circumferential + np.arange(circumferential))
        vertices.append(np.stack([r * np.cos(angle), r * np.sin(angle), np.full(circumferential, z)], axis=1))
    corners = np.concatenate([*vertices, [[0.0, 0.0, profile[-1][1]]]])
    low, top = np.zeros(circumferential, dtype=int), np.full(circumferential, len(corners) - 1)
    triangles = [np.stack([low, np.roll(rings[0], -1), rings[0]], axis=1)]
    for number, (a, b) in enumerate(itertools.pairwise(rings)):
        a_next, b_next = np.roll(a, -1), np.roll(b, -1)
        if number % 2 == 0:
            triangles += [np.stack(t, axis=1) for t in ((a, a_next, b), (a_next, b_next, b))]
        else:
            triangles += [np.stack(t, axis=1) for t in ((a, b_next, b), (a, a_next, b_next))]
    triangles.append(np.stack([top, rings[-1], np.roll(rings[-1], -1)], axis=1))
    return Surface(corners, np.concatenate(triangles))


def cylinder(radius: float, half_length: float, circumferential: int) -> Surface:
    """Build a closed cylinder about z (lengths in m), its corners on the true one."""
    edge = 0.9 * 2 * np.pi * radius / circumferential
    up, out = max(1, round(2 * half_length / edge)), max(1, round(radius / edge))
    lid = [(radius * i / out, -half_length) for i in range(out)]
    wall = [(radius, half_length * (2 * i / up - 1)) for i in range(up + 1)]
    return turned([*lid, *wall, *((r, -z) for r, z in lid[::-1])], circumferential)


def capsule(radius: float, half_length: float, circumferential: int) -> Surface:
    """Build a cylinder about z with half spheres as ends (lengths in m), its corners on the true one."""
    edge = 0.9 * 2 * np.pi * radius / circumferential
    up, down = max(1, round(2 * half_length / edge)), max(2, round(0.5 * np.pi * radius / edge))
    angle = 0.5 * np.pi * np.arange(down + 1) / down
    end = [(radius * np.sin(a), -half_length - radius * np.cos(a)) for a in angle]
    end[0] = (0.0, end[0][1])
    wall = [(radius, half_length * (2 * i / up - 1)) for i in range(1, up)]
    return turned([*end, *wall, *((r, -z) for r, z in end[::-1])], circumferential)


def round_normals(
    points: FloatArray, radius: float, half_length: float, flat_ends: bool
) -> tuple[FloatArray, FloatArray]:
    """Find the nearest points of a true round body, and the normals there.

    points : (n, 3) on facets of its surface, m.
    """
    offset = points.copy()
    offset[:, 2] -= points[:, 2] if flat_ends else np.clip(points[:, 2], -half_length, half_length)
    distance = np.linalg.norm(offset, axis=1, keepdims=True)
    normals = offset / np.where(distance > 0, distance, 1.0)
    nearest = points - offset + radius * normals
    if flat_ends:
        end = np.abs(points[:, 2]) > half_length * (1 - 1e-9)
        normals[end] = np.sign(points[end, 2])[:, None] * [0.0, 0.0, 1.0]
        nearest[end] = points[end]
    return nearest, normals


def rotating_ellipsoids() -> list[tuple[Surface, FloatArray]]:
    """Build two ellipsoids of 320 faces, each with its normal velocity (n_face,), that rotate about z.

    No axis of theirs is an axis of symmetry. One has the mesh of the icosahedron, the other has shifted vertices.
    """
    rng = np.random.default_rng(0)
    unit = sphere(1.0, 2)
    shifted = unit.vertices + 0.3 * np.sqrt(unit.areas.mean()) * rng.uniform(-1, 1, unit.vertices.shape)
    shifted /= np.linalg.norm(shifted, axis=1, keepdims=True)
    found = [Surface(vertices * [0.2, 0.15, 0.1], unit.triangles) for vertices in (unit.vertices, shifted)]
    return [(b, np.einsum("fi,fi->f", np.cross([0.0, 0.0, 1.0], b.centroids), b.normals)) for b in found]


def wedge(degrees: float, rows: int = 3, length: float = 0.1, width: float = 0.06) -> Surface:
    """Build a wedge with its edge along y and `rows` of triangles from there to the back (lengths in m)."""
    half = length * np.tan(np.radians(degrees) / 2.0)
    vertices: list[tuple[float, float, float]] = []
    numbers: dict[tuple[int, int, int], int] = {}
    quads: list[list[int]] = []

    def corner(i: int, j: int, side: int) -> int:
        place = (i, j, side if i else 0)
        if place not in numbers:
            numbers[place] = len(vertices)
            vertices.append((length * i / rows, width * (j / 2 - 0.5), side * half * i / rows))
        return numbers[place]

    for i, j in itertools.product(range(rows), range(2)):
        ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        quads += [[corner(*p, 1) for p in ring], [corner(*p, -1) for p in ring[::-1]]]
    for i, (j, way) in itertools.product(range(rows), ((0, 1), (2, -1))):
        quads.append([corner(i, j, -1), corner(i + 1, j, -1), corner(i + 1, j, 1), corner(i, j, 1)][::way])
    for j in range(2):
        quads.append([corner(rows, j, -1), corner(rows, j + 1, -1), corner(rows, j + 1, 1), corner(rows, j, 1)])
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d)) if len(set(t)) == 3]
    return Surface(np.array(vertices), np.array(triangles))


def pulsating(frequency: ArrayLike, radius: float, distance: float, air: Air) -> ComplexArray:
    """Compute the pressure, Pa, of a sphere that pulsates with 1 m/s.

    frequency (n,): hz.
    radius, distance: radius of the sphere and distance of the microphone from its centre, m.
    """
    omega = 2 * np.pi * np.asarray(frequency)
    k = omega / air.speed_of_sound
    return np.asarray(
        1j * omega * air.density * radius**2 * np.exp(-1j * k * (distance - radius))
        / ((1 + 1j * k * radius) * distance)
    )  # fmt: skip


def rigid_sphere(ka: float, cosine: ArrayLike) -> ComplexArray:
    """Compute the total pressure on a rigid sphere in a plane wave of 1 Pa.

    Σ jⁿ (2n + 1) P_n (−j / ka²) / h_n′(ka); the Wronskian j_n h_n′ − j_n′ h_n is −j / ka² under e^{+jωt}.

    cosine : (n,) 1 faces the source.
    """
    n = np.arange(int(ka) + 25)
    h_slope = spherical_jn(n, ka, True) - 1j * spherical_yn(n, ka, True)
    legendre = np.polynomial.legendre.legvander(np.atleast_1d(np.asarray(cosine)), n[-1])
    return np.asarray(legendre @ (1j**n * (2 * n + 1) * (-1j / ka**2) / h_slope))
