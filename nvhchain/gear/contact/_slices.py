"""Compiled solution of the contact of slices; `slice_forces` states the problem."""

from __future__ import annotations

import numba
import numpy as np

_SUMS = {"reassoc", "contract"}
"""Compiler flags that let sums follow the order of the processor's vectors: four times as fast, equal except for
rounding."""


@numba.njit(
    "boolean(float64[:, ::1], float64[::1], int64)", cache=True, nogil=True, error_model="numpy", fastmath=_SUMS
)
def cholesky_solve(H: np.ndarray, x: np.ndarray, n: int) -> bool:
    """Overwrite the leading n entries of x by H⁻¹x; the lower triangle of H becomes its factor.

    Returns False where H is not positive definite.
    """
    for i in range(n):
        for j in range(i + 1):
            s = H[i, j]
            for k in range(j):
                s -= H[i, k] * H[j, k]
            if i == j:
                if not s > 0.0:
                    return False
                H[i, i] = np.sqrt(s)
            else:
                H[i, j] = s / H[j, j]
    for i in range(n):
        s = x[i]
        for k in range(i):
            s -= H[i, k] * x[k]
        x[i] = s / H[i, i]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, n):
            s -= H[k, i] * x[k]
        x[i] = s / H[i, i]
    return True


@numba.njit("int64(float64, float64, float64, int64)", cache=True, nogil=True, error_model="numpy")
def piece_of(q: float, limit: float, pieces_per_ratio: float, last: int) -> int:
    """Return the piece of the local law for the load q > 0 (N/m)."""
    if q >= limit:
        return last
    return max(int(np.floor(np.log(q / limit) * pieces_per_ratio)) + last, 0)


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
    limit: np.ndarray,
    pieces_per_ratio: float,
    level: np.ndarray,
    half_slope: np.ndarray,
    offset: np.ndarray,
    stored: np.ndarray,
    F: np.ndarray,
    g: np.ndarray,
) -> tuple[float, float]:
    """Fill the gaps g (m); return the potential Φ (J) and the largest violation (m)."""
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
            k = piece_of(q, limit[i], pieces_per_ratio, last)
            A, H, D, log = level[i, k], half_slope[i, k], offset[i, k], np.log(q)
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
    """Solve by projected Newton with an active set, one case after the other, each started from the one before."""
    n = len(length)
    last = level.shape[1] - 1
    F, trial, g, g_trial = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    step, free = np.zeros(n), np.zeros(n, np.int64)
    H = np.zeros((n, n))
    before = 0.0
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
        energy, worst = gaps(C, a, length, limit, pieces_per_ratio, level, half_slope, offset, stored, F, g)
        iteration = 0
        while worst > tolerance * scale and iteration < max_iterations:
            iteration += 1
            m = 0
            for i in range(n):
                if F[i] > 0.0 or g[i] < 0.0:
                    free[m] = i
                    m += 1
            for r in range(m):
                i = free[r]
                # δ_loc has no finite slope at 0: a slice that closes takes the slope at a thousandth of the load that
                # would take up about the whole approach locally
                q = F[i] / length[i]
                if q <= 0.0:
                    q = 1e-3 * min(scale / level[i, 0], limit[i])
                k = piece_of(q, limit[i], pieces_per_ratio, last)
                for s in range(r):
                    H[r, s] = C[i, free[s]]
                H[r, r] = C[i, i] + (level[i, k] - half_slope[i, k] * (np.log(q) + 1.0)) / length[i]
                step[r] = -g[i]
            if not cholesky_solve(H, step, m):
                break
            alpha = 1.0
            accepted = False
            for _ in range(40):
                slope = 0.0
                trial[:] = 0.0
                for r in range(m):
                    i = free[r]
                    trial[i] = max(0.0, F[i] + alpha * step[r])
                    slope += g[i] * (trial[i] - F[i])
                e, w = gaps(C, a, length, limit, pieces_per_ratio, level, half_slope, offset, stored, trial, g_trial)
                # near the solution Φ is flat to rounding; a falling residual is accepted instead
                if w < 0.5 * worst or e <= energy + 1e-4 * slope:
                    accepted = True
                    break
                alpha *= 0.5
            if not accepted:
                break
            F, trial, g, g_trial = trial, F, g_trial, g
            energy, worst = e, w
        residual[case] = worst / scale
        for i in range(n):  # an array slice would compile for seconds
            forces[case, i] = F[i]
