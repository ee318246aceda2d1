"""Error of radiated sound due to the surface mesh or a cheaper radiation level."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics import ENGINES
from nvhchain.acoustics.accuracy.mesh_error import FIELD_POINT_FACTOR, FIELD_POINT_FLOOR, expected_accuracy
from nvhchain.acoustics.accuracy.radiation_levels import expected_radiation_error, size_in_waves
from nvhchain.case import Case
from nvhchain.conventions import Air
from nvhchain.error_band.band import COVERAGE
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, SoundAccuracy, Surface

QUADRATURE_MARGIN = 8.0
"""Largest relative error of a sound field over the quadrature error of a constant pressure on the surface.

Measured: two to eight (docs/measured/acoustics/quadrature.md).
"""


def radiation_error(
    surface: Surface, lines: FloatArray, case: Case, fidelity: AcousticsFidelity, accuracy: SoundAccuracy
) -> dict[str, FloatArray]:
    """Return source → relative error (n_f, 1) at `lines` (n_f,) Hz.

    Boundary elements: the expected error that a result states (`accuracy`), the nearest point included. The part of the
    body's shape is alike at all lines; the rest grows with the square of the frequency up to what is stated at the
    upper one. Cheaper levels: the errors of single points and motions, at every line.
    """
    if fidelity.radiation != "boundary_elements":
        return {"radiation": relative(level_error(surface, lines, case.air, fidelity.radiation))[:, None]}
    if accuracy.expected_error_db is None:
        accuracy = expected_accuracy(surface, None, float(lines[-1]), case.air, fidelity, ENGINES[case.engine])
    sources = {"surface mesh": _mesh_error(lines, accuracy)[:, None]}
    if accuracy.quadrature_error is not None:
        sources["quadrature"] = np.full((len(lines), 1), QUADRATURE_MARGIN * accuracy.quadrature_error / COVERAGE)
    return sources


def _mesh_error(lines: FloatArray, accuracy: SoundAccuracy) -> FloatArray:
    """Return the relative error (n_f,) at `lines` (n_f,) Hz: that of the shape, and what the elements per wave add."""
    worst, shape = relative(accuracy.expected_error_db or 0.0), relative(accuracy.expected_error_low_db or 0.0)
    if accuracy.expected_error_nearest_db is not None:
        worst, shape = relative(accuracy.expected_error_nearest_db), FIELD_POINT_FACTOR * shape + FIELD_POINT_FLOOR
    if accuracy.expected_error_low_db is None or not accuracy.upper_frequency:
        shape = worst
    part = np.minimum(lines / (accuracy.upper_frequency or 1.0), 1.0) ** 2
    return np.asarray(shape + np.maximum(worst - shape, 0.0) * part)


def level_error(surface: Surface, lines: FloatArray, air: Air, radiation: str) -> FloatArray:
    """Return the RMS error (n_f,) dB of a cheaper radiation level for single points and motions at `lines` (Hz)."""
    return expected_radiation_error(radiation, size_in_waves(surface, np.maximum(lines, 1e-300), air))


def relative(decibel: FloatArray | float) -> FloatArray:
    """Return the relative error of an amplitude from an error in dB."""
    return np.asarray(10 ** (np.asarray(decibel) / 20) - 1.0)
