"""Compiled solution of the contact of slices; `slice_forces` states the problem."""

from __future__ import annotations

import numba
import numpy as np

_SUMS = {"reassoc", "contract"}
"""Compiler flags that let sums follow the order of the processor's vectors: four times as fast, equal except for
rounding."""


SETTLED = 0.1
"""Part of the residual that a step may leave, for the next one to take the same factor."""

TILE = 4
"""Rows and columns of a matrix that are eliminated together, while they stay in the processor's registers."""


@numba.njit("void(float64[:, ::1], int64, int64)", cache=True, nogil=True, error_model="numpy", fastmath=_SUMS)
def reduce_tile(H: np.ndarray, i: int, j: int) -> None:
    """Subtract from the tile of H at row i and column j what the factor's columns before j make of it."""
    a0, a1, a2, a3 = H[i, j], H[i, j + 1], H[i, j + 2], H[i, j + 3]
    b0, b1, b2, b3 = H[i + 1, j], H[i + 1, j + 1], H[i + 1, j + 2], H[i + 1, j + 3]
    c0, c1, c2, c3 = H[i + 2, j], H[i + 2, j + 1], H[i + 2, j + 2], H[i + 2, j + 3]
    d0, d1, d2, d3 = H[i + 3, j], H[i + 3, j + 1], H[i + 3, j + 2], H[i + 3, j + 3]
    for k in range(j):
        a, b, c, d = H[i, k], H[i + 1, k], H[i + 2, k], H[i + 3, k]
        p, q, r, s = H[j, k], H[j + 1, k], H[j + 2, k], H[j + 3, k]
        a0, a1, a2, a3 = a0 - a * p, a1 - a * q, a2 - a * r, a3 - a * s
        b0, b1, b2, b3 = b0 - b * p, b1 - b * q, b2 - b * r, b3 - b * s
        c0, c1, c2, c3 = c0 - c * p, c1 - c * q, c2 - c * r, c3 - c * s
        d0, d1, d2, d3 = d0 - d * p, d1 - d * q, d2 - d * r, d3 - d * s
    H[i, j], H[i, j + 1], H[i, j + 2], H[i, j + 3] = a0, a1, a2, a3
    H[i + 1, j], H[i + 1, j + 1], H[i + 1, j + 2], H[i + 1, j + 3] = b0, b1, b2, b3
    H[i + 2, j], H[i + 2, j + 1], H[i + 2, j + 2], H[i + 2, j + 3] = c0, c1, c2, c3
    H[i + 3, j], H[i + 3, j + 1], H[i + 3, j + 2], H[i + 3, j + 3] = d0, d1, d2, d3


@numba.njit("boolean(float64[:, ::1], int64)", cache=True, nogil=True, error_model="numpy", fastmath=_SUMS)
def factorize(H: np.ndarray, n: int) -> bool:
    """Overwrite the lower triangle of the leading n rows of H by its Cholesky factor, n a multiple of `TILE`.

    Returns False where H is not positive definite.
    """
    for i in range(0, n, TILE):
        for j in range(0, i, TILE):
            reduce_tile(H, i, j)
            for row in range(i, i + TILE):
                s0 = H[row, j] / H[j, j]
                s1 = (H[row, j + 1] - s0 * H[j + 1, j]) / H[j + 1, j + 1]
                s2 = (H[row, j + 2] - s0 * H[j + 2, j] - s1 * H[j + 2, j + 1]) / H[j + 2, j + 2]
                s3 = H[row, j + 3] - s0 * H[j + 3, j] - s1 * H[j + 3, j + 1] - s2 * H[j + 3, j + 2]
                H[row, j], H[row, j + 1], H[row, j + 2], H[row, j + 3] = s0, s1, s2, s3 / H[j + 3, j + 3]
        for row in range(i, i + TILE):
            for column in range(i, row + 1):
                s = H[row, column]
                for k in range(column):
                    s -= H[row, k] * H[column, k]
                if row > column:
                    H[row, column] = s / H[column, column]
                elif s > 0.0:
                    H[row, row] = np.sqrt(s)
                else:
                    return False
    return True


@numba.njit("void(float64[:, ::1], float64[::1], int64)", cache=True, nogil=True, error_model="numpy", fastmath=_SUMS)
def substitute(H: np.ndarray, x: np.ndarray, n: int) -> None:
    """Overwrite the leading n entries of x by their solution, with the factor in the lower triangle of H."""
    for i in range(n):
        s = x[i]
        for k in range(i):
            s -= H[i, k] * x[k]
        x[i] = s / H[i, i]
    for i in range(n - 1, -1, -1):
        x[i] /= H[i, i]
        for k in range(i):
            x[k] -= H[i, k] * x[i]


@numba.njit("int64(float64, float64, float64, int64)", cache=True, nogil=True, error_model="numpy")
def piece_of(load: float, limit: float, pieces_per_ratio: float, last: int) -> int:
    """Return the piece of the local law for a load; both it and the limit are logarithms (of N/m)."""
    if load >= limit:
        return last
    return max(int(np.floor((load - limit) * pieces_per_ratio)) + last, 0)


