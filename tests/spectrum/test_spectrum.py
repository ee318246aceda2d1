"""Spectra of known signals."""

from __future__ import annotations

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.handoff import BearingForces
from nvhchain.spectrum import amplitude_spectrum, force_spectrum

RATE = 20_000.0


def _record(signal, *, periodic, speed=50.0, rate=RATE):
    force = np.zeros((len(signal), 1, 3))
    force[:, 0, 0] = signal
    return BearingForces(np.arange(len(signal)) / rate, force, ("A1",), np.zeros((1, 3)), speed, periodic)


def _time(n=4000):
    return np.arange(n) / RATE


def test_tone_on_a_line_has_its_peak_amplitude_and_no_other_line():
    t = _time()
    spectrum = force_spectrum(_record(3.0 * np.cos(2 * np.pi * 250.0 * t), periodic=True), low=0.0, high=5000.0)
    line = np.argmin(np.abs(spectrum.frequency - 250.0))
    assert spectrum.frequency[line] == pytest.approx(250.0, rel=1e-12)
    assert spectrum.force[line, 0, 0] == pytest.approx(3.0, abs=1e-12)
    rest = np.delete(np.abs(spectrum.force[:, 0, 0]), line)
    assert rest.max() < 1e-12


def test_cosine_is_real_and_sine_is_minus_j():
    t = _time()
    w = 2 * np.pi * 500.0
    for signal, expected in ((np.cos(w * t), 1.0), (np.sin(w * t), -1j), (np.cos(w * t + 0.6), np.exp(0.6j))):
        spectrum = force_spectrum(_record(signal, periodic=True), low=500.0, high=501.0)
        assert spectrum.force[0, 0, 0] == pytest.approx(expected, abs=1e-12)
        spectrum = force_spectrum(_record(signal, periodic=False), low=500.0, high=501.0)
        assert spectrum.force[0, 0, 0] == pytest.approx(expected, abs=1e-9)


def test_hann_keeps_the_amplitude_on_a_line_and_loses_at_most_its_scallop_between_lines():
    t = _time()
    for frequency, floor in ((1000.0, 1.0 - 1e-9), (1002.5, 0.848)):  # lines every 5 Hz; the Hann scallop is 1.42 dB
        spectrum = force_spectrum(
            _record(2.0 * np.cos(2 * np.pi * frequency * t + 1.1), periodic=False), low=900.0, high=1100.0
        )
        assert 2.0 * floor <= np.abs(spectrum.force).max() <= 2.0 * (1 + 1e-9)


def test_hann_keeps_the_mean_on_its_own_line():
    t = _time()
    record = _record(7.0 + np.cos(2 * np.pi * 1003.0 * t), periodic=False)
    spectrum = force_spectrum(record, low=0.0, high=200.0)
    assert spectrum.force[0, 0, 0] == pytest.approx(7.0, abs=1e-4)
    assert np.abs(spectrum.force[1:, 0, 0]).max() < 1e-4


@pytest.mark.parametrize("n", [400, 401])
def test_parseval_with_mean_and_half_the_sampling_rate(n):
    signal = np.random.default_rng(1).standard_normal(n) + 2.0
    _, amplitude = amplitude_spectrum(signal, RATE, periodic=True)
    power = np.abs(amplitude) ** 2
    last = n // 2 + 1 if n % 2 else n // 2
    total = power[0] + 0.5 * power[1:last].sum() + power[last:].sum()
    assert total == pytest.approx(np.mean(signal**2), rel=1e-12)
    assert amplitude[0] == pytest.approx(signal.mean(), rel=1e-12)


def test_alternating_signal_has_its_amplitude_at_half_the_sampling_rate():
    frequency, amplitude = amplitude_spectrum(np.tile([1.0, -1.0], 50), RATE, periodic=True)
    assert frequency[-1] == RATE / 2
    assert amplitude[-1] == pytest.approx(1.0, abs=1e-12)


def test_band_limits_include_lines_that_fall_on_them():
    spectrum = force_spectrum(_record(np.cos(2 * np.pi * 50.0 * _time()), periodic=True), low=50.0, high=5000.0)
    assert spectrum.frequency[0] == pytest.approx(50.0)
    assert spectrum.frequency[-1] == pytest.approx(5000.0)


def test_order_cut_keeps_only_the_orders_asked_for():
    turns = 50.0
    t = _time()
    signal = (
        np.cos(2 * np.pi * 2 * turns * t) + 0.5 * np.cos(2 * np.pi * 20 * turns * t) + np.cos(2 * np.pi * 7 * turns * t)
    )
    record = _record(signal, periodic=True, speed=2 * np.pi * turns)
    spectrum = force_spectrum(record, low=0.0, high=5000.0, orders=(2, 20))
    assert spectrum.frequency == pytest.approx([100.0, 1000.0])
    assert np.abs(spectrum.force[:, 0, 0]) == pytest.approx([1.0, 0.5], abs=1e-12)
    assert spectrum.input_speed == pytest.approx(2 * np.pi * turns)


def test_refusals_name_value_and_remedy():
    record = _record(np.cos(_time()), periodic=True)
    with pytest.raises(InputError, match="sampling rate 20000 Hz is below"):
        force_spectrum(record, low=50.0, high=9000.0)
    with pytest.raises(InputError, match=r"resolves 5 Hz, but 1\.0 Hz is asked for: record 1 s"):
        force_spectrum(record, low=50.0, high=5000.0, resolution=1.0)
    with pytest.raises(InputError, match=r"record 1\.5 s"):
        force_spectrum(record.replace(periodic=False), low=50.0, high=5000.0, resolution=1.0)
    with pytest.raises(InputError, match="no line of the record"):
        force_spectrum(record, low=51.0, high=54.0)
    with pytest.raises(InputError, match="low must not be negative"):
        force_spectrum(record, low=500.0, high=100.0)
    with pytest.raises(InputError, match="falls between the lines"):
        force_spectrum(record, low=0.0, high=5000.0, orders=(0.33,))
    with pytest.raises(InputError, match="constant input speed"):
        force_spectrum(record.replace(input_speed=np.linspace(10, 20, 4000)), low=0.0, high=5000.0, orders=(1,))


def test_what_is_no_signal_or_band_is_refused():
    record = _record(np.cos(_time()), periodic=True)
    with pytest.raises(InputError, match="low = '50' is of the wrong kind: give a number"):
        force_spectrum(record, low="50", high=5000.0)
    with pytest.raises(InputError, match="low must not be negative"):
        force_spectrum(record, low=np.nan, high=5000.0)
    for nothing in ([], np.float64(3.0)):
        with pytest.raises(InputError, match="has no spectrum: give samples"):
            amplitude_spectrum(nothing, 1e3, periodic=True)
    frequency, found = amplitude_spectrum([1.0, 3.0], 1e3, periodic=True)
    assert found.tolist() == [2.0, -1.0]
    assert frequency.tolist() == [0.0, 500.0]
