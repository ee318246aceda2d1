"""Sound does not care where the scene lies, how it is turned, mirrored or scaled, and obeys linearity and reciprocity.

All on one mesh, so that nothing but rounding and the quadrature of turned triangles (3e-6) may differ.  Mirrored
triangles take their corners in another order: 1e-6 of quadrature, 4e-8 with finer one, which the test takes.
"""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import PointSource, radiate, solve_direct, surface_pressure, transfer_vectors
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.conventions import Air
from nvhchain.handoff import RigidPlane, Surface, SurfaceVelocity
from nvhchain.levels import decibel


@pytest.fixture(scope="module")
def pressure(body, velocity, points, air, fidelity):
    """(n_f, n_point) Pa of the scene as it is."""
    return solve_direct(velocity, points, air=air, fidelity=fidelity).pressure


def close(found, expected, tolerance):
    return np.abs(found - expected).max() < tolerance * np.abs(expected).max()


def moving(velocity, surface):
    return SurfaceVelocity(velocity.frequency, velocity.normal_velocity, surface)


def test_a_scene_that_is_moved_as_a_whole_sounds_the_same(body, velocity, points, pressure, air, fidelity):
    shift = np.array([3.0, -2.0, 5.0])
    moved = body.replace(vertices=body.vertices + shift)
    found = solve_direct(moving(velocity, moved), points + shift, air=air, fidelity=fidelity).pressure
    assert close(found, pressure, 1e-12)


def test_a_scene_that_is_turned_as_a_whole_sounds_the_same(body, velocity, points, pressure, rotation, air, fidelity):
    turned = body.replace(vertices=body.vertices @ rotation.T)
    found = solve_direct(moving(velocity, turned), points @ rotation.T, air=air, fidelity=fidelity).pressure
    assert close(found, pressure, 1e-5)


def test_a_mirrored_scene_sounds_the_same(body, velocity, points, air, fidelity):
    flip = np.array([-1.0, 1.0, 1.0])
    mirrored = Surface(body.vertices * flip, body.triangles[:, ::-1])
    fine = replace(fidelity, quadrature_order=4, singular_order=6)
    found = solve_direct(moving(velocity, mirrored), points * flip, air=air, fidelity=fine).pressure
    assert close(found, solve_direct(velocity, points, air=air, fidelity=fine).pressure, 1e-7)


@pytest.mark.parametrize("scale", [1e-2, 1e2])
def test_a_scaled_scene_at_scaled_frequencies_has_the_same_pressure(
    body, velocity, points, pressure, air, fidelity, scale
):
    """p depends on k L and ρc alone: v and ρc as before, lengths times s, frequencies over s."""
    scaled = SurfaceVelocity(
        velocity.frequency / scale, velocity.normal_velocity, body.replace(vertices=scale * body.vertices)
    )
    assert close(solve_direct(scaled, scale * points, air=air, fidelity=fidelity).pressure, pressure, 1e-10)


def test_sound_twice_as_fast_at_twice_the_frequency_and_three_times_the_density(
    velocity, points, pressure, air, fidelity
):
    """Same k, ρc six times as large."""
    other = Air(2 * air.speed_of_sound, 3 * air.density)
    quick = SurfaceVelocity(2 * velocity.frequency, velocity.normal_velocity, velocity.surface)
    assert close(solve_direct(quick, points, air=other, fidelity=fidelity).pressure, 6 * pressure, 1e-10)
    vectors = transfer_vectors(quick.surface, points, quick.frequency, air=other, fidelity=fidelity)
    assert close(radiate(vectors, quick, fidelity=fidelity).pressure, 6 * pressure, 1e-8)


def test_pressures_of_two_motions_add_up(body, velocity, points, pressure, air, fidelity):
    up = SurfaceVelocity(velocity.frequency, np.tile(body.normals[:, 2].astype(complex), (3, 1)), body)
    rest = SurfaceVelocity(velocity.frequency, velocity.normal_velocity - up.normal_velocity, body)
    parts = [solve_direct(part, points, air=air, fidelity=fidelity).pressure for part in (up, rest)]
    assert close(sum(parts), pressure, 1e-10)


def test_twice_the_velocity_is_six_decibels_more_and_a_turned_phase_turns_the_pressure(
    velocity, points, pressure, air, fidelity
):
    twice = SurfaceVelocity(velocity.frequency, 2j * velocity.normal_velocity, velocity.surface)
    found = solve_direct(twice, points, air=air, fidelity=fidelity).pressure
    assert close(found, 2j * pressure, 1e-12)
    assert decibel(found) - decibel(pressure) == pytest.approx(20 * np.log10(2), abs=1e-9)


def test_a_transfer_vector_is_the_pressure_on_the_rigid_body_under_a_source_at_the_field_point(
    body, points, velocity, air, fidelity
):
    """Reciprocity (Fahy, J. Acoust. Soc. Am. 97, 1995): p(x) per volume velocity of a face of the rigid body is the
    pressure that the same volume velocity at x has on that face, as far as its velocity is passed on by it and those
    beside; within the error of so coarse a mesh."""
    vectors = transfer_vectors(body, points, velocity.frequency, air=air, fidelity=fidelity)
    still = SurfaceVelocity(velocity.frequency, 0 * velocity.normal_velocity, body)
    omega = 2 * np.pi * velocity.frequency[:, None]
    for m, point in enumerate(points):
        under = surface_pressure(still, incident=PointSource(tuple(point)), air=air, fidelity=fidelity).pressure
        on_faces = body.areas * under[:, body.triangles].mean(axis=2)
        expected = 1j * omega * air.density * (on_faces @ velocity_within_faces(body))
        found = vectors.vectors[:, m]
        error = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
        assert (error < [0.01, 0.03, 0.13]).all()
        net, true = ((v * velocity.normal_velocity).sum(axis=1) for v in (found, expected))
        assert (np.abs(net - true) < 0.04 * np.abs(true)).all()


def test_a_body_on_one_side_of_a_rigid_plane_is_the_body_and_its_image_without_the_plane(
    body, velocity, points, air, fidelity
):
    """Method of images, here with the image's mesh; 5e-5 apart at the lowest line, whatever the quadrature."""
    plane = RigidPlane((0.0, 0.0, -0.3), (0.0, 0.0, 1.0))
    heard = points[:2]
    flip = np.array([1.0, 1.0, -1.0])
    below = body.vertices * flip - [0.0, 0.0, 0.6]
    both = Surface(
        np.concatenate([body.vertices, below]),
        np.concatenate([body.triangles, body.triangles[:, ::-1] + len(body.vertices)]),
    )
    pair = SurfaceVelocity(velocity.frequency, np.tile(velocity.normal_velocity, (1, 2)), both)
    expected = solve_direct(pair, heard, air=air, fidelity=fidelity).pressure
    vectors = transfer_vectors(body, heard, velocity.frequency, air=air, fidelity=fidelity, plane=plane)
    assert close(radiate(vectors, velocity, fidelity=fidelity).pressure, expected, 1e-4)
