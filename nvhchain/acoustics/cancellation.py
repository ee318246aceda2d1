"""What discretisation leaves where parts of a motion cancel each other: the power of a dipole, as an error of it."""

from __future__ import annotations

import warnings

import numpy as np

from nvhchain.acoustics.accuracy import MESH_ERROR
from nvhchain.acoustics.surface import mean_edge
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface

CANCELLATION = 0.3
"""Thrust that the error of the mesh leaves, relative to the area times the root mean square pressure on it, times the
square of half the body's diagonal over the mean edge: a bound; rotating boxes and ellipsoids of irregular mesh, which
radiate hardly anything else at low frequency, 0.006 to 0.26 (docs/measured/sound_power.md).  Bodies of revolution that
rotate about their own axis are beyond it: the facets alone move their air."""


def cancellation_resistance(
    surface: Surface, wavenumber: float, pressure: ComplexArray, plane: RigidPlane | None
) -> ComplexArray:
    """Radiation resistance E (m, m), times ρc, of the error that velocities with these pressures (n_v, m) Pa may have.

    ½ q̇ᴴ E q̇/(ρc) is the power k²F²/(24πρc) of a dipole (Morse & Ingard, Theoretical Acoustics, 1968, sect. 7.1) with
    the thrust F = CANCELLATION (h/a)² √(S ∫|p|² dS), h the mean edge and a half the body's diagonal; twice that over a
    rigid plane, which doubles the thrust along it and leaves half of the space.  Hermitian, semidefinite.
    """
    half_diagonal = 0.5 * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    on_faces = pressure[surface.triangles].mean(axis=1)
    thrust = surface.areas.sum() * (on_faces.conj().T * surface.areas) @ on_faces
    dipole = wavenumber**2 / (12 * np.pi) * (1.0 if plane is None else 2.0)
    return np.asarray((CANCELLATION * (mean_edge(surface) / half_diagonal) ** 2) ** 2 * dipole * thrust)


def told_cancellation(
    frequency: FloatArray, power: FloatArray, error_power: FloatArray, fidelity: AcousticsFidelity
) -> dict[str, float]:
    """Provenance of the largest error of motions whose parts cancel each other, dB, and where it is, Hz.

    power, error_power: (n_f,) W, that found and that of the dipole of `cancellation_resistance`, whose amplitudes add
    up at worst.  Gives an AccuracyWarning where it is larger than the error of a mesh with
    `fidelity.elements_per_wavelength`.
    """
    loud = np.flatnonzero(power > 0)
    if len(loud) == 0:
        return {}
    error = np.sqrt(error_power[loud] / power[loud])
    worst = int(error.argmax())
    largest, at = float(20 * np.log10(1 + error[worst])), float(frequency[loud[worst]])
    asked = MESH_ERROR / fidelity.elements_per_wavelength**2
    if error[worst] > asked:
        warnings.warn(
            f"the parts of the motion cancel each other at {np.count_nonzero(error > asked)} lines: expect errors of "
            f"the sound power up to {largest:.2g} dB, at {at:.4g} Hz; refine the mesh or raise the lower frequency",
            AccuracyWarning,
            stacklevel=3,
        )
    return {"cancellation_error_dB": largest, "cancellation_frequency": at}
