"""Housing of a run-up: forces of an order, and the motion that they cause."""

import numpy as np
import pytest

from nvhchain.acoustics import radiate
from nvhchain.handoff import BearingForces, ForceSpectrum
from nvhchain.housing import respond
from nvhchain.plots import OrderMarks
from nvhchain.report import run_up
from nvhchain.report.causes.run_up import order_forces
from nvhchain.report.page.sections.speed import moving_housing
from nvhchain.report.page.sections.speed.moving_housing import _contribution, _motion
from nvhchain.spectrum import Waterfall
from nvhchain.testing import ball_with_modes


@pytest.fixture(scope="module")
def forces():
    """Two orders in a run-up from 50 to 150 rad/s, at the first bearing."""
    time = np.linspace(0.0, 10.0, 80001)
    angle = 50.0 * time + 5.0 * time**2
    force = np.zeros((len(time), 4, 3))
    force[:, 0, 0] = 7.0 + 3.0 * np.cos(20 * angle + 0.4) + 2.0 * np.cos(37 * angle)
    force[:, 0, 2] = -1.5 * np.cos(20 * angle)
    return BearingForces(time, force, ball_with_modes.BEARINGS, np.zeros((4, 3)), 50.0 + 10.0 * time)


def test_an_order_is_found_with_its_amplitude_and_the_phase_between_channels(forces):
    found = order_forces(forces, 20.0, np.array([70.0, 100.0, 130.0])).force
    assert np.abs(found[:, 0, 0]) == pytest.approx(3.0, rel=2e-3)
    assert found[:, 0, 0] / found[:, 0, 2] == pytest.approx(-2.0 * np.exp(0.4j), rel=2e-3)
    assert np.abs(found[:, 1:]).max() < 1e-12
    assert np.abs(order_forces(forces, 28.0, np.array([100.0])).force).max() < 5e-3


def test_motion_is_the_response_to_that_force_at_its_frequency(forces):
    housing = ball_with_modes.housing(ball_with_modes.case())
    moved = _motion(forces, housing, [(20.0, 70.0), (20.0, 130.0), (37.0, 100.0)])
    steady = np.zeros((1, 4, 3), complex)
    steady[0, 0, 0] = 2.0
    alone = respond(housing, ForceSpectrum([37 * 100 / (2 * np.pi)], steady, forces.names)).normal_velocity[0]
    assert np.abs(moved[2]) == pytest.approx(np.abs(alone), rel=5e-3)


def test_a_harmonic_between_the_lines_of_a_short_record_leaves_the_loudest_line():
    marks = OrderMarks(mesh={"stage": 22.0}, slots={})
    lines = np.arange(300) * (4.0 / 15.0)  # 66 lies between two of them
    loud = float(lines[247])
    assert run_up._snap_to_harmonics([loud], lines, marks) == [loud]
    assert run_up._snap_to_harmonics([79.9], np.arange(1000) * 0.1, OrderMarks(mesh={"stage": 20.0}, slots={})) == [
        80.0
    ]


def test_a_record_of_nearly_constant_speed_has_no_slider_over_speed():
    time = np.linspace(0.0, 1.0, 200)
    speed = 180.0 * (1.0 + 0.02 * np.sin(2 * np.pi * 30.0 * time))
    forces = BearingForces(time, np.zeros((200, 1, 3)), ("a",), np.zeros((1, 3)), speed)
    loud = run_up.Curve("order 20", "dB", speed, np.full(200, 60.0), 20.0)
    assert moving_housing._places({"one": [loud]}, [forces], 1000.0) == []
    rising = forces.replace(input_speed=np.linspace(90.0, 180.0, 200))
    assert len(moving_housing._places({"one": [loud]}, [rising], 1000.0)) == moving_housing.SPEEDS


def test_mesh_orders_are_followed_before_louder_sound_between_them():
    """Eight peaks between mesh orders stand above the third harmonic of the mesh, which is followed all the same."""
    axis = np.arange(1000) * 0.1
    amplitude = np.full((4, 1000), 1e-6, complex)
    between = np.array([21.5, 23.7, 25.9, 28.1, 30.3, 32.5, 34.7, 36.9])
    amplitude[:, np.rint(between * 10).astype(int)] = 1.0
    amplitude[:, [200, 399, 599]] = 0.9  # the second and the third a line beside the harmonic
    marks = OrderMarks(mesh={"stage": 20.0}, slots={})
    found = run_up.main_orders([Waterfall(np.arange(4.0), np.full(4, 200.0), axis, amplitude, True)], marks)
    assert set(found) > {20.0, 40.0, 60.0}  # by their names, as curves and players use them
    assert len(found) == run_up.MAIN_ORDERS


def test_contributions_of_faces_add_up_to_the_sound_of_a_steady_state_at_the_speed(forces):
    case = ball_with_modes.case()
    housing = ball_with_modes.housing(case)
    vectors = ball_with_modes.parts(case, housing)[2]
    places = [(37.0, 110.0), (37.0, 130.0), (60.0, 110.0)]
    motion = _motion(forces, housing, places)
    faces = _contribution([vectors], vectors.points[0], housing, places, motion)
    for number, (order, speed) in enumerate(places):
        force = order_forces(forces, order, np.array([speed]))
        heard = radiate(vectors, respond(housing, force)).pressure[0, 0]
        assert (faces[number] * housing.surface.areas).sum() / 10.0 == pytest.approx(abs(heard), rel=1e-9)
    assert _contribution([vectors], vectors.points[0], housing, [(37.0, 1e4)], motion[:1]) is None  # above all vectors
    assert _contribution([], vectors.points[0], housing, places, motion) is None
    turned = vectors.replace(points=vectors.points[::-1], vectors=vectors.vectors[:, ::-1])
    other = _contribution([turned], vectors.points[0], housing, places, motion)
    assert np.abs(other - faces).max() < 1e-9 * np.abs(faces).max()  # whatever the order of the points
    assert _contribution([vectors], vectors.points[0] + 0.1, housing, places, motion) is None
