"""The step table: one order, and a function and a field of the result for every row."""

import dataclasses
from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.case import FIELD_POINT_QUANTITIES, RADIATED
from nvhchain.chain import Result
from nvhchain.chain.steps import MADE_BY
from nvhchain.chain.supplied import Supplied
from nvhchain.scene.planning import COSTS
from nvhchain.scene.steps import BEARING_FORCES, STEPS, SURFACE_VELOCITY, Scene


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


def test_every_row_has_its_function_and_its_field_of_the_result():
    assert set(MADE_BY) == set(STEPS)
    assert set(COSTS) <= set(STEPS)
    fields = {field.name for field in dataclasses.fields(Result)}
    assert {step.name for step in STEPS} == fields - {"case", "fidelity", "supplied", "decision"}
    assert {step.name for step in STEPS if step.can_be_supplied} == Supplied.__annotations__.keys()


@pytest.mark.parametrize("radiation", ["boundary_elements", "equivalent_radiated_power"])
@pytest.mark.parametrize("options", [{}, {"tilt": True}, {"friction": 0.05, "loaded_misalignment": True}])
def test_each_step_comes_after_what_it_needs(case, options, radiation):
    everything = tuple({"bearing_forces", "surface_velocity", *FIELD_POINT_QUANTITIES, *RADIATED})
    asked = replace(case, quantities=everything, options=replace(case.options, **options))
    fidelity = replace(nvh.DRAFT, acoustics=replace(nvh.DRAFT.acoustics, radiation=radiation))
    scene = Scene(asked, fidelity)
    made = set()
    for step in scene.steps:
        assert made.issuperset(step.needs(scene)), step.name
        made.add(step)


def test_supplied_hand_offs_leave_out_what_only_they_need(case):
    assert SURFACE_VELOCITY in Scene(case, nvh.DRAFT).steps
    given = Scene(case, nvh.DRAFT, ["surface_velocity"]).steps
    assert [step.name for step in given] == ["transfer_vectors", "pressure"]
    rigid = replace(case, quantities=("bearing_forces",), options=replace(case.options, rigid_housing=True))
    assert [step.name for step in Scene(rigid, nvh.DRAFT).steps] == ["mesh_laws", "bearing_forces", "force_spectrum"]
    assert BEARING_FORCES not in Scene(rigid, nvh.DRAFT, ["bearing_forces"]).steps
