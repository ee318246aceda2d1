"""Closed bodies and exact fields that the acoustics tests share."""

import itertools

import numpy as np

from nvhchain.acoustics import sphere
from nvhchain.handoff import Surface, SurfaceVelocity


def box(size, edge, remove=None, alike=False):
    """Closed surface of cubes of side `edge` filling `size`, without the cubes for which `remove(centre)` holds.

    alike: the diagonals of a wall all run one way, not to and fro.
    """
    counts = np.round(np.asarray(size) / edge).astype(int)
    filled = np.zeros(counts + 2, dtype=bool)
    for cell in itertools.product(*(range(n) for n in counts)):
        centre = (np.array(cell) + 0.5) * edge
        filled[tuple(np.array(cell) + 1)] = remove is None or not remove(centre)
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


def cells(counts, size, alike=False):
    """A `box` of this size, m, of so many cells along its axes, the rectangles on its walls halved."""
    body = box(counts, 1.0, alike=alike)
    return Surface(body.vertices * np.asarray(size) / counts, body.triangles)


def united(*parts):
    """One surface of several bodies."""
    first = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    triangles = [part.triangles + offset for part, offset in zip(parts, first, strict=True)]
    return Surface(np.vstack([part.vertices for part in parts]), np.vstack(triangles))


def twice(body, shift):
    """A body and its like, `shift` (3,) m apart."""
    return united(body, Surface(body.vertices + np.asarray(shift), body.triangles))


def resonator(cell=0.02):
    """A cube of 120 mm with a cavity of 80 mm behind a neck of 20 × 20 mm: resonates at 257 Hz with a Q of 210."""

    def hollow(centre):
        place = np.round(np.asarray(centre) / cell - 0.5).astype(int)
        return bool(((place >= 1) & (place <= 4)).all()) or place.tolist() == [2, 2, 5]

    return box((6 * cell,) * 3, cell, remove=hollow)


def source_field(points, position, k):
    """Pressure and gradient of a point source, G = e^{-jkr}/(4 pi r)."""
    offset = points - np.asarray(position)
    r = np.linalg.norm(offset, axis=1)
    pressure = np.exp(-1j * k * r) / (4 * np.pi * r)
    return pressure, -((1j * k + 1 / r) * pressure / r)[:, None] * offset


def source_velocity(surface, position, frequency, air):
    """Normal velocity that a point source inside the body gives its faces."""
    omega = 2 * np.pi * np.atleast_1d(frequency)
    velocity = [
        np.einsum("fj,fj->f", source_field(surface.centroids, position, w / air.speed_of_sound)[1], surface.normals)
        / (-1j * w * air.density)
        for w in omega
    ]
    return SurfaceVelocity(np.atleast_1d(frequency), np.array(velocity), surface)


def mean_edge(surface):
    corners = surface.vertices[surface.triangles]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def quartered(surface):
    """Every triangle in four, one after the other."""
    a, b, c = (surface.vertices[surface.triangles[:, i]] for i in range(3))
    corners = np.stack([[a, (a + b) / 2, (c + a) / 2], [(a + b) / 2, b, (b + c) / 2], [(c + a) / 2, (b + c) / 2, c],
                        [(a + b) / 2, (b + c) / 2, (c + a) / 2]])  # fmt: skip
    points = corners.transpose(2, 0, 1, 3).reshape(-1, 3)
    _, first, triangles = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return Surface(points[first], triangles.reshape(-1, 3))


def shell(count, radius, seed=7):
    """Points spread over a sphere."""
    x = np.random.default_rng(seed).normal(size=(count, 3))
    return radius * x / np.linalg.norm(x, axis=1, keepdims=True)


