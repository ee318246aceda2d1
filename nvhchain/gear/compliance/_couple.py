"""Compiled: compliance between points on flanks from coefficients of splines."""

import numba
import numpy as np


@numba.njit(
    "void(float64[:, :, :, ::1], int64[::1], int64[::1], int32[:, ::1], float64[:, ::1], float64[:, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def couple(
    coefficients: np.ndarray,
    place: np.ndarray,
    tooth: np.ndarray,
    index: np.ndarray,
    weight: np.ndarray,
    total: np.ndarray,
) -> None:
    """Fill the rows of the compliance under points of the same and of later teeth; the rest follows by symmetry.

    Teeth farther apart than the coefficients reach get nothing.
    """
    n, support = index.shape
    sector = len(place)
    size = coefficients.shape[2]
    row = np.empty(size)
    for i in range(n):
        held = place[tooth[i] % sector]
        start = 0
        while start < n:
            end = start + 1
            while end < n and tooth[end] == tooth[start]:
                end += 1
            distance = tooth[start] - tooth[i]
            if 0 <= distance < coefficients.shape[1]:
                block = coefficients[held, distance]
                row[:] = 0.0
                for p in range(support):
                    w = weight[i, p]
                    source = block[index[i, p]]
                    for c in range(size):
                        row[c] += w * source[c]
                for j in range(start, end):
                    value = 0.0
                    for q in range(support):
                        value += weight[j, q] * row[index[j, q]]
                    if distance == 0:  # (i, j) and (j, i) are both visited
                        total[i, j] += 0.5 * value
                        total[j, i] += 0.5 * value
                    else:
                        total[i, j] += value
                        total[j, i] += value
            start = end
