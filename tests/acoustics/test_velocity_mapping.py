"""Velocities on needles reach the faces of the new mesh, side by side and in place."""

import numpy as np
import pytest

from nvhchain.acoustics import map_velocity, remesh_needles
from nvhchain.errors import InputError
from nvhchain.handoff import SurfaceVelocity
from nvhchain.testing.bodies import cells, cylinder, turned

FREQUENCY = np.array([100.0, 200.0])


def needles():
    """Cylinder of 64 strips, each as long as the body."""
    return turned([(0.0, -0.1), (0.05, -0.1), (0.05, 0.1), (0.0, 0.1)], 64)


@pytest.fixture(scope="module")
def remeshed():
    """Even triangles in place of the needles."""
    return remesh_needles(needles(), 0.02).surface


def moving(surface, normal):
    return SurfaceVelocity(FREQUENCY, np.array([[1.0], [2j]]) * normal, surface)


@pytest.mark.slow
def test_a_shaking_cylinder_of_needles_shakes_after_remeshing(remeshed):
    given, new = needles(), remeshed
    factor = np.array([1.0, 2j, 3.0])
    shaking = SurfaceVelocity([100.0, 200.0, 300.0], factor[:, None] * given.normals.T, given)
    for found, along in zip(map_velocity(shaking, new).normal_velocity / factor[:, None], new.normals.T, strict=True):
        # strips are 5.6° wide, new faces up to three of them
        assert np.abs(found - along).max() < 0.2
        assert np.sqrt(np.average((found - along).real ** 2, weights=new.areas)) < 0.03


def test_the_same_mesh_keeps_its_velocity():
    body = cylinder(0.05, 0.1, 12)
    normal = np.random.default_rng(1).normal(size=len(body.triangles))
    assert map_velocity(moving(body, normal), body).normal_velocity[0] == pytest.approx(normal, abs=1e-14)


def test_both_sides_of_a_thin_plate_stay_apart():
    coarse, fine = (cells((n, n, 1), (0.3, 0.3, 0.001)) for n in (3, 9))
    found = map_velocity(moving(coarse, np.where(coarse.normals[:, 2] > 0.5, 3.0, -1.0)), fine).normal_velocity[0].real
    assert set(found[fine.normals[:, 2] > 0.5]) == {3.0}
    assert set(found[fine.normals[:, 2] < 0.5]) == {-1.0}


def test_a_face_takes_the_velocity_of_its_own_side_even_where_the_other_one_is_nearer():
    given = cells((3, 3, 1), (0.3, 0.3, 0.001))
    moved = given.replace(vertices=given.vertices + np.array([0.0, 0.0, 0.0008]))
    up = given.normals[:, 2] > 0.5
    down = given.normals[:, 2] < -0.5
    found = map_velocity(moving(given, np.where(up, 3.0, -1.0)), moved).normal_velocity[0].real
    assert set(found[up]) == {3.0}
    assert set(found[down]) == {-1.0}


@pytest.mark.slow
def test_a_superposition_remains_one(remeshed):
    given, rng = needles(), np.random.default_rng(2)
    coordinates, shapes = rng.normal(size=(2, 3)) + 1j, rng.normal(size=(3, len(given.triangles)))
    mapped = map_velocity(SurfaceVelocity.superposition(FREQUENCY, coordinates, shapes, given), remeshed)
    assert mapped.shapes.shape == (3, len(mapped.surface.triangles))
    plain = map_velocity(moving(given, shapes[0]), mapped.surface).normal_velocity[0].real
    assert mapped.shapes[0] == pytest.approx(plain)


def test_a_mesh_somewhere_else_is_refused_with_the_place():
    body = cylinder(0.05, 0.1, 12)
    with pytest.raises(InputError, match=r"no face within .* mm of \(.*\) mm .* same body at the same place"):
        map_velocity(moving(body, body.normals[:, 0]), body.replace(vertices=body.vertices + 0.1))
