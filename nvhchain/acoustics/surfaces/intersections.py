"""Triangles of a surface that pass through each other, touch, are folded or face each other across a gap."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from nvhchain.fem.triangles import squared_distance
from nvhchain.handoff import FloatArray, IntArray, Surface

FACING = np.cos(np.radians(120.0))
"""Cosine of the angle between normals below which two triangles stand opposite to each other."""

_ROUNDING = 1e-12
"""Height over a plane, in edges, that counts as lying in it."""

FOLD = 1e-3
"""Angle (rad) between two triangles at their common edge below which they lie on each other."""

_PLANE_TOLERANCE = 1e-9
"""Angle (rad) and overlap (edges) that rounding may cause for triangles that only touch each other."""


class Facing(NamedTuple):
    """Triangles that stand opposite to each other.

    pairs : (n, 2) triangles.
    ratio : (n,) distance of each pair, in longest edges of the longer triangle.
    air : (n,) bool true if the triangles face each other across a gap, False if they are the two sides of a wall.
    """

    pairs: IntArray
    ratio: FloatArray
    air: NDArray[np.bool_]


def neighbours(surface: Surface, reach: float) -> IntArray:
    """Return pairs (n, 2) of triangles without a common vertex whose widened bounding boxes overlap.

    Each box is widened on every side by `reach` times half the longest edge of its triangle.
    """
    from nvhchain.acoustics.surfaces._pairs import sweep  # compiled

    corners = surface.vertices[surface.triangles]
    margin = 0.5 * reach * surface.longest_edges[:, None]
    low, high = corners.min(axis=1) - margin, corners.max(axis=1) + margin
    axis = int(np.argmax(np.ptp(surface.vertices, axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    # sorted along the longest extent, so that a sweep visits few pairs
    turned = np.roll(np.arange(3), -axis)
    boxes = np.ascontiguousarray(np.concatenate([low[:, turned], high[:, turned]], axis=1)[order])
    triangles = np.ascontiguousarray(surface.triangles[order])
    pairs = np.empty((sweep(boxes, triangles, np.empty((0, 2), dtype=np.int64)), 2), dtype=np.int64)
    sweep(boxes, triangles, pairs)
    return order[pairs]


def crossing_pairs(surface: Surface, pairs: IntArray) -> IntArray:
    """Return those of `pairs` (n, 2) of triangles without a common vertex that cross, touch or overlap.

    An edge of one triangle passes through the other or ends on it, or both overlap in one plane.
    """
    corners = surface.vertices[surface.triangles]
    size = surface.longest_edges
    flat = pairs[_coplanar(surface, pairs)]
    for one, other in ((0, 1), (1, 0)):
        # most neighbours lie on one side of each other's plane
        height = _heights(corners[pairs[:, one]], corners[pairs[:, other]], surface.normals[pairs[:, other]])
        slack = _ROUNDING * np.maximum(size[pairs[:, 0]], size[pairs[:, 1]])[:, None]
        one_side = (height > slack).all(axis=1) | (height < -slack).all(axis=1) | (np.abs(height) <= slack).all(axis=1)
        pairs = pairs[~one_side]
    crossing = np.zeros(len(pairs), dtype=bool)
    for left, right in ((pairs[:, 0], pairs[:, 1]), (pairs[:, 1], pairs[:, 0])):
        height = _heights(corners[left], corners[right], surface.normals[right])
        slack = _ROUNDING * np.maximum(size[left], size[right])
        for i in range(3):
            start, end = height[:, i], height[:, (i + 1) % 3]
            piercing = (np.minimum(start, end) <= slack) & (np.maximum(start, end) >= -slack)
            piercing &= np.abs(end - start) > 2.0 * slack  # an edge in the plane crosses nothing
            share = (start / np.where(piercing, start - end, 1.0)).clip(0.0, 1.0)[:, None]
            point = (1.0 - share) * corners[left, i] + share * corners[left, (i + 1) % 3]
            crossing |= piercing & (squared_distance(point, corners[right]) <= slack**2)
    return np.concatenate([pairs[crossing], flat[_overlapping(surface, flat)]])


def folded_pairs(surface: Surface) -> IntArray:
    """Return pairs (n, 2) of triangles that share more than their common vertex or edge.

    At an edge, they are folded onto each other within `FOLD`. At a vertex, they overlap in one plane, or the line in
    which their planes meet runs into both from there.
    """
    pairs, common = joined_pairs(surface)
    edge_pairs, vertex_pairs = pairs[common == 2], pairs[common == 1]
    inward = np.array([_inward(surface, edge_pairs[:, i], edge_pairs[:, 1 - i]) for i in (0, 1)])
    folded = np.linalg.norm(inward[0] - inward[1], axis=1) < FOLD
    flat = _coplanar(surface, vertex_pairs)
    meeting, coplanar_pairs = vertex_pairs[~flat], vertex_pairs[flat]
    line = np.cross(surface.normals[meeting[:, 0]], surface.normals[meeting[:, 1]])
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    ways = _runs_into(surface, meeting, line)
    some = np.flatnonzero(ways.any(axis=0))  # few in a fan, whose pairs grow with the square of its triangles
    intersecting = np.zeros(len(meeting), dtype=bool)
    intersecting[some] = (ways[:, some] & _runs_into(surface, meeting[some, ::-1], line[some])).any(axis=0)
    twice = pairs[common == 3]
    return np.concatenate(
        [twice, edge_pairs[folded], meeting[intersecting], coplanar_pairs[_overlapping(surface, coplanar_pairs)]]
    )


def joined_pairs(surface: Surface) -> tuple[IntArray, IntArray]:
    """Return pairs (n, 2) of triangles with common vertices, and the number (n,) of these."""
    count = len(surface.triangles)
    corner = np.repeat(np.arange(count), 3)
    incidence = sp.csr_matrix((np.ones(3 * count, dtype=np.int64), (corner, surface.triangles.ravel())))
    joined = sp.triu(incidence @ incidence.T, k=1).tocoo()
    return np.stack([joined.row, joined.col], axis=1).astype(np.int64), joined.data


def _inward(surface: Surface, triangle: IntArray, neighbour: IntArray) -> FloatArray:
    """Return inward unit vectors (n, 3) in triangles `triangle` (n,), normal to the edge in common with `neighbour`."""
    shared = (surface.triangles[triangle][:, :, None] == surface.triangles[neighbour][:, None, :]).any(axis=2)
    apex = np.argmin(shared, axis=1)
    start, end, tip = (_corner(surface, triangle, apex + i) for i in (1, 2, 0))
    edge, arm = end - start, tip - start
    share = np.einsum("ni,ni->n", edge, arm) / np.einsum("ni,ni->n", edge, edge)
    altitude = arm - share[:, None] * edge
    return np.asarray(altitude / np.linalg.norm(altitude, axis=1, keepdims=True))


def _runs_into(surface: Surface, pairs: IntArray, line: FloatArray) -> NDArray[np.bool_]:
    """Return a mask (2, n) of lines (n, 3) that run into the first triangle of `pairs` (n, 2).

    The lines are unit vectors in the plane of that triangle and start at the vertex shared with the second. The rows
    count along and against them.
    """
    corners, own = surface.vertices[surface.triangles], pairs[:, 0]
    shared_corner = (
        (surface.triangles[own][:, :, None] == surface.triangles[pairs[:, 1]][:, None, :]).any(axis=2).argmax(axis=1)
    )
    # for every corner: unit vectors in the plane, normal to both its edges, into the triangle
    edges = np.stack([np.roll(corners, -1, axis=1) - corners, corners - np.roll(corners, 1, axis=1)], axis=2)
    inward = np.cross(surface.normals[:, None, None], edges)
    inward /= np.linalg.norm(inward, axis=3, keepdims=True)
    sine = np.array([np.einsum("ni,ni->n", inward[own, shared_corner, side], line) for side in (0, 1)])
    return np.array([(sine >= -_PLANE_TOLERANCE).all(axis=0), (sine <= _PLANE_TOLERANCE).all(axis=0)])


def _corner(surface: Surface, triangles: IntArray, number: IntArray) -> FloatArray:
    """Return corners (n, 3) of `triangles` (n,) by their cyclic numbers (n,)."""
    return np.asarray(surface.vertices[surface.triangles[triangles, number % 3]])


def _coplanar(surface: Surface, pairs: IntArray) -> NDArray[np.bool_]:
    """Return a mask of `pairs` (n, 2) of triangles that lie in one plane."""
    corners = surface.vertices[surface.triangles]
    slack = _PLANE_TOLERANCE * surface.longest_edges[pairs].max(axis=1)
    parallel = np.einsum("ni,ni->n", *surface.normals[pairs].transpose(1, 0, 2)) ** 2 > 0.9
    flat = np.zeros(len(pairs), dtype=bool)
    one, other = pairs[parallel].T
    height = [_heights(corners[a], corners[b], surface.normals[b]) for a, b in ((one, other), (other, one))]
    flat[parallel] = np.abs(height).max(axis=(0, 2)) <= slack[parallel]
    return flat


def _overlapping(surface: Surface, pairs: IntArray) -> NDArray[np.bool_]:
    """Return a mask of `pairs` (n, 2) of triangles in one plane that overlap: no edge separates the two."""
    corners = surface.vertices[surface.triangles[pairs]]
    slack = _PLANE_TOLERANCE * surface.longest_edges[pairs].max(axis=1)
    overlapping = np.ones(len(pairs), dtype=bool)
    for own in (0, 1):
        for i in range(3):
            start = corners[:, own, i]
            outward = np.cross(corners[:, own, (i + 1) % 3] - start, surface.normals[pairs[:, own]])
            outward /= np.linalg.norm(outward, axis=1, keepdims=True)
            nearest = np.einsum("nij,nj->ni", corners[:, 1 - own] - start[:, None], outward).min(axis=1)
            overlapping &= nearest < -slack
    return overlapping


def _heights(points: FloatArray, corners: FloatArray, normals: FloatArray) -> FloatArray:
    """Return heights (n, 3) of three points each over the planes of triangles with corners (n, 3, 3) and `normals`."""
    return np.asarray(np.einsum("nij,nj->ni", points - corners[:, :1], normals))


def facing_pairs(surface: Surface, pairs: IntArray, reach: float) -> Facing:
    """Return those of `pairs` (n, 2) of triangles that stand opposite to each other nearer than `reach` edges.

    The distance is the smallest one of corners, edge midpoints and centroid of one triangle from the other.
    """
    normals, corners, size = surface.normals, surface.vertices[surface.triangles], surface.longest_edges
    opposite = np.einsum("ni,ni->n", normals[pairs[:, 0]], normals[pairs[:, 1]]) < FACING
    offset = surface.centroids[pairs[:, 1]] - surface.centroids[pairs[:, 0]]
    ahead = np.einsum("ni,ni->n", offset, normals[pairs[:, 0]])
    other_ahead = np.einsum("ni,ni->n", offset, normals[pairs[:, 1]])
    chosen = opposite & (ahead * other_ahead < 0)
    pairs, air = pairs[chosen], ahead[chosen] > 0
    # a triangle on one side of the other's plane is no nearer than its lowest corner: needles of a fan
    for own in (0, 1):
        one, other = pairs[:, own], pairs[:, 1 - own]
        height = _heights(corners[one], corners[other], normals[other])
        plane_distance = np.maximum(height.min(axis=1), -height.max(axis=1))
        reached = plane_distance < reach * np.maximum(size[one], size[other])
        pairs, air = pairs[reached], air[reached]
    least = np.full(len(pairs), np.inf)
    for one, other in ((pairs[:, 0], pairs[:, 1]), (pairs[:, 1], pairs[:, 0])):
        for i in range(3):
            for point in (corners[one, i], 0.5 * (corners[one, i] + corners[one, (i + 1) % 3])):
                least = np.minimum(least, squared_distance(point, corners[other]))
        least = np.minimum(least, squared_distance(surface.centroids[one], corners[other]))
    ratio = np.sqrt(least) / np.maximum(size[pairs[:, 0]], size[pairs[:, 1]])
    near = ratio < reach
    return Facing(pairs[near], ratio[near], air[near])
