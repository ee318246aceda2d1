"""Distances across air: points from a closed surface, inside or outside, and triangles that face each other."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface

SHIFT = 0.02
"""Relative frequency error of resonances of the air in openings, over the longest edge in widths of the opening. The
value is 0.8 to 6 times the measured error (docs/measured/acoustics/openings.md)."""

WIDEST = 2.8
"""Longest edge, in widths of the opening, above which the frequency error does not grow."""

_OPPOSITE = float(np.cos(np.radians(105.0)))
"""Cosine of the angle between normals below which two triangles enclose air; inner edges of 90° do not."""


def resonance_shift(surface: Surface, plane: RigidPlane | None = None) -> float:
    """Return the relative frequency error of the mesh for resonances of the air in the body's openings.

    The width of an opening is the distance of a triangle from the nearest opposite one. That one lies on the body or on
    its image behind a rigid plane. The result is 0 if no triangle has an opposite one. The search takes 0.4 s for 24
    000 triangles and twice that with a plane, once for a surface.
    """
    return SHIFT * min(float((surface.longest_edges / _opening_widths(surface, plane)).max()), WIDEST)


def opening_energy_ratio(
    surface: Surface, plane: RigidPlane | None, face_pressure: ComplexArray, velocity: ComplexArray
) -> float:
    """Return ∫ d|p|² dS / |∫ p v* dS| (Pa s) for pressures and normal velocities (n_face,), d the longest edge.

    The ratio compares the energy before faces that look at each other across air with the work done on all faces. It is
    largest if an opening resonates.
    """
    opposite = surface.areas * surface.longest_edges * np.isfinite(_opening_widths(surface, plane))
    work = float(np.abs(surface.areas @ (face_pressure * velocity.conj())))
    return float(opposite @ np.abs(face_pressure) ** 2) / work if work > 0 else 0.0


@lru_cache(maxsize=8)
def _opening_widths(surface: Surface, plane: RigidPlane | None) -> FloatArray:
    """Return the width (n_face,) m of the air before every triangle; inf if no other stands opposite."""
    from nvhchain.acoustics.surfaces._pairs import opening_widths  # compiled

    centroids, normals = surface.centroids, surface.normals
    if plane is not None:
        centroids = np.concatenate([centroids, plane.mirror(centroids)])
        normals = np.concatenate([normals, plane.mirror_direction(normals)])
    return np.asarray(opening_widths(len(surface.triangles), centroids, normals, _OPPOSITE))


_PAIRS = 2**18
"""Pairs of points and triangles per block, whose arrays stay in the cache."""


def winding_numbers(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return winding numbers (m,) of a closed surface of triangles (n, 3, 3) about points (m, 3).

    The number is one inside and zero outside.  Source: van Oosterom & Strackee 1983, eq. 8.
    """
    middle = corners.mean(axis=(0, 1))
    a, b, c = np.moveaxis(corners - middle, 1, 0)
    sides = (a, a), (b, b), (c, c), (a, b), (b, c), (c, a)
    sums, dots = [(u + v).T for u, v in sides], [np.einsum("ij,ij->i", u, v) for u, v in sides]
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    doubled = (np.cross(a, b) + np.cross(b, c) + np.cross(c, a)).T
    found, block = np.empty(len(points)), max(1, _PAIRS // len(corners))
    for start in range(0, len(points), block):
        x = points[start : start + block] - middle
        square = np.einsum("ij,ij->i", x, x)[:, None]
        aa, bb, cc, ab, bc, ca = (
            square - np.einsum("pi,if->pf", x, both) + dot for both, dot in zip(sums, dots, strict=True)
        )
        la, lb, lc = (np.sqrt(squared.clip(0.0)) for squared in (aa, bb, cc))
        angle = np.arctan2(volumes - np.einsum("pi,if->pf", x, doubled), la * lb * lc + ab * lc + bc * la + ca * lb)
        found[start : start + block] = angle.sum(axis=1) / (2.0 * np.pi)
    return found


def clearances(surface: Surface, points: FloatArray, reach: float = np.inf) -> FloatArray:
    """Return the smallest distance (m,) of points (m, 3) from a triangle, in longest edges of that triangle.

    Distances of `reach` or more are inf.  Source: Ericson, Real-Time Collision Detection, 5.1.5.
    """
    corners, least = surface.vertices[surface.triangles], np.full(len(points), np.inf)
    tree, search_radius = cKDTree(points), (1.0 + reach) * surface.longest_edges
    pairs = np.cumsum(tree.query_ball_point(surface.centroids, search_radius, return_length=True))
    for some in np.split(np.arange(len(corners)), np.flatnonzero(np.diff(pairs // _PAIRS)) + 1):
        near_points = tree.query_ball_point(surface.centroids[some], search_radius[some])
        triangle = np.repeat(some, [len(indices) for indices in near_points])
        point = np.concatenate([np.asarray(indices, dtype=int) for indices in near_points])
        distance = _distances(corners[triangle] - points[point, None]) / surface.longest_edges[triangle]
        np.minimum.at(least, point, distance)
    return np.where(least < reach, least, np.inf)


def _distances(corners: FloatArray) -> FloatArray:
    """Return distances (n,) of triangles (n, 3, 3) from the origin."""
    a, b, c = np.moveaxis(corners, 1, 0)
    aa, bb, cc, ab, bc, ca = (np.einsum("ij,ij->i", u, v) for u, v in ((a, a), (b, b), (c, c), (a, b), (b, c), (c, a)))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))

    # Voronoi regions of the triangle; every edge parameter is the clipped projection on that edge.
    u, v = aa - ab, aa - ca
    gram_uu, gram_vv, gram_uv = aa + bb - 2 * ab, aa + cc - 2 * ca, aa - ab - ca + bc
    determinant = gram_uu * gram_vv - gram_uv**2
    s = (gram_vv * u - gram_uv * v) / determinant
    t = (gram_uu * v - gram_uv * u) / determinant
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    nearest = np.where(inside, np.abs(triple) / np.sqrt(determinant), np.inf)
    for first, second, p, q, pq in ((a, b, aa, bb, ab), (b, c, bb, cc, bc), (c, a, cc, aa, ca)):
        w = np.clip((p - pq) / (p + q - 2 * pq), 0.0, 1.0)[:, None]
        nearest = np.minimum(nearest, np.linalg.norm(first + w * (second - first), axis=1))
    return nearest
