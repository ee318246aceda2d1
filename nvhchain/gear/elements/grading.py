"""Graded element ends along a line: dense about a place that disturbs the stress, growing with the distance from it."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf

import numpy as np

from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class Grading:
    """Size of elements along a line: constant within a zone, then growing.

    centre : middle of the zone (m).
    size : size within the zone (m).
    zone : half length of the zone (m).
    growth : growth of the size per distance beyond the zone (m/m).
    largest : largest size (m).
    """

    centre: float
    size: float
    zone: float
    growth: float
    largest: float = inf

    def needed(self, low: float, high: float) -> int:
        """Return the number of elements needed between `low` and `high` (m)."""
        start, end = self._count(np.array([low, high]))
        return ceil(float(end - start) - 1e-9)

    def ends(self, low: float, high: float, elements: int | None = None) -> FloatArray:
        """Return element ends (elements + 1,) in m from `low` to `high`.

        By default they are as many as needed.  With another number all elements are scaled a little.
        """
        start, end = self._count(np.array([low, high]))
        points = self._place(np.linspace(start, end, (elements or self.needed(low, high)) + 1))
        points[0], points[-1] = low, high
        return points

    @property
    def _grown(self) -> float:
        """Distance from the centre at which elements reach the largest size (m)."""
        return self.zone + (self.largest - self.size) / self.growth

    def _count(self, place: FloatArray) -> FloatArray:
        """Return the number of elements from the centre to `place` (m): the integral of 1/size."""
        away = np.abs(place - self.centre)
        growing = np.clip(away - self.zone, 0.0, self._grown - self.zone)
        number = np.minimum(away, self.zone) / self.size + np.log1p(self.growth * growing / self.size) / self.growth
        return np.sign(place - self.centre) * (number + np.maximum(away - self._grown, 0.0) / self.largest)

    def _place(self, count: FloatArray) -> FloatArray:
        """Return the position (m) for a number of elements from the centre; the inverse of `_count`."""
        number, even = np.abs(count), self.zone / self.size
        grown = even + np.log(self.largest / self.size) / self.growth  # number of elements up to the largest
        growing = np.clip(number - even, 0.0, grown - even)
        away = np.minimum(number * self.size, self.zone) + np.expm1(self.growth * growing) * self.size / self.growth
        excess = np.maximum(number - grown, 0.0)
        part = np.multiply(excess, self.largest, where=excess > 0, out=np.zeros_like(excess))  # 0 · ∞ counts as 0
        return self.centre + np.sign(count) * (away + part)


def insert_middles(ends: FloatArray) -> FloatArray:
    """Return the element ends with their middles in between."""
    points = np.empty(2 * len(ends) - 1)
    points[::2], points[1::2] = ends, 0.5 * (ends[:-1] + ends[1:])
    return points