@numba.njit(
    "Tuple((float64, float64))(float64[:, ::1], float64[::1], float64[::1], float64[::1], float64, float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath=_SUMS,
)
def gaps(
    C: np.ndarray,
    approach: np.ndarray,
    length: np.ndarray,
    log_limit: np.ndarray,
    pieces_per_ratio: float,
    level: np.ndarray,
    half_slope: np.ndarray,
    offset: np.ndarray,
    stored: np.ndarray,
    F: np.ndarray,
    g: np.ndarray,
) -> tuple[float, float]:
    """Fill the gaps g (m); return the potential Φ (J) and the largest violation (m).

    log_limit (n,): logarithms of the limits (N/m).
    """
    n = len(F)
    last = level.shape[1] - 1
    energy = 0.0
    worst = 0.0
    for i in range(n):
        u = 0.0
        for j in range(n):
            u += C[i, j] * F[j]
        energy += F[i] * (0.5 * u - approach[i])
        u -= approach[i]
        if F[i] > 0.0:
            q = F[i] / length[i]
            log = np.log(q)
            k = piece_of(log, log_limit[i], pieces_per_ratio, last)
            A, H, D = level[i, k], half_slope[i, k], offset[i, k]
            u += D + q * (A - H * log)
            energy += length[i] * (stored[i, k] + q * (D + q * (0.5 * A - H * (0.5 * log - 0.25))))
            worst = max(worst, abs(u))
        else:
            worst = max(worst, -u)
        g[i] = u
    return energy, worst


@numba.njit(
    "void(float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64, float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64, int64, float64[:, ::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def solve(
    C: np.ndarray,
    approach: np.ndarray,
    length: np.ndarray,
    limit: np.ndarray,
    pieces_per_ratio: float,
    level: np.ndarray,
    half_slope: np.ndarray,
    offset: np.ndarray,
    stored: np.ndarray,
    tolerance: float,
    max_iterations: int,
    forces: np.ndarray,
    residual: np.ndarray,
) -> None:
    """Solve by projected Newton with an active set, one case after the other, each started from the one before.

    A factor is used again, in the next case too, while the same slices carry and each step leaves at most a part
    `SETTLED` of the residual.
    """
    n = len(length)
    last = level.shape[1] - 1
    F, trial, g, g_trial = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    step, free = np.zeros(n + TILE), np.zeros(n, np.int64)
    H, factored = np.zeros((n + TILE, n + TILE)), np.zeros(n, np.int64)
    carrying, settled = 0, False
    before, log_limit = 0.0, np.log(limit)
    for case in range(len(approach)):
        a, scale = approach[case], 0.0
        for i in range(n):
            scale = max(scale, a[i])
        if not scale > 0.0:
            F[:] = 0.0
            before = 0.0
            continue
        # the law is close to linear: the scaled previous solution lies near and below the new one
        F *= scale / before if before > 0.0 else 0.0
        before = scale
        energy, worst = gaps(C, a, length, log_limit, pieces_per_ratio, level, half_slope, offset, stored, F, g)
        iteration = 0
        while worst > tolerance * scale and iteration < max_iterations:
            iteration += 1
            m = 0
            for i in range(n):
                if F[i] > 0.0 or g[i] < 0.0:
                    settled = settled and factored[m] == i
                    free[m] = i
                    step[m] = -g[i]
                    m += 1
            settled = settled and m == carrying
            carrying, whole = m, -(-m // TILE) * TILE
            for r in range(m, whole):
                step[r] = 0.0
            again = settled
            if not again:
                for r in range(m):
                    i = free[r]
                    factored[r] = i
                    # δ_loc has no finite slope at 0: a slice that closes takes the slope at a thousandth of the load
                    # that would take up about the whole approach locally
                    q = F[i] / length[i]
                    if q <= 0.0:
                        q = 1e-3 * min(scale / level[i, 0], limit[i])
                    log = np.log(q)
                    k = piece_of(log, log_limit[i], pieces_per_ratio, last)
                    for s in range(r):
                        H[r, s] = C[i, free[s]]
                    H[r, r] = C[i, i] + (level[i, k] - half_slope[i, k] * (log + 1.0)) / length[i]
                for r in range(m, whole):  # rows that move nothing
                    for s in range(r):
                        H[r, s] = 0.0
                    H[r, r] = 1.0
                if not factorize(H, whole):
                    break
            substitute(H, step, whole)
            alpha = 1.0
            accepted = False
            for _ in range(40):
                slope = 0.0
                trial[:] = 0.0
                for r in range(m):
                    i = free[r]
                    trial[i] = max(0.0, F[i] + alpha * step[r])
                    slope += g[i] * (trial[i] - F[i])
                e, w = gaps(
                    C, a, length, log_limit, pieces_per_ratio, level, half_slope, offset, stored, trial, g_trial
                )
                # near the solution Φ is flat to rounding; a falling residual is accepted instead
                if w < 0.5 * worst or e <= energy + 1e-4 * slope:
                    accepted = True
                    break
                alpha *= 0.5
            settled = accepted and w <= SETTLED * worst
            if not accepted and again:
                continue
            if not accepted:
                break
            F, trial, g, g_trial = trial, F, g_trial, g
            energy, worst = e, w
        residual[case] = worst / scale
        for i in range(n):  # an array slice would compile for seconds
            forces[case, i] = F[i]
