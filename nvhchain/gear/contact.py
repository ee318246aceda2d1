"""Contact of cut flanks: the complementarity problem of all slices.

Of n slices (all engaged pairs together) the normal forces F_i ≥ 0 (N) and gaps g_i ≥ 0 (m) obey F_i g_i = 0,

    g = −δ + e + δ_loc(F) + C F,

δ the prescribed approach of the unloaded flanks along their common normal, e their unloaded separation
(0 for pure involutes), C (m/N) the global compliance of both gears, symmetric and not negative. δ_loc grows
strictly with F, so this is the optimality condition of a strictly convex function Φ(F) over F ≥ 0: the solution
exists, is unique, and Σ F never falls with δ.
"""

from __future__ import annotations

import numba
import numpy as np

from nvhchain.errors import SolverError
from nvhchain.gear.flattening import contact_half_width, half_space_compliance, local_deflection
from nvhchain.gear.local_law import LocalLaw, local_law
from nvhchain.handoff import FloatArray

__all__ = [
    "LocalLaw",
    "complementarity_residual",
    "contact_half_width",
    "half_space_compliance",
    "local_deflection",
    "local_law",
    "slice_forces",
]

MAX_ITERATIONS = 100
"""Newton steps of one complementarity problem; a dozen is usual, more means failure."""

_SUMS = {"reassoc", "contract"}
"""Sums in the order of the processor's vectors: four times as fast, rounding apart the same."""


def complementarity_residual(
    compliance: FloatArray, approach: FloatArray, length: FloatArray, law: LocalLaw, force: FloatArray
) -> float:
    """Largest violation, m, of F ≥ 0, g ≥ 0, F g = 0 by the slice forces `force` (n,), N, of one case.

    |g| where F > 0 and max(0, −g) where F = 0, g from the definition; arguments as in `slice_forces`.
    Raises SolverError for a force that pulls.
    """
    if not len(force):
        return 0.0
    if not (force >= 0).all():
        raise SolverError(f"a slice pulls with {-force.min():g} N")
    local = law.deflection(force / length)
    gap = np.where(force > 0, local, 0.0) + compliance @ force - approach
    return float(np.where(force > 0, np.abs(gap), np.maximum(-gap, 0.0)).max())


def slice_forces(
    compliance: FloatArray,
    approach: FloatArray,
    length: FloatArray,
    law: LocalLaw,
    *,
    tolerance: float,
) -> FloatArray:
    """Slice forces (n_case, n), N, for the approach δ − e of every slice in every case.

    compliance: C (n, n) m/N.  approach: (n_case, n) m; rising cases are solved fastest.  length: (n,) m of contact
    line.  law: local deflection.  tolerance: admissible residual relative to the case's largest
    approach; the residual is |g_i| where F_i > 0 and max(0, −g_i) where F_i = 0.
    Raises SolverError when a case does not reach it.
    """
    approach = np.ascontiguousarray(approach, dtype=float)
    forces = np.zeros_like(approach)
    residual = np.zeros(len(approach))
    if approach.shape[1]:
        _solve(
            np.ascontiguousarray(compliance, dtype=float),
            approach,
            np.ascontiguousarray(length, dtype=float),
            law.limit,
            1.0 / np.log(law.ratio),
            law.level,
            law.half_slope,
            law.offset,
            law.energy,
            tolerance,
            MAX_ITERATIONS,
            forces,
            residual,
        )
    worst = int(np.argmax(residual)) if len(residual) else 0
    if len(residual) and not residual[worst] <= tolerance:
        raise SolverError(
            f"contact did not converge: relative residual {residual[worst]:.3g}, {tolerance:g} asked, approach "
            f"{1e6 * approach[worst].max():.4g} µm; check that the load is not far beyond the gears' size"
        )
    return forces


@numba.njit(
    "boolean(float64[:, ::1], float64[::1], int64)", cache=True, nogil=True, error_model="numpy", fastmath=_SUMS
)
def _cholesky_solve(H: np.ndarray, x: np.ndarray, n: int) -> bool:
    """Overwrite the leading n entries of x by H⁻¹x; the lower triangle of H becomes its factor."""
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
def _piece(q: float, limit: float, per_ratio: float, last: int) -> int:
    """Piece of the local law on which the load q > 0, N/m, lies."""
    if q >= limit:
        return last
    return max(int(np.floor(np.log(q / limit) * per_ratio)) + last, 0)


@numba.njit(
    "Tuple((float64, float64))(float64[:, ::1], float64[::1], float64[::1], float64[::1], float64, float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath=_SUMS,
)
def _gap(
    C: np.ndarray,
    approach: np.ndarray,
    length: np.ndarray,
    limit: np.ndarray,
    per_ratio: float,
    level: np.ndarray,
    half_slope: np.ndarray,
    offset: np.ndarray,
    stored: np.ndarray,
    F: np.ndarray,
    g: np.ndarray,
) -> tuple[float, float]:
    """Fill the gaps g; return the potential Φ (J) and the largest violation (m)."""
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
            k = _piece(q, limit[i], per_ratio, last)
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
def _solve(
    C: np.ndarray,
    approach: np.ndarray,
    length: np.ndarray,
    limit: np.ndarray,
    per_ratio: float,
    level: np.ndarray,
    half_slope: np.ndarray,
    offset: np.ndarray,
    stored: np.ndarray,
    tolerance: float,
    max_iterations: int,
    forces: np.ndarray,
    residual: np.ndarray,
) -> None:
    """Projected Newton with an active set, one case after the other, each started from the one before."""
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
        # the law is close to linear: the scaled previous answer lies near and below the new one
        F *= scale / before if before > 0.0 else 0.0
        before = scale
        energy, worst = _gap(C, a, length, limit, per_ratio, level, half_slope, offset, stored, F, g)
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
                # δ_loc has no finite slope at 0: a slice that closes gets that at a thousandth of about the load that
                # would take the whole approach locally
                q = F[i] / length[i]
                if q <= 0.0:
                    q = 1e-3 * min(scale / level[i, 0], limit[i])
                k = _piece(q, limit[i], per_ratio, last)
                for s in range(r):
                    H[r, s] = C[i, free[s]]
                H[r, r] = C[i, i] + (level[i, k] - half_slope[i, k] * (np.log(q) + 1.0)) / length[i]
                step[r] = -g[i]
            if not _cholesky_solve(H, step, m):
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
                e, w = _gap(C, a, length, limit, per_ratio, level, half_slope, offset, stored, trial, g_trial)
                # near the solution Φ is flat to rounding; there a falling residual decides
                if w < 0.5 * worst or e <= energy + 1e-4 * slope:
                    accepted = True
                    break
                alpha *= 0.5
            if not accepted:
                break
            F, trial, g, g_trial = trial, F, g_trial, g
            energy, worst = e, w
        residual[case] = worst / scale
        for i in range(n):  # a slice would compile for seconds
            forces[case, i] = F[i]
