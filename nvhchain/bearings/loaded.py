"""Displacement of a single bearing under a load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from nvhchain.bearings.newton import settle
from nvhchain.bearings.rows import BallRow, RollerRow
from nvhchain.errors import SolverError, require
from nvhchain.handoff import FloatArray

RESIDUAL = 1e-10
"""Residual of the equilibrium, relative to the load."""

SMALL = 5e-5
"""Displacement (m) at which the usual stiffness of a bearing is taken."""


class Supporting(Protocol):
    """Bearing: force and stiffness by its displacement."""

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force (5,) and stiffness (5, 5) at the displacement `u` (5,)."""


def usual_stiffness(bearing: Supporting) -> tuple[FloatArray, float]:
    """Return the mean stiffness of a bearing pressed in all directions, and by how much it is pressed.

    Returns stiffness (5, 5): stiffness (N/m, N, N m). reach: displacement (m).

    The displacement grows from `SMALL` until the bearing carries in every direction of the translations.
    """
    for growth in range(8):
        u = SMALL * 2.0**growth * np.array([[1, 0, 1], [-1, 0, 1], [0, 1, -1], [0, -1, -1]])
        made = [bearing.evaluate(np.append(each, [0.0, 0.0]))[1] for each in u]
        if all(each[:2, :2].any() for each in made):
            break
    return np.asarray(np.mean(made, axis=0)), SMALL * 2.0**growth


def holds_tilt(bearing: Supporting | None) -> bool:
    """Return True for a bearing that resists tilts; one without model, and a single row of balls, do not."""
    rows: Sequence[BallRow | RollerRow] = getattr(bearing, "rows", ())
    balls = len(rows) == 1 and isinstance(rows[0], BallRow)
    return bearing is not None and not balls and bool((np.diag(usual_stiffness(bearing)[0])[3:5] > 0.0).all())


def load_surplus(moved: FloatArray, reach: float) -> float:
    """Return the factor ≥ 1 by which a load is raised, so that displacements `moved` (n,) become `reach` (m)."""
    return max(1.0, reach / max(float(np.abs(moved).max()), 1e-12))


def displacement(bearing: Supporting, load: FloatArray, *, tilts: bool = True) -> FloatArray:
    """Return the displacement of a bearing under a load.

    load (5,): force of the shaft along x, y, z (N) and moment about x and y (N m).
    tilts: False holds the tilts at 0; their moments then follow.
    Returns (5,): displacement along x, y, z (m) and tilts about x and y (rad).
    """
    load = np.asarray(load, dtype=float)
    require(
        load.shape == (5,) and bool(np.isfinite(load).all()) and bool(load.any()),
        f"load = {load.tolist()} must be five finite numbers, not all 0: three forces (N) and two moments (N m)",
    )
    free = np.arange(5 if tilts else 3)
    spring, reach = usual_stiffness(bearing)
    # a motion that the bearing leaves free is held
    scale = np.diag(spring)
    spring = spring + np.diag(np.where(scale <= 1e-9 * scale.max(), 1e-3 * scale.max(), 0.0))
    lever = np.sqrt(np.diag(spring)[3:].max() / np.diag(spring)[:3].max())
    size = np.linalg.norm(load[:3]) + np.linalg.norm(load[3:]) / lever
    sizes = size * np.array([1.0, 1.0, 1.0, lever, lever])

    def forces(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        u = np.zeros(5)
        u[free] = x
        force, stiffness = bearing.evaluate(u)
        return force[free], stiffness[np.ix_(free, free)]

    held = spring[np.ix_(free, free)]
    surplus = load_surplus(np.linalg.solve(held, load[free]), reach)
    u = np.zeros(5)
    try:
        u[free] = settle(forces, load[free], held, sizes[free], RESIDUAL, surplus).position
    except SolverError as error:
        raise SolverError(f"the bearing does not carry the load {load.tolist()} (N, N m): {error}") from None
    return u
