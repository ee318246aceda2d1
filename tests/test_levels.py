"""Levels against IEC 61672 table values and closed forms."""

import numpy as np
import pytest

from nvhchain import levels
from nvhchain.errors import InputError


def test_one_pascal_rms_is_94_decibel():
    assert levels.decibel(np.sqrt(2.0)) == pytest.approx(93.9794, abs=1e-4)


@pytest.mark.parametrize(
    ("frequency", "weight"),
    [(31.5, -39.4), (63, -26.2), (125, -16.1), (250, -8.6), (500, -3.2),
     (1000, 0.0), (2000, 1.2), (4000, 1.0), (8000, -1.1)],
)  # fmt: skip
def test_a_weighting_matches_iec_61672_table_3(frequency, weight):
    exact = 1000.0 * 10 ** (np.round(10 * np.log10(frequency / 1000.0)) / 10.0)
    assert levels.a_weighting(exact) == pytest.approx(weight, abs=0.051)


def test_overall_level_adds_energy_not_amplitude():
    frequency = np.array([1000.0, 1001.0])
    single = levels.overall(frequency[:1], np.array([1.0 + 0j]))
    assert levels.overall(frequency, np.array([1.0 + 0j, -1.0])) == pytest.approx(single + 10 * np.log10(2), abs=0.01)


def test_time_history_is_the_cosine_sum_of_its_lines():
    frequency = np.array([20.0, 40.0, 100.0])
    pressure = np.array([1 + 2j, 3 - 1j, 0.5j])
    time, signal = levels.time_history(frequency, pressure, sample_rate=1000.0)
    expected = (pressure[:, None] * np.exp(2j * np.pi * frequency[:, None] * time)).real.sum(axis=0)
    assert time[-1] + time[1] == pytest.approx(1 / 20.0)
    assert np.abs(signal - expected).max() < 1e-12


def test_time_history_refuses_inharmonic_lines_and_low_rates():
    with pytest.raises(InputError, match="whole multiples"):
        levels.time_history(np.array([20.0, 41.0, 57.5]), np.ones(3, complex), sample_rate=1000.0)
    with pytest.raises(InputError, match="sample rate"):
        levels.time_history(np.array([20.0, 40.0]), np.ones(2, complex), sample_rate=80.0)


@pytest.mark.parametrize(
    ("frequency", "count", "message"),
    [([0.0], 1, "not be 0 Hz alone"), ([100.0, 100.0], 2, "must rise"), ([-50.0, 100.0], 2, "must rise"),
     ([], 0, "give one line each"), ([100.0, 200.0], 3, "give one line each"), ([100.0, np.nan], 2, "must rise")],
)  # fmt: skip
def test_lines_without_a_period_give_no_time_history(frequency, count, message):
    with pytest.raises(InputError, match=message):
        levels.time_history(frequency, np.ones(count, complex), sample_rate=1000.0)


def test_what_has_no_level_is_refused():
    with pytest.raises(InputError, match="has no level: give samples"):
        levels.equivalent([], sample_rate=1e3)
    with pytest.raises(InputError, match="sample_rate = nan Hz must be positive"):
        levels.equivalent([1.0, 2.0], sample_rate=np.nan)
    with pytest.raises(InputError, match="frequency = 'loud' is of the wrong kind"):
        levels.overall("loud", np.ones(4))


@pytest.mark.parametrize(("frequency", "seconds", "error"), [(31.7, 1.0, 0.45), (31.7, 5.0, 0.1), (200.4, 0.5, 0.02)])
def test_a_record_that_does_not_close_on_itself_has_the_level_of_its_tone(frequency, seconds, error):
    """The jump from its end to its beginning would sound at all frequencies: 9 dB at 31.7 Hz in 1 s."""
    time = np.arange(round(seconds * 20e3)) / 20e3
    wanted = levels.decibel(1.0) + levels.a_weighting(frequency)
    for phase in np.linspace(0.0, 2 * np.pi, 12, endpoint=False):
        found = levels.equivalent(np.cos(2 * np.pi * frequency * time + phase), sample_rate=20e3)
        assert found == pytest.approx(wanted, abs=error)


def test_octave_bands_have_the_middles_and_edges_of_iec_61260():
    lines = np.arange(20.0, 12_000.0, 0.5)
    thirds = levels.octave_bands(lines, np.full(len(lines), 1e-3))
    at = np.argmin(np.abs(thirds.middle - 1000.0))
    assert thirds.middle[at + np.arange(3)] == pytest.approx([1000.0, 1258.925, 1584.893], rel=1e-6)
    inside = np.count_nonzero((lines >= 891.251) & (lines < 1122.018))
    assert thirds.level[at] == pytest.approx(levels.decibel(1e-3) + 10 * np.log10(inside))
    sixths = levels.octave_bands(lines, np.full(len(lines), 1e-3), fraction=6)
    assert np.abs(sixths.middle - 1059.254).min() < 1e-2  # G^(1/12) kHz
    octaves = levels.octave_bands(lines, np.full(len(lines), 1e-3), fraction=1)
    assert np.abs(octaves.middle - 1995.262).min() < 1e-2
    for of in (thirds, sixths, octaves):
        energy = 10 * np.log10((10 ** (of.level / 10)).sum())
        assert energy == pytest.approx(levels.overall(lines, np.full(len(lines), 1e-3 + 0j), weighted=False))


def test_numbers_as_text_have_a_minus_sign_and_no_sign_where_they_round_to_zero():
    assert levels.number_text(-0.04, "+.1f") == levels.number_text(0.0, "+.1f") == "0.0"
    assert levels.number_text(-0.06, "+.1f") == "−0.1"
    assert levels.number_text(1.25, "+.2f") == "+1.25"
    assert levels.number_text(-1.5e-7, ".2g") == "−1.5e−07"


def test_third_octaves_of_a_record_add_up_to_its_level_and_hold_its_tones():
    """A tone of 250 Hz that is cut off, and one of 2 kHz half as large: 6 dB less."""
    time = np.arange(0, 1.003, 1e-4)
    signal = np.sin(2 * np.pi * 250.0 * time) + 0.5 * np.sin(2 * np.pi * 2000.0 * time)
    found = levels.record_bands(signal, sample_rate=1e4)
    total = 10 * np.log10((10 ** (found.level / 10)).sum())
    assert total == pytest.approx(float(levels.equivalent(signal, sample_rate=1e4, weighted=False)), abs=1e-6)
    at = {round(middle): level for middle, level in zip(found.middle, found.level, strict=True)}
    assert at[251] == pytest.approx(float(levels.decibel(1.0)), abs=0.05)
    assert at[1995] == pytest.approx(float(levels.decibel(0.5)), abs=0.05)
    assert at[794] < at[251] - 20
