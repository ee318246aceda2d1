"""Limits of a difference: shared errors cancel, others add in quadrature."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Ramp
from nvhchain.error_band import COVERAGE, SHARED, ErrorBand, difference_limits, shared_inputs, shared_sources
from nvhchain.errors import InputError

pytestmark = pytest.mark.usefixtures("common_operators")

CASES = Path(__file__).parents[2] / "cases"
LINES = np.array([500.0, 1000.0])


def band(amplitude, **errors):
    """Band of relative errors by source, at one place."""
    amplitude = np.array(amplitude, dtype=float)[:, None]
    sources = {name.replace("_", " "): np.array(error)[:, None] * amplitude for name, error in errors.items()}
    return ErrorBand(LINES, amplitude, sources, weighted=False)


def width(limits):
    low, high = limits[0]
    return 0.5 * (high - low)


def test_a_shared_error_of_every_line_cancels_where_the_spectra_are_alike():
    first, second = (band(size * np.array([1.0, 0.5]), masters=[0.1, 0.2], housing=[0.1, 0.05]) for size in (1.0, 2.0))
    low, high = difference_limits(first, second, SHARED)[0]
    assert (low, high) == pytest.approx((20 * np.log10(2),) * 2, abs=1e-12)
    assert width(difference_limits(first, second)) > 1.0


def test_a_shared_error_counts_by_the_change_of_the_shares():
    """Energy moves from the first line to the second: shares 1, 0 and 0.2, 0.8; only the second line errs, by 5 %."""
    first, second = band([1.0, 1e-9], masters=[0.0, 0.05]), band([1.0, 2.0], masters=[0.0, 0.05])
    low, _ = difference_limits(first, second, ["masters"])[0]
    assert 20 * np.log10(5**0.5) - low == pytest.approx(-20 * np.log10(1 - COVERAGE * 0.8 * 0.05), abs=1e-6)


def test_independent_errors_add_in_quadrature():
    first, second = band([1.0, 0.0], gear=[0.03, 0.0]), band([1.0, 0.0], gear=[0.04, 0.0])
    low, high = difference_limits(first, second, SHARED)[0]
    fall, rise = (20 * np.log10(np.abs(1 + sign * COVERAGE * np.array([0.03, 0.04]))) for sign in (-1, 1))
    assert low == pytest.approx(-np.hypot(rise[0], fall[1]))
    assert high == pytest.approx(np.hypot(fall[0], rise[1]))


def test_a_shared_error_of_quite_different_spectra_widens_no_more_than_independent_ones():
    first, second = band([1.0, 0.01], masters=[0.1, 0.1]), band([0.01, 1.0], masters=[0.1, 0.1])
    assert width(difference_limits(first, second, SHARED)) <= width(difference_limits(first, second)) + 1e-12


def test_an_error_as_large_as_the_sound_leaves_the_limit_of_both_levels_added():
    first, second = band([1.0, 0.0], gear=[0.6, 0.0]), band([2.0, 0.0], gear=[0.0, 0.0])
    low, high = difference_limits(first, second)[0]
    assert high == np.inf
    assert low == pytest.approx(second.overall[0, 0] - first.overall[0, 1])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_a_second_load_is_compared_far_more_closely_than_either_level_is_known(tmp_path):
    """40 N·m for 60 N·m, to 2 kHz: `draft` differs from `standard` by less than the limits of both, a fraction of the
    levels'."""
    found = {}
    for fidelity in (nvh.DRAFT, nvh.STANDARD):
        first, second = (
            nvh.run(
                nvh.load_case(
                    CASES / "small" / "single_stage.toml",
                    changes=[f"operation.input_torque={torque}", "band.high=2000"],
                ),
                fidelity=fidelity,
                operators=tmp_path / fidelity.name,
            )
            for torque in (60, 40)
        )
        (low, high), difference = (
            difference_limits(first.error_band, second.error_band, SHARED)[0],
            float(second.overall[0] - first.overall[0]),
        )
        assert low < difference < high
        assert high - low < 0.3 * np.ptp(second.error_band.overall[0])
        found[fidelity.name] = low, difference, high
    low, _, high = found["standard"]
    assert low < found["draft"][1] < high


def test_errors_of_one_mesh_law_under_one_load_cancel():
    """Runs with the same laws share no housing; another torque has errors of its own, another speed other lines."""
    case = nvh.load_case(CASES / "small" / "single_stage.toml")
    law, other = (SimpleNamespace(content_hash=name) for name in "ab")
    first, second = band([1.0, 0.5], gear=[0.1, 0.2]), band([2.0, 1.0], gear=[0.1, 0.2])

    def limits(laws, torque=60, **operation):
        loaded = replace(case, operation=replace(case.operation, input_torque=torque, **operation))
        inputs = [shared_inputs(case, None, None, (law,)), shared_inputs(loaded, None, None, laws)]
        return difference_limits(first, second, shared_sources(*inputs))

    assert limits((law,))[0] == pytest.approx((20 * np.log10(2),) * 2, abs=1e-12)
    apart = width(difference_limits(first, second))
    assert width(limits((other,))) == width(limits((law,), 40)) == apart > 1.0
    assert width(limits((law,), input_speed=1.2 * case.operation.input_speed)) == apart
    assert width(limits((law,), ramp=Ramp(2.0 * case.operation.input_speed, 2.0))) == apart


def test_bands_of_different_places_are_refused():
    two = ErrorBand(LINES, np.ones((2, 2)), {})
    with pytest.raises(InputError, match="bands have 2 and 1 places"):
        difference_limits(two, band([1.0, 1.0]))


def test_moved_natural_frequencies_that_change_two_levels_alike_cancel_in_their_difference():
    """Each level may fall by 6 dB; together they do, but for 1 dB."""
    lines, size = np.array([1000.0]), np.array([[1.0]])
    falling = {"falls": {"housing": 0.25 * size}, "moved": np.array([[0.25], [1.0], [1.2]])}
    first = ErrorBand(lines, size, {"housing": 0.05 * size}, **falling)
    second = replace(first, amplitude=2.0 * size, moved=first.moved * np.array([[1.0], [10**-0.1], [1.0]]))
    apart = difference_limits(first, second)[0]
    together = difference_limits(first, second, {"housing"})[0]
    assert together == pytest.approx(20 * np.log10(2.0) + np.array([-1.0, 0.0]))
    assert apart[0] < together[0] - 1.5
