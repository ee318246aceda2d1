"""Errors of knobs on another case than the swept one, by face width, overlap and wave."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT, REFERENCE
from nvhchain.tradeoff.extrapolation import extent, growth, open_below

EVEN = replace(REFERENCE, gear=REFERENCE.gear.even_layers(12))
"""`reference` with as many layers in all gears, in teeth and blank, as before layers had a largest thickness."""


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


@pytest.fixture(scope="module")
def two_stages(request):
    return nvh.load_case(request.config.rootpath / "cases" / "gearbox" / "slotted.toml")


def test_layers_err_with_the_fourth_power_of_their_thickness_and_the_overlap(case, two_stages):
    layers = replace(EVEN, gear=replace(EVEN.gear, width_layers=4))
    swept = extent(case)
    widths = [16 / 2.7, extent(two_stages)["width"][1]]
    assert swept["width"] == pytest.approx(widths[:1])
    assert growth(layers, EVEN, [case], swept) == 1.0
    overlap = extent(two_stages)["overlap"][1] / swept["overlap"][0]
    assert growth(layers, EVEN, [case, two_stages], swept) == pytest.approx(overlap * (widths[1] / widths[0]) ** 4)
    assert growth(layers, EVEN, [two_stages], None) == 1.0


def test_layers_of_blanks_err_with_the_third_power_of_their_thickness(case, two_stages):
    few = replace(REFERENCE, gear=replace(REFERENCE.gear, width_layers=3))
    swept, wide = extent(case), extent(two_stages)["width"][1]
    ratio = wide / swept["width"][0]
    assert growth(few, REFERENCE, [two_stages], swept) == pytest.approx(ratio**3, rel=0.02)


def test_slices_of_faces_that_overlap_more_err_as_their_sum_differs_from_the_integral(case, two_stages):
    """b sin β/(π m): 0.33 of the swept stage, 0.82 of the second one; the base's own slices count on both sides."""
    slices, swept = replace(REFERENCE, gear=replace(REFERENCE.gear, slices=8)), extent(case)
    overlaps = [16e-3 * np.sin(np.radians(10.0)) / (np.pi * 2.7e-3), extent(two_stages)["overlap"][1]]
    assert swept["overlap"] == pytest.approx(overlaps[:1])
    few, many = (np.pi * np.array(overlaps) / count for count in (8, REFERENCE.gear.slices))
    narrow, wide = np.sqrt((few / np.sin(few) - 1) ** 2 - (many / np.sin(many) - 1) ** 2)
    assert growth(slices, REFERENCE, [two_stages], swept) == pytest.approx(wide / narrow)


def test_a_sweep_that_does_not_tell_what_errors_grow_with_is_refused(case, two_stages):
    """No overlap counted as a spur gear would make slices of helical gears exact."""
    slices = replace(REFERENCE, gear=replace(REFERENCE.gear, slices=8))
    with pytest.raises(InputError, match=r"states wave, width of its case, but .*measure it again"):
        growth(slices, REFERENCE, [two_stages], {"width": extent(case)["width"], "wave": 0.1116})
    with pytest.raises(InputError, match=r"measure it again"):
        growth(slices, REFERENCE, [two_stages], extent(case) | {"wave": "0.1116"})


def test_elements_of_the_housing_err_with_the_square_of_their_size_over_the_wave(case):
    coarse = replace(REFERENCE, housing=replace(REFERENCE.housing, element_size=0.013))
    high = replace(case, band=replace(case.band, high=16_000.0))  # waves of half the length
    assert growth(coarse, REFERENCE, [high], extent(case)) == pytest.approx(4.0)


def test_thin_layers_of_wide_teeth_close_the_tenth_harmonic(two_stages):
    """The same harmonic at the presets, whose teeth have layers of at most 0.75 to 1.5 modules."""
    assert open_below(REFERENCE, two_stages)[1] == pytest.approx(1.37, abs=0.01)
    assert open_below(DRAFT, two_stages)[1] == pytest.approx(4.99, abs=0.01)
