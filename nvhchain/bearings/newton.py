"""Newton's method for the equilibrium of bearings: the minimum of a convex energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nvhchain.errors import SolverError
from nvhchain.handoff import FloatArray

Balance = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Function of the position that returns the unbalanced force, the gradient of the energy, and the stiffness."""

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


def settle(balance: Balance, start: FloatArray, spring: FloatArray, size: FloatArray, tolerance: float) -> Settled:
    """Return the position at which the forces balance.

    Parameters
    ----------
    balance : callable
        Gradient (n,) and second derivative (n, n) of a convex energy.
    start : (n,) array
        First position.
    spring : (n, n) array
        Stiffness of the usual size, which holds what has no contact yet.
    size : (n,) array
        Usual force of every unknown, > 0.
    tolerance : float
        Largest residual relative to `size`, in the largest entry.

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
    step is shortened, by the rule of false position, to where the force along it vanishes.
    """
    x = np.array(start, dtype=float)
    force, stiffness = balance(x)
    residual = float(np.abs(force / size).max())
    for step in range(STEPS):
        if residual <= tolerance:
            return Settled(x, step, residual)
        held = stiffness + min(1e-2, residual**2) * spring
        try:
            way = -np.linalg.solve(held, force)
        except np.linalg.LinAlgError:
            way = -np.linalg.solve(stiffness + spring, force)
        x, force, stiffness = _along(balance, x, np.asarray(way), float(force @ way))
        residual = float(np.abs(force / size).max())
    if residual <= tolerance:
        return Settled(x, STEPS, residual)
    raise SolverError(
        f"the forces did not balance within {STEPS} Newton steps: residual {residual:.3g} of {tolerance:g}"
    )


def _along(balance: Balance, x: FloatArray, way: FloatArray, first: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, force and stiffness after a step along `way`, shortened where it passes the minimum by far."""
    low, high, at_low, at_high = 0.0, 1.0, first, 0.0
    reach = 1.0
    for _ in range(30):
        force, stiffness = balance(x + reach * way)
        slope = float(force @ way)
        if slope <= -0.3 * first or reach < 1e-9:
            break
        high, at_high = reach, slope
        guess = low + (high - low) * at_low / (at_low - at_high)
        reach = max(guess, low + 0.1 * (high - low))
    return x + reach * way, force, stiffness
