"""Loudness, sharpness and roughness of the signals that the standards name, and prominence of tones."""

import sys

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.sound import Sound, _mosqito, hearing, loudness_at, loudness_level, tone_prominence
from nvhchain.sound.tonality import critical_band, prominence_limits

RATE = 48000
TIME = np.arange(2 * RATE) / RATE


def at_level(signal, level):
    return signal * (2e-5 * 10 ** (level / 20) / np.sqrt(np.mean(signal**2)))


def tone(frequency, level):
    return at_level(np.sin(2 * np.pi * frequency * TIME), level)


def noise(low, high, level, seed=0):
    axis = np.fft.rfftfreq(len(TIME), 1 / RATE)
    band = (axis >= low) & (axis < high)
    spectrum = np.zeros(len(axis), dtype=complex)
    spectrum[band] = np.exp(2j * np.pi * np.random.default_rng(seed).random(band.sum()))
    return at_level(np.fft.irfft(spectrum, len(TIME)), level)


def test_loudness_of_tones_of_1_khz():
    """ISO 532-1: 40 dB have 1 sone, 60 dB have 4 sone, within 5 %."""
    found = loudness_at(Sound(tone(1000.0, 40.0), RATE, True), np.array([0.0, 20.0]))
    assert found == pytest.approx([1.0, 4.0], rel=0.05)
    assert loudness_level(4.0) == pytest.approx(60.0)


def in_third_octaves(level):
    """Noise with these levels (dB) in the third octaves from 25 Hz on."""
    middle = 10.0 ** (np.arange(14, 14 + len(level)) / 10)
    return sum(noise(f * 10**-0.05, f * 10**0.05, of, seed=round(f)) for f, of in zip(middle, level, strict=True))


SIGNAL_1 = (
    -60,
    -60,
    78,
    79,
    89,
    72,
    80,
    89,
    75,
    87,
    85,
    79,
    86,
    80,
    71,
    70,
    72,
    71,
    72,
    74,
    69,
    65,
    67,
    77,
    68,
    58,
    45,
    30,
)
"""Levels of the third octaves from 25 Hz to 12.5 kHz (dB), ISO 532-1, annex B.2."""


@pytest.mark.parametrize(
    ("signal", "loudness"),
    [
        pytest.param(in_third_octaves(SIGNAL_1), 83.296, id="1: third octaves"),
        pytest.param(tone(250.0, 80.0), 14.655, id="2: 250 Hz, 80 dB"),
        pytest.param(tone(1000.0, 60.0), 4.019, id="3: 1 kHz, 60 dB"),
        pytest.param(tone(4000.0, 40.0), 1.549, id="4: 4 kHz, 40 dB"),
        pytest.param(in_third_octaves([42.7] * 30), 10.498, id="5: pink noise, 60 dB from 0.3 Hz on"),
    ],
)
def test_loudness_of_the_steady_signals_of_iso_532_1(signal, loudness):
    """Annexes B.2 and B.3, synthesised from their description: within 5 % or 0.1 sone (section 5.1)."""
    found = loudness_at(Sound(signal, RATE, True), np.zeros(1))
    assert found == pytest.approx([loudness], rel=0.05, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "samples"),
    [
        pytest.param(0.010, {0.028: 4.300, 0.040: 1.873, 0.080: 0.593, 0.200: 0.101}, id="10: 10 ms"),
        pytest.param(0.050, {0.040: 5.025, 0.068: 5.975, 0.120: 1.495, 0.200: 0.455}, id="11: 50 ms"),
        pytest.param(0.500, {0.080: 6.355, 0.200: 7.770, 0.400: 8.063, 0.600: 1.662}, id="12: 500 ms"),
    ],
)
def test_loudness_over_time_of_the_tone_pulses_of_iso_532_1(seconds, samples):
    """Annex B.4, tones of 1 kHz and 70 dB with Gaussian edges: within 5 % or 0.1 sone in 2 ms (section 6.1)."""
    check_over_time(pulse(70.0, 0.015, 0.013 + seconds), samples)


@pytest.mark.slow
def test_loudness_over_time_of_the_combined_tone_pulses_of_iso_532_1():
    """Annex B.4, signal 13: 100 ms at 60 dB and 10 ms at 80 dB, tones of 1 kHz with Gaussian edges."""
    samples = {0.050: 2.701, 0.100: 3.373, 0.120: 3.375, 0.136: 9.976, 0.160: 3.446, 0.200: 1.594, 0.300: 0.372}
    check_over_time(pulse(60.0, 0.015, 0.113) + pulse(80.0, 0.123, 0.131), samples)


