"""How well a mesh resolves the openings of a body: triangles that look at each other across air."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from functools import lru_cache

import numba
import numpy as np

from nvhchain.acoustics.intersections import FACING
from nvhchain.handoff import Surface

SHIFT = 0.0175
"""Frequency by which a mesh misses the resonances of the air in openings, relative, over the longest edge in widths of
the opening: 0.8 to 6 times what was found (docs/measured/openings.md)."""

WIDEST = 1.5
"""Longest edge in widths of the opening above which the resonances are missed by no more."""


@lru_cache(maxsize=8)
def resonance_shift(surface: Surface) -> float:
    """Frequency by which the mesh may miss the resonances of the air in the body's openings, relative to theirs.

    The width of an opening is the distance from a triangle's centroid along its outward normal to the first triangle
    met, if that stands opposite (`FACING`).  0 where no triangle looks at another.
    1 s for 24 000 triangles, once for a surface.
    """
    edges = surface.longest_edges
    widths = _widths(surface.vertices[surface.triangles], surface.centroids, surface.normals, edges)
    return SHIFT * min(float((edges / widths).max()), WIDEST)


@numba.njit("boolean(float64[:,::1], float64[::1], float64, float64, float64)", cache=True, nogil=True)
def _holds(corners, normal, x, y, z):
    """Whether a point in the plane of a triangle lies in it."""
    for p in range(3):
        q = (p + 1) % 3
        ax, ay, az = corners[q, 0] - corners[p, 0], corners[q, 1] - corners[p, 1], corners[q, 2] - corners[p, 2]
        bx, by, bz = x - corners[p, 0], y - corners[p, 1], z - corners[p, 2]
        turn = normal[0] * (ay * bz - az * by) + normal[1] * (az * bx - ax * bz) + normal[2] * (ax * by - ay * bx)
        if turn < 0.0:
            return False
    return True


@numba.njit("float64[::1](float64[:,:,::1], float64[:,::1], float64[:,::1], float64[::1])", cache=True, nogil=True)
def _widths(corners, centroids, normals, longest):
    """Width (n,) m of the air before every triangle, inf where there is no other opposite."""
    count = len(corners)
    widths = np.full(count, np.inf)
    for i in range(count):
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        x, y, z = centroids[i, 0], centroids[i, 1], centroids[i, 2]
        first, met = np.inf, -1
        for j in range(count):
            mx, my, mz = centroids[j, 0] - x, centroids[j, 1] - y, centroids[j, 2] - z
            ahead = mx * nx + my * ny + mz * nz
            beside = mx * mx + my * my + mz * mz - ahead * ahead
            if beside > longest[j] ** 2 or ahead < -longest[j] or j == i:
                continue
            across = normals[j, 0] * nx + normals[j, 1] * ny + normals[j, 2] * nz
            if across == 0.0:
                continue
            width = (normals[j, 0] * mx + normals[j, 1] * my + normals[j, 2] * mz) / across
            if 0.0 < width < first and _holds(corners[j], normals[j], x + width * nx, y + width * ny, z + width * nz):
                first, met = width, j
        if met >= 0 and (normals[met] * normals[i]).sum() < FACING:
            widths[i] = first
    return widths
