"""Transfer vectors of faces that each lie in an infinite baffle: the Rayleigh integral over the visible faces."""

from __future__ import annotations

import warnings

import numpy as np

from nvhchain.acoustics.plane import check_plane, with_images
from nvhchain.acoustics.potentials import layer_potentials
from nvhchain.acoustics.projection import check_memory
from nvhchain.acoustics.surface import check_points
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray, RigidPlane, Surface, SurfaceVelocity

MEASURED = ((0.5, 9.5, 16.0), (1.0, 4.2, 13.0), (2.0, 1.3, 12.0), (4.0, 0.5, 11.0), (np.inf, 0.0, 8.0))
"""Wavenumber times half size of the body up to which a row holds, mean level error and error of single levels (RMS),
dB: the worse of a box under bending waves and a gearbox (docs/measured/radiation.md)."""

TOLERABLE = 3.0
"""dB of mean level error, twice the power, above which it is warned of."""


def rayleigh_accuracy(surface: Surface, frequency: FloatArray, air: Air) -> dict[str, float]:
    """Provenance of what the Rayleigh integral lets expect at the lowest frequency (n_f,) Hz above 0 Hz.

    expected_error_dB: of single levels, expected_mean_error_dB: of the mean over points and excitations, and so of the
    power.  Gives an AccuracyWarning where the mean is off by more than `TOLERABLE`.  A flat radiator in a baffle is
    exact all the same.
    """
    radiating = frequency[frequency > 0]
    if len(radiating) == 0:
        return {}
    half_size = 0.5 * float(np.linalg.norm(np.ptp(surface.vertices, axis=0))) / np.sqrt(3.0)
    ka = 2 * np.pi * float(radiating[0]) / air.speed_of_sound * half_size
    _, mean, single = next(row for row in MEASURED if ka < row[0])
    if mean > TOLERABLE:
        warnings.warn(
            f"Rayleigh integral at {radiating[0]:.4g} Hz, where wavenumber times half size of the body is {ka:.2g}: "
            f"unless it is flat and in a baffle, expect levels {mean:.2g} dB too high in the mean, {single:.2g} dB off "
            "at single points; choose radiation = 'boundary_elements' or raise the lower frequency",
            AccuracyWarning,
            stacklevel=3,
        )
    return {"expected_error_dB": single, "expected_mean_error_dB": mean}


def check_rayleigh_memory(surface: Surface, points: int, kept: int) -> int:
    """Bytes that the vectors of one frequency take while they are made; `ResourceError` unless they and `kept` bytes of
    results fit into free memory."""
    task = 16 * points * (len(surface.vertices) + 2 * len(surface.triangles))
    check_memory(task + kept, "Rayleigh integrals", "frequencies")
    return task


def rayleigh_vectors(
    frequency: FloatArray, surface: Surface, points: FloatArray, air: Air, near_ratio: float
) -> ComplexArray:
    """p = jωρ ∫ v_n e^{−jkr}/(2πr) dS over the faces that look towards the point: (n_f, n_point, n_face) Pa/(m/s).

    Exact for a flat radiator in a rigid baffle; the rest of the body neither shades nor reflects.  A face looks towards
    a point that lies in front of its plane; parts of the body in between are not seen.
    points: (n_point, 3) m; images behind a rigid plane are further points.  near_ratio: see `layer_potentials`.
    Source: Pierce, Acoustics, section 5.2.
    """
    ahead = np.array([np.einsum("fi,fi->f", x - surface.centroids, surface.normals) > 0 for x in points])
    vectors = np.zeros((len(frequency), len(points), len(surface.triangles)), dtype=complex)
    for vector, f in zip(vectors, frequency, strict=True):
        omega = 2 * np.pi * float(f)
        _, single = layer_potentials(surface, points, omega / air.speed_of_sound, near_ratio)
        vector[ahead] = 2j * omega * air.density * single[ahead]
    return vectors


def rayleigh_field(
    surface_velocity: SurfaceVelocity, points: FloatArray, air: Air, near_ratio: float, plane: RigidPlane | None
) -> FieldPressure:
    """Sound pressure by the Rayleigh integral at every line, without keeping transfer vectors.

    points: (n_point, 3) m, outside the body.  plane: a rigid plane that reflects.  Raises InputError as
    `transfer_vectors` does, and ResourceError.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    x = check_points(surface, points)
    if plane is not None:
        check_plane(plane, surface, x)
    ends = with_images(x, plane)
    check_rayleigh_memory(surface, len(ends), 16 * len(frequency) * len(x))
    expected = rayleigh_accuracy(surface, frequency, air)
    pressure = np.empty((len(frequency), len(x)), dtype=complex)
    for line, velocity in enumerate(surface_velocity.normal_velocity):
        vectors = rayleigh_vectors(frequency[line : line + 1], surface, ends, air, near_ratio)[0]
        pressure[line] = (vectors @ velocity).reshape(-1, len(x)).sum(axis=0)
    return FieldPressure(frequency, x, pressure, provenance={"stage": "acoustics.rayleigh_field"} | expected)