def pulse(level, start, end):
    """One second with a tone of 1 kHz that has its full level (dB) from `start` to `end` (s)."""
    time = np.arange(RATE) / RATE
    away = np.maximum(start - time, 0.0) + np.maximum(time - end, 0.0)
    full = 2e-5 * 10 ** (level / 20) * np.sqrt(2)
    return full * np.exp(-((away / 0.00166) ** 2)) * np.sin(2 * np.pi * 1000.0 * time)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frequency", "samples"),
    [
        pytest.param(250.0, {7.5: 5.572, 8.5: 7.882, 9.5: 11.415}, id="6: 250 Hz"),
        pytest.param(1000.0, {7.5: 6.434, 8.5: 9.109, 9.5: 12.932}, id="7: 1 kHz"),
        pytest.param(4000.0, {7.5: 9.749, 8.5: 13.791, 9.5: 19.615}, id="8: 4 kHz"),
    ],
)
def test_loudness_over_time_of_the_rising_tones_of_iso_532_1(frequency, samples):
    """Annex B.4, tones that rise from 30 to 80 dB between 0.1 and 10.1 s; the last three seconds."""
    start = 7.0
    time = start + np.arange(round(3.0 * RATE)) / RATE
    pressure = 2e-5 * np.sqrt(2) * 10 ** ((30.0 + 5.0 * (time - 0.1)) / 20)
    found = {at - start: loudness for at, loudness in samples.items()}
    check_over_time(pressure * np.sin(2 * np.pi * frequency * time), found)


def check_over_time(signal, samples):
    """Compare the loudness (sone) at times (s) with the standard's, within its tolerances."""
    time, found, _ = _mosqito.loudness_in_time(signal)
    for at, loudness in samples.items():
        near = found[np.abs(time - at) < 0.003]
        assert np.abs(near - loudness).min() <= max(0.05 * loudness, 0.1), at


def test_sharpness_of_a_narrow_band_at_1_khz():
    """DIN 45692: a critical band of noise at 1 kHz, 60 dB, has 1 acum, within 5 %."""
    assert hearing(Sound(noise(920.0, 1080.0, 60.0), RATE, True)).sharpness == pytest.approx(1.0, rel=0.05)


def test_roughness_of_a_fully_modulated_tone():
    """A tone of 1 kHz and 60 dB that is fully modulated at 70 Hz has 1 asper, within the just noticeable 17 %."""
    modulated = at_level((1 + np.cos(2 * np.pi * 70.0 * TIME)) * np.sin(2 * np.pi * 1000.0 * TIME), 60.0)
    assert hearing(Sound(modulated, RATE, True)).roughness == pytest.approx(1.0, rel=0.17)


@pytest.mark.slow
def test_loudness_over_time_settles_at_the_steady_one():
    found = hearing(Sound(tone(1000.0, 60.0)[:RATE], RATE))
    assert found.loudness == pytest.approx(4.0, rel=0.05)
    settled = found.time > 0.3
    assert found.loudness_in_time[settled] == pytest.approx(4.0, rel=0.05)
    assert len(found.time) == len(found.sharpness_in_time) == len(found.roughness_in_time)


def test_tone_is_prominent_by_its_distance_from_the_background_in_the_critical_band():
    low, high = critical_band(1000.0)
    assert (low, high) == pytest.approx((922.2, 1084.4), abs=0.5)  # 162.2 Hz wide, ECMA-418-1
    background = Sound(noise(20.0, 20_000.0, 60.0), RATE, True)
    of_band = 60.0 + 10 * np.log10((high - low) / 19_980.0)
    for above, prominent in ((9.0, True), (6.0, False)):
        found = tone_prominence(1000.0, of_band + above, background)
        assert found.tone_to_noise == pytest.approx(above, abs=0.1)
        assert found.prominent is prominent
    # bands beside it are about as wide: the ratio is that of the band with the tone to one without
    assert found.prominence_ratio == pytest.approx(10 * np.log10(1 + 10**0.6), abs=0.3)
    with pytest.raises(InputError, match="its prominence is defined from"):
        tone_prominence(50.0, 60.0, background)


@pytest.mark.parametrize(("frequency", "limits"), [(4000.0, (8.0, 9.0)), (1000.0, (8.0, 9.0)), (250.0, (24.66, 29.0))])
def test_limits_of_prominence_rise_below_1_khz(frequency, limits):
    """ECMA-418-1: by 8.33 and 10 dB an octave."""
    assert prominence_limits(frequency) == pytest.approx(limits)


def test_missing_extra_is_one_line_of_remedy(monkeypatch):
    monkeypatch.setattr("nvhchain.runtime.extras.installed", lambda module: False)
    with pytest.raises(InputError, match=r'^mosqito is not installed: pip install "nvhchain\[sound\]"$'):
        hearing(Sound(tone(1000.0, 60.0), RATE, True))


def test_a_broken_mosqito_is_one_line_with_its_remedy(tmp_path, monkeypatch):
    """Installed, but built against other packages: its import fails."""
    (tmp_path / "mosqito.py").write_text("raise ImportError('numpy.core.multiarray failed\\nto import')\n")
    for name in [name for name in sys.modules if name.partition(".")[0] == "mosqito" or name.endswith("._mosqito")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match=r"mosqito is installed but cannot be imported .* --force-reinstall mosqito$"):
        hearing(Sound(np.zeros(4800), 48000))
