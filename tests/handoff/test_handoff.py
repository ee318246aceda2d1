"""Hand-offs check themselves when they are made."""

import numpy as np
import pytest

from nvhchain.conventions import Air
from nvhchain.errors import InputError
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    FloatArray,
    HandOff,
    MeshLaw,
    Surface,
    SurfaceVelocity,
)
from nvhchain.handoff.declared import array

VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def law(**changes):
    fields = {
        "angle": [0.0, 0.1],
        "deflection": [-1e-4, 0.0, 1e-5],
        "force": [[-10.0, 0.0, 5.0], [-10.0, 0.0, 6.0]],
        "period": 0.2,
        "teeth": (20, 50),
        "base_radius": [0.025, 0.064],
        "base_helix_angle": 0.16,
        "working_pressure_angle": 0.35,
        "centre_distance": 0.096,
        "face_width": 0.022,
    }
    return MeshLaw(**{**fields, **changes})


def test_tetrahedron_has_its_closed_form_volume_area_and_outward_normals():
    surface = Surface(VERTICES, TRIANGLES)
    assert surface.volume == pytest.approx(1 / 6, rel=1e-14)
    assert surface.areas.sum() == pytest.approx(1.5 + np.sqrt(3) / 2, rel=1e-14)
    outward = np.einsum("ij,ij->i", surface.normals, surface.centroids - VERTICES.mean(axis=0))
    assert (outward > 0).all()


@pytest.mark.parametrize(
    ("triangles", "message"),
    [
        (TRIANGLES[:3], "at least 4"),
        (np.vstack([TRIANGLES[:3], TRIANGLES[:1]]), "edges"),
        (TRIANGLES[:, [0, 2, 1]], "inward"),
        (np.vstack([TRIANGLES[:3], TRIANGLES[3:, [0, 2, 1]]]), "oriented"),
        (TRIANGLES + 1, "refer to vertices"),
    ],
)
def test_open_inward_and_inconsistent_surfaces_are_refused(triangles, message):
    with pytest.raises(InputError, match=message):
        Surface(VERTICES, triangles)


def test_arrays_are_read_only_and_detached_from_the_input():
    vertices = VERTICES.copy()
    surface = Surface(vertices, TRIANGLES)
    vertices[0] = 5.0
    assert surface.vertices[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        surface.vertices[0, 0] = 1.0


def test_content_hash_follows_content_and_not_provenance():
    surface = Surface(VERTICES, TRIANGLES)
    assert surface.content_hash == Surface(VERTICES, TRIANGLES, provenance={"stage": "x"}).content_hash
    assert surface.content_hash != Surface(2 * VERTICES, TRIANGLES).content_hash


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"force": [[-10.0, 0.0, -5.0], [-10.0, 0.0, 6.0]]}, "never fall"),
        ({"force": [[-10.0, 0.0, np.nan], [-10.0, 0.0, 6.0]]}, "finite"),
        ({"angle": [0.1, 0.0]}, "increase"),
        ({"period": 0.05}, "period"),
        ({"force": [[0.0, 1.0]]}, "shape"),
        ({"force": np.ones((2, 3)) * 1j}, "complex"),
    ],
)
def test_mesh_law_refuses_unphysical_tables(changes, message):
    with pytest.raises(InputError, match=message):
        law(**changes)


def test_bearing_forces_refuse_jittered_time_and_spread_a_scalar_speed():
    force = np.zeros((4, 1, 3))
    good = BearingForces([0.0, 0.1, 0.2, 0.3], force, ("A1",), [[0.0, 0, 0]], 10.0)
    assert good.input_speed.tolist() == [10.0] * 4
    assert good.sample_rate == pytest.approx(10.0)
    with pytest.raises(InputError, match="not uniform"):
        BearingForces([0.0, 0.1, 0.25, 0.3], force, ("A1",), [[0.0, 0, 0]], 10.0)


def test_repeated_bearing_names_are_refused():
    with pytest.raises(InputError, match="must be distinct"):
        BearingForces([0.0, 1.0], np.zeros((2, 2, 3)), ("A", "A"), np.zeros((2, 3)), 1.0)


def test_velocity_must_match_the_faces_of_its_surface():
    with pytest.raises(InputError, match="shape"):
        SurfaceVelocity([100.0], np.zeros((1, 5)), Surface(VERTICES, TRIANGLES))


