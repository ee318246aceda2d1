"""Natural frequencies that are moved within their errors."""

import numpy as np
import pytest

from nvhchain.error_band.housing import FEW_SAMPLES, SAMPLES, moved_housings, shifted, velocity_shares
from nvhchain.handoff import ForceSpectrum, HousingAccuracy
from nvhchain.testing import ball_with_modes
from nvhchain.testing.ball_with_modes import BEARINGS, load


@pytest.fixture(scope="module")
def housing():
    return ball_with_modes.housing(ball_with_modes.case())


def test_a_mode_may_stand_lower_or_higher_than_it_is(housing):
    """From 1000 to 995 or 1005 Hz, by the differences of squares that the motion goes with.

    Each line takes the larger change: that of the mode which comes closer. Damping adds little so far away.
    """
    beside = ForceSpectrum(np.array([900.0, 1100.0]), load(1.0, 1.0), BEARINGS, input_speed=188.5)
    below, above = velocity_shares(housing, beside).motion_change[:, 1]
    assert below == pytest.approx((1000**2 - 900**2) / (995**2 - 900**2) - 1, rel=0.03)
    assert above == pytest.approx((1100**2 - 1000**2) / (1100**2 - 1005**2) - 1, rel=0.03)


def test_modes_whose_error_is_larger_than_their_frequency_stay_modes(housing):
    """Elements that are far too long for thin walls are warned of, and not refused."""
    count = len(housing.natural_frequency)
    wrong = housing.replace(accuracy=HousingAccuracy(frequency_error=np.full(count, 1.5)))
    assert (shifted(wrong, -1.0).natural_frequency > 0.0).all()


def test_moved_modes_stay_modes_whatever_their_errors(housing):
    """Elements far too long for thin walls err by more than a half: frequencies below 0 Hz were refused."""
    wrong = housing.replace(accuracy=HousingAccuracy(frequency_error=np.full(len(housing.natural_frequency), 1.5)))
    for count in (SAMPLES, FEW_SAMPLES):
        assert len(moved_housings(wrong, count)) == count
        assert all((of.natural_frequency > 0.0).all() for of in moved_housings(wrong, count))


def test_ways_move_as_far_as_they_are_normally_distributed(housing):
    """Few ways reach as far as many; in every other one all modes are off by as many deviations."""
    error = 0.01 * np.ones(len(housing.natural_frequency))
    known = housing.replace(accuracy=HousingAccuracy(frequency_error=error))
    for count in (SAMPLES, FEW_SAMPLES):
        off = (
            np.array([of.natural_frequency / housing.natural_frequency - 1 for of in moved_housings(known, count)])
            / 0.01
        )
        np.testing.assert_allclose(off[::2], np.broadcast_to(off[::2, :1], off[::2].shape), atol=1e-9)
        assert off[::2, 0].max() == pytest.approx(1.96, abs=0.01)
        assert off[::2, 0].min() == pytest.approx(-1.96, abs=0.01)
        assert np.ptp(off[1::2], axis=1).min() > 0.1
