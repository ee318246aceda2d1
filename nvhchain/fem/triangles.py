"""Points near triangles in space, and a triangle cut into equal pieces."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import FloatArray, IntArray


def squared_distance(point: FloatArray, corners: FloatArray) -> FloatArray:
    """Squared distance m² of points (..., 3) from triangles (..., 3, 3)."""
    a, b, c = (corners[..., i, :] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    height = np.einsum("...i,...i->...", point - a, normal)
    inside = np.ones(height.shape, dtype=bool)
    nearest = np.full(height.shape, np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        edge, arm = q - p, point - p
        inside &= np.einsum("...i,...i->...", np.cross(edge, arm), normal) >= 0
        along = np.einsum("...i,...i->...", arm, edge) / np.einsum("...i,...i->...", edge, edge)
        gap = arm - along.clip(0, 1)[..., None] * edge
        nearest = np.minimum(nearest, np.einsum("...i,...i->...", gap, gap))
    return np.where(inside, height**2, nearest)


def lying_on(points: FloatArray, corners: FloatArray, beside: float) -> IntArray:
    """Pairs (q, 2) of a point (p, 3) and a triangle (k, 3, 3) on which it lies, up to `beside` of the triangle's size.

    Triangles without area have no points on them.
    """
    centre = corners.mean(axis=1)
    size = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    near = cKDTree(points).query_ball_point(centre, (1 + beside) * size)
    owner = np.repeat(np.arange(len(corners)), [len(found) for found in near])
    point = np.concatenate([np.array(found, dtype=np.int64) for found in near])
    a, b, c = corners[owner].transpose(1, 0, 2)
    frame = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=2)
    area = np.abs(np.linalg.det(frame)) > 1e-12 * size[owner] ** 4
    owner, point, frame, away = owner[area], point[area], frame[area], (points[point] - a)[area]
    u, v, w = np.linalg.solve(frame, away[:, :, None])[:, :, 0].T
    height = np.abs(w) * np.linalg.norm(frame[:, :, 2], axis=1)
    on = (np.minimum(u, v) > -beside) & (u + v < 1 + beside) & (height < beside * size[owner])
    return np.column_stack([point, owner])[on]


def equal_pieces(count: int) -> FloatArray:
    """Corners (count², 3, 3) in area coordinates of the equal pieces of a triangle, `count` of them along each edge."""
    i, j = (index.ravel() for index in np.indices((count, count)))
    corner = np.array([[0, 0], [1, 0], [0, 1]])
    upward = np.stack([i, j], axis=1)[i + j < count][:, None] + corner
    downward = np.stack([i, j], axis=1)[i + j < count - 1][:, None] + 1 - corner
    xy = np.concatenate([upward, downward]) / count
    return np.concatenate([1 - xy.sum(axis=2, keepdims=True), xy], axis=2)
