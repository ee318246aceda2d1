"""The sweep that tolerances are planned from: of the presets as they are, and still true where it is measured again."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.scene import plan
from nvhchain.tradeoff import cheapest, knobs_of, planner, records, shipped_sweep, variants
from nvhchain.tradeoff.extrapolation import extent

SMALL = "cases/small/single_stage.toml"


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / SMALL)


@pytest.fixture(scope="module")
def sweep():
    return shipped_sweep()


def test_rows_are_settings_of_today_around_the_reference_of_today(case, sweep):
    assert (sweep.case, sweep.base) == (case.name, "reference")
    known = {(knob, value) for knob, value, _ in (*variants(case, REFERENCE), *records(case))}
    rows = [(row.knob, row.value) for row in sweep.measurements[1:]]
    assert len(rows) == len(set(rows))
    assert set(rows) <= known
    planner.base_error(sweep, case)
    cheapest(case, 3.0)  # refuses a base that is no longer what was measured


def test_what_errors_grow_with_is_told_of_the_swept_case(case, sweep):
    told, here = sweep.origin.extent, extent(case)
    assert set(told) == set(here)
    assert all(told[name] == pytest.approx(here[name], rel=1e-3) for name in here)


def test_the_table_in_the_documentation_is_that_of_the_numbers(request, sweep):
    from nvhchain.tradeoff import markdown

    table = (request.config.rootpath / "docs/measured/chain/tradeoff_single-stage.md").read_text()
    assert markdown(sweep) in table


def test_standard_was_within_one_decibel(sweep):
    (row,) = [row for row in sweep.measurements if (row.knob, row.value) == ("preset", "standard")]
    assert max(abs(row.deviation.overall), abs(row.deviation.worst_order)) < 1.0


@pytest.mark.parametrize("fidelity", [DRAFT, STANDARD, REFERENCE], ids=lambda preset: preset.name)
def test_the_plan_was_right_within_a_factor_of_two(case, sweep, fidelity):
    """Processor seconds of every stage of a second or more and of all together, and peak memory, as measured."""
    (row,) = [row for row in sweep.measurements if row.value == fidelity.name]
    planned = plan(case, fidelity=fidelity)
    for stage in planned.steps:
        measured = row.stages.get(stage.name.replace(" ", "_"))
        if measured is not None and measured.processor >= 1.0:
            assert 0.5 <= stage.seconds / measured.processor <= 2.0, stage.name
            assert 0.5 <= stage.megabytes / measured.megabytes <= 2.0, stage.name
    assert {"housing", "mesh_law_stage", "transfer_vectors"} <= set(row.stages)
    assert 0.5 <= planned.seconds / row.processor <= 2.0
    assert 0.5 <= planned.megabytes / row.megabytes <= 2.0


@pytest.mark.parametrize("tolerance", [1.0, 2.0, 3.0])
def test_a_tolerance_is_planned_for_in_less_time_than_the_reference(case, sweep, tolerance):
    choice = cheapest(case, tolerance)
    assert choice.expected_error_db <= planner.SHARE * tolerance
    assert choice.expected_seconds < 0.8 * choice.base_seconds
    closer = max(0.5 * tolerance, planner.base_error(sweep, case))
    assert choice.expected_seconds <= cheapest(case, closer).expected_seconds
    assert set(choice.settings) <= {"preset", *(knob.name for knob in knobs_of(case))}


def test_no_tolerance_finer_than_the_reference_is_known_is_promised(case, sweep):
    best = planner.base_error(sweep, case)
    assert 0 < best < 1.0
    with pytest.raises(InputError, match="the best there is, reference"):
        cheapest(case, 0.99 * best)
    forces = replace(case, quantities=("bearing_forces",), field_points=())
    cheapest(forces, 1.01 * planner.base_error(sweep, forces))


@pytest.mark.parametrize("name", ["slotted", "run_up_slotted"])
def test_a_decibel_is_planned_for_in_the_gearbox_of_the_examples(request, sweep, name):
    """The commands of docs/explanation/accuracy.md."""
    case = nvh.load_case(request.config.rootpath / "cases" / "gearbox" / f"{name}.toml")
    choice = cheapest(case, 1.0)
    assert not choice.same_case
    assert choice.expected_error_db <= planner.SHARE
    assert choice.expected_seconds <= choice.base_seconds
