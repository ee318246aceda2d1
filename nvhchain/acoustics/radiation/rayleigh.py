"""Transfer vectors of faces that each lie in an infinite baffle: the Rayleigh integral over the visible faces."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.accuracy.radiation_levels import level_accuracy
from nvhchain.acoustics.radiation.projection import check_memory
from nvhchain.acoustics.surfaces.reflecting_plane import append_images, check_plane
from nvhchain.acoustics.surfaces.surface import check_points
from nvhchain.acoustics.waves.layer_potentials import layer_potentials
from nvhchain.conventions import Air
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    RigidPlane,
    SoundAccuracy,
    Surface,
    SurfaceVelocity,
)


def rayleigh_accuracy(surface: Surface, frequency: FloatArray, air: Air) -> SoundAccuracy:
    """Return `level_accuracy` of the Rayleigh integral, although a flat radiator in a baffle is exact."""
    return level_accuracy(surface, frequency, air, "rayleigh")


def check_rayleigh_memory(surface: Surface, points: int, stored_bytes: int) -> int:
    """Return the bytes needed to compute the vectors of one frequency.

    ResourceError unless they and `stored_bytes` bytes of results fit into free memory.
    """
    task = 16 * points * (len(surface.vertices) + 2 * len(surface.triangles))
    check_memory(task + stored_bytes, "Rayleigh integrals", "ask for fewer frequencies or field points")
    return task


def rayleigh_vectors(
    frequency: FloatArray, surface: Surface, points: FloatArray, air: Air, cut_ratio: float
) -> ComplexArray:
    """Return p = jωρ ∫ v_n e^{−jkr}/(2πr) dS over the faces that look towards the point, (n_f, n_point, n_face).

    points : (n_point, 3) field points (m); images behind a rigid plane are further points.
    cut_ratio : near-field limit of `layer_potentials`.

    The integral is exact for a flat radiator in a rigid baffle. The rest of the body neither shades nor reflects. A
    face looks towards a point in front of its plane; parts of the body in between are neglected. Source: Pierce,
    Acoustics, section 5.2.
    """
    ahead = np.array([np.einsum("fi,fi->f", x - surface.centroids, surface.normals) > 0 for x in points])
    vectors = np.zeros((len(frequency), len(points), len(surface.triangles)), dtype=complex)
    for vector, f in zip(vectors, frequency, strict=True):
        omega = 2 * np.pi * float(f)
        _, single = layer_potentials(surface, points, omega / air.speed_of_sound, cut_ratio)
        vector[ahead] = 2j * omega * air.density * single[ahead]
    return vectors


def rayleigh_field(
    surface_velocity: SurfaceVelocity, points: FloatArray, air: Air, cut_ratio: float, plane: RigidPlane | None
) -> FieldPressure:
    """Compute sound pressure by the Rayleigh integral at every line, without keeping transfer vectors.

    InputError in the cases of `transfer_vectors`. ResourceError if the integrals do not fit into free memory.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    x = check_points(surface, points)
    if plane is not None:
        check_plane(plane, surface, x)
    ends = append_images(x, plane)
    check_rayleigh_memory(surface, len(ends), 16 * len(frequency) * len(x))
    expected = rayleigh_accuracy(surface, frequency, air)
    pressure = np.empty((len(frequency), len(x)), dtype=complex)
    for line, velocity in enumerate(surface_velocity.normal_velocity):
        vectors = rayleigh_vectors(frequency[line : line + 1], surface, ends, air, cut_ratio)[0]
        pressure[line] = (vectors @ velocity).reshape(-1, len(x)).sum(axis=0)
    made = {"stage": "acoustics.rayleigh_field"}
    return FieldPressure(frequency, x, pressure, accuracy=expected, provenance=made)
