"""Gears of the four pairs of S. Shweiki's thesis, ch. 3; table 3.2 itself is that of tests/gallery/test_gallery.py."""

import runpy
from pathlib import Path

import pytest

from nvhchain.gear import GearBody, GearPair, mass_properties

GEARS = runpy.run_path(str(Path(__file__).parents[2] / "cases" / "studies" / "thesis_gears.py"))
SPUR, BLANKS = GEARS["SPUR"], GEARS["BLANKS"]


def test_tip_and_root_diameters_contact_ratio_and_masses_are_those_of_the_thesis():
    assert (2 * SPUR.root_radius, 2 * SPUR.tip_circle_radius) == pytest.approx((141.7e-3, 154.5e-3), rel=1e-12)
    solid = GearBody(SPUR)
    assert GearPair(solid, solid, 150e-3).transverse_contact_ratio == pytest.approx(1.4557, abs=1e-4)
    for name, mass in {"a": 1.72, "b": 1.72, "c": 1.68, "d": 1.68}.items():
        assert mass_properties(GearBody(SPUR, BLANKS[name])).mass == pytest.approx(mass, rel=1e-3)
