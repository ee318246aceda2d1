"""Motion of the seats of a reduced housing, for comparison with full models."""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import ComplexArray, FloatArray, ReducedHousing
from nvhchain.handoff.housing import times_real
from nvhchain.housing.modes.damping import DampingCurve
from nvhchain.housing.modes.response import _residual_loss, modal_displacement


def seat_displacement(
    housing: ReducedHousing,
    frequency: FloatArray,
    force: ComplexArray,
    *,
    structural: bool | None = None,
    damping: DampingCurve | None = None,
) -> ComplexArray:
    """Return the displacement (n_f, motions · n_bearing) m of the seats: modal sum plus residual.

    structural, damping : as in `respond`.
    """
    q = modal_displacement(housing, frequency, force, structural=structural, damping=damping)
    shapes = housing.flat_shapes
    residual = housing.seat_residual.reshape(force.shape[1], -1)
    return times_real(q, shapes) + times_real(force / _residual_loss(housing, frequency, structural, damping), residual)


def seat_flexibility(housing: ReducedHousing) -> FloatArray:
    """Return the static flexibility (motions · n_bearing, …) m/N of the seats: modes, Ritz vectors, residual."""
    shapes = housing.flat_shapes
    omega2 = (2 * np.pi * housing.natural_frequency) ** 2
    return np.asarray(shapes.T @ (shapes / omega2[:, None]) + housing.seat_residual.reshape(shapes.shape[1], -1))
