"""Ratios and common periods in whole numbers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from nvhchain.dynamics import train
from nvhchain.errors import InputError


def test_speed_ratios_and_senses_follow_the_teeth(make_gearbox, make_laws):
    found = train(make_gearbox(rotation=-1), make_laws())
    assert found.speed_ratio == (1, Fraction(2, 5), Fraction(6, 41))
    assert found.rotation == (-1, 1, -1)


@pytest.mark.parametrize(
    ("slotted", "plain_wheel", "turns"),
    [
        (False, False, Fraction(41, 4)),
        (True, False, Fraction(41, 2)),
        (False, True, Fraction(1, 4)),
        (True, True, Fraction(1, 2)),
    ],
)
def test_common_period_of_solid_and_slotted_gearbox(make_gearbox, make_laws, slotted, plain_wheel, turns):
    """Orders of the record's first line: 4/41, 2/41, and with a plain gear 4: 4 and 2."""
    assert train(make_gearbox(), make_laws(slotted, plain_wheel)).common_period == turns


def test_a_law_over_part_of_a_tooth_is_refused(make_gearbox, make_laws):
    laws = make_laws()
    with pytest.raises(InputError, match=r"covers 1\.05\d* wheel teeth, which is not whole"):
        train(make_gearbox(), (laws[0].replace(period=laws[0].period * 1.05), laws[1]))


def test_period_tolerates_rounding_of_the_stored_angle(make_gearbox, make_laws):
    laws = make_laws()
    nudged = laws[0].replace(period=np.nextafter(laws[0].period, 1.0))
    assert train(make_gearbox(), (nudged, laws[1])).common_period == Fraction(41, 4)
