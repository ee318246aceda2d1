"""What is known beforehand about the error of a boundary element result, said where it exceeds what was asked for."""

from __future__ import annotations

import warnings

import numpy as np

from nvhchain.acoustics.surface import LOCAL_COARSENING, MESH_SCATTER, check_mesh, element_sizes, point_clearance
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, Surface

MESH_ERROR = 1.2
"""Error at field points relative to their peak, times the square of the elements per wavelength: fitted to interior
point sources in boxes, brackets and plates at 1.7…12 elements per wavelength, which it meets within a factor of three;
round bodies are up to eight times better."""

NEAR_POINT = 0.5
"""Clearance in element edges below which a field point sees the single elements."""

NEAR_FACTOR = 2.0
"""Growth of the error from far field points to those next to the surface: 1.3 to 2.4 in the same measurements."""

NEAR_FLOOR = 0.005
"""Relative error next to the surface at low frequency, from the velocity that is constant on each element: 0.3 to 1.3 %
in the same measurements."""


def expected_accuracy(
    surface: Surface, points: FloatArray | None, f_max: float, air: Air, fidelity: AcousticsFidelity
) -> dict[str, float]:
    """Provenance of what the mesh and the field points let expect at the upper frequency `f_max` (Hz).

    elements_per_wavelength: there.  expected_error_dB: at the loudest field points.  With a point nearer than half
    an element edge also clearance: in edges, and expected_error_nearest_dB: there, at its own pressure.
    Gives an AccuracyWarning where the mesh is coarser than `fidelity.elements_per_wavelength` asks for, or a point
    that near.  An error of e dB means a factor 10^(e/20) in either direction; silent directions are worse.
    Raises what `check_mesh` raises.
    """
    if f_max <= 0:
        return {}
    check_mesh(surface, f_max, air, fidelity)
    mean, coarsest = element_sizes(surface)
    per_wavelength = air.speed_of_sound / (f_max * max(mean / MESH_SCATTER, coarsest / LOCAL_COARSENING))
    error = MESH_ERROR / per_wavelength**2
    expected = {"elements_per_wavelength": per_wavelength, "expected_error_dB": _decibel(error)}
    asked = fidelity.elements_per_wavelength
    if per_wavelength < asked:
        warnings.warn(
            f"mesh has {per_wavelength:.3g} elements per wavelength at {f_max:.4g} Hz, {asked:g} asked: expect errors "
            f"of about {_decibel(error):.2g} dB there; refine to {1e3 * air.speed_of_sound / (f_max * asked):.3g} mm "
            "or lower the upper frequency",
            AccuracyWarning,
            stacklevel=3,
        )
    clearance = np.inf if points is None else point_clearance(surface, points, NEAR_POINT)
    if clearance < NEAR_POINT:
        near = _decibel(NEAR_FACTOR * error + NEAR_FLOOR)
        expected |= {"clearance": float(clearance), "expected_error_nearest_dB": near}
        warnings.warn(
            f"a field point is {clearance:.2g} element edges from the surface: expect errors of about {near:.2g} dB "
            "there, and a velocity averaged over each element; refine the mesh near it or move it away",
            AccuracyWarning,
            stacklevel=3,
        )
    return expected


def _decibel(relative_error: float) -> float:
    return float(20.0 * np.log10(1.0 + relative_error))
