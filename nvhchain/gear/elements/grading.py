"""Ends of elements along a line: close together about a place that disturbs the stress, ever farther apart beyond."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf

import numpy as np

from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class Grading:
    """Size of elements, m: `size` within `zone` of `centre`, beyond it growing by `growth`/m·m up to `largest`."""

    centre: float
    size: float
    zone: float
    growth: float
    largest: float = inf

    def needed(self, low: float, high: float) -> int:
        """Elements between `low` and `high`, m."""
        start, end = self._count(np.array([low, high]))
        return ceil(float(end - start) - 1e-9)

    def ends(self, low: float, high: float, elements: int | None = None) -> FloatArray:
        """(elements + 1,) m from `low` to `high`: those needed, or so many, all a little smaller or larger."""
        start, end = self._count(np.array([low, high]))
        points = self._place(np.linspace(start, end, (elements or self.needed(low, high)) + 1))
        points[0], points[-1] = low, high
        return points

    @property
    def _grown(self) -> float:
        """Distance from the centre at which elements are the largest, m."""
        return self.zone + (self.largest - self.size) / self.growth

    def _count(self, at: FloatArray) -> FloatArray:
        """Elements from the centre to `at`: the integral of 1/size."""
        away = np.abs(at - self.centre)
        growing = np.clip(away - self.zone, 0.0, self._grown - self.zone)
        number = np.minimum(away, self.zone) / self.size + np.log1p(self.growth * growing / self.size) / self.growth
        return np.sign(at - self.centre) * (number + np.maximum(away - self._grown, 0.0) / self.largest)

    def _place(self, count: FloatArray) -> FloatArray:
        """Inverse of `_count`."""
        number, even = np.abs(count), self.zone / self.size
        grown = even + np.log(self.largest / self.size) / self.growth  # elements up to the largest
        growing = np.clip(number - even, 0.0, grown - even)
        away = np.minimum(number * self.size, self.zone) + np.expm1(self.growth * growing) * self.size / self.growth
        beyond = np.maximum(number - grown, 0.0)
        part = np.multiply(beyond, self.largest, where=beyond > 0, out=np.zeros_like(beyond))  # 0 · ∞ is none
        return self.centre + np.sign(count) * (away + part)


def with_middles(ends: FloatArray) -> FloatArray:
    """Element ends and, between them, their middles."""
    points = np.empty(2 * len(ends) - 1)
    points[::2], points[1::2] = ends, 0.5 * (ends[:-1] + ends[1:])
    return points
