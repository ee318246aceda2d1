"""At slow speeds a mesh law has the harmonics that the band holds, where this costs next to nothing."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import gear
from nvhchain.case import Ramp
from nvhchain.error_band.gears import force_error
from nvhchain.gear import Slots
from nvhchain.scene import plan
from nvhchain.scene.mechanics import law_knobs
from nvhchain.testing.coarse_runs import TINY, small_gearbox
from nvhchain.tradeoff.extrapolation import open_below

ANGLES = TINY.gear.angles_per_mesh


def at(case, rpm, **changes):
    return replace(case, operation=replace(case.operation, input_speed=rpm * pi / 30, **changes))


def angles(case):
    return law_knobs(case, 0, TINY.gear).angles_per_mesh


@pytest.mark.parametrize(("rpm", "factor"), [(1251.0, 1), (1249.0, 2), (683.0, 2), (681.0, 4), (1.0, 32)])
def test_a_law_has_three_angles_for_every_harmonic_in_the_band(rpm, factor):
    """The band of 2500 Hz holds 6 harmonics of 20 teeth at 1250 rpm, 11 at 682 rpm; 512 angles are the most."""
    assert angles(at(small_gearbox(), rpm)) == factor * ANGLES


def test_a_run_up_counts_with_its_mean_speed():
    case = at(small_gearbox(), 100.0, ramp=Ramp(end_speed=3000.0 * pi / 30, duration=1.0))
    assert angles(case) == ANGLES


def test_a_law_of_many_angles_or_slices_is_not_refined():
    """Seven slots under 30 teeth make a law of 30 mesh periods."""
    case = small_gearbox()
    pinion, wheel = case.gears
    slots = Slots(7, 1.2 * wheel.geometry.bore_radius, 0.8 * wheel.geometry.root_radius, 0.2)
    slotted = replace(case, gears=(pinion, replace(wheel, blank=slots)))
    assert slotted.pairs[0].meshes_per_body_period == 30
    assert angles(at(slotted, 100.0)) == ANGLES
    assert law_knobs(at(case, 100.0), 0, replace(TINY.gear, slices=1000)) == replace(TINY.gear, slices=1000)
    assert law_knobs(at(slotted, 100.0), 0, nvh.STANDARD.gear) == nvh.STANDARD.gear


def test_a_slow_speed_is_planned_and_computed_with_a_law_of_finer_angles_which_errs_less():
    """Harmonics that the law lacks have an error of several times themselves."""
    case = replace(at(small_gearbox(), 500.0), quantities=("bearing_forces",))
    knobs = replace(TINY, gear=replace(TINY.gear, bodies="analytic"))
    (step,) = (one for one in plan(case, fidelity=knobs).steps if one.name.startswith("mesh law"))
    assert f"{4 * ANGLES} angles" in step.models
    case = replace(case, options=replace(case.options, rigid_housing=True))
    slow = nvh.run(case, fidelity=knobs)
    assert len(slow.mesh_laws[0].angle) == 4 * ANGLES
    coarse = gear.mesh_law(case.pairs[0], nominal_force=gear.law_load(case.mesh_forces[0]), fidelity=knobs.gear)
    orders = 20.0 * np.arange(9.0, 16.0)  # the band holds 15 harmonics, 16 angles hold 8
    elements = TINY.gear
    fine, missing = (force_error(case, [law], elements, 300.0).relative(orders) for law in (slow.mesh_laws[0], coarse))
    assert (fine < missing / 3).all()


def test_the_planner_judges_the_law_that_a_slow_speed_has():
    """At 600 rpm the law has 128 angles, whatever 64 alone would leave open."""
    case = at(small_gearbox(5000.0), 600.0)
    (fine,) = open_below(nvh.DRAFT, case)
    (same,) = open_below(replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, angles_per_mesh=128)), case)
    assert law_knobs(case, 0, nvh.DRAFT.gear).angles_per_mesh == 128
    assert fine == same < np.inf
