"""Points that lie close where the contact is and ever farther apart away from it."""

from __future__ import annotations

from math import ceil

import numpy as np

from nvhchain.handoff import FloatArray


def elements_needed(low: float, high: float, centre: float, size: float, zone: float, growth: float) -> int:
    """Elements between `low` and `high`, m, of `size` within `zone` of `centre`, beyond it growing by `growth`/m·m."""
    return ceil(
        float(
            _count(np.array([high]), centre, size, zone, growth)[0]
            - _count(np.array([low]), centre, size, zone, growth)[0]
        )
        - 1e-9
    )


def graded(
    low: float, high: float, centre: float, size: float, zone: float, growth: float, elements: int
) -> FloatArray:
    """(elements + 1,) m: ends of `elements` elements that keep these proportions; all a little smaller or larger."""
    start, end = _count(np.array([low, high]), centre, size, zone, growth)
    points = _place(np.linspace(start, end, elements + 1), centre, size, zone, growth)
    points[0], points[-1] = low, high
    return points


def _count(at: FloatArray, centre: float, size: float, zone: float, growth: float) -> FloatArray:
    """Elements from `centre` to `at`: the integral of 1/h with h = size + growth · (distance − zone)₊."""
    away = np.abs(at - centre)
    beyond = np.log1p(growth * np.maximum(away - zone, 0.0) / size) / growth
    return np.sign(at - centre) * (np.minimum(away, zone) / size + beyond)


def _place(count: FloatArray, centre: float, size: float, zone: float, growth: float) -> FloatArray:
    """Inverse of `_count`."""
    number = np.abs(count)
    beyond = np.maximum(number - zone / size, 0.0)
    away = np.minimum(number * size, zone) + np.expm1(growth * beyond) * size / growth
    return centre + np.sign(count) * away
