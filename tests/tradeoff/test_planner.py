"""The planner on a table that is made up: what it turns, what it leaves, and what it promises."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.fidelity import REFERENCE
from nvhchain.tradeoff import Deviation, Measurement, Tradeoff, cheapest
from nvhchain.tradeoff.measure import Cost

BASE = {"mesh_law_stage": 60.0, "housing": 30.0, "transfer_vectors": 10.0}


def row(knob, value, overall, worst, **stages):
    costs = {stage: Cost(stages.get(stage, seconds), 500.0) for stage, seconds in BASE.items()}
    return Measurement(knob, value, costs, Deviation(overall, worst, 1000.0, {20.0: worst}))


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


@pytest.fixture
def sweep():
    base = Measurement("base", "reference", {stage: Cost(s, 500.0) for stage, s in BASE.items()}, None)
    rows = (
        row("gear.width_layers", "4", 0.5, -2.0, mesh_law_stage=15.0),
        row("gear.width_layers", "8", 0.02, 0.1, mesh_law_stage=30.0),
        row("gear.slices", "16", 0.01, -0.05, mesh_law_stage=54.0),
        row("gear.deflections", "24", 0.0, 0.3, mesh_law_stage=59.9),
        row("housing.element_size", "0.013", -0.2, 0.4, housing=12.0),
        row("acoustics.precision", "single", 0.0, 0.0, transfer_vectors=7.0),
        row("dynamics.stored_samples_per_period", "2.56", 0.0, 0.0, housing=1.0),
        row("preset", "draft", 1.0, 2.5, mesh_law_stage=5.0, housing=5.0),
    )
    return Tradeoff("single-stage", "reference", (base, *rows))


def test_one_decibel_buys_the_gentle_settings_and_their_errors_and_times_add_up(case, sweep):
    choice = cheapest(case, 1.0, sweep)
    assert choice.turned == {
        "acoustics.precision": "single",
        "gear.width_layers": "8",
        "housing.element_size": "0.013",
        "gear.slices": "16",
    }
    assert choice.expected_error_db == pytest.approx(0.1 + 0.4 + 0.05)
    assert choice.expected_seconds == pytest.approx(60 * 0.5 * 0.9 + 12 + 7)
    assert choice.base_seconds == 100.0
    assert choice.fidelity.gear.width_layers == 8
    assert choice.fidelity.gear.slices == 16
    assert choice.fidelity.gear.deflections == REFERENCE.gear.deflections
    assert choice.fidelity.housing.element_size == 0.013
    assert choice.fidelity.acoustics.precision == "single"
    assert "gear.width_layers = 8" in str(choice)
    assert "housing.element_size" not in cheapest(case, 0.75, sweep).turned  # 0.55 dB exceed the share of 0.75 dB


def test_a_wide_tolerance_buys_the_coarse_setting_instead_and_never_two_of_one_knob(case, sweep):
    choice = cheapest(case, 5.0, sweep)
    assert choice.turned["gear.width_layers"] in ("4", "8")
    assert choice.expected_error_db <= 0.7 * 5.0
    assert cheapest(case, 5.0, sweep).expected_seconds < cheapest(case, 1.0, sweep).expected_seconds + 1e-9


def test_hardly_any_tolerance_leaves_all_but_what_costs_nothing(case, sweep):
    choice = cheapest(case, 0.01, sweep)
    assert choice.turned == {"acoustics.precision": "single"}
    nothing = replace(sweep, measurements=sweep.measurements[:2])
    assert cheapest(case, 0.01, nothing).fidelity.gear == REFERENCE.gear
    assert "every knob as in the base" in str(cheapest(case, 0.01, nothing))


def test_what_the_case_does_not_look_at_is_not_turned(case, sweep, sphere):
    assert "dynamics.stored_samples_per_period" not in cheapest(case, 5.0, sweep).turned
    assert set(cheapest(sphere, 5.0, sweep).turned) == {"acoustics.precision"}


def test_no_tolerance_or_a_base_without_name_is_refused(case, sweep):
    with pytest.raises(InputError, match="must be positive"):
        cheapest(case, 0.0, sweep)
    with pytest.raises(InputError, match="is no preset"):
        cheapest(case, 1.0, replace(sweep, base="mine"))
