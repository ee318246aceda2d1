"""Error of radiated sound due to the surface mesh or a cheaper radiation level."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics import ENGINES
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
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

    Boundary elements: the expected error that a result states (`accuracy`), at the upper frequency, the nearest
    point included. At the lowest frequency the error of the body's shape remains. Cheaper levels: the errors of single
    points and motions, at every line.
    """
    if fidelity.radiation != "boundary_elements":
        return {"radiation": relative(level_error(surface, lines, case.air, fidelity.radiation))[:, None]}
    if accuracy.expected_error_db is None:
        accuracy = expected_accuracy(surface, None, float(lines[-1]), case.air, fidelity, ENGINES[case.engine])
    worst = max(accuracy.expected_error_db or 0.0, accuracy.expected_error_nearest_db or 0.0)
    sources = {"surface mesh": np.full((len(lines), 1), relative(worst))}
    if accuracy.quadrature_error is not None:
        sources["quadrature"] = np.full((len(lines), 1), QUADRATURE_MARGIN * accuracy.quadrature_error / COVERAGE)
    return sources


def level_error(surface: Surface, lines: FloatArray, air: Air, radiation: str) -> FloatArray:
    """Return the RMS error (n_f,) dB of a cheaper radiation level for single points and motions at `lines` (Hz)."""
    return expected_radiation_error(radiation, size_in_waves(surface, np.maximum(lines, 1e-300), air))


def relative(decibel: FloatArray | float) -> FloatArray:
    """Return the relative error of an amplitude from an error in dB."""
    return np.asarray(10 ** (np.asarray(decibel) / 20) - 1.0)
