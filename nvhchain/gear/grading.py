"""Points along a line, close together near an end that disturbs the stress and farther apart away from it."""

from __future__ import annotations

from math import ceil

import numpy as np

from nvhchain.handoff import FloatArray

GROWTH = 0.5
"""Of the distance between points, over the way from the end: each is some 1.5 times the one before."""

_SAMPLES = 2001
"""Along the line at which the distance between points is added up."""


def graded(low: float, high: float, size: float, fine: float, near: list[float]) -> FloatArray:
    """Points, m, from `low` to `high`, at most about `size` apart, and `fine` apart at the ends in `near`."""
    if not near or fine >= size:
        return np.linspace(low, high, ceil((high - low) / size - 1e-9) + 1)
    x = np.linspace(low, high, _SAMPLES)
    away = np.abs(x[:, None] - near).min(axis=1)
    density = 1 / np.minimum(size, fine + GROWTH * away)
    number = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(x)))
    return np.interp(np.linspace(0.0, number[-1], ceil(number[-1] - 1e-9) + 1), number, x)
