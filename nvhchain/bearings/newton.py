"""Newton's method for the equilibrium of bearings: the minimum of a convex energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nvhchain.errors import SolverError
from nvhchain.handoff import FloatArray

Forces = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Function of the position (n,) that returns the elastic forces (n,) and the stiffness (n, n)."""

STEPS = 60
"""Largest number of Newton steps; more indicate a load that nothing balances."""


@dataclass(frozen=True, eq=False)
class Settled:
    """Equilibrium that Newton's method has found.

    Parameters
    ----------
    position : (n,) array
        Position.
    steps : int
        Newton steps.
    residual : float
        Unbalanced force, relative to the load.
    """

    position: FloatArray
    steps: int
    residual: float


LESS = 0.1
"""Factor of the load from one Newton step to the next, on the way from a surplus to the load itself."""


def settle(
    forces: Forces, load: FloatArray, spring: FloatArray, size: FloatArray, tolerance: float, surplus: float = 1.0
) -> Settled:
    """Return the position at which elastic forces balance a load, from the position 0.

    Parameters
    ----------
    forces : callable
        Gradient (n,) and second derivative (n, n) of a convex energy.
    load : (n,) array
        Load.
    spring : (n, n) array
        Stiffness of the usual size, which holds what has no contact yet.
    size : (n,) array
        Usual force of every unknown, > 0.
    tolerance : float
        Largest residual relative to `size`, in the largest entry.
    surplus : float
        Factor ≥ 1 of the load with which the search begins.

    Returns
    -------
    Settled
        Position, steps and residual.

    Raises
    ------
    SolverError
        If the forces do not balance within `STEPS` steps.

    Notes
    -----
    The spring is scaled by the square of the residual, at most 1e-2. Convergence is therefore quadratic at the end. A
    step is shortened, by the rule of false position, to where the force along it vanishes. Under a load that is small
    against the stiffness times the clearance, contacts are few and hard to find. The search therefore begins with a
    surplus, whose many contacts it then loses one by one.
    """
    x, factor = np.zeros(len(load)), surplus
    force, stiffness = forces(x)
    for step in range(STEPS + 1):
        residual = float(np.abs((force - factor * load) / size).max()) / factor
        if factor > 1.0 and residual <= NEAR:
            factor = max(1.0, LESS * factor)
            residual = float(np.abs((force - factor * load) / size).max()) / factor
        if residual <= tolerance and factor == 1.0:
            return Settled(x, step, residual)
        held = stiffness + min(1e-2, residual**2) * spring
        try:
            way = np.asarray(np.linalg.solve(held, factor * load - force))
        except np.linalg.LinAlgError:
            way = np.asarray(np.linalg.solve(stiffness + spring, factor * load - force))
        x, force, stiffness = _along(forces, factor * load, x, way, float((force - factor * load) @ way))
    raise SolverError(
        f"the forces did not balance within {STEPS} Newton steps: residual {residual:.3g} of {tolerance:g}"
    )


NEAR = 0.3
"""Residual below which the surplus of the load is lowered."""


def _along(
    forces: Forces, load: FloatArray, x: FloatArray, way: FloatArray, first: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, force and stiffness after a step along `way`, shortened where it passes the minimum by far."""
    low, high, at_low, at_high = 0.0, 1.0, first, 0.0
    reach = 1.0
    for _ in range(30):
        force, stiffness = forces(x + reach * way)
        slope = float((force - load) @ way)
        if slope <= -0.3 * first or reach < 1e-9:
            break
        high, at_high = reach, slope
        guess = low + (high - low) * at_low / (at_low - at_high)
        reach = max(guess, low + 0.1 * (high - low))
    return x + reach * way, force, stiffness
