"""Forced response of the reduced housing: normal velocity of the radiating surface under bearing forces."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import ResourceError, counted
from nvhchain.handoff import ComplexArray, FloatArray, ForceSpectrum, ReducedHousing, SurfaceVelocity
from nvhchain.handoff.housing import LINES_PER_PRODUCT, times_real
from nvhchain.housing.modes.damping import DampingCurve
from nvhchain.runtime.memory import free_memory


def respond(
    housing: ReducedHousing,
    force_spectrum: ForceSpectrum,
    *,
    structural: bool | None = None,
    damping: DampingCurve | None = None,
) -> SurfaceVelocity:
    """Compute the normal velocity v_n = jω u_n of every face at the lines that carry force.

    force_spectrum: forces on the housing at its seats; their names are those of the housing, in any order.
    structural: True for a loss factor of twice the damping ratio, False for viscous damping; by default as in the
    housing.
    damping: damping ratio of all modes over the frequency of the line; by default the housing's modal damping.
    Returns normal velocity (n_f, n_face) m/s.
    """
    force = force_spectrum.sort_bearings(housing.names, housing.motions)
    loaded = np.flatnonzero((force != 0).any(axis=1))
    if loaded.size == 0:
        loaded = np.array([0])  # no force anywhere: one line of zeros
    faces = housing.normal_shapes.shape[1]
    need, free = 16.0 * loaded.size * faces * 2, free_memory()
    if need > free:
        raise ResourceError(
            f"surface velocity of {counted(loaded.size, 'line')} on {faces} faces needs {need / 1e9:.1f} GB, "
            f"{free / 1e9:.1f} GB are free: narrow the band or coarsen the radiating surface"
        )
    frequency, force = force_spectrum.frequency[loaded], force[loaded]
    coordinates = [
        _coordinates(housing, frequency[part], force[part], structural, damping)
        for part in (slice(start, start + LINES_PER_PRODUCT) for start in range(0, loaded.size, LINES_PER_PRODUCT))
    ]
    return SurfaceVelocity.superposition(frequency, np.concatenate(coordinates), _shapes(housing), housing.surface)


def modal_displacement(
    housing: ReducedHousing,
    frequency: FloatArray,
    force: ComplexArray,
    *,
    structural: bool | None = None,
    damping: DampingCurve | None = None,
) -> ComplexArray:
    """Return modal coordinates (n_f, n_mode) kg^½ m under seat forces (n_f, motions · n_bearing) at lines (n_f,) Hz.

    structural, damping : as in `respond`.
    """
    shapes = housing.flat_shapes
    return np.asarray(times_real(force, shapes.T) * _receptance(housing, frequency, structural, damping))


def face_displacement(
    housing: ReducedHousing,
    frequency: FloatArray,
    force: ComplexArray,
    *,
    structural: bool | None = None,
    damping: DampingCurve | None = None,
) -> ComplexArray:
    """Return the outward normal displacement (n_f, n_face) m: modal sum plus residual.

    structural, damping : as in `respond`.
    """
    return times_real(_coordinates(housing, frequency, force, structural, damping), _shapes(housing))


def _coordinates(
    housing: ReducedHousing,
    frequency: FloatArray,
    force: ComplexArray,
    structural: bool | None,
    damping: DampingCurve | None,
) -> ComplexArray:
    """Return modal coordinates, then forces on the residual: factors (n_f, n_mode + m) of `_shapes`."""
    q = modal_displacement(housing, frequency, force, structural=structural, damping=damping)
    return np.hstack([q, force / _residual_loss(housing, frequency, structural, damping)])


def _shapes(housing: ReducedHousing) -> FloatArray:
    """Return outward shapes (n_mode + motions · n_bearing, n_face) of modes, kg^-½, and residual flexibility, m/N."""
    return np.vstack([housing.normal_shapes, housing.flat_residual])


def _receptance(
    housing: ReducedHousing, frequency: FloatArray, structural: bool | None, damping: DampingCurve | None
) -> ComplexArray:
    """Return modal coordinates per modal force (n_f, n_mode) s²."""
    curve = None if damping is None else damping.ratio_at(np.asarray(frequency))
    return housing.receptance(frequency, structural=structural, damping=curve)


def _residual_loss(
    housing: ReducedHousing, frequency: FloatArray, structural: bool | None, damping: DampingCurve | None
) -> ComplexArray | complex:
    """Return the damping factor 1 + jη on the residual's stiffness; η = 2ζ of the line or the highest mode."""
    structural = bool(housing.structural_damping) if structural is None else structural
    if structural and damping is not None:
        return np.asarray(1 + 2j * damping.ratio_at(np.asarray(frequency))[:, None])
    return 1 / housing.residual_gain(structural=structural)
