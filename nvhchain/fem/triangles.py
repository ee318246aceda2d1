"""Distances of points from triangles in space, and triangles cut into equal pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import FloatArray, IntArray


def squared_distance(point: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the squared distance (m²) of points (..., 3) from triangles (..., 3, 3)."""
    a, b, c = (corners[..., i, :] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    height = np.einsum("...i,...i->...", point - a, normal)
    inside = np.ones(height.shape, dtype=bool)
    nearest = np.full(height.shape, np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        edge, arm = q - p, point - p
        inside &= np.einsum("...i,...i->...", np.cross(edge, arm), normal) >= 0
        share = np.einsum("...i,...i->...", arm, edge) / np.einsum("...i,...i->...", edge, edge)
        gap = arm - share.clip(0, 1)[..., None] * edge
        nearest = np.minimum(nearest, np.einsum("...i,...i->...", gap, gap))
    return np.where(inside, height**2, nearest)


@dataclass(frozen=True, eq=False)
class Planes:
    """Triangles in their own planes, for distances of many points.

    origin : (k, 3) first corners (m).
    axes : (k, 3, 3) unit vectors along the first side, across it towards the third corner, and normal.
    corner : (k, 3) place of the second corner along the first axis, and both coordinates of the third (m).
    """

    origin: FloatArray
    axes: FloatArray
    corner: FloatArray


def planes(corners: FloatArray) -> Planes:
    """Return the planes of triangles (k, 3, 3) with an area."""
    a, b, c = corners.transpose(1, 0, 2)
    side, arm = b - a, c - a
    length = np.linalg.norm(side, axis=1)
    first_axis = side / length[:, None]
    reach = np.einsum("ka,ka->k", arm, first_axis)
    second_axis = arm - reach[:, None] * first_axis
    height = np.linalg.norm(second_axis, axis=1)
    second_axis /= height[:, None]
    axes = np.stack([first_axis, second_axis, np.cross(first_axis, second_axis)], axis=1)
    return Planes(a, axes, np.stack([length, reach, height], axis=1))


def squared_distance_to(triangles: Planes, triangle: IntArray, points: FloatArray) -> FloatArray:
    """Return the squared distance (p,) (m²) of points (p, 3), each from one triangle of index `triangle` (p,)."""
    x, y, z = np.einsum("pia,pa->ip", triangles.axes[triangle], points - triangles.origin[triangle])
    b, c, d = triangles.corner[triangle].T
    # outside: below the first side, right of the second, or left of the third
    outside = (y < 0) | (d * (x - b) > (c - b) * y) | (d * x < c * y)
    least = (x - (x / b).clip(0, 1) * b) ** 2 + y**2
    for start, run in ((b, c - b), (0.0, c)):
        part = (((x - start) * run + y * d) / (run**2 + d**2)).clip(0, 1)
        least = np.minimum(least, (x - start - part * run) ** 2 + (y - part * d) ** 2)
    return np.asarray(np.where(outside, least, 0.0) + z**2)


def nearest_coordinates(triangles: Planes, triangle: IntArray, points: FloatArray) -> FloatArray:
    """Return area coordinates (p, 3) of the place on triangle `triangle` (p,) nearest to each point (p, 3)."""
    x, y, _ = np.einsum("pia,pa->ip", triangles.axes[triangle], points - triangles.origin[triangle])
    b, c, d = triangles.corner[triangle].T
    third = y / d
    second = (x - c * third) / b
    result = np.stack([1 - second - third, second, third], axis=1)
    outside = (result < 0).any(axis=1)
    flat = np.stack([x, y], axis=1)
    ends = [np.zeros((len(x), 2)), np.stack([b, np.zeros(len(x))], axis=1), np.stack([c, d], axis=1)]
    least = np.full(len(x), np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        side = ends[j] - ends[i]
        part = (((flat - ends[i]) * side).sum(axis=1) / (side**2).sum(axis=1)).clip(0, 1)
        apart = ((flat - ends[i] - part[:, None] * side) ** 2).sum(axis=1)
        nearer = outside & (apart < least)
        least[nearer] = apart[nearer]
        result[nearer] = 0.0
        result[nearer, i], result[nearer, j] = 1 - part[nearer], part[nearer]
    return result


def lying_on(points: FloatArray, corners: FloatArray, tolerance: float | FloatArray) -> IntArray:
    """Return pairs (q, 2) of points (p, 3) and triangles (k, 3, 3) on which they lie.

    tolerance : tolerance relative to the size of a triangle, (k,) or one for all.

    Triangles without area have no points on them.
    """
    tolerance = np.broadcast_to(tolerance, len(corners))
    centre = corners.mean(axis=1)
    size = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    near = cKDTree(points).query_ball_point(centre, (1 + tolerance) * size)
    owner = np.repeat(np.arange(len(corners)), [len(found) for found in near])
    point = np.concatenate([np.array(found, dtype=np.int64) for found in near])
    a, b, c = corners[owner].transpose(1, 0, 2)
    frame = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=2)
    area = np.abs(np.linalg.det(frame)) > 1e-12 * size[owner] ** 4
    owner, point, frame, away = owner[area], point[area], frame[area], (points[point] - a)[area]
    tolerance = tolerance[owner]
    u, v, w = np.linalg.solve(frame, away[:, :, None])[:, :, 0].T
    height = np.abs(w) * np.linalg.norm(frame[:, :, 2], axis=1)
    on = (np.minimum(u, v) > -tolerance) & (u + v < 1 + tolerance) & (height < tolerance * size[owner])
    return np.column_stack([point, owner])[on]


def equal_pieces(count: int) -> FloatArray:
    """Return corners (count², 3, 3) in area coordinates of the equal pieces of a triangle, `count` along each edge."""
    i, j = (index.ravel() for index in np.indices((count, count)))
    corner = np.array([[0, 0], [1, 0], [0, 1]])
    upward = np.stack([i, j], axis=1)[i + j < count][:, None] + corner
    downward = np.stack([i, j], axis=1)[i + j < count - 1][:, None] + 1 - corner
    xy = np.concatenate([upward, downward]) / count
    return np.concatenate([1 - xy.sum(axis=2, keepdims=True), xy], axis=2)
