"""Outline of the casting in the transverse plane: the convex hull of circles around the shafts, with an offset.

The hull is a closed chain of arcs joined by common tangents. An offset changes every radius by the same amount and
keeps the tangent directions. Outlines at different offsets therefore have the same edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nvhchain.handoff import FloatArray

_DIRECTIONS = 7200
"""Number of directions in which the outermost circle is looked up before the tangents are found exactly."""


@dataclass(frozen=True)
class Arc:
    """Arc of a circle from angle `start` to `end` > `start` (rad), counter-clockwise; lengths in m."""

    x: float
    y: float
    radius: float
    start: float
    end: float

    def point(self, angle: float) -> FloatArray:
        """Return the point (2,) m at an angle (rad)."""
        return np.array([self.x, self.y]) + self.radius * np.array([np.cos(angle), np.sin(angle)])


def hull(circles: Sequence[tuple[float, float, float]], offset: float = 0.0) -> tuple[Arc, ...]:
    """Return the convex hull of `circles` (x, y, radius; m) as counter-clockwise arcs, radii grown by `offset` (m)."""
    return _hull(tuple(circles), offset)


@lru_cache(maxsize=128)
def _hull(circles: tuple[tuple[float, float, float], ...], offset: float) -> tuple[Arc, ...]:
    """Return the hull; every state of a map checks its case with the same ones."""
    x, y, radius = np.array(circles, dtype=float).T
    angle = np.linspace(0.0, 2 * np.pi, _DIRECTIONS, endpoint=False)
    reach = x[:, None] * np.cos(angle) + y[:, None] * np.sin(angle) + radius[:, None]
    outermost = reach.argmax(axis=0)
    change = np.flatnonzero(outermost != np.roll(outermost, 1))
    if change.size == 0:
        i = int(outermost[0])
        return (Arc(x[i], y[i], radius[i] + offset, 0.0, 2 * np.pi),)
    starts = [
        _tangent(x, y, radius, int(outermost[index - 1]), int(outermost[index]), float(angle[index]))
        for index in change
    ]
    arcs = []
    for number, index in enumerate(change):
        i = int(outermost[index])
        start = starts[number]
        end = starts[(number + 1) % len(starts)]
        arcs.append(Arc(x[i], y[i], radius[i] + offset, start, start + (end - start) % (2 * np.pi)))
    return tuple(arcs)


def _tangent(x: FloatArray, y: FloatArray, radius: FloatArray, i: int, j: int, angle: float) -> float:
    """Return the normal direction (rad) of the common outer tangent of circles i and j that lies close to `angle`."""
    dx, dy = x[j] - x[i], y[j] - y[i]
    distance, base = np.hypot(dx, dy), np.arctan2(dy, dx)
    # n·(c_j − c_i) + r_j − r_i = 0
    lean = np.arccos((radius[i] - radius[j]) / distance)
    options = np.array([base + lean, base - lean])
    turn = (options - angle + np.pi) % (2 * np.pi) - np.pi
    return float(angle + turn[np.abs(turn).argmin()])


def stations(arcs: Sequence[Arc], count: int, start: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return `count` points (count, 2) m and outward normals (count, 2), evenly spaced along the outline.

    start : position of the first point over the spacing, from the first arc's start.
    """
    pieces: list[tuple[float, Arc, FloatArray | None]] = []
    for arc, following in zip(arcs, [*arcs[1:], arcs[0]], strict=True):
        pieces.append((arc.radius * (arc.end - arc.start), arc, None))
        line = following.point(following.start) - arc.point(arc.end)
        pieces.append((float(np.hypot(*line)), arc, line))
    ends = np.cumsum([length for length, _, _ in pieces])
    points, normals = [], []
    for s in (np.arange(count) + start) / count * ends[-1] % ends[-1]:
        k = int(np.searchsorted(ends, s, side="right"))
        length, arc, segment = pieces[k]
        share = 1 - (ends[k] - s) / length
        angle = arc.start + share * (arc.end - arc.start) if segment is None else arc.end
        points.append(arc.point(angle) + (0.0 if segment is None else share * segment))
        normals.append([np.cos(angle), np.sin(angle)])
    return np.array(points).reshape(-1, 2), np.array(normals).reshape(-1, 2)


def inner_distance(arcs: Sequence[Arc], points: FloatArray) -> FloatArray:
    """Return the distance (k,) m of `points` (k, 2) inside the outline; outside, minus a lower bound of it."""
    normal, support = _support(tuple(arcs))
    return np.asarray((support - np.atleast_2d(points) @ normal).min(axis=1))


@lru_cache(maxsize=128)
def _support(arcs: tuple[Arc, ...]) -> tuple[FloatArray, FloatArray]:
    """Return normals (2, n) of an outline and its largest reach (n,) m along them."""
    angle = np.linspace(0.0, 2 * np.pi, _DIRECTIONS, endpoint=False)
    normal = np.stack([np.cos(angle), np.sin(angle)])
    return normal, np.max([arc.x * normal[0] + arc.y * normal[1] + arc.radius for arc in arcs], axis=0)
