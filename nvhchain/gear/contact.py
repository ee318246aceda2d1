"""Contact of cut flanks: Weber–Banaschek local deflection and the complementarity problem of all slices.

Of n slices (all engaged pairs together) the normal forces F_i ≥ 0 (N) and gaps g_i ≥ 0 (m) obey F_i g_i = 0,

    g = −δ + e + δ_loc(F) + C F,

δ the prescribed approach of the unloaded flanks along their common normal, e their unloaded separation
(0 for pure involutes), C (m/N) the global compliance of both gears, symmetric and not negative. δ_loc grows
strictly with F, so this is the optimality condition of a strictly convex function Φ(F) over F ≥ 0: the solution
exists, is unique, and Σ F never falls with δ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import ArrayLike

from nvhchain.conventions import Material
from nvhchain.errors import SolverError
from nvhchain.handoff import FloatArray

MAX_ITERATIONS = 100
"""Newton steps of one complementarity problem; a dozen is usual, more means failure."""

_SUMS = {"reassoc", "contract"}
"""Sums in the order of the processor's vectors: four times as fast, rounding apart the same."""


def half_space_compliance(material: Material) -> float:
    """2 (1 − ν²)/(π E), 1/Pa: what one flank contributes to the local deflection per unit q."""
    return 2.0 * (1.0 - material.poisson**2) / (np.pi * material.young)


def contact_half_width(
    load: ArrayLike, curvature_radius: ArrayLike, materials: tuple[Material, Material]
) -> FloatArray:
    """Hertzian half width L = √{(4/π)[(1−ν₁²)/E₁ + (1−ν₂²)/E₂] q ρ}, m.

    load: q, N per metre of contact line.  curvature_radius: ρ = ρ₁ρ₂/(ρ₁+ρ₂), m, in the normal plane.
    """
    a = sum(half_space_compliance(m) for m in materials)
    return np.sqrt(2.0 * a * np.asarray(load, float) * np.asarray(curvature_radius, float))


