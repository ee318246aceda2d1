"""Closed bodies and exact fields that the acoustics tests share."""

import itertools

import numpy as np

from nvhchain.handoff import Surface, SurfaceVelocity


def box(size, edge, remove=None):
    """Closed surface of cubes of side `edge` filling `size`, without the cubes for which `remove(centre)` holds."""
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
            quads.append(quad if cell.sum() % 2 else np.roll(quad, 1, axis=0))
    points = np.array(quads).reshape(-1, 3)
    vertices, index = np.unique(points, axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    return Surface((vertices - 1) * edge - 0.5 * np.asarray(size), triangles)


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


def shell(count, radius, seed=7):
    """Points spread over a sphere."""
    x = np.random.default_rng(seed).normal(size=(count, 3))
    return radius * x / np.linalg.norm(x, axis=1, keepdims=True)
