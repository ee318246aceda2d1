"""The plan says which part of the limits will be the largest, and what narrows it."""

import re
from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain import error_band
from nvhchain.case import Ramp, Spread
from nvhchain.fidelity import PRESETS
from nvhchain.scene import modelled
from nvhchain.scene.expected_limits import COVERAGE, limit_lines
from nvhchain.testing.coarse_runs import small_gearbox


def lines(case, fidelity=nvh.DRAFT):
    return limit_lines(modelled(case, fidelity), fidelity)


def test_every_preset_has_numbers_and_finer_ones_are_narrower():
    ranges = [re.findall(r"−([\d.]+)…\+([\d.]+) dB", lines(small_gearbox(), preset)[0]) for preset in PRESETS.values()]
    limits = [[float(value) for value in one[0]] for one in ranges]
    assert limits[0] > limits[1] > limits[2]
    assert [float(value) for value in ranges[0][2]] == limits[1]  # the next finer one is named


def test_other_knobs_have_no_numbers_of_their_own():
    knobs = replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, slices=16))
    assert lines(small_gearbox(), knobs)[0].startswith("numerical: not measured with these knobs")


@pytest.mark.parametrize(("factor", "first"), [(3.0, "uncertain inputs: about "), (1.001, "numerical: ")])
def test_the_largest_part_stands_first(factor, first):
    spread = Spread(bearing_stiffness=factor, damping=1.0, friction=1.0)
    found = lines(replace(small_gearbox(), spread=spread))
    assert found[0].startswith(first)
    assert len(found) == 2
    assert "most from bearing stiffness; a narrower [spread]" in "".join(found)


def test_what_is_left_out_is_a_part_with_twice_its_estimate():
    """An eighth of the amplitude is left out: limits count 25 %, 1.9 dB up and 2.5 dB down."""
    case = small_gearbox()
    case = replace(case, options=replace(case.options, loaded_misalignment="auto", gyroscopic="auto"))
    decision = modelled(case, nvh.DRAFT)
    assert decision.excluded_error.mean > 0.0

    def excluded(mean):
        some = replace(decision, excluded_error=replace(decision.excluded_error, mean=mean))
        return [line for line in limit_lines(some, nvh.DRAFT) if line.startswith("excluded options: about ")]

    assert "−2.5 and +1.9 dB" in excluded(0.125)[0]
    assert "+6.8 dB, without lower limit" in excluded(0.6)[0]
    assert excluded(0.0) == []
    assert COVERAGE == error_band.COVERAGE


def test_a_spread_without_effect_and_bearings_without_damping_say_so():
    spread = Spread(bearing_stiffness=1.0, damping=1.0, friction=1.0)
    assert lines(replace(small_gearbox(), spread=spread))[1].endswith("their spread changes no level")
    assert lines(small_gearbox())[1].endswith("the case states no [spread]")
    still = tuple(replace(one, radial_damping=0.0, axial_damping=0.0) for one in small_gearbox().bearings)
    bare = replace(small_gearbox(), bearings=still)
    assert bare.undamped
    (line,) = (one for one in lines(bare) if one.startswith("uncertain inputs"))
    assert "the damping of bearings, which the case lacks, narrows it" in line


def test_run_ups_and_forces_alone_have_none():
    case = small_gearbox()
    ramp = replace(case.operation, ramp=Ramp(end_speed=300.0, duration=1.0))
    assert lines(replace(case, operation=ramp)) == ()
    assert lines(replace(case, quantities=("bearing_forces",))) == ()


def test_the_printed_plan_ends_with_them():
    text = str(nvh.plan(small_gearbox(), fidelity=nvh.DRAFT))
    assert "95 % limits to expect, the largest part first:\n  numerical: −" in text
