"""Distances from triangles in space, and a triangle cut into equal pieces."""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import FloatArray


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


def equal_pieces(count: int) -> FloatArray:
    """Corners (count², 3, 3) in area coordinates of the equal pieces of a triangle, `count` of them along each edge."""
    i, j = (index.ravel() for index in np.indices((count, count)))
    corner = np.array([[0, 0], [1, 0], [0, 1]])
    upward = np.stack([i, j], axis=1)[i + j < count][:, None] + corner
    downward = np.stack([i, j], axis=1)[i + j < count - 1][:, None] + 1 - corner
    xy = np.concatenate([upward, downward]) / count
    return np.concatenate([1 - xy.sum(axis=2, keepdims=True), xy], axis=2)
