"""What discretisation leaves where parts of a motion cancel each other: the sound of a dipole, as an error of it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from nvhchain.acoustics.accuracy import MESH_ERROR, QUADRATURE_GROWTH
from nvhchain.acoustics.bodies import separate
from nvhchain.acoustics.surface import mean_edge, width_to_length
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface

CANCELLATION = 0.2
"""Thrust that the error of the mesh leaves, relative to the area times the root mean square pressure on it, times the
square of the mean edge over half the diagonal of the body that carries it, over the body's width by its length: a
bound; rotating boxes and ellipsoids of irregular mesh, which radiate hardly anything else at low frequency, 0.004 to
0.18 (docs/measured/sound_power.md).  Of strips that bend all along the error is 0.5 dB at four edges a wave, be they
as long as wide or 16 times as long.
Bodies of revolution that rotate about their own axis are beyond it: the facets alone move their air."""


def cancellation_resistance(
    surface: Surface, wavenumber: float, pressure: ComplexArray, plane: RigidPlane | None, quadrature_error: float
) -> ComplexArray:
    """Radiation resistance E (m, m), times ρc, of the error that velocities with these pressures (n_v, m) Pa may have.

    ½ q̇ᴴ E q̇/(ρc) is the power k²F²/(24πρc) of a dipole (Morse & Ingard, Theoretical Acoustics, 1968, sect. 7.1) with
    the thrust F that is left; twice that over a rigid plane, which doubles the thrust along it and leaves half of the
    space.  quadrature_error: of `expected_accuracy`.  Hermitian, semidefinite.
    """
    dipole = wavenumber**2 / (12 * np.pi) * (1.0 if plane is None else 2.0)
    return np.asarray(dipole * sum(thrust.squared for thrust in _thrusts(surface, pressure, quadrature_error)))


def cancellation_pressure(
    surface: Surface,
    wavenumber: float,
    pressure: ComplexArray,
    points: FloatArray,
    plane: RigidPlane | None,
    quadrature_error: float,
) -> float:
    """Largest pressure (Pa) at field points (n_point, 3) m of the thrusts F that are left of pressures (n_v, 1) Pa.

    |jk + 1/r| F/(4πr) on the axis of a dipole amid the pressures on every body, r half their extent at least; with a
    plane twice that.
    """
    squares = 0.0
    for thrust in _thrusts(surface, pressure, quadrature_error):
        r = max(float(np.linalg.norm(points - thrust.middles[0], axis=1).min()), float(thrust.extents[0]))
        squares += (1.0 + (wavenumber * r) ** 2) * float(thrust.squared[0, 0].real) / (4 * np.pi * r**2) ** 2
    return float(np.sqrt(squares)) * (1.0 if plane is None else 2.0)


@dataclass(frozen=True, eq=False)
class _Thrust:
    """Of the pressures on one body.  squared: FᴴF (m, m) N².  middles: (m, 3) m and extents (m,) m of what carries
    them."""

    squared: ComplexArray
    middles: FloatArray
    extents: FloatArray


def _thrusts(surface: Surface, pressure: ComplexArray, quadrature_error: float) -> list[_Thrust]:
    """What is left on every body of pressures (n_v, m) Pa: F = (CANCELLATION h²/(a²w) + ε) √(S ∫|p|² dS), h the
    mean edge, ε the error of sound fields by quadrature, which is that of sharp edges.

    a and S: half the diagonal and the area of the body, or of the part of it that carries |p|² (√3 radii of gyration;
    twice (∫|p|² dS)²/∫|p|⁴ dS), if that is smaller: what lies at rest far away cancels nothing. w: width over length of
    the body, or of what carries |p|², if that is larger (`width_to_length`). They are those of every column by itself.
    """
    on_faces = pressure[surface.triangles].mean(axis=1)
    made = []
    for faces, body in separate(surface):
        here, h = on_faces[faces], mean_edge(body)
        carried = body.areas[:, None] * np.abs(here) ** 2
        total = carried.sum(axis=0)
        weight = np.where(total > 0, carried, body.areas[:, None])
        weight = weight / weight.sum(axis=0)
        middles = weight.T @ body.centroids
        square = (body.centroids**2).sum(axis=1) @ weight - (middles**2).sum(axis=1)
        half_diagonal = 0.5 * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
        extents = np.clip(np.sqrt(3.0 * square.clip(0.0)), h, half_diagonal)
        area = np.minimum(body.areas.sum(), 2.0 / (weight**2 / body.areas[:, None]).sum(axis=0))
        spread = np.column_stack([body.areas / body.areas.sum(), weight])
        slender = width_to_length(body.centroids, spread)
        compact = np.maximum(extents**2 * np.maximum(slender[0], slender[1:]), h**2)
        share = (CANCELLATION * h**2 / compact + QUADRATURE_GROWTH * quadrature_error) * np.sqrt(area)
        squared = np.outer(share, share) * ((here.conj().T * body.areas) @ here)
        made.append(_Thrust(squared, middles, extents))
    return made


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
