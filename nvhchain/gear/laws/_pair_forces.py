"""Compiled forces of tooth pairs that share a load, each with its own deviation; `deviated_pairs` states it."""

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


SECANTS = 40
"""Largest number of approaches tried for one position under a given force; five are usual."""


@numba.njit(
    "void(float64[:, :, :, ::1], float64[:, :, ::1], int64[::1], float64, float64[:, :, ::1], float64[:, :, ::1], "
    "float64, float64, float64[:, :, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def shared_load(
    force: np.ndarray,
    coupling: np.ndarray,
    counts: np.ndarray,
    step: float,
    gap: np.ndarray,
    tilt: np.ndarray,
    load: float,
    tolerance: float,
    carried: np.ndarray,
) -> None:
    """Fill the forces (n_later, n_row, n_pair) (N) of the pairs that together carry a load (N).

    The approach is bracketed and found by false position, which halves the weight of an end that stays (Illinois).
    """
    later, rows, pairs = gap.shape
    own = np.zeros(pairs)
    pressed = 10.0 * step
    for m in range(later):
        for a in range(rows):
            count = counts[a]
            if count == 0:
                continue
            F = carried[m, a]
            low = gap[m, a, :count].min()
            below, high, above, x, side = -load, low, 0.0, low + pressed, 0
            stride = pressed  # until the load is bracketed
            for _ in range(SECANTS):
                for p in range(count):
                    own[p] = x - gap[m, a, p]
                excess = shared(force, coupling[a], a, count, step, own, tilt[m, a], F, 0.1 * tolerance) - load
                if abs(excess) <= tolerance * load:
                    break
                if excess < 0.0:
                    low, below = x, excess
                    if side < 0:
                        above *= 0.5
                    side = -1
                else:
                    high, above = x, excess
                    if side > 0:
                        below *= 0.5
                    side = 1
                if above > 0.0:
                    x = (low * above - high * below) / (above - below)
                else:
                    stride *= 2.0
                    x = low + stride
            pressed = max(x - gap[m, a, :count].min(), step)
