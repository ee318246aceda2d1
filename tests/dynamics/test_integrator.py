"""The time loop against scipy's Radau on the same equations, its order, its energy, its extremes."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nvhchain.dynamics.time_loop.simulation import Motion, Simulation, advance, quasi_static_state, simulation
from nvhchain.dynamics.time_loop.trapezoid_correction import phases_at_ends
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity

PLAIN = DynamicsFidelity(time_step=1e-5, angle_refinement=1)
SPEED = 2500 / 60  # input turns per second
WHEEL_TURNS = (20 / 50, 20 / 50 * 30 / 82)  # wheel turns per input turn


def _phases(laws, times):
    """Mesh-law phases at `times`, from tooth counts alone."""
    return np.array(
        [[SPEED * w * 2 * np.pi * t / law.period for w, law in zip(WHEEL_TURNS, laws, strict=True)] for t in times]
    )


def _bilinear(law, theta, delta):
    """F(θ, δ) and ∂F/∂δ, written anew from the hand-off: linear in both, periodic in θ, end slopes continued in δ."""
    place = theta % law.period / law.period * len(law.angle)
    row, cell = int(place), int(np.searchsorted(law.deflection, delta)) - 1
    cell = min(max(cell, 0), len(law.deflection) - 2)
    low, high = law.force[row % len(law.angle)], law.force[(row + 1) % len(law.angle)]
    a, b = (low[c] + (place - row) * (high[c] - low[c]) for c in (cell, cell + 1))
    x0, x1 = law.deflection[cell], law.deflection[cell + 1]
    return a + (b - a) * (delta - x0) / (x1 - x0), (b - a) / (x1 - x0)


def _contact(laws, t, d):
    """Contact forces and their slopes at time t: drive flank where the law is positive, back flank where negative."""
    force, slope = np.zeros(len(d)), np.zeros(len(d))
    for k, law in enumerate(laws):
        theta = SPEED * WHEEL_TURNS[k] * 2 * np.pi * t
        for flank, side in ((2 * k, 1.0), (2 * k + 1, -1.0)):
            f, s = _bilinear(law, theta, side * d[flank])
            if side * f > 0:
                force[flank], slope[flank] = side * f, s
    return force, slope


def _radau(model: Simulation, laws, motion, duration, samples):
    """Contact deflections and bearing forces by Radau on M ẍ + C ẋ + K x = load − Wᵀ F, started from the same state."""
    a = model.assembly
    n, load = len(a.mass), a.load(model.torque)
    z = motion.state.reshape(2, -1)
    z = z[0] + 1j * z[1]
    m = a.mass[:, None]

    def slope(t, xv):
        x, v = xv[:n], xv[n:]
        force, _ = _contact(laws, t, a.contact @ x)
        return np.concatenate([v, (load - a.contact.T @ force - a.damping @ v - a.stiffness @ x) / a.mass])

    def jacobian(t, xv):
        _, k = _contact(laws, t, a.contact @ xv[:n])
        stiffness = a.stiffness + (a.contact.T * k) @ a.contact
        return np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness / m, -a.damping / m]])

    start = np.concatenate([(model.modes.displacement @ z).real, (model.modes.velocity @ z).real])
    times = np.linspace(0, duration, samples, endpoint=False)
    absolute = np.repeat([1e-12, 1e-8], n)
    result = solve_ivp(
        slope, (0, duration), start, "Radau", t_eval=times, rtol=1e-7, atol=absolute, jac=jacobian, max_step=1e-4
    )
    assert result.success
    x, v = result.y[:n], result.y[n:]
    return (a.contact @ x).T, (a.bearing_stiffness @ x + a.bearing_damping @ v).T


def _run(gearbox, laws, housing, torque, step, duration, every, fidelity=PLAIN, kick=0.0):
    """The same by the time loop: model, first motion, deflections and and bearing forces every `every` s."""
    model = simulation(gearbox, laws, housing, input_torque=torque, time_step=step, fidelity=fidelity)
    motion = quasi_static_state(model, np.zeros(2))
    motion = Motion(motion.state * (1.0 + kick), motion.excess)
    middle = (np.arange(round(duration / step)) + 0.5) * step
    _, states, _ = advance(model, motion, _phases(laws, middle), stride=round(every / step))
    return model, motion, states @ model.contact_output.T, states @ model.bearing_output.T


@pytest.mark.slow
def test_agrees_with_radau_over_20_ms_within_1e_4_of_the_peak_at_standard_step(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    laws, housing = make_laws(slotted=True, angles=12), make_housing(gearbox, modes=2)
    model, motion, deflection, force = _run(gearbox, laws, housing, 250.0, 1e-5, 0.02, 2e-5)
    expected_deflection, expected = _radau(model, laws, motion, 0.02, 1000)
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()
    drive = np.s_[:, 0::2]
    assert np.abs(deflection - expected_deflection)[drive].max() < 1e-3 * np.abs(expected_deflection[drive]).max()


@pytest.mark.slow
def test_agrees_with_radau_through_contact_loss_and_is_of_second_order(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(angles=8, plain_wheel=True, error=5e-6)
    kick = 3.0  # released from four times the static deflection: the flanks part on the rebound
    errors = []
    for step in (2e-6, 1e-6, 5e-7):
        model, motion, deflection, force = _run(gearbox, laws, None, 60.0, step, 0.02, 2e-5, kick=kick)
        if not errors:
            lost = np.mean(deflection[:, 0::2] < -10e-6, axis=0)  # beyond every transmission error
            assert (lost > 0.002).any()
            _, expected = _radau(model, laws, motion, 0.02, 1000)
        errors.append(np.abs(force - expected).max() / np.abs(expected).max())
    assert errors[-1] < 1e-4
    order = np.log2(errors[0] / errors[2]) / 2
    assert 1.7 < order < 2.4


@pytest.mark.parametrize("torque", [250.0, 0.0, -250.0])
@pytest.mark.parametrize("step", [1e-5, 1e-3])
def test_energy_is_exact_at_fixed_angle_without_damping(make_gearbox, make_laws, make_housing, torque, step):
    """Kinetic, elastic and mesh energy less the torques' work stays what it was, over backlash and back flanks too."""
    gearbox, laws = make_gearbox(damping=0.0), make_laws(angles=8)
    energy, size = _energy_at_fixed_angle(gearbox, laws, make_housing(gearbox, modes=5, damping=0.0), torque, step)
    assert np.ptp(energy) < 1e-9 * size


