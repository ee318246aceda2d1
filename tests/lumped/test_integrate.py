"""The Runge–Kutta march against scipy's DOP853 at tight tolerance on the same equation, contact loss included."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import LUMPED
from nvhchain.lumped import GearPair, Windows, integrate
from nvhchain.lumped.integrate import static_equilibrium


def windows(step, steps, frequency, rate=0.0, stride=1):
    return Windows(np.array([step]), np.array([steps]), np.zeros(1), np.array([frequency]), np.array([stride]), rate)


def peer(pair, time, frequency, rate, state):
    """x at `time` (n,), from 0, by DOP853."""
    n = len(pair.stiffness)
    spline = CubicSpline(np.arange(n + 1), np.append(pair.stiffness, pair.stiffness[0]), bc_type="periodic")
    damping = 2 * pair.damping_ratio * np.sqrt(pair.mean_stiffness * pair.mass)

    def motion(t, y):
        phase = (frequency * t + 0.5 * rate * t * t) / pair.mesh_cycles % 1.0
        gap = y[0] - np.clip(y[0], -pair.half_backlash, pair.half_backlash)
        return [y[1], (pair.force - damping * y[1] - spline(phase * n) * gap) / pair.mass]

    # the short longest step keeps the error estimate from passing over a kink
    done = solve_ivp(motion, (0, time[-1]), state, method="DOP853", rtol=1e-11, atol=1e-16, max_step=4e-6, t_eval=time)
    return done.y[0]


@pytest.mark.parametrize(
    ("half_backlash", "frequency", "rate"),
    [(50e-6, 2900.0, 0.0), (4e-6, 2900.0, 0.0), (50e-6, 2500.0, 5e4)],
    ids=["contact loss", "back-flank impacts", "run-up through resonance"],
)
def test_march_agrees_with_dop853_over_contact_loss(study_pair, half_backlash, frequency, rate):
    pair = replace(study_pair(18, 6, order=57), half_backlash=half_backlash)
    state = static_equilibrium([pair])[:, 0] + [20e-6, 0.0]
    time = np.arange(1, 5001) * 2e-6
    x = peer(pair, time, frequency, rate, state)
    assert x.min() < (half_backlash if half_backlash > 1e-5 else -half_backlash), "the case must lose contact"
    error = {}
    for finer in (1, 8):
        fine = windows(2e-6 / finer, 5000 * finer, frequency, rate, stride=finer)
        march = integrate([pair], fine, state=state[:, None])
        error[finer] = np.abs(march.samples[:, 0] - x).max() / np.ptp(x)
    # every kink of the force costs a local error of third order in the step: second order in all
    assert error[1] < 3e-4
    assert error[8] < 5e-6


def test_phase_of_a_steep_run_up_is_followed_within_the_step(study_pair):
    pair = study_pair(28, 0.5, order=57)
    state = static_equilibrium([pair])
    time = np.arange(1, 501) * 2e-6
    x = peer(pair, time, 500.0, 2e7, state[:, 0])
    march = integrate([pair], windows(2e-6, 500, 500.0, 2e7), state=state)
    assert np.abs(march.samples[:, 0] - x).max() < 5e-7 * np.ptp(x)


def test_error_falls_with_the_fourth_power_of_the_step_while_in_contact(study_pair):
    pair = study_pair(28, 2)
    state = static_equilibrium([pair])
    time = 1.6e-3
    x = peer(pair, np.array([0.0, time]), 1500.0, 0.0, state[:, 0])[-1]
    errors = [
        abs(integrate([pair], windows(time / n, n, 1500.0), state=state).state[0, 0] - x) for n in (100, 200, 400)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.15)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.15)


def test_five_pairs_together_move_as_each_one_alone(study_pair):
    pairs = [study_pair(18, 4), study_pair(22, 4), study_pair(22, 4, 3, order=57), study_pair(28, 4), study_pair(33, 4)]
    several = windows(2e-6, 30_000, 2700.0, rate=3000.0, stride=7)
    together = integrate(pairs, several)
    for i, pair in enumerate(pairs):
        alone = integrate([pair], several)
        np.testing.assert_allclose(together.samples[:, i], alone.samples[:, 0], rtol=1e-12)
        np.testing.assert_allclose(together.rms[:, i], alone.rms[:, 0], rtol=1e-9)


def test_statistics_and_samples_describe_the_same_motion(study_pair):
    pair = study_pair(22, 4)
    split = Windows(
        np.full(3, 2e-6), np.array([1000, 1003, 997]), np.array([0.0, 5.4, 10.8162]),
        np.full(3, 2700.0), np.array([0, 1, 1]),
    )  # fmt: skip
    motion = integrate([pair], split)
    assert split.sample_count == len(motion.samples) == 2000
    parts = np.split(motion.samples[:, 0], [1003])
    np.testing.assert_allclose(motion.rms[1:, 0], [part.std() for part in parts], rtol=1e-9)
    np.testing.assert_allclose(motion.mean[1:, 0], [part.mean() for part in parts], rtol=1e-12)
    assert [motion.lowest[1, 0], motion.highest[2, 0]] == [parts[0].min(), parts[1].max()]
    assert motion.state[0, 0] == motion.samples[-1, 0]


def test_windows_only_divide_the_time(study_pair):
    pair = study_pair(22, 4, 3)
    whole = integrate([pair], windows(2e-6, 4000, 2700.0, rate=2000.0))
    time = np.array([0.0, 1234 * 2e-6])
    halves = Windows(
        np.full(2, 2e-6), np.array([1234, 2766]), 2700.0 * time + 1000.0 * time**2, 2700.0 + 2000.0 * time,
        np.ones(2, dtype=int), 2000.0,
    )  # fmt: skip
    np.testing.assert_allclose(integrate([pair], halves).samples, whole.samples, rtol=1e-11)


def test_steps_that_do_not_resolve_the_motion_are_refused(study_pair):
    pair = study_pair(18, 4)
    with pytest.raises(InputError, match=r"natural period .* time_step of"):
        integrate([pair], windows(2e-5, 100, 100.0))
    with pytest.raises(InputError, match=r"mesh cycle .* time_step of"):
        integrate([pair], windows(2e-6, 100, 40e3))


@pytest.mark.parametrize(
    ("steps", "frequency", "rate", "message"),
    [
        (100, -100.0, 0.0, r"falls to -100 Hz, but gears turn forwards here: keep frequency and"),
        (1000, 100.0, -1e6, r"falls to -1900 Hz"),
        (0, 100.0, 0.0, r"steps = \[0\] must be whole numbers of 1 or more"),
    ],
)
def test_windows_that_turn_back_or_are_empty_are_refused(steps, frequency, rate, message):
    with pytest.raises(InputError, match=message):
        windows(2e-6, steps, frequency, rate)
    with pytest.raises(InputError, match="none is given"):
        Windows(*(np.empty(0, dtype=int) for _ in range(5)))


def test_steps_that_pass_over_the_waves_of_the_curve_are_refused():
    """250 waves in a mesh cycle of 250 steps would be read at one point of the wave, as a constant."""
    angle = 2 * np.pi * np.arange(4000) / 4000
    fast = GearPair(0.65, 5e3, 2.5e8 * (1 + 0.5 * np.cos(250 * angle)), 1, 0.06, 50e-6)
    with pytest.raises(InputError, match=r"250 waves in the mesh cycle .* use a time_step of 5e-07 s or less"):
        integrate([fast], windows(2e-6, 100, 2000.0))
    assert np.isfinite(integrate([fast], windows(5e-7, 100, 2000.0)).state).all()


def test_steps_beyond_the_stability_of_damping_are_refused_and_up_to_it_die_out():
    """2ζω_n h = 2.785 is where Runge–Kutta of fourth order grows on the negative real axis."""
    pair = GearPair(1.0, 1e3, np.full(4, 1e8), 1, 6.24)
    end = integrate([pair], windows(2e-5, 5000, 100.0)).state[0]
    with pytest.raises(InputError, match=r"step 2\.01e-05 s .* time_step of 2e-05 s or less"):
        integrate([pair], windows(2.01e-5, 5000, 100.0))
    np.testing.assert_allclose(end, 1e-5, rtol=1e-6)


def test_growth_without_bound_is_an_error(mathieu):
    pair = mathieu(0.3, 0.0)
    with pytest.raises(SolverError, match="parametrically unstable"):
        integrate([pair], windows(2e-6, 5_000_000, 2 * pair.natural_frequency), state=np.array([[1e-6], [0.0]]))


def test_motion_is_reproducible_to_the_last_bit(study_pair):
    run = [integrate([study_pair(18, 6)] * 4, windows(2e-6, 20_000, 2900.0)).samples for _ in range(2)]
    assert run[0].tobytes() == run[1].tobytes()


def test_pair_states_what_it_cannot_use(study_pair):
    pair = study_pair(18, 4)
    for change, message in (
        ({"mass": 0.0}, "mass"),
        ({"stiffness": np.array([1e8, 1e8, -1.0, 1e8])}, "positive at every angle"),
        ({"half_backlash": np.nan}, "half_backlash"),
        ({"damping_ratio": -0.1}, "damping_ratio"),
    ):
        with pytest.raises(InputError, match=message):
            replace(pair, **change)
    with pytest.raises(InputError, match="steps_per_period"):
        replace(LUMPED, steps_per_period=1.0)
