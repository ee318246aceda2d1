"""Contact pressure without friction: unknown forces of cells on a surface of known compliance.

Forces F ≥ 0 (N) and gaps g ≥ 0 (m) of the cells obey F g = 0 and g = g₀ − δ + C F; Σ F is given. C is symmetric and
positive definite.  The solution is therefore the optimum of a strictly convex function, and unique.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from nvhchain.errors import SolverError, require
from nvhchain.handoff import FloatArray

_ROUNDS = 200
"""Largest number of changes of the set of cells in contact; about ten are usual, more means a cycle."""

_TOLERANCE = 1e-10
"""Admissible overlap of open cells, relative to the approach."""


@dataclass(frozen=True, eq=False)
class PressureField:
    """Forces of cells in contact.

    Parameters
    ----------
    force : (n,) array
        Force per cell (N).
    approach : float
        δ (m).
    residual : float
        Largest overlap of cells or gap of loaded ones (m).
    """

    force: FloatArray
    approach: float
    residual: float


def pressed(compliance: FloatArray, gap: FloatArray, force: float, *, guess: FloatArray | None = None) -> PressureField:
    """Press two surfaces together with a given force.

    Parameters
    ----------
    compliance : (n, n) array
        C (m/N), symmetric.
    gap : (n,) array
        g₀ (m).
    force : float
        Force (N), > 0.
    guess : (n,) array, optional
        Cell forces of a nearby case (N).

    Returns
    -------
    PressureField
        Cell forces and approach.

    Raises
    ------
    InputError
        If the force is not positive.
    SolverError
        If the set of cells does not settle.

    Notes
    -----
    Active set by Newton's method on the complementarity (Hintermüller, Ito, Kunisch 2003): cells that pull leave, cells
    that overlap enter.
    """
    require(force > 0, f"force = {force:g} N must be positive")
    n = len(gap)
    active = gap <= gap.min() + 0.1 * np.ptp(gap) if guess is None else guess > 0
    for _ in range(_ROUNDS):
        at = np.flatnonzero(active)
        factor = cho_factor(compliance[np.ix_(at, at)], lower=True, check_finite=False)
        of_one, of_gap = cho_solve(factor, np.column_stack([np.ones(len(at)), gap[at]]), check_finite=False).T
        approach = (force + of_gap.sum()) / of_one.sum()
        forces = np.zeros(n)
        forces[at] = approach * of_one - of_gap
        left = gap - approach + compliance[:, at] @ forces[at]
        after = np.where(active, forces > 0, left < -_TOLERANCE * abs(approach))
        if (after == active).all():
            residual = max(float(np.abs(left[at]).max()), float(np.maximum(-left, 0.0).max()))
            return PressureField(forces, float(approach), residual)
        if not after.any():
            after[np.argmin(left)] = True
        active = after
    raise SolverError(f"the cells in contact did not settle within {_ROUNDS} rounds at {force:g} N")
