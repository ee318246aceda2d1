"""Steady running: closed form of the linear gearbox, lines, energy, housing identity, refusals."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces
from nvhchain.dynamics.assembly import assemble
from nvhchain.dynamics.quasi_static import law_phases
from nvhchain.dynamics.simulation import advance, at_rest, bearing_force, simulation
from nvhchain.dynamics.steady import _period
from nvhchain.dynamics.train import train
from nvhchain.errors import InputError, ResourceError, SolverError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.spectrum import amplitude_spectrum

SPEED = 2500 * 2 * pi / 60


def _run(gearbox, laws, housing, step=1e-5, **changes):
    options = {"input_speed": SPEED, "input_torque": 250.0, "f_max": 5000.0, "duration": 0.0}
    options.update({name: changes.pop(name) for name in tuple(changes) if name in options})
    return bearing_forces(gearbox, laws, housing, fidelity=DynamicsFidelity(time_step=step, **changes), **options)


def test_linear_gearbox_has_the_forced_response_of_its_impedance(make_gearbox, make_laws, make_housing):
    """Constant mesh stiffness, harmonic transmission error: (K + Wᵀk W + jωC − ω²M) X = Wᵀ k E, solved directly."""
    gearbox = make_gearbox()
    housing = make_housing(gearbox, modes=20)
    laws = make_laws(mesh_ripple=0.0, plain_wheel=True, error=0.0, cells=3)
    amplitude, harmonics = 1e-6, ((0, 1), (1, 3))  # 1 µm at mesh order 1 of stage 1 and mesh order 3 of stage 2
    made = []
    for (_, order), law in zip(harmonics, laws, strict=True):
        stiffness = np.diff(law.force, axis=1)[0, -1] / np.diff(law.deflection)[-1]
        angle = np.arange(240) * law.period / 240
        error = amplitude * np.cos(2 * pi * order * angle / law.period)
        # a gap, then one straight line over the working range: what the closed form assumes
        line = stiffness * (np.array([1e-5, 1e-4]) - error[:, None])
        made.append(
            law.replace(angle=angle, deflection=np.array([-1e-3, -1e-5, 1e-5, 1e-4]), force=np.hstack([0 * line, line]))
        )
    record = _run(gearbox, made, housing, settle_level=1e-8)
    frequency, force = amplitude_spectrum(record.force.reshape(len(record.time), -1), record.sample_rate, periodic=True)
    a = assemble(gearbox, made, housing)
    drive = a.contact[0::2]
    k_mesh = np.array([law.force[0, 3] - law.force[0, 2] for law in made]) / 9e-5
    worst = 0.0
    for (k, _), hertz in zip(harmonics, (20 * SPEED / (2 * pi), 3 * 12 * SPEED / (2 * pi)), strict=True):
        omega = 2 * pi * hertz
        dynamic = a.stiffness + (drive.T * k_mesh) @ drive + 1j * omega * a.damping - omega**2 * np.diag(a.mass)
        x = np.linalg.solve(dynamic, drive[k] * k_mesh[k] * amplitude)
        expected = (a.bearing_stiffness + 1j * omega * a.bearing_damping) @ x
        line = round(hertz / frequency[1])
        worst = max(worst, np.abs(force[line] - expected).max() / np.abs(expected).max())
    assert worst < 2e-3
    # everything else is silent
    lines = [0, *(round(f / frequency[1]) for f in (20 * SPEED / (2 * pi), 36 * SPEED / (2 * pi)))]
    rest = np.delete(force[: len(frequency) // 20], lines, axis=0)
    assert np.abs(rest).max() < 1e-4 * np.abs(force[lines[1:]]).max()


@pytest.mark.parametrize(
    ("slotted", "plain_wheel", "base"),
    [(False, False, 4 / 41), (True, False, 2 / 41), (False, True, 4.0), (True, True, 2.0)],
)
def test_lines_only_at_multiples_of_the_common_order(make_gearbox, make_laws, make_housing, slotted, plain_wheel, base):
    """Two common periods recorded: the lines between are 80 dB below the strongest."""
    gearbox = make_gearbox()
    record = _run(
        gearbox,
        make_laws(slotted, plain_wheel),
        make_housing(gearbox, modes=10),
        step=2e-5,
        duration=1.5 * 2 * pi / (base * SPEED),
        settle_level=1e-6,
    )
    frequency, force = amplitude_spectrum(record.force.reshape(len(record.time), -1), record.sample_rate, periodic=True)
    assert frequency[2] * 2 * pi / SPEED == pytest.approx(base, rel=1e-9)
    strongest = np.abs(force[1:]).max()
    assert np.abs(force[1::2]).max() < 1e-4 * strongest
    lines = np.abs(force[2::2][: int(5000 / frequency[2])]).max(axis=1)
    assert (lines > 1e-4 * strongest).any()


def test_slots_bring_the_orders_that_solid_gears_do_not_have(make_gearbox, make_laws):
    """Orders 2, 6, 10, 14, 18, 22 of the input: present with five slots, 80 dB down without."""
    gearbox, levels = make_gearbox(), {}
    for slotted in (False, True):
        # the solid gearbox repeats after 10.25 turns; twice that holds lines at these orders too
        record = _run(gearbox, make_laws(slotted), None, step=2e-5, duration=0.4)
        frequency, force = amplitude_spectrum(
            record.force.reshape(len(record.time), -1), record.sample_rate, periodic=True
        )
        lines = [round(order * SPEED / (2 * pi) / frequency[1]) for order in (2, 6, 10, 14, 18, 22)]
        assert lines == [41, 123, 205, 287, 369, 451]
        levels[slotted] = np.abs(force[lines]).max(axis=1) / np.abs(force[1:]).max()
    assert levels[False].max() < 1e-4
    assert levels[True].min() > 2e-4


def _last_period(gearbox, laws, housing, step, periods):
    """A settled period by the pieces of the steady run: model, states and mean contact forces."""
    kinematics = train(gearbox, laws)
    n_step = round(float(kinematics.common_period) * 2 * pi / SPEED / step)
    step = float(kinematics.common_period) * 2 * pi / SPEED / n_step
    model = simulation(
        gearbox, laws, housing, input_torque=250.0, time_step=step, fidelity=DynamicsFidelity(time_step=step)
    )
    repeats = [int(kinematics.common_period / period) for period in kinematics.law_period]
    motion = at_rest(model, law_phases(model.assembly, laws))
    for _ in range(periods):
        motion, _, _ = _period(model, motion, repeats, np.zeros(2), n_step)
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


def test_housing_identity_holds_with_bearing_damping(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox(damping=2500.0)
    assert _identity_error(gearbox, make_laws(True, True), make_housing(gearbox, modes=15), 1e-5) < 1e-4


def test_mesh_deflection_at_crawling_speed_is_the_static_one(make_gearbox, make_law):
    """Slowly turned on stiff bearings, δ follows the law at constant force: δ(θ) = e(θ) + F/k(θ)."""
    gearbox = make_gearbox(damping=2500.0)
    laws = (make_law(0, angles=96), make_law(1, hand=-1, angles=96))
    record = _run(gearbox, laws, None, step=5e-5, f_max=1000.0, input_speed=0.05 * SPEED)
    force = 250.0 / (laws[0].base_radius[0] * np.cos(laws[0].base_helix_angle))
    turns = 0.05 * SPEED * record.time / (2 * pi)
    phase = (20 * turns) % 1.0
    rows = np.array([np.interp(force, row, laws[0].deflection) for row in laws[0].force])
    expected = np.interp(phase * len(rows), np.arange(len(rows) + 1), np.append(rows, rows[0]))
    swing = np.ptp(expected)
    assert np.abs(record.mesh_deflection[:, 0] - expected).max() < 0.02 * swing


def test_torque_free_train_turns_and_stays_finite(make_gearbox, make_laws):
    """Rattle: nothing presses the flanks together, and nothing drifts away either."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True, error=5e-6)
    model = simulation(gearbox, laws, None, input_torque=0.0, time_step=1e-5, fidelity=DynamicsFidelity(time_step=1e-5))
    motion = at_rest(model, np.zeros(2))
    phases = (np.arange(100_000)[:, None] + 0.5) * 1e-5 * SPEED / (2 * pi) * np.array([20, 12])
    _, states, _ = advance(model, motion, phases)
    d = states @ model.contact_output[0::2].T
    assert np.isfinite(states).all()
    assert d.max() > 6e-6  # they do touch
    assert (d > -120e-6).all()
    assert (d < 40e-6).all()


