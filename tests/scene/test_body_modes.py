"""Lowest frequency of a gear's body, by plate theory."""

from dataclasses import replace
from math import pi, sqrt

import pytest

import nvhchain as nvh
from nvhchain.conventions import STEEL, Material
from nvhchain.gear import ThinRim
from nvhchain.scene import modelled
from nvhchain.scene.body_modes import Disc, gear_disc, lowest_frequency, vibrating_bodies

THIRD = Material(210e9, 1 / 3, 7850.0)


@pytest.mark.parametrize(("inner", "wanted"), [(0.3, 6.33), (0.5, 13.0), (0.7, 37.0)])
def test_a_thin_ring_held_inside_vibrates_as_in_leissa(inner, wanted):
    """NASA SP-160, table of clamped-free plates, ν = 1/3: the lowest λ² of 0 and 1 nodal diameters."""
    thickness = 2e-3
    bend = 210e9 * thickness**3 / (12 * (1 - 1 / 9))
    found = lowest_frequency(Disc(inner, 1.0, thickness, 1.0 + 1e-9, thickness), THIRD)
    assert 2 * pi * found * sqrt(7850.0 * thickness / bend) == pytest.approx(wanted, rel=0.04)


def test_a_stiff_rim_on_a_thin_web_tilts_as_a_rigid_ring():
    """One nodal diameter: the ring tilts on the web. Heavier rims are slower, thicker webs faster."""
    thin, thick = (Disc(0.02, 0.06, t, 0.065, 0.02) for t in (3e-3, 5e-3))
    heavy = replace(thin, rim_outer=0.07)
    assert lowest_frequency(heavy, STEEL) < lowest_frequency(thin, STEEL) < lowest_frequency(thick, STEEL)


def test_gear_bodies_are_modelled_where_they_change_a_line(request):
    """Their resonances are narrow: nine decibels of the level came from one line, whose share no estimate knew."""
    small = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    case = replace(small, options=replace(small.options, gear_body_modes="auto"))
    pinion, wheel = case.gears
    thin = replace(case, gears=(pinion, replace(wheel, blank=ThinRim(2e-3, 0.018, 0.034))))
    found = {name: modelled(each, nvh.DRAFT).options[-1] for name, each in (("solid", case), ("thin", thin))}
    assert found["solid"].note == "no gear body has modes up to 5600 Hz"
    assert not found["solid"].modelled
    assert abs(found["thin"].level_db) < 1.0 < 2.0 < found["thin"].distance_db
    assert found["thin"].modelled
    (body,) = vibrating_bodies(thin)
    assert 1000 < body.modes.frequency.min() < lowest_frequency(gear_disc(wheel.body), STEEL)
    loose = replace(nvh.DRAFT, option_tolerance_db=4.0)
    assert modelled(thin, loose).case.options.gear_body_modes is False
