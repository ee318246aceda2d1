"""What the surface mesh, or a cheaper level of radiation, leaves open of the sound of a motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.acoustics import ENGINES
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.accuracy.radiation_levels import expected_radiation_error
from nvhchain.case import Case
from nvhchain.conventions import Air
from nvhchain.error_band.band import COVERAGE
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, Surface

QUADRATURE_MARGIN = 8.0
"""Relative error of a sound field over the quadrature error of a constant pressure on the surface, at most: two to
eight (docs/measured/acoustics/quadrature.md)."""


def radiation_error(
    surface: Surface, lines: FloatArray, case: Case, fidelity: AcousticsFidelity, told: dict[str, Any]
) -> dict[str, FloatArray]:
    """Name of the source and its relative error (n_f, 1) at `lines` (n_f,) Hz.

    Boundary elements: at the upper frequency, as a result says of itself (`told`, its provenance), of the nearest point
    too; the error of their shape is left at the lowest.  Cheaper levels: of single points and motions, at every line.
    """
    if fidelity.radiation != "boundary_elements":
        return {"radiation": relative(level_error(surface, lines, case.air, fidelity.radiation))[:, None]}
    if "expected_error_dB" not in told:
        told = expected_accuracy(surface, None, float(lines[-1]), case.air, fidelity, ENGINES[case.engine])
    worst = max(told.get(f"{which}_dB", 0.0) for which in ("expected_error", "expected_error_nearest"))
    sources = {"surface mesh": np.full((len(lines), 1), relative(worst))}
    if "quadrature_error" in told:
        sources["quadrature"] = np.full((len(lines), 1), QUADRATURE_MARGIN * told["quadrature_error"] / COVERAGE)
    return sources


def level_error(surface: Surface, lines: FloatArray, air: Air, radiation: str) -> FloatArray:
    """(n_f,) dB, RMS, of the levels at single points and of single motions that a cheaper level gives at `lines` (Hz).

    Over the wavenumber times half size of the body.
    """
    half_size = 0.5 * float(np.linalg.norm(np.ptp(surface.vertices, axis=0))) / np.sqrt(3.0)
    ka = 2 * np.pi * np.maximum(lines, 1e-300) / air.speed_of_sound * half_size
    return expected_radiation_error(radiation, ka)


def relative(decibel: FloatArray | float) -> FloatArray:
    """Error of an amplitude, relative, that is so many dB."""
    return np.asarray(10 ** (np.asarray(decibel) / 20) - 1.0)
