"""Steady running: closed form of the linear gearbox, lines, slow and torque-free running, coarse steps, refusals."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.time_loop.simulation import advance, quasi_static_state, simulation
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
    laws = make_laws(mesh_ripple=0.0, plain_wheel=True, error=0.0, grid=(80e-6, 3))
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
    motion = quasi_static_state(model, np.zeros(2))
    phases = (np.arange(100_000)[:, None] + 0.5) * 1e-5 * SPEED / (2 * pi) * np.array([20, 12])
    _, states, _ = advance(model, motion, phases)
    d = states @ model.contact_output[0::2].T
    assert np.isfinite(states).all()
    assert d.max() > 6e-6  # they do touch
    assert (d > -120e-6).all()
    assert (d < 40e-6).all()


def test_a_law_too_few_is_refused(make_gearbox, make_laws):
    with pytest.raises(InputError, match="1 mesh laws for 2 meshes"):
        _run(make_gearbox(), make_laws()[:1], None)


def test_duration_and_counts_that_are_none_are_refused(make_gearbox, make_laws):
    for duration in (np.nan, np.inf, -1.0):
        with pytest.raises(InputError, match=r"duration = .* must be finite and 0 or more"):
            _run(make_gearbox(), make_laws(), None, duration=duration)
    for name in ("angle_refinement", "contact_iterations", "gyroscopic_speeds"):
        with pytest.raises(InputError, match=rf"dynamics {name} = 1\.5 must be a whole number"):
            DynamicsFidelity(1e-5, **{name: 1.5})
    assert DynamicsFidelity(1e-5, gyroscopic_speeds=2.0).gyroscopic_speeds == 2


def test_rattle_on_coarse_steps_stays_bounded_with_damping(make_gearbox, make_laws, make_housing):
    """2 s in which flanks part and strike, at steps up to a millisecond: within thrice the backlash."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True, error=5e-6)
    housing = make_housing(gearbox, modes=8)
    for step in (1e-4, 4e-4, 1e-3):
        model = simulation(
            gearbox, laws, housing, input_torque=2.0, time_step=step, fidelity=DynamicsFidelity(time_step=step)
        )
        phases = (np.arange(round(2.0 / step))[:, None] + 0.5) * step * SPEED / (2 * pi) * np.array([20, 12])
        _, states, _ = advance(model, quasi_static_state(model, np.zeros(2)), phases)
        deflection = states @ model.contact_output[0::2].T
        late = deflection[len(deflection) // 2 :]
        assert late.min() < 0.0, "the flanks must part"
        assert np.abs(deflection).max() < 3 * 80e-6
        assert np.ptp(late, axis=0).max() < 1.5 * np.ptp(deflection[: len(late)], axis=0).max()


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
    motion = quasi_static_state(model, np.zeros(2))
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
    motion, means = quasi_static_state(model, np.zeros(2)), []
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
