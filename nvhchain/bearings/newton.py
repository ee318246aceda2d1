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

    position (n,): position.
    steps: Newton steps.
    residual: unbalanced force, relative to the load.
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

    forces: gradient (n,) and second derivative (n, n) of a convex energy.
    load (n,).
    spring (n, n): stiffness of the usual size, which holds what has no contact yet.
    size (n,): usual force of every unknown, > 0.
    tolerance: largest residual relative to `size`, in the largest entry.
    surplus: factor ≥ 1 of the load with which the search begins.

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
        x, force, stiffness = _step(forces, factor * load, x, way, float((force - factor * load) @ way))
    raise SolverError(
        f"the forces did not balance within {STEPS} Newton steps: residual {residual:.3g} of {tolerance:g}"
    )


NEAR = 0.45
"""Residual below which the surplus of the load is lowered."""


def _step(
    forces: Forces, load: FloatArray, x: FloatArray, way: FloatArray, first: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, force and stiffness after a step along `way`, changed where its end is far from the minimum.

    A step is shortened where the force along it turns. It is lengthened where most of the force is left: a part that
    moves freely within its clearance is held by the spring only. A shortened step that leaves most of the force is
    lengthened again, as far as the force does not turn.

    first : work of the unbalanced force per step at its beginning, < 0.
    """
    low, low_slope, high, high_slope = 0.0, first, 0.0, 0.0
    reach = 1.0
    for _ in range(40):
        force, stiffness = forces(x + reach * way)
        slope = float((force - load) @ way)
        if slope > -TURNED * first:
            high, high_slope = reach, slope
        elif slope < LEFT * first and reach < LONGEST:
            low, low_slope = reach, slope
        else:
            break
        if high == 0.0:
            reach *= LONGER
        elif high - low < 1e-9 * high:
            break
        else:
            guess = low + (high - low) * low_slope / (low_slope - high_slope)
            reach = min(max(guess, low + 0.1 * (high - low)), high - 0.05 * (high - low))
    return x + reach * way, force, stiffness


TURNED, LEFT = 0.3, 0.7
"""Work of the unbalanced force at the end of a step relative to its beginning: largest when it has turned, and when it
is left."""
LONGER, LONGEST = 4.0, 1e4
"""Factor by which a step is lengthened, and its limit."""
