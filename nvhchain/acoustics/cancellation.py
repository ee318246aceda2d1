"""What discretisation leaves where parts of a motion cancel each other: the sound of a dipole, as an error of it."""

from __future__ import annotations

import warnings

import numpy as np

from nvhchain.acoustics.accuracy import MESH_ERROR, QUADRATURE_GROWTH
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
    surface: Surface, wavenumber: float, pressure: ComplexArray, plane: RigidPlane | None, quadrature_error: float
) -> ComplexArray:
    """Radiation resistance E (m, m), times ρc, of the error that velocities with these pressures (n_v, m) Pa may have.

    ½ q̇ᴴ E q̇/(ρc) is the power k²F²/(24πρc) of a dipole (Morse & Ingard, Theoretical Acoustics, 1968, sect. 7.1) with
    the thrust F that is left; twice that over a rigid plane, which doubles the thrust along it and leaves half of the
    space.  quadrature_error: of `expected_accuracy`.  Hermitian, semidefinite.
    """
    dipole = wavenumber**2 / (12 * np.pi) * (1.0 if plane is None else 2.0)
    return dipole * _squared_thrust(surface, pressure, quadrature_error)


def cancellation_pressure(
    surface: Surface,
    wavenumber: float,
    pressure: ComplexArray,
    points: FloatArray,
    plane: RigidPlane | None,
    quadrature_error: float,
) -> float:
    """Largest pressure (Pa) at field points (n_point, 3) m of the thrust F that is left of pressures (n_v, 1) Pa.

    |jk + 1/r| F/(4πr) on the axis of the dipole in the middle of the body, r half its diagonal at least; with a plane
    twice that.
    """
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    nearest = np.linalg.norm(points - 0.5 * (low + high), axis=1).min()
    r = max(float(nearest), 0.5 * float(np.linalg.norm(high - low)))
    thrust = float(np.sqrt(_squared_thrust(surface, pressure, quadrature_error)[0, 0].real))
    return float(np.hypot(wavenumber, 1.0 / r)) * thrust / (4 * np.pi * r) * (1.0 if plane is None else 2.0)


def _squared_thrust(surface: Surface, pressure: ComplexArray, quadrature_error: float) -> ComplexArray:
    """FᴴF (m, m) N² of pressures (n_v, m) Pa: F = (CANCELLATION (h/a)² + ε) √(S ∫|p|² dS), h the mean edge, a half the
    body's diagonal, ε the error of sound fields by quadrature, which is that of sharp edges."""
    half_diagonal = 0.5 * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    on_faces = pressure[surface.triangles].mean(axis=1)
    share = CANCELLATION * (mean_edge(surface) / half_diagonal) ** 2 + QUADRATURE_GROWTH * quadrature_error
    return np.asarray(share**2 * surface.areas.sum() * (on_faces.conj().T * surface.areas) @ on_faces)


def told_cancellation(
    frequency: FloatArray, power: FloatArray, error_power: FloatArray, fidelity: AcousticsFidelity, one_element: float
) -> dict[str, float]:
    """Provenance of the largest error of motions whose parts cancel each other, dB, and where it is, Hz.

    power, error_power: (n_f,) W, or Pa², that found and that of the dipole that is left, whose amplitudes add up at
    worst.  one_element: Hz at which the mesh has one element per wavelength.  Gives an AccuracyWarning where the error
    is larger than that of a mesh with `fidelity.elements_per_wavelength`, and than that of this one.
    """
    loud = np.flatnonzero(power > 0)
    if len(loud) == 0:
        return {}
    error = np.sqrt(error_power[loud] / power[loud])
    worst = int(error.argmax())
    largest, at = float(20 * np.log10(1 + error[worst])), float(frequency[loud[worst]])
    asked = MESH_ERROR * np.maximum(1 / fidelity.elements_per_wavelength, frequency[loud] / one_element) ** 2
    if (error > asked).any():
        warnings.warn(
            f"the parts of the motion cancel each other at {np.count_nonzero(error > asked)} lines: expect errors "
            f"up to {largest:.2g} dB, at {at:.4g} Hz; refine the mesh or raise the lower frequency",
            AccuracyWarning,
            stacklevel=3,
        )
    return {"cancellation_error_dB": largest, "cancellation_frequency": at}
