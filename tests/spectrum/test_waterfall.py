"""Waterfalls of known signals: tones and orders under a ramp, sidebands, phase, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.spectrum import order_cut, order_waterfall, waterfall

RATE = 25_000.0


def _ramp(duration=4.0, start=20.0, end=40.0, rate=RATE):
    """Times, speed in rad/s and turns of an even ramp between two rates of turns per second."""
    time = np.arange(round(duration * rate)) / rate
    return (
        time,
        2 * np.pi * (start + (end - start) * time / duration),
        start * time + (end - start) * time**2 / (2 * duration),
    )


def test_a_tone_stays_on_its_line_at_its_amplitude_whatever_the_speed():
    time, speed, _ = _ramp()
    of = waterfall(
        3.0 * np.cos(2 * np.pi * 500.0 * time), sample_rate=RATE, input_speed=speed, resolution=6.0, high=1e3
    )
    line = np.argmin(np.abs(of.axis - 500.0))
    assert of.axis[line] == pytest.approx(500.0)
    assert np.abs(of.amplitude[:, line]) == pytest.approx(np.full(len(of.time), 3.0), rel=1e-6)
    assert np.abs(of.amplitude[:, np.abs(of.axis - 500.0) > 10.0]).max() < 1e-6
    assert of.input_speed == pytest.approx(np.interp(of.time, time, speed), rel=1e-9)
    assert of.axis[-1] == pytest.approx(1e3)


def test_overlap_sets_how_far_apart_the_windows_are():
    time, speed, _ = _ramp()
    for overlap, share in ((0.0, 1.0), (0.75, 0.25)):
        of = waterfall(time, sample_rate=RATE, input_speed=speed, resolution=6.0, high=1e3, overlap=overlap)
        assert np.diff(of.time) == pytest.approx(np.full(len(of.time) - 1, share * 0.25), rel=1e-3)


def test_an_order_stays_on_its_line_with_amplitude_and_phase_through_a_ramp():
    """Order 20.2 is not whole over the 1.25 turns between windows, so that its phase would show where they start."""
    _, speed, turns = _ramp()
    signal = 2.0 * np.cos(2 * np.pi * 20.2 * turns + 0.7)
    of = order_waterfall(signal, sample_rate=RATE, input_speed=speed, resolution=0.3, high=100.0)
    cut = order_cut(of, [20.2])[:, 0]
    assert cut == pytest.approx(np.full(len(cut), 2.0 * np.exp(0.7j)), rel=1e-5)
    assert np.abs(of.amplitude[:, np.abs(of.axis - 20.2) > 0.5]).max() < 1e-4
    # the same signal smears over many lines of a waterfall against frequency: the order sweeps 0.5 s · 100 Hz/s
    smeared = waterfall(signal, sample_rate=RATE, input_speed=speed, resolution=3.0, high=2000.0)
    assert np.abs(smeared.amplitude).max() < 0.8 * 2.0


@pytest.mark.parametrize(("samples_per_period", "error"), [(5.0, 1e-4), (10.0, 1e-6)])
def test_interpolation_keeps_the_amplitude_up_to_the_top_of_the_band(samples_per_period, error):
    _, speed, turns = _ramp(start=30.0, end=30.3)
    order = RATE / samples_per_period / 30.3
    order = round(5 * order) / 5
    of = order_waterfall(
        np.cos(2 * np.pi * order * turns), sample_rate=RATE, input_speed=speed, resolution=0.3, high=order + 1
    )
    assert np.abs(order_cut(of, [order])) == pytest.approx(np.ones((len(of.time), 1)), abs=error)


def test_from_a_standstill_nothing_folds_back():
    """A tone at 11 kHz lies beyond every line shown, at every speed."""
    time, speed, turns = _ramp(duration=8.0, start=0.0)
    signal = np.cos(2 * np.pi * 4.0 * turns) + np.cos(2 * np.pi * 11e3 * time)
    of = order_waterfall(signal, sample_rate=RATE, input_speed=speed, resolution=0.3, high=30.0)
    assert np.abs(order_cut(of, [4.0])) == pytest.approx(np.ones((len(of.time), 1)), rel=1e-3)
    away = np.abs(of.axis - 4.0) > 0.8
    assert np.abs(of.amplitude[:, away]).max() < 2e-3


def test_modulation_shows_as_sidebands():
    """Mesh order 20, modulated by slots that pass twice a turn: lines at 18 and 22 with half the modulation."""
    _, speed, turns = _ramp()
    signal = (1.0 + 0.2 * np.cos(2 * np.pi * 2.0 * turns)) * np.cos(2 * np.pi * 20.0 * turns)
    of = order_waterfall(signal, sample_rate=RATE, input_speed=speed, resolution=0.3, high=40.0)
    cut = np.abs(order_cut(of, [20.0, 18.0, 22.0, 16.0]))
    assert cut[:, 0] == pytest.approx(np.ones(len(cut)), rel=1e-5)
    assert cut[:, 1:3] == pytest.approx(np.full((len(cut), 2), 0.1), rel=1e-3)
    assert cut[:, 3].max() < 1e-4


def test_channels_keep_their_shape_and_the_mean_its_line():
    _, speed, turns = _ramp()
    signal = np.cos(2 * np.pi * 3.0 * turns)[:, None, None] * np.arange(6.0).reshape(2, 3) + 100.0
    of = order_waterfall(signal, sample_rate=RATE, input_speed=speed, resolution=0.3, high=10.0)
    assert of.amplitude.shape[2:] == (2, 3)
    assert of.amplitude[:, 0] == pytest.approx(np.full((len(of.time), 2, 3), 100.0), rel=1e-4)
    assert np.abs(order_cut(of, [3.0])[0, 0]) == pytest.approx(np.arange(6.0).reshape(2, 3), abs=1e-3)


def test_orders_beyond_the_band_of_the_record_are_left_out():
    _, speed, turns = _ramp()
    of = order_waterfall(np.cos(2 * np.pi * 3 * turns), sample_rate=RATE, input_speed=speed, resolution=0.3, high=600.0)
    beyond = of.axis[None, :] * (of.input_speed / (2 * np.pi))[:, None] > RATE / 2.5
    assert beyond.any()
    assert np.abs(of.amplitude[beyond]).max() == 0.0


@pytest.mark.parametrize(
    ("call", "changes", "message"),
    [
        (waterfall, {"high": 12e3}, r"sampling rate 25000 Hz is below 2\.56 × 12000 Hz"),
        (waterfall, {"resolution": 0.1}, "shorter than a window of 15 s"),
        (waterfall, {"overlap": 1.0}, "overlap = 1.0"),
        (waterfall, {"input_speed": np.ones(3)}, "give the same number"),
        (order_waterfall, {"resolution": 0.01}, r"turns 120 times in the record, but a window takes 150 turns"),
        (order_waterfall, {"resolution": 0.0}, "must be positive"),
        (waterfall, {"resolution": 1e12}, r"resolution = 1e\+12 is coarser than the whole band to 100"),
        (waterfall, {"sample_rate": np.nan}, "sample_rate = nan must be positive and finite"),
        (order_waterfall, {"input_speed": np.where(np.arange(100_000) == 7, np.nan, 1.0)}, "not finite in sample 7"),
        (order_waterfall, {"high": "100"}, "high = '100' is of the wrong kind: give a number"),
        (order_waterfall, {"input_speed": -np.ones(100_000)}, "backwards"),
    ],
)
def test_what_cannot_be_resolved_is_refused(call, changes, message):
    time, speed, _ = _ramp()
    arguments = {"sample_rate": RATE, "input_speed": speed, "resolution": 3.0, "high": 100.0} | changes
    with pytest.raises(InputError, match=message):
        call(time, **arguments)


def test_order_cuts_need_lines_of_orders():
    time, speed, turns = _ramp()
    with pytest.raises(InputError, match="make it with order_waterfall"):
        order_cut(waterfall(time, sample_rate=RATE, input_speed=speed, resolution=3.0, high=100.0), [1.0])
    of = order_waterfall(turns, sample_rate=RATE, input_speed=speed, resolution=0.3, high=10.0)
    with pytest.raises(InputError, match=r"order 4\.1 falls between the lines"):
        order_cut(of, [4.1])
    with pytest.raises(InputError, match="beyond the waterfall's last, 10"):
        order_cut(of, [4.0, 12.0])