def test_torque_reversal_swaps_the_flanks(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    driving, coasting = (
        simulation(gearbox, laws, None, input_torque=t, time_step=1e-5, fidelity=DynamicsFidelity(time_step=1e-5))
        for t in (250.0, -250.0)
    )
    # same state, other modes: hand the motion over through the unknowns
    motion = at_rest(coasting, np.zeros(2))
    start = at_rest(driving, np.zeros(2))
    assert (driving.contact_output[0::2] @ start.state > 0).all()
    phases = (np.arange(40_000)[:, None] + 0.5) * 1e-5 * SPEED / (2 * pi) * np.array([20, 12])
    from nvhchain.dynamics.propagator import state_of

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


def test_one_millisecond_step_stays_bounded(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    model = simulation(
        gearbox,
        make_laws(True),
        make_housing(gearbox),
        input_torque=250.0,
        time_step=1e-3,
        fidelity=DynamicsFidelity(time_step=1e-3),
    )
    motion = at_rest(model, np.zeros(2))
    phases = (np.arange(20_000)[:, None] + 0.5) * 1e-3 * SPEED / (2 * pi) * np.array([2, 12 / 41])
    _, states, _ = advance(model, motion, phases)
    d = states @ model.contact_output[0::2].T
    assert np.abs(d).max() < 3 * np.abs(d[0]).max()


def test_nothing_drifts_in_a_long_run(make_gearbox, make_laws):
    """20 s of running: the mean mesh deflection of the last second is that of the fifth."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    model = simulation(
        gearbox, laws, None, input_torque=250.0, time_step=4e-5, fidelity=DynamicsFidelity(time_step=4e-5)
    )
    motion, means = at_rest(model, np.zeros(2)), []
    for second in range(20):
        n = np.arange(25_000) + 25_000 * second
        phases = (n[:, None] + 0.5) * 4e-5 * SPEED / (2 * pi) * np.array([20, 12])
        motion, states, _ = advance(model, motion, phases)
        # 1/6 s holds whole mesh periods
        means.append((states[-(25_000 // 25) * 24 :] @ model.contact_output[0::2].T).mean(axis=0))
    assert np.abs(means[-1] - means[4]).max() < 1e-6 * np.abs(means[4]).max()


def test_too_long_a_step_for_the_band_is_refused(make_gearbox, make_laws):
    with pytest.raises(InputError, match=r"time step 50 µs samples at 20 kHz; f_max = 5000 Hz"):
        _run(make_gearbox(), make_laws(), None, step=5e-5)


def test_a_step_that_skips_over_the_teeth_is_refused(make_gearbox, make_laws):
    with pytest.raises(InputError, match=r"the mesh frequency = 3\.333e\+04 Hz"):
        _run(make_gearbox(), make_laws(), None, input_speed=40 * SPEED)


def test_a_record_beyond_memory_is_refused_before_it_starts(make_gearbox, make_laws):
    with pytest.raises(ResourceError, match=r"needs .* GiB, but .* GiB are free: raise the input speed"):
        _run(make_gearbox(), make_laws(), None, input_speed=1e-6)


def test_a_gearbox_that_does_not_settle_is_reported(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox(damping=0.0)
    with pytest.raises(SolverError, match="cannot settle"):
        _run(gearbox, make_laws(plain_wheel=True), make_housing(gearbox, modes=4, damping=0.0))


def test_zero_housing_damping_settles_on_bearing_damping_alone(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox(damping=4000.0)
    record = _run(
        gearbox, make_laws(plain_wheel=True), make_housing(gearbox, modes=4, damping=0.0), step=2e-5, settle_level=1e-3
    )
    assert np.isfinite(record.force).all()


def test_step_that_does_not_converge_is_reported_with_its_time(make_gearbox, make_laws):
    with pytest.raises(SolverError, match=r"did not converge at t = .* s within 0 iterations"):
        _run(make_gearbox(), make_laws(), None, contact_iterations=0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"input_speed": 0.0}, "input_speed = 0.0 rad/s must be positive"),
        ({"input_speed": np.nan}, "must be positive"),
        ({"input_torque": np.inf}, "must be finite"),
        ({"f_max": -1.0}, "must be positive"),
    ],
)
def test_nonsense_operating_points_are_refused(make_gearbox, make_laws, change, message):
    with pytest.raises(InputError, match=message):
        _run(make_gearbox(), make_laws(), None, **change)
