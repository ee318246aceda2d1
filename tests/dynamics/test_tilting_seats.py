"""Seats that tilt under the moments of their bearings: in equilibrium, in a run and in its forced response."""

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces, equilibrium
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.housing.modes.response import modal_displacement
from nvhchain.spectrum import force_spectrum
from nvhchain.testing.two_stages import SPEED, moment_bearings, tilting


def recorded(box, laws, housing, f_max):
    fidelity = DynamicsFidelity(time_step=1e-5)
    given = {"input_torque": 250.0, "input_speed": SPEED, "duration": 0.02}
    return bearing_forces(box, laws, housing, **given, f_max=f_max, fidelity=fidelity)


def test_a_seat_is_in_series_with_its_bearing_in_all_five_motions(make_gearbox, make_laws, make_housing):
    """A bearing K on a seat of flexibility R is one of (K⁻¹ + R)⁻¹ on a rigid seat."""
    laws, box = make_laws(), moment_bearings(make_gearbox())
    housing = tilting(make_housing(box, modes=1))
    housing = housing.replace(seat_shapes=np.zeros_like(housing.seat_shapes))
    residual, matrix = housing.seat_residual[0, :, 0], np.array(box.bearings[0].model.matrix)
    softer = np.linalg.inv(np.linalg.inv(matrix) + residual)
    found, expected, rigid = (
        equilibrium(gearbox, laws, on, input_torque=250.0)
        for gearbox, on in ((box, housing), (moment_bearings(box, 0.5 * (softer + softer.T)), None), (box, None))
    )
    size = np.abs(expected.bearing_load).max(axis=0)
    assert size[3:].min() > 1.0
    assert np.abs((found.bearing_load - expected.bearing_load) / size).max() < 1e-8
    assert np.abs(found.misalignment - expected.misalignment).max() < 1e-8 * np.abs(expected.misalignment).max()
    assert np.abs((rigid.bearing_load - expected.bearing_load) / size).max() > 1e-2


def test_mean_moments_of_a_run_are_those_of_the_equilibrium(make_gearbox, make_laws, make_housing):
    laws = make_laws(error=0.0, mesh_ripple=0.0, plain_wheel=True)
    box = moment_bearings(make_gearbox())
    housing = tilting(make_housing(box, modes=10))
    balanced = equilibrium(box, laws, housing, input_torque=250.0).bearing_load
    run = recorded(box, laws, housing, 2000.0)
    assert np.abs((run.wrench.mean(axis=0) - balanced) / np.abs(balanced).max(axis=0)).max() < 1e-6


def test_moments_move_the_modes_of_a_housing_and_pass_into_the_spectrum(make_gearbox, make_laws, make_housing):
    laws, box = make_laws(), moment_bearings(make_gearbox())
    housing = tilting(make_housing(box, modes=12))
    run = recorded(box, laws, housing, 3000.0)
    lines = force_spectrum(run, low=100.0, high=3000.0)
    both = lines.sort_bearings(housing.names, 5).reshape(len(lines.frequency), -1, 5)
    assert np.array_equal(both, lines.wrench)
    assert np.array_equal(lines.select(slice(3, 9)).moment, lines.moment[3:9])
    whole = modal_displacement(housing, lines.frequency, lines.sort_bearings(housing.names, 5))
    pushed = modal_displacement(housing.drop_tilts(), lines.frequency, lines.sort_bearings(housing.names))
    tilted = np.einsum("fbt,mbt->fm", lines.moment, housing.seat_shapes[:, :, 3:])
    assert whole - pushed == pytest.approx(tilted * housing.receptance(lines.frequency), rel=1e-9, abs=1e-15)
    assert np.abs(whole - pushed).max() > 0.02 * np.abs(whole).max()


def test_seats_that_state_tilts_of_zero_are_those_drop_tilts(make_gearbox, make_laws, make_housing):
    laws, box = make_laws(), moment_bearings(make_gearbox())
    plain = make_housing(box, modes=10)
    still = plain.replace(
        seat_shapes=np.pad(plain.seat_shapes, [(0, 0), (0, 0), (0, 2)]),
        seat_residual=np.pad(plain.seat_residual, [(0, 0), (0, 2), (0, 0), (0, 2)]),
        face_residual=np.pad(plain.face_residual, [(0, 0), (0, 2), (0, 0)]),
    )
    one, other = (equilibrium(box, laws, each, input_torque=250.0).bearing_load for each in (plain, still))
    assert np.abs(one - other).max() < 1e-9 * np.abs(one).max()
