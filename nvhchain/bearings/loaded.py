"""Usual stiffness of a single bearing, and the motions that it resists."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from nvhchain.bearings.rows import BallRow, RollerRow
from nvhchain.handoff import FloatArray

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
