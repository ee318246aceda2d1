"""Sweeps and run-ups: linear limit, jumps against harmonic balance, agreement of slow run-up and steady sweep."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import LUMPED
from nvhchain.lumped import (
    GearPair,
    backbone_frequency,
    order_lines,
    periodic_response,
    run_up,
    steady_motion,
    steady_sweep,
)
from nvhchain.lumped.harmonic_balance import _Balance


def test_small_error_amplitude_gives_the_linear_oscillator(study_pair):
    pair = study_pair(28, 0.01, order=57)
    frequency = np.linspace(0.3, 2.0, 35) * pair.natural_frequency
    ratio = frequency / pair.natural_frequency
    expected = 0.01e-6 / np.sqrt(2) / np.abs(1 - ratio**2 + 2j * pair.damping_ratio * ratio)
    response = steady_sweep([pair], frequency)
    np.testing.assert_allclose(response.rms[:, 0], expected, rtol=2e-3)
    np.testing.assert_allclose(response.cycle_rms, response.rms, rtol=1e-6)
    np.testing.assert_allclose(response.mean[:, 0], 50e-6 + 28e-6, rtol=1e-6)
    assert not response.loses_contact.any()


def test_sweeps_jump_where_harmonic_balance_folds(study_pair):
    pair = study_pair(18, 4, order=57)
    folds = periodic_response(pair, 1500.0, 4500.0).folds
    assert len(folds) == 2
    up, down = max(folds), min(folds)
    frequency = np.arange(2800.0, 3100.0, 4.0)
    rising, falling = (steady_sweep([pair], f).rms[:, 0] for f in (frequency, frequency[::-1]))
    at = int(np.argmax(np.diff(rising)))
    # just past a fold the motion lingers near the lost branch for longer than a speed of the sweep lasts
    lingering = 2.0
    assert frequency[at] - lingering <= up <= frequency[at + 1]
    at = int(np.argmin(np.diff(falling)))
    assert frequency[::-1][at + 1] <= down <= frequency[::-1][at] + lingering
    assert np.diff(rising).max() > 6e-6


def test_response_on_both_branches_is_that_of_harmonic_balance(study_pair):
    pair = study_pair(18, 4, order=57)
    curve = periodic_response(pair, 1500.0, 4500.0)
    frequency = np.concatenate((np.linspace(2000, 2950, 12), np.linspace(3050, 4000, 12)))
    up = steady_sweep([pair], frequency)
    low, high = np.flatnonzero(np.diff(np.sign(np.diff(curve.mesh_frequency)))) + 1
    expected = np.concatenate(
        (
            np.interp(frequency[:12], curve.mesh_frequency[: low + 1], curve.rms[: low + 1]),
            np.interp(frequency[12:], curve.mesh_frequency[high:], curve.rms[high:]),
        )
    )
    np.testing.assert_allclose(up.rms[:, 0], expected, rtol=2e-3)


def test_peaks_at_low_damping_lie_on_the_backbone(study_pair):
    pair = study_pair(20, 1, order=57, damping_ratio=0.01)
    curve = periodic_response(pair, 1500.0, 4500.0, fidelity=replace(LUMPED, harmonics=24))
    peak = int(np.argmax(curve.rms))
    ratio = (curve.highest[peak] - 50e-6) / 20e-6 - 1.0
    assert ratio > 1.5, "the peak must lose contact for long"
    expected = float(backbone_frequency(ratio)) * pair.natural_frequency
    assert curve.mesh_frequency[peak] == pytest.approx(expected, rel=5e-3)


def test_slow_run_up_follows_the_upward_sweep_cycle_by_cycle(study_pair):
    pair = study_pair(22, 4, 3)
    passed = run_up([pair], start=2000.0, stop=2400.0, duration=8.0)
    cycles = passed.response
    assert len(cycles.mesh_frequency) == 17_600
    frequency = np.linspace(2050.0, 2350.0, 13)
    steady = steady_sweep([pair], frequency)
    for f, expected in zip(frequency, steady.cycle_rms[:, 0], strict=True):
        near = np.argsort(np.abs(cycles.mesh_frequency - f))[: 57 * 4]
        found = np.sqrt(np.mean(cycles.rms[near, 0] ** 2))
        assert found == pytest.approx(expected, rel=1e-2)


def test_run_up_from_rest_counts_every_mesh_cycle_and_keeps_the_motion(study_pair):
    pair = study_pair(22, 4)
    passed = run_up([pair], start=0.0, stop=4750.0, duration=0.5, sample_rate=50e3)
    assert len(passed.response.mesh_frequency) == int(0.25 * 4750)
    assert len(passed.time) == len(passed.error) == 25_000
    np.testing.assert_allclose(passed.mesh_frequency, 9500.0 * passed.time)
    cycle = np.arange(100, 1187)
    np.testing.assert_allclose(passed.response.mesh_frequency[100:], np.sqrt(2 * 9500.0 * (cycle + 0.5)), rtol=2e-3)
    turned = 0.5 * 9500.0 * passed.time**2
    inside = (turned > 1000) & (turned < 1001)
    assert passed.response.rms[1000, 0] == pytest.approx(passed.error[inside, 0].std(), rel=0.05)
    down = run_up([pair], start=4750.0, stop=0.0, duration=0.5 + 1.2e-6)  # not a whole number of steps
    assert down.response.mesh_frequency[0] > 4700.0
    assert len(down.response.mesh_frequency) == int(0.25 * 4750)


def test_record_of_steady_motion_closes_and_follows_the_branch_it_came_from(study_pair):
    pair = study_pair(18, 4)
    high = steady_motion([pair], 2950.0, approach=np.arange(3300.0, 2960.0, -10.0))
    low = steady_motion([pair], 2950.0)
    assert high.mesh_cycles == 57
    assert len(high.error) % 57 == 0
    assert high.time[-1] * 2950.0 == pytest.approx(57.0)
    assert high.error.std() > 1.5 * low.error.std()
    lines = np.abs(np.fft.rfft(high.error[:, 0]))
    orders = np.arange(len(lines)) % 57 == 0
    assert lines[~orders].max() < 1e-5 * lines[57]


def test_threads_change_nothing(study_pair):
    pairs = [study_pair(av, 4) for av in (18, 20, 22, 24, 26)]
    frequency = np.arange(2500.0, 3000.0, 50.0)
    alone = steady_sweep(pairs, frequency)
    with ThreadPoolExecutor(2) as executor:
        shared = steady_sweep(pairs, frequency, executor=executor)
    assert alone.rms.tobytes() == shared.rms.tobytes()


def test_record_at_one_speed_that_would_fold_is_refused():
    """At a sixtieth of resonance the 60th harmonic is strongest; 64 samples a cycle would show it at order 4."""
    angle = 2 * np.pi * np.arange(1024) / 1024
    pair = GearPair(1.0, 1e3, 1e8 * (1 + 0.05 * np.cos(angle) + 0.05 * np.cos(60 * angle)), 1, 0.08)
    speed = pair.natural_frequency / 60
    for samples in (64, 0, -1, 479, 500.5):
        with pytest.raises(InputError, match=r"fold back .* whole number of 480 or more"):
            steady_motion([pair], speed, samples_per_cycle=samples)
    motion = steady_motion([pair], speed, samples_per_cycle=480)
    _, lines = order_lines(motion.error[:, 0], motion.mesh_cycles, 1)
    assert len(motion.error) == 480
    assert np.argmax(lines[2:]) + 2 == 60


def test_what_a_sweep_cannot_do_is_refused(study_pair):
    pair = study_pair(22, 4)
    with pytest.raises(InputError, match="positive and finite"):
        steady_sweep([pair], [0.0, 100.0])
    with pytest.raises(InputError, match="some damping"):
        steady_sweep([replace(pair, damping_ratio=0.0)], [1000.0])
    with pytest.raises(InputError, match=r"settle_time .* use 0\.\d+ s"):
        steady_sweep([replace(pair, damping_ratio=0.005)], [1000.0])
    with pytest.raises(InputError, match="sweep these pairs apart"):
        steady_sweep([study_pair(22, 4, order=3), study_pair(22, 4, order=19), replace(pair, mesh_cycles=2)], [1000.0])
    with pytest.raises(InputError, match="two finite speeds"):
        run_up([pair], start=100.0, stop=100.0, duration=1.0)
    with pytest.raises(InputError, match="fold back"):
        run_up([pair], start=100.0, stop=1000.0, duration=1.0, sample_rate=10e3)
    with pytest.raises(InputError, match="whole fraction"):
        run_up([pair], start=100.0, stop=1000.0, duration=1.0, sample_rate=44.1e3)
    for rate in (0.0, np.nan, np.inf, -1e3, 1e12):
        with pytest.raises(InputError, match="sample rate"):
            run_up([pair], start=100.0, stop=1000.0, duration=1.0, sample_rate=rate)
    for stop in (np.nan, np.inf, 1e12):
        with pytest.raises(InputError, match=r"two finite speeds|time_step of"):
            run_up([pair], start=100.0, stop=stop, duration=1.0)
    for duration in (np.nan, np.inf, 1e12):
        with pytest.raises(InputError, match=r"stay below 2000 s"):
            run_up([pair], start=100.0, stop=1000.0, duration=duration)
    with pytest.raises(InputError, match="gear pair"):
        steady_sweep([], [100.0])
    with pytest.raises(InputError, match="256 or more"):
        periodic_response(pair, 1000.0, 2000.0, fidelity=replace(LUMPED, harmonic_samples=128))
    with pytest.raises(InputError, match="hangs free"):
        periodic_response(replace(pair, force=0.0), 1000.0, 2000.0)


def test_derivative_of_the_balance_is_that_of_its_residual(study_pair):
    balance = _Balance.set_up(study_pair(18, 6, order=57), replace(LUMPED, harmonics=6))
    rng = np.random.default_rng(2)
    u = np.append(np.concatenate(([4.0], 0.5 * rng.standard_normal(12))), 0.9)
    assert (np.abs(balance.series @ u[:-1]) < balance.gap).any(), "the motion must lose contact"
    _, exact = balance.residual(u)
    for column, direction in enumerate(1e-6 * np.eye(14)):
        numeric = (balance.residual(u + direction)[0] - balance.residual(u - direction)[0]) / 2e-6
        np.testing.assert_allclose(exact[:, column], numeric, atol=1e-4 * np.abs(exact).max())


def test_curve_that_needs_more_points_than_allowed_is_an_error(study_pair):
    with pytest.raises(SolverError, match="within 10 points"):
        periodic_response(study_pair(18, 4, order=57), 1500.0, 4500.0, fidelity=replace(LUMPED, arc_points=10))
