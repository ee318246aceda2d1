"""Compiled forces of tooth pairs that share a load, each with its own deviation; `deviated_law` states the problem."""

from __future__ import annotations

import numba
import numpy as np

ROUNDS = 60
"""Largest number of rounds over the pairs of one position; ten are usual."""


@numba.njit(
    "float64(float64[:, :, :, ::1], float64[:, ::1], int64, int64, float64, float64[::1], float64[::1], float64[::1],"
    "float64)",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def shared(
    force: np.ndarray,
    coupling: np.ndarray,
    row: int,
    count: int,
    step: float,
    approach: np.ndarray,
    tilt: np.ndarray,
    F: np.ndarray,
    tolerance: float,
) -> float:
    """Fill the forces F (N) of the pairs of a row at their own approaches (m) and tilts; return their sum.

    force : (n_table, n_row, n_pair, n) forces of a pair alone at approaches 0, step, 2 step, …: untilted, or in tables
    at even tilts from −1 to 1.  coupling : (n_pair, n_pair).
    """
    last, tables = force.shape[3] - 2, force.shape[0]
    total = 0.0
    for _ in range(ROUNDS):
        change = 0.0
        total = 0.0
        for p in range(count):
            x = approach[p]
            for q in range(count):
                if q != p:
                    x -= coupling[p, q] * F[q]
            x /= step
            new = 0.0
            if x > 0.0:
                i = min(int(x), last)
                t = 0.5 * (tilt[p] + 1.0) * (tables - 1)
                k = max(min(int(t), tables - 2), 0)
                new = force[k, row, p, i] + (x - i) * (force[k, row, p, i + 1] - force[k, row, p, i])
                if tables > 1:
                    k += 1
                    more = force[k, row, p, i] + (x - i) * (force[k, row, p, i + 1] - force[k, row, p, i])
                    new += (t - (k - 1)) * (more - new)
            change = max(change, abs(new - F[p]))
            F[p] = new
            total += new
        if change <= tolerance * (total + 1e-12):
            break
    return total


@numba.njit(
    "void(float64[:, :, :, ::1], float64[:, :, ::1], int64[::1], float64, float64[:, :, ::1], float64[:, :, ::1], "
    "float64[::1], float64, float64[:, :, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def mesh_forces(
    force: np.ndarray,
    coupling: np.ndarray,
    counts: np.ndarray,
    step: float,
    gap: np.ndarray,
    tilt: np.ndarray,
    approach: np.ndarray,
    tolerance: float,
    total: np.ndarray,
) -> None:
    """Fill the mesh forces (n_later, n_row, n_approach) (N) at rising approaches of the flanks (m).

    gap, tilt : (n_later, n_row, n_pair) approaches at which the tables of the pairs begin (m), and tilts within ±1.
    """
    later, rows, size = total.shape
    pairs = gap.shape[2]
    F, own = np.zeros(pairs), np.zeros(pairs)
    for m in range(later):
        for a in range(rows):
            F[:] = 0.0
            for j in range(size):
                for p in range(counts[a]):
                    own[p] = approach[j] - gap[m, a, p]
                total[m, a, j] = shared(force, coupling[a], a, counts[a], step, own, tilt[m, a], F, tolerance)