def turned(profile, around):
    """Surface of revolution about z: (r, z) from the lower to the upper pole, both at r = 0, rings of `around` corners
    turned by half a corner against each other."""
    rings, vertices = [], [[[0.0, 0.0, profile[0][1]]]]
    for number, (r, z) in enumerate(profile[1:-1]):
        angle = 2 * np.pi * (np.arange(around) + 0.5 * (number % 2)) / around
        rings.append(1 + number * around + np.arange(around))
        vertices.append(np.stack([r * np.cos(angle), r * np.sin(angle), np.full(around, z)], axis=1))
    vertices = np.concatenate([*vertices, [[0.0, 0.0, profile[-1][1]]]])
    low, top = np.zeros(around, dtype=int), np.full(around, len(vertices) - 1)
    triangles = [np.stack([low, np.roll(rings[0], -1), rings[0]], axis=1)]
    for number, (a, b) in enumerate(itertools.pairwise(rings)):
        a_next, b_next = np.roll(a, -1), np.roll(b, -1)
        if number % 2 == 0:
            triangles += [np.stack(t, axis=1) for t in ((a, a_next, b), (a_next, b_next, b))]
        else:
            triangles += [np.stack(t, axis=1) for t in ((a, b_next, b), (a, a_next, b_next))]
    triangles.append(np.stack([top, rings[-1], np.roll(rings[-1], -1)], axis=1))
    return Surface(vertices, np.concatenate(triangles))


def cylinder(radius, half_length, around):
    """Closed cylinder about z, its corners on the true one."""
    edge = 0.9 * 2 * np.pi * radius / around
    up, out = max(1, round(2 * half_length / edge)), max(1, round(radius / edge))
    lid = [(radius * i / out, -half_length) for i in range(out)]
    wall = [(radius, half_length * (2 * i / up - 1)) for i in range(up + 1)]
    return turned([*lid, *wall, *((r, -z) for r, z in lid[::-1])], around)


def capsule(radius, half_length, around):
    """Cylinder about z with half spheres as ends, its corners on the true one."""
    edge = 0.9 * 2 * np.pi * radius / around
    up, down = max(1, round(2 * half_length / edge)), max(2, round(0.5 * np.pi * radius / edge))
    angle = 0.5 * np.pi * np.arange(down + 1) / down
    end = [(radius * np.sin(a), -half_length - radius * np.cos(a)) for a in angle]
    end[0] = (0.0, end[0][1])
    wall = [(radius, half_length * (2 * i / up - 1)) for i in range(1, up)]
    return turned([*end, *wall, *((r, -z) for r, z in end[::-1])], around)


def round_normals(points, radius, half_length, flat_ends):
    """Nearest points of the true cylinder (`flat_ends`), capsule or (half_length 0) sphere and the normals there.

    points: (n, 3) on facets of its surface.
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


def rotating_ellipsoids():
    """Two of 320 faces that rotate about an axis not theirs, each with its normal velocity (n_face,): the icosahedron's
    mesh, and one whose vertices were shifted."""
    rng = np.random.default_rng(0)
    unit = sphere(1.0, 2)
    shifted = unit.vertices + 0.3 * np.sqrt(unit.areas.mean()) * rng.uniform(-1, 1, unit.vertices.shape)
    shifted /= np.linalg.norm(shifted, axis=1, keepdims=True)
    found = [Surface(vertices * [0.2, 0.15, 0.1], unit.triangles) for vertices in (unit.vertices, shifted)]
    return [(b, np.einsum("fi,fi->f", np.cross([0.0, 0.0, 1.0], b.centroids), b.normals)) for b in found]


def wedge(degrees, rows=3, length=0.1, width=0.06):
    """A wedge of this angle with its edge along y, and `rows` of triangles from there to the back."""
    half = length * np.tan(np.radians(degrees) / 2.0)
    at, numbers, quads = [], {}, []

    def corner(i, j, side):
        place = (i, j, side if i else 0)
        if place not in numbers:
            numbers[place] = len(at)
            at.append((length * i / rows, width * (j / 2 - 0.5), side * half * i / rows))
        return numbers[place]

    for i, j in itertools.product(range(rows), range(2)):
        ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        quads += [[corner(*p, 1) for p in ring], [corner(*p, -1) for p in ring[::-1]]]
    for i, (j, way) in itertools.product(range(rows), ((0, 1), (2, -1))):
        quads.append([corner(i, j, -1), corner(i + 1, j, -1), corner(i + 1, j, 1), corner(i, j, 1)][::way])
    for j in range(2):
        quads.append([corner(rows, j, -1), corner(rows, j + 1, -1), corner(rows, j + 1, 1), corner(rows, j, 1)])
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d)) if len(set(t)) == 3]
    return Surface(np.array(at), np.array(triangles))