def _energy_at_fixed_angle(gearbox, laws, housing, torque, step, fidelity=PLAIN, steps=1500):
    """J after every step of a hard push, and its moving part's size."""
    model = simulation(gearbox, laws, housing, input_torque=torque, time_step=step, fidelity=fidelity)
    a, n = model.assembly, len(model.assembly.mass)
    motion = quasi_static_state(model, np.zeros(2))
    rng = np.random.default_rng(3)
    motion = Motion(
        motion.state + 2e-3 * rng.standard_normal(len(motion.state)) * np.abs(motion.state).max(), motion.excess
    )
    # a hard push along the torsional coordinates, so that every flank is reached
    push = np.zeros(n)
    push[a.lateral :] = 3.0
    z = model.modes.input @ (a.mass * push)
    motion = Motion(motion.state + np.concatenate([z.real, z.imag]), motion.excess)
    phases = np.full((steps, 2), 0.37)
    _, states, excess = advance(model, motion, phases)
    d = states @ model.contact_output.T
    contact = excess[:-1] + model.contact_stiffness * 0.5 * (d[1:] + d[:-1])
    assert (contact > 1.0).any(axis=0).sum() >= 3
    z = states[:, : states.shape[1] // 2] + 1j * states[:, states.shape[1] // 2 :]
    x, v = (z @ model.modes.displacement.T).real, (z @ model.modes.velocity.T).real
    potential = np.array([_potential(laws, 0.37, d) for d in x @ a.contact.T])
    kinetic, elastic = 0.5 * (v**2) @ a.mass, 0.5 * np.einsum("ti,ij,tj->t", x, a.stiffness, x)
    return kinetic + elastic + potential - x @ a.load(model.torque), np.ptp(potential) + np.ptp(kinetic)


def _potential(laws, phase, d):
    """∫ F dd of all contacts from an open state, exact: the law is linear between its nodes and its zero."""
    total = 0.0
    for k, law in enumerate(laws):
        row = np.array([_bilinear(law, phase * law.period, node)[0] for node in law.deflection])
        for flank, side in ((2 * k, 1.0), (2 * k + 1, -1.0)):
            grid, force = (law.deflection, row) if side > 0 else (-law.deflection[::-1], -row[::-1])
            # the gap is tabulated as zeros, so the clipped nodes carry the whole law
            inner = grid < d[flank]
            last = _bilinear(law, phase * law.period, side * d[flank])[0] * side
            total += np.trapezoid(
                np.append(np.maximum(force[inner], 0), max(last, 0)), np.append(grid[inner], d[flank])
            )
    return total


@pytest.mark.slow
def test_agrees_with_radau_through_back_flank_impacts(make_gearbox, make_laws):
    """A narrow gap, a light torque and a hard start: the flanks part, hit behind, and come back, for 20 ms."""
    gearbox = make_gearbox()
    laws = make_laws(angles=8, plain_wheel=True, error=4e-6, backlash=25e-6)
    model, motion, deflection, force = _run(gearbox, laws, None, 60.0, 2.5e-7, 0.02, 2e-5, kick=6.0)
    drive, back = deflection[:, 0::2], deflection[:, 1::2]
    assert (drive < -8e-6).mean(axis=0).max() > 0.01
    assert (back > 40e-6).sum() > 5
    expected_deflection, expected = _radau(model, laws, motion, 0.02, 1000)
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()
    assert np.abs(drive - expected_deflection[:, 0::2]).max() < 1e-4 * np.abs(expected_deflection).max()


@pytest.mark.parametrize(("softer", "kick"), [(1.0, 4.0), (300.0, 8.0)])
def test_agrees_with_radau_without_backlash(make_gearbox, make_laws, softer, kick):
    """On stiff bearings one flank takes over from the other inside a cell of the law, each along its own normal. Soft
    ones let the load push the gears apart, so that the drive flank opens inside a cell and nothing takes over."""
    gearbox, laws = make_gearbox(), []
    bearings = tuple(
        replace(b, radial_stiffness=b.radial_stiffness / softer, axial_stiffness=b.axial_stiffness / softer)
        for b in gearbox.bearings
    )
    gearbox = replace(gearbox, bearings=bearings)
    for law in make_laws(angles=8, plain_wheel=True):
        deflection = np.array([-5e-3, -3e-5, 5e-5, 5e-3])
        e = 5e-6 * np.sin(law.teeth[1] * law.angle)
        laws.append(law.replace(deflection=deflection, force=4e8 * (deflection - e[:, None])))
    model, motion, deflection, force = _run(gearbox, laws, None, 60.0, 2.5e-7, 0.005, 2e-5, kick=kick)
    open_drive = deflection[:, 0::2] < -5.1e-6
    taken_over = deflection[:, 1::2] > 5.1e-6
    assert open_drive.any()
    assert taken_over.any() if softer == 1.0 else not taken_over.any()
    _, expected = _radau(model, laws, motion, 0.005, 250)
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()


BENT = replace(PLAIN, path_correction=True)


@pytest.mark.parametrize(("error", "backlash", "kick"), [(5e-6, 80e-6, 3.0), (4e-6, 25e-6, 6.0)])
def test_path_correction_are_right_within_5e_5_at_2_5_us_where_flanks_part_and_strike_a_tenth_of_what_it_is_without(
    make_gearbox, make_laws, error, backlash, kick
):
    """The runs that agree with Radau above, drive flanks alone and both, against 0.1 µs without path correction."""
    gearbox, laws = make_gearbox(), make_laws(angles=8, plain_wheel=True, error=error, backlash=backlash)

    def forces(step, fidelity):
        return _run(gearbox, laws, None, 60.0, step, 0.02, 2e-5, fidelity, kick)[-1]

    expected = forces(1e-7, PLAIN)
    errors = [
        np.abs(forces(step, fidelity) - expected).max() / np.abs(expected).max()
        for step, fidelity in ((1e-5, BENT), (1e-5, PLAIN), (2.5e-6, BENT), (2.5e-6, PLAIN))
    ]
    assert errors[0] < 0.1 * errors[1]
    assert errors[2] < 5e-5
    assert errors[2] < 0.1 * errors[3]


@pytest.mark.slow
@pytest.mark.parametrize("torque", [250.0, 0.0, -250.0])
def test_energy_drifts_little_with_path_correction_and_less_at_shorter_steps(
    make_gearbox, make_laws, make_housing, torque
):
    """Hard impacts for 6 ms without damping: 0.3 % at 4 µs, less than half of that at half the step."""
    gearbox, laws = make_gearbox(damping=0.0), make_laws(angles=8)
    housing = make_housing(gearbox, modes=5, damping=0.0)
    drift = []
    for step, steps in ((4e-6, 1500), (2e-6, 3000)):
        energy, size = _energy_at_fixed_angle(gearbox, laws, housing, torque, step, BENT, steps)
        drift.append(np.abs(energy - energy[0]).max() / size)
    assert drift[0] < 0.003
    assert drift[1] < 0.5 * drift[0]


def test_path_correction_are_refused_where_they_feed_in_what_nothing_damps_and_bounded_where_not(
    make_gearbox, make_laws, make_housing
):
    """The remedy holds at once; a second of damped rattle at 10 µs stays within the backlash."""
    laws = make_laws(plain_wheel=True, error=5e-6)

    def run(damping, step, duration):
        gearbox = make_gearbox(damping=damping)
        housing = make_housing(gearbox, modes=5, damping=0.01 if damping else 0.0)
        return _run(gearbox, laws, housing, 0.0, step, duration, 1e-4, BENT)[2][:, 0::2]

    with pytest.raises(InputError, match=r"small motions grow by \d.* 1/s, more than damping .*limit 0\.1 1/s") as at:
        run(0.0, 1e-5, 1.0)
    remedy = 1e-6 * float(re.search(r"take ([\d.]+) µs", str(at.value))[1])
    assert 2e-6 < remedy < 1e-5
    assert np.isfinite(run(0.0, remedy, 1e-3)).all()
    drive = run(2500.0, 1e-5, 1.0)
    assert -120e-6 < drive.min() < drive.max() < 40e-6
    late = len(drive) // 2
    assert np.ptp(drive[late:], axis=0).max() < 1.2 * np.ptp(drive[:late], axis=0).max()


def test_path_correction_are_refused_at_steps_that_are_long_against_the_meshes_and_at_contact_level(
    make_gearbox, make_laws
):
    laws = make_laws(angles=8)
    with pytest.raises(InputError, match=r"time step 50 µs is too long for path_correction: .* take 2\d.* µs or leave"):
        _run(make_gearbox(), laws, None, 250.0, 5e-5, 1e-3, 1e-4, BENT)
    with pytest.raises(InputError, match="`contact` has no path_correction"):
        _run(make_gearbox(), laws, None, 250.0, 1e-5, 1e-3, 1e-4, replace(BENT, mesh_level="contact"))


def test_phases_at_the_ends_of_steps_are_the_same_in_every_block_and_period():
    x = np.arange(12.0)[:, None]
    phases = 0.7 + 0.09 * x * [1.0, -2.0] + 0.002 * x**2
    ends = phases_at_ends(phases)
    assert np.abs(ends[:-1] - 0.5 * (phases[1:] + phases[:-1])).max() < 1e-15
    assert np.abs(phases_at_ends(phases[:5]) - ends[:5]).max() < 1e-15
    apart = phases_at_ends(phases % 1.0) - ends
    assert np.abs(apart - np.round(apart)).max() < 1e-14
