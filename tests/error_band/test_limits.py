"""Limits of amplitudes at lines and of their level, from the errors of independent sources."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.error_band import COVERAGE, ErrorBand, difference_limits, format_level, format_limits
from nvhchain.error_band.band import ONE_CAUSE
from nvhchain.levels import decibel, overall


def band(**sources):
    pressure = np.array([[1.0], [0.1]])
    return ErrorBand(np.array([1000.0, 2000.0]), pressure, {k: np.array(v) for k, v in sources.items()})


def test_sources_add_in_quadrature_and_cover_two_of_their_estimates():
    made = band(housing=[[0.03], [0.0]], gear=[[0.04], [0.01]])
    assert made.error == pytest.approx(COVERAGE * np.array([[0.05], [0.01]]))
    assert made.upper[0] - decibel(1.0) == pytest.approx(20 * np.log10(1.1))
    assert made.lower[0] - decibel(1.0) == pytest.approx(20 * np.log10(0.9))


def test_an_error_beyond_the_pressure_leaves_no_lower_limit():
    made = band(gear=[[0.01], [0.2]])
    assert made.lower[1] < -1000
    assert made.upper[1, 0] == pytest.approx(decibel(0.5))


@pytest.mark.parametrize("scale", [1e200, 1e-200])
def test_limits_are_the_same_about_the_level_of_any_amplitude(scale):
    """400 decades of energy either way are no reason for NaN or for a warning."""
    one = band(housing=[[0.2], [0.01]], gear=[[0.1], [0.02]])
    with np.errstate(over="raise", under="ignore", invalid="raise", divide="raise"):
        other = replace(one, amplitude=scale * one.amplitude, sources={k: scale * v for k, v in one.sources.items()})
        shift = 20 * np.log10(scale)
        assert other.level == pytest.approx(one.level + shift)
        assert other.overall == pytest.approx(one.overall + shift)
        assert other.upper == pytest.approx(one.upper + shift)


def test_errors_of_one_source_add_up_over_the_lines_those_of_the_housing_in_quadrature():
    """Two equal lines, each 10 % off with coverage: both up, or at random √½ of it."""
    frequency, pressure, error = np.array([1000.0, 1000.1]), np.ones((2, 1)), 0.05 * np.ones((2, 1))
    middle = overall(frequency, pressure.astype(complex))[0]
    for name, share in (("surface mesh", 0.1), ("housing", 0.1 / 2**0.5)):
        lower, upper = ErrorBand(frequency, pressure, {name: error}).overall[0] - middle
        assert upper == pytest.approx(10 * np.log10(1 + 2 * share + 0.01), rel=1e-3)
        assert lower == pytest.approx(20 * np.log10(1 - share), rel=1e-3)


def test_an_error_beyond_all_of_the_sound_leaves_no_lower_overall_limit():
    limits = band(gear=[[0.6], [0.05]]).overall[0]
    assert limits[0] == -np.inf
    assert np.isfinite(limits[1])
    assert format_limits(limits) == f"below {limits[1]:.1f}"
    assert format_limits([None, 70.0]) == "below 70.0"
    assert format_limits([60.0, 70.0]) == "60.0…70.0"


def test_a_level_is_told_with_its_limits_and_silence_as_such():
    assert format_level(65.04, "dB(A)", [60.0, 70.0]) == "65.0 dB(A) (95 % limits 60.0…70.0)"
    silent = ErrorBand(np.array([100.0]), np.zeros((1, 1)), {})
    assert format_level(silent.level[0], "dB(A)", silent.overall[0]) == "silence"


def test_silence_with_an_error_is_as_loud_as_that_at_most():
    """0.05 Pa, covered twice, in one place; in the other there is neither sound nor error."""
    error = np.array([[0.05, 0.0]])
    made = ErrorBand(np.array([1000.0]), np.zeros((1, 2)), {"gear": error, "housing": 0 * error})
    assert made.overall[0, 1] == pytest.approx(decibel(0.1))
    assert made.overall[0, 1] == pytest.approx(made.upper[0, 0])
    assert made.overall[0, 0] < -1000
    assert made.overall[1].max() < -1000
    assert format_level(made.level[0], "dB(A)", made.overall[0]) == "silence (95 % limits below 71.0 dB(A))"
    assert format_level(made.level[1], "dB(A)", made.overall[1]) == "silence"
    faint = replace(made, amplitude=np.full((1, 2), 1e-200))  # whose energy over that of the error is no number
    assert faint.overall[0, 1] == pytest.approx(made.overall[0, 1])


@pytest.mark.parametrize("relative", [0.05, 0.2, 0.4])
def test_overall_limits_hold_errors_that_go_the_same_way_at_all_lines(relative):
    frequency, pressure = np.array([900.0, 1000.0, 1100.0]), np.array([[1.0], [0.3], [0.6]])
    band = ErrorBand(frequency, pressure, {"masters": relative / 2 * pressure})
    low, high = (overall(frequency, (1 + way * relative) * pressure.astype(complex))[0] for way in (-1, 1))
    assert band.overall[0] == pytest.approx([low, high], abs=1e-9)


def test_overall_limits_hold_errors_of_one_sign_that_differ_from_line_to_line():
    frequency, pressure = np.array([900.0, 1000.0, 1100.0]), np.array([[1.0], [0.3], [0.6]])
    error = np.array([[0.1], [0.2], [0.3]])
    band = ErrorBand(frequency, pressure, {"masters": error / COVERAGE})
    low, high = (overall(frequency, (pressure + way * error).astype(complex))[0] for way in (-1, 1))
    assert low - 1.0 < band.overall[0, 0] <= low
    assert band.overall[0, 1] == pytest.approx(high, abs=1e-9)


def test_errors_by_gears_change_sign_from_harmonic_to_harmonic_and_a_quarter_of_their_squares_adds_up():
    """Two lines of equal weight off by 1 % each: √(0.75 · 2 + 0.25 · 4) % of half of the energy, 1 % with one sign."""
    frequency, size = np.array([500.0, 1000.0]), np.ones((2, 1))
    gears, masters = (ErrorBand(frequency, size, {name: 0.01 * size}, weighted=False) for name in ("gear", "masters"))
    fall = [1.0 - 10 ** ((band.overall[0, 0] - band.level[0]) / 20) for band in (gears, masters)]
    assert fall == pytest.approx([COVERAGE * 0.01 * 2.5**0.5 / 2, COVERAGE * 0.01])
    tone = replace(gears, one_sign=ONE_CAUSE)  # as in a run-up, whose tones are spread over lines
    assert 1.0 - 10 ** ((tone.overall[0, 0] - tone.level[0]) / 20) == pytest.approx(COVERAGE * 0.01)
    single = ErrorBand(frequency[:1], size[:1], {"gear": 0.01 * size[:1]}, weighted=False)
    assert 1.0 - 10 ** ((single.overall[0, 0] - single.level[0]) / 20) == pytest.approx(COVERAGE * 0.01)


def test_parts_of_the_overall_limits_add_up_and_name_the_line_that_each_widens_most():
    frequency = np.array([500.0, 1000.0, 2000.0])
    amplitude = np.array([[0.1], [1.0], [0.2]])
    sources = {"masters": np.array([[0.0], [0.01], [0.2]]), "housing": np.array([[0.05], [0.3], [0.0]])}
    band = ErrorBand(frequency, amplitude, sources, weighted=False)
    (first, share, at), (second, rest, where) = band.parts
    assert (first, second) == ("housing", "masters")
    assert (at[0], where[0]) == (1000.0, 2000.0)
    housing, masters = 0.005**2 + 0.3**2, (0.01 + 0.04) ** 2  # masters add over the lines, the housing in quadrature
    assert share[0] == pytest.approx(housing / (housing + masters))
    assert share[0] + rest[0] == pytest.approx(1.0)


def test_band_without_errors_has_no_parts_of_limits():
    band = ErrorBand(np.array([500.0]), np.ones((1, 2)), {"masters": np.zeros((1, 2))})
    assert [share.tolist() for _, share, _ in band.parts] == [[0.0, 0.0]]


def test_an_error_that_lowers_more_than_it_raises_has_limits_of_its_own_on_either_side():
    size, up, down = np.array([[1.0], [2.0]]), np.array([[0.05], [0.1]]), np.array([[0.4], [0.3]])
    lines = np.array([1000.0, 2000.0])
    both = ErrorBand(lines, size, {"housing": up}, falls={"housing": down})
    rising, falling = ErrorBand(lines, size, {"housing": up}), ErrorBand(lines, size, {"housing": down})
    np.testing.assert_array_equal(both.upper, rising.upper)
    np.testing.assert_array_equal(both.lower, falling.lower)
    np.testing.assert_array_equal(both.overall[0], [falling.overall[0, 0], rising.overall[0, 1]])
    assert [(name, share[0]) for name, share, _ in both.parts] == [("housing", 1.0)]
    wider = both.widened("more", 0.2)
    assert (wider.lower < both.lower).all()
    assert (wider.upper > both.upper).all()
    assert difference_limits(both, both, {"housing"}) == pytest.approx(np.zeros((1, 2)), abs=1e-9)
