"""Groups of points that are neighbours in space."""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import FloatArray, IntArray


def bisect(positions: FloatArray, group: IntArray) -> tuple[IntArray, IntArray]:
    """Cut a group of `positions` (n, 3) at the median of its longest extent."""
    axis = int(np.argmax(np.ptp(positions[group], axis=0)))
    group = group[np.argsort(positions[group, axis], kind="stable")]
    return group[: len(group) // 2], group[len(group) // 2 :]


def groups(positions: FloatArray, size: int) -> list[IntArray]:
    """Return groups of at most `size` neighbours that together hold each of `positions` (n, 3) once."""
    found, stack = [], [np.arange(len(positions))]
    while stack:
        group = stack.pop()
        if len(group) <= size:
            found.append(group)
        else:
            stack += bisect(positions, group)
    return found


def diameter(positions: FloatArray) -> float:
    """Return the diagonal (m) of the box around `positions` (n, 3)."""
    return float(np.linalg.norm(np.ptp(positions, axis=0)))


def distance_to_box(positions: FloatArray, points: FloatArray) -> FloatArray:
    """Return the distance (m) of every point (m, 3) from the box around `positions` (n, 3); 0 inside."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    distance: FloatArray = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)
    return distance