def test_pressure_must_match_its_points():
    with pytest.raises(InputError, match="shape"):
        FieldPressure([100.0], np.zeros((2, 3)), np.zeros((1, 1)))


def test_air_with_a_speed_in_kilometres_per_second_is_refused():
    with pytest.raises(InputError, match="speed_of_sound"):
        Air(speed_of_sound=0.343)


def test_nobody_can_change_a_hand_off_from_outside_and_hand_offs_share_what_nobody_can_write():
    time, force = np.arange(3.0), np.ones((3, 1, 3))
    of = BearingForces(time, force[:, :], ("A",), np.zeros((1, 3)), np.ones(3))
    time[1], force[1] = 7.0, 7.0
    assert of.time.tolist() == [0.0, 1.0, 2.0]
    assert (of.force == 1.0).all()
    with pytest.raises(ValueError, match="read-only"):
        of.force[0] = 2.0
    again = of.replace(periodic=True)
    assert np.shares_memory(again.force, of.force)
    view = force[:]
    view.flags.writeable = False  # through `force` it can still be written
    assert not np.shares_memory(of.replace(force=view).force, force)


def test_a_superposition_is_multiplied_once_and_gives_way_to_another_velocity():
    surface = Surface(VERTICES, TRIANGLES)
    moving = SurfaceVelocity.superposition([100.0], [[2.0]], [[1.0, 2, 3, 4]], surface)
    assert "normal_velocity" not in vars(moving)
    assert moving.normal_velocity.tolist() == (200j * np.pi * 2.0 * np.array([[1.0, 2, 3, 4]])).tolist()
    assert moving.normal_velocity is moving.normal_velocity
    kept = moving.replace(provenance={"stage": "x"})
    assert kept.content_hash == moving.content_hash
    assert np.shares_memory(kept.shapes, moving.shapes)
    other = moving.replace(normal_velocity=np.ones((1, 4)))
    assert (other.normal_velocity == 1.0).all()
    assert other.shapes is None


@pytest.mark.parametrize(
    "parts",
    [
        {},
        {"coordinates": [[1.0]]},
        {"normal_velocity": np.ones((1, 4)), "coordinates": [[1.0]], "shapes": np.ones((1, 4))},
    ],
)
def test_a_velocity_is_given_once_and_whole(parts):
    with pytest.raises(InputError, match="give one of both"):
        SurfaceVelocity(
            **{"frequency": [100.0], "normal_velocity": None, "surface": Surface(VERTICES, TRIANGLES)} | parts
        )


def test_an_axis_has_one_length_in_all_fields():
    forces = {"time": [0.0, 0.1], "force": np.zeros((2, 1, 3)), "names": ("A",), "positions": [[0.0, 0, 0]]}
    recorded = {"mesh_deflection": np.zeros((2, 2)), "transmission_error": np.zeros((2, 2))}
    assert BearingForces(**forces, input_speed=1.0, **recorded).sizes["mesh"] == 2
    with pytest.raises(InputError, match=r"transmission_error has shape \(2, 3\), but \(2, 2\) is needed"):
        BearingForces(**forces, input_speed=1.0, **recorded | {"transmission_error": np.zeros((2, 3))})
    with pytest.raises(InputError, match="names has 2 values along bearing, but 1 are needed"):
        BearingForces(**forces | {"names": ("A", "B")}, input_speed=1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frequency": []}, "frequency is empty"),
        ({"frequency": [-1.0]}, r"frequency = -1 Hz is below the lowest admissible value 0"),
        ({"input_speed": np.nan}, "input_speed = nan must be finite"),
        ({"input_speed": "fast"}, "input_speed = 'fast' must be a number"),
    ],
)
def test_numbers_and_axes_of_any_hand_off_are_checked(changes, message):
    with pytest.raises(InputError, match=message):
        FieldPressure(**{"frequency": [1.0], "points": [[0.0, 0, 1]], "pressure": [[1.0]]} | changes)


def test_a_surface_must_be_one():
    with pytest.raises(InputError, match="surface = ball must be a Surface"):
        SurfaceVelocity([100.0], np.ones((1, 4)), "ball")


def test_a_name_is_not_an_axis_and_a_field():
    with pytest.raises(TypeError, match="point is an axis and a field"):

        class Wrong(HandOff):
            point: FloatArray = array("m", "axis", "a point")
            values: FloatArray = array("1", "point", "values")
