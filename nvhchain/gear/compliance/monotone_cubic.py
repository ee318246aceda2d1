"""Monotone cubic interpolation through rows of points, each row with its own abscissae, at one place.

Source: Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; end slopes after Moler, Numerical Computing with
MATLAB, ch. 3.6.  `scipy.interpolate.PchipInterpolator` computes the same, one row a call.
"""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import FloatArray, IntArray


def monotone_cubic(x: FloatArray, y: FloatArray, first: IntArray, last: IntArray, place: float) -> FloatArray:
    """Return the value (rows,) at x = `place` of the cubic through columns `first` to `last` of each row.

    x: (rows, n), never falling.  y: (n,), rising.  first, last: (rows,) with x[first] ≤ at ≤ x[last], first < last. The
    curve jumps where x is equal in several columns.
    """
    row = np.arange(len(x))
    step = np.diff(x, axis=1)
    left = np.clip((x < place).sum(axis=1) - 1, first, last - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.diff(y) / step
        tangent = np.zeros(x.shape)
        near, far = step[:, 1:], step[:, :-1]
        before, after = 2 * near + far, near + 2 * far
        mean = (before / slope[:, :-1] + after / slope[:, 1:]) / (before + after)  # mean of 1/slope
        tangent[:, 1:-1] = 1.0 / mean
        tangent[row, first] = _end(step, slope, row, first, np.minimum(first + 1, last - 1))
        tangent[row, last] = _end(step, slope, row, last - 1, np.maximum(last - 2, first))
        width, rise = step[row, left], slope[row, left]
        start, end = tangent[row, left], tangent[row, left + 1]
        s, bend = place - x[row, left], (start + end - 2 * rise) / width
        curve = y[left] + start * s + ((rise - start) / width - bend) * (s * s) + bend / width * (s * s * s)
    return np.where(s > 0, curve, y[left])


def _end(step: FloatArray, slope: FloatArray, row: IntArray, outer: IntArray, inner: IntArray) -> FloatArray:
    """Return the tangent at an end from the two nearest intervals: that of a parabola, never falling."""
    h, k, m, n = step[row, outer], step[row, inner], slope[row, outer], slope[row, inner]
    tangent = ((2 * h + k) * m - h * n) / (h + k)
    return np.where(inner == outer, m, np.where(tangent > 0, tangent, 0.0))