def local_deflection(
    load: ArrayLike,
    curvature_radius: ArrayLike,
    depths: tuple[ArrayLike, ArrayLike],
    materials: tuple[Material, Material],
) -> FloatArray:
    """Approach of the two tooth centre lines by flattening, m (Weber–Banaschek).

    δ_loc = Σ_i 2q(1−ν_i²)/(πE_i) [ln(2h_i/L) − ν_i/(2(1−ν_i))], 0 without load.
    load: q, N/m.  curvature_radius: m.  depths: h_i, m, along the normal from flank to tooth centre line.
    Holds while L is well below h_i.  Source: C. Weber, K. Banaschek, Schriftenreihe Antriebstechnik 11 (1953).
    """
    q = np.asarray(load, float)
    width = contact_half_width(q, curvature_radius, materials)
    total = np.zeros(np.broadcast(q, curvature_radius, *depths).shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        for h, m in zip(depths, materials, strict=True):
            bracket = np.log(2.0 * np.asarray(h, float) / width) - m.poisson / (2.0 * (1.0 - m.poisson))
            total = total + half_space_compliance(m) * q * bracket
    return np.where(q > 0, total, 0.0)


@dataclass(frozen=True, eq=False)
class LocalLaw:
    """δ_loc = q (A − (a/2) ln q) per slice, q in N/m; from `limit` on its tangent.

    level: A, (n,) 1/Pa.  half_slope: a/2, 1/Pa.  limit: (n,) N/m, where L reaches half the smaller depth, as far as
    the formula means anything; the tangent keeps the law rising (by itself it falls from L ≈ h on).
    """

    level: FloatArray
    half_slope: float
    limit: FloatArray


def local_law(
    curvature_radius: FloatArray, depths: tuple[FloatArray, FloatArray], materials: tuple[Material, Material]
) -> LocalLaw:
    """`local_deflection` of slices with given ρ (n,), m, and depths, two (n,), m, in the form the solver uses."""
    parts = [half_space_compliance(m) for m in materials]
    a = sum(parts)
    level = -0.5 * a * np.log(2.0 * a * curvature_radius)
    for part, h, m in zip(parts, depths, materials, strict=True):
        level = level + part * (np.log(2.0 * h) - m.poisson / (2.0 * (1.0 - m.poisson)))
    limit = (0.5 * np.minimum(*depths)) ** 2 / (2.0 * a * curvature_radius)
    return LocalLaw(np.ascontiguousarray(level), 0.5 * a, np.ascontiguousarray(limit))


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
    q = force / length
    within = np.clip(q, 1e-300, law.limit)
    local = within * (law.level - law.half_slope * np.log(within))
    local = local + (law.level - law.half_slope * (np.log(within) + 1)) * np.maximum(q - law.limit, 0.0)
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
            law.level,
            law.limit,
            law.half_slope,
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


@numba.njit(
    "Tuple((float64, float64))(float64[:, ::1], float64[::1], float64[::1], float64[::1], float64[::1], float64, "
    "float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath=_SUMS,
)
def _gap(
    C: np.ndarray,
    approach: np.ndarray,
    length: np.ndarray,
    level: np.ndarray,
    limit: np.ndarray,
    half_slope: float,
    F: np.ndarray,
    g: np.ndarray,
) -> tuple[float, float]:
    """Fill the gaps g; return the potential Φ (J) and the largest violation (m)."""
    n = len(F)
    energy = 0.0
    worst = 0.0
    for i in range(n):
        u = 0.0
        for j in range(n):
            u += C[i, j] * F[j]
        energy += F[i] * (0.5 * u - approach[i])
        u -= approach[i]
        if F[i] > 0.0:
            q = min(F[i] / length[i], limit[i])
            beyond = F[i] / length[i] - q
            log = np.log(q)
            local = q * (level[i] - half_slope * log)
            slope = level[i] - half_slope * (log + 1.0)
            u += local + slope * beyond
            energy += length[i] * q * q * (0.5 * level[i] - half_slope * (0.5 * log - 0.25))
            energy += length[i] * beyond * (local + 0.5 * slope * beyond)
            worst = max(worst, abs(u))
        else:
            worst = max(worst, -u)
        g[i] = u
    return energy, worst


@numba.njit(
    "void(float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64[::1], float64, float64, int64, "
    "float64[:, ::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _solve(
    C: np.ndarray,
    approach: np.ndarray,
    length: np.ndarray,
    level: np.ndarray,
    limit: np.ndarray,
    half_slope: float,
    tolerance: float,
    max_iterations: int,
    forces: np.ndarray,
    residual: np.ndarray,
) -> None:
    """Projected Newton with an active set, one case after the other, each started from the one before."""
    n = len(length)
    F, trial, g, g_trial = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    step, free = np.zeros(n), np.zeros(n, np.int64)
    H = np.zeros((n, n))
    before = 0.0
    for case in range(len(approach)):
        a = approach[case]
        scale = a.max()
        if not scale > 0.0:
            F[:] = 0.0
            before = 0.0
            continue
        # the law is close to linear: the scaled previous answer lies near and below the new one
        F *= scale / before if before > 0.0 else 0.0
        before = scale
        energy, worst = _gap(C, a, length, level, limit, half_slope, F, g)
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
                q = min(F[i] / length[i], limit[i])
                if q <= 0.0:
                    q = 1e-3 * min(scale / level[i], limit[i])
                for s in range(r):
                    H[r, s] = C[i, free[s]]
                H[r, r] = C[i, i] + (level[i] - half_slope * (np.log(q) + 1.0)) / length[i]
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
                e, w = _gap(C, a, length, level, limit, half_slope, trial, g_trial)
                # near the solution Φ is flat to rounding; there a falling residual decides
                if w < 0.5 * worst or e <= energy + 1e-4 * slope:
                    accepted = True
                    break
                alpha *= 0.5
            if not accepted:
                break
            F[:] = trial
            g[:] = g_trial
            energy, worst = e, w
        residual[case] = worst / scale
        forces[case] = F
