"""Loudness, sharpness and roughness of the signals that the standards name, and prominence of tones."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.sound import Sound, hearing, loudness_at, loudness_level, tone_prominence
from nvhchain.sound.tonality import critical_band

RATE = 48000
TIME = np.arange(2 * RATE) / RATE

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


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


def test_sharpness_of_a_narrow_band_at_1_khz():
    """DIN 45692: a critical band of noise at 1 kHz, 60 dB, has 1 acum, within 5 %."""
    assert hearing(Sound(noise(920.0, 1080.0, 60.0), RATE, True)).sharpness == pytest.approx(1.0, rel=0.05)


def test_roughness_of_a_fully_modulated_tone():
    """A tone of 1 kHz and 60 dB that is fully modulated at 70 Hz has 1 asper, within the just noticeable 17 %."""
    modulated = at_level((1 + np.cos(2 * np.pi * 70.0 * TIME)) * np.sin(2 * np.pi * 1000.0 * TIME), 60.0)
    assert hearing(Sound(modulated, RATE, True)).roughness == pytest.approx(1.0, rel=0.17)


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


def test_missing_extra_is_one_line_of_remedy(monkeypatch):
    monkeypatch.setattr("nvhchain.runtime.extras.installed", lambda module: False)
    with pytest.raises(InputError, match=r"^mosqito is not installed: pip install nvhchain\[sound\]$"):
        hearing(Sound(tone(1000.0, 60.0), RATE, True))
