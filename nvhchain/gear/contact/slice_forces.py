"""Contact of flanks cut into slices: the complementarity problem of all slices.

For n slices (all engaged pairs together) the normal forces F_i ≥ 0 (N) and gaps g_i ≥ 0 (m) obey F_i g_i = 0,

    g = −δ + e + δ_loc(F) + C F,

with δ the prescribed approach of the unloaded flanks along their common normal and e their unloaded separation (0 for
pure involutes).  C (m/N) is the global compliance of both gears, symmetric and not negative.

δ_loc grows strictly with F.  The problem is therefore the optimality condition of a strictly convex function Φ(F) over
F ≥ 0.  The solution exists, is unique, and Σ F never falls with δ.
"""

from __future__ import annotations

import numpy as np

from nvhchain.errors import SolverError
from nvhchain.gear.contact.local_law import LocalLaw
from nvhchain.handoff import FloatArray

MAX_ITERATIONS = 100
"""Largest number of Newton steps of one complementarity problem; a dozen is usual, more means failure."""


def complementarity_residual(
    compliance: FloatArray, approach: FloatArray, length: FloatArray, law: LocalLaw, force: FloatArray
) -> float:
    """Return the largest violation (m) of F ≥ 0, g ≥ 0, F g = 0 by the slice forces of one case.

    compliance (n, n): C (m/N).
    approach (n,): δ − e (m).
    length (n,): length of contact line (m).
    force (n,): slice forces (N).
    Returns the largest of |g| where F > 0 and max(0, −g) where F = 0 (m).
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
    """Return the slice forces for the approach δ − e of every slice in every case.

    compliance (n, n): C (m/N).
    approach (n_case, n): δ − e (m); rising cases are solved fastest.
    length (n,): length of contact line (m).
    tolerance: admissible residual relative to the case's largest approach.
    Returns (n_case, n): slice forces (N).

    The residual is |g_i| where F_i > 0 and max(0, −g_i) where F_i = 0.
    """
    from nvhchain.gear.contact._slices import solve  # compiled, or read from its cache, when first needed

    approach = np.ascontiguousarray(approach, dtype=float)
    forces = np.zeros_like(approach)
    residual = np.zeros(len(approach))
    if approach.shape[1]:
        solve(
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
