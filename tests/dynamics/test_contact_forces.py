"""Contact forces of a run: the energy they feed in, the housing they move, the flanks they act on."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from nvhchain.dynamics.model.train import train
from nvhchain.dynamics.runs.steady import _Cycle, _period
from nvhchain.dynamics.time_loop.propagator import state_of
from nvhchain.dynamics.time_loop.quasi_static import law_phases
from nvhchain.dynamics.time_loop.simulation import advance, bearing_force, quasi_static_state, simulation
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.spectrum import amplitude_spectrum
from nvhchain.testing.two_stages import moment_bearings, tilting

SPEED = 2500 * 2 * pi / 60


def _last_period(gearbox, laws, housing, step, periods):
    """A settled period by the pieces of the steady run: model, states and mean contact forces."""
    kinematics = train(gearbox, laws)
    n_step = round(float(kinematics.common_period) * 2 * pi / SPEED / step)
    step = float(kinematics.common_period) * 2 * pi / SPEED / n_step
    model = simulation(
        gearbox, laws, housing, input_torque=250.0, time_step=step, fidelity=DynamicsFidelity(time_step=step)
    )
    repeats = tuple(int(kinematics.common_period / period) for period in kinematics.law_period)
    cycle = _Cycle(n_step, step, repeats, np.zeros(2), np.ones(2), None)
    motion = quasi_static_state(model, law_phases(model.assembly, laws))
    for _ in range(periods):
        motion, _, _ = _period(model, motion, cycle)
    odd = 2 * np.arange(n_step)[:, None] + 1
    before = motion.excess
    _, states, excess = advance(model, motion, odd * np.array(repeats) / (2.0 * n_step))
    z = states[:, : states.shape[1] // 2] + 1j * states[:, states.shape[1] // 2 :]
    return model, z, bearing_force(model, states, before, excess), _contact(model, states, excess)


def _contact(model, states, excess):
    """Mean contact forces of the steps, the linear part included; the deflections repeat after the record."""
    d = states @ model.contact_output.T
    return excess + model.contact_stiffness * 0.5 * (d + np.roll(d, -1, axis=0))


def test_energy_that_the_meshes_feed_in_is_what_bearings_and_housing_take_out(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    housing = make_housing(gearbox, modes=15, damping=0.03)
    model, z, _, contact = _last_period(gearbox, make_laws(True, True), housing, 1e-5, 60)
    a = model.assembly
    d = (z @ (a.contact @ model.modes.displacement).T).real
    velocity = (z @ model.modes.velocity.T).real
    fed = -np.sum(contact * (np.roll(d, -1, axis=0) - d))
    lost = np.einsum("ti,ij,tj->", velocity, a.damping, velocity) * model.step.step
    assert lost > 0
    assert fed == pytest.approx(lost, rel=1e-3)


def _identity_error(gearbox, laws, housing, step):
    """Seat motion inside the run against the forced response under its bearing forces, relative to the peak."""
    model, z, force, _ = _last_period(gearbox, laws, housing, step, 400)
    a = model.assembly
    x = (z @ model.modes.displacement.T).real
    first = 5 * len(gearbox.shafts)
    inside = x[:, first : a.lateral] @ a.seat_shapes.T + force @ a.seat_residual.T
    frequency, f = amplitude_spectrum(force, 1 / model.step.step, periodic=True)
    _, u = amplitude_spectrum(inside, 1.0, periodic=True)
    omega = 2 * pi * frequency
    n_mode = len(housing.natural_frequency)
    natural = 2 * pi * housing.natural_frequency
    shapes = housing.seat_shapes.reshape(n_mode, -1)
    band = slice(1, int(5000 * len(z) * model.step.step) + 1)
    receptance = 1 / (natural**2 - omega[band, None] ** 2 + 2j * housing.modal_damping * natural * omega[band, None])
    forced = (f[band] @ shapes.T * receptance) @ shapes + f[band] @ housing.seat_residual.reshape(
        len(a.seat_residual), -1
    ).T
    return np.abs(forced - u[band]).max() / np.abs(u[band]).max()


def test_housing_motion_in_the_run_is_its_forced_response_under_the_bearing_forces(
    make_gearbox, make_laws, make_housing
):
    """Without bearing damping: 1e-4 at 10 µs, falling at least as h²."""
    gearbox, laws = make_gearbox(damping=0.0), make_laws(True, True)
    housing = make_housing(gearbox, modes=15, damping=0.03)
    coarse, fine = (_identity_error(gearbox, laws, housing, step) for step in (1e-5, 5e-6))
    assert coarse < 1e-4
    assert fine < max(coarse / 3.5, 1e-6)


def test_housing_identity_holds_for_seats_that_tilt_under_moments(make_gearbox, make_laws, make_housing):
    gearbox = moment_bearings(make_gearbox(damping=0.0))
    housing = tilting(make_housing(gearbox, modes=15, damping=0.03))
    assert _identity_error(gearbox, make_laws(True, True), housing, 1e-5) < 1e-4


def test_housing_identity_holds_with_bearing_damping(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox(damping=2500.0)
    assert _identity_error(gearbox, make_laws(True, True), make_housing(gearbox, modes=15), 1e-5) < 1e-4


def test_torque_reversal_swaps_the_flanks(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    driving, coasting = (
        simulation(gearbox, laws, None, input_torque=t, time_step=1e-5, fidelity=DynamicsFidelity(time_step=1e-5))
        for t in (250.0, -250.0)
    )
    # same state, other modes: hand the motion over through the unknowns
    motion = quasi_static_state(coasting, np.zeros(2))
    start = quasi_static_state(driving, np.zeros(2))
    assert (driving.contact_output[0::2] @ start.state > 0).all()
    phases = (np.arange(40_000)[:, None] + 0.5) * 1e-5 * SPEED / (2 * pi) * np.array([20, 12])
    x = (
        driving.modes.displacement @ (start.state[: len(start.state) // 2] + 1j * start.state[len(start.state) // 2 :])
    ).real
    motion = type(motion)(state_of(coasting.modes, x), motion.excess)
    _, states, excess = advance(coasting, motion, phases)
    contact = _contact(coasting, states, excess)[:-1]
    assert (contact[0, [0, 2]] > 0).all()
    assert np.abs(contact[0, [1, 3]]).max() < 1e-6 * contact.max()
    late = contact[-5000:]
    assert np.abs(late[:, [0, 2]]).max() < 1e-6 * late.max()
    expected = 250.0 / (laws[0].base_radius[0] * np.cos(laws[0].base_helix_angle))
    assert late[:, 1].mean() == pytest.approx(expected, rel=1e-3)
