"""Housing of a run-up: forces of an order, and the motion that they cause."""

import numpy as np
import pytest

from nvhchain.handoff import BearingForces, ForceSpectrum
from nvhchain.housing import respond
from nvhchain.report.page.sections.speed.moving_housing import _motion, order_forces
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
    found = order_forces(forces, 20.0, np.array([70.0, 100.0, 130.0]))
    assert np.abs(found[:, 0, 0]) == pytest.approx(3.0, rel=2e-3)
    assert found[:, 0, 0] / found[:, 0, 2] == pytest.approx(-2.0 * np.exp(0.4j), rel=2e-3)
    assert np.abs(found[:, 1:]).max() < 1e-12
    assert np.abs(order_forces(forces, 28.0, np.array([100.0]))).max() < 5e-3


def test_motion_is_the_response_to_that_force_at_its_frequency(forces):
    housing = ball_with_modes.housing(ball_with_modes.case())
    moved = _motion(forces, housing, [(20.0, 70.0), (20.0, 130.0), (37.0, 100.0)])
    steady = np.zeros((1, 4, 3), complex)
    steady[0, 0, 0] = 2.0
    alone = respond(housing, ForceSpectrum([37 * 100 / (2 * np.pi)], steady, forces.names)).normal_velocity[0]
    assert np.abs(moved[2]) == pytest.approx(np.abs(alone), rel=5e-3)
