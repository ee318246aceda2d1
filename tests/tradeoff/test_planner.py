"""The planner on a table that is made up: what it turns, what it leaves, and what it promises."""

import json
from contextlib import nullcontext
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import RadiatorCase
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.files import hdf5
from nvhchain.scene import PlannedStep, plan, steps
from nvhchain.tradeoff import Deviation, Measurement, Tradeoff, as_json, cheapest, markdown, planner, shipped
from nvhchain.tradeoff.extrapolation import MARGIN, open_below
from nvhchain.tradeoff.knobs import knobs_by_package
from nvhchain.tradeoff.measure import Cost
from nvhchain.tradeoff.sweep import SweepOrigin, case_identity

BASE = {"mesh_law_stage": 60.0, "housing": 30.0, "transfer_vectors": 10.0}
SCENE = {"mesh law stage": 60.0, "housing": 60.0, "bearing forces": 6.0, "transfer vectors": 74.0}
"""s by step of what is planned for: another mix than that of the sweep."""
STEP = dict(zip(SCENE, (steps.MESH_LAWS, steps.HOUSING, steps.BEARING_FORCES, steps.TRANSFER_VECTORS), strict=True))


CONVERGED = {
    "dynamics.contact_residual": ("1e-06", "1e-09"),
    "housing.elements_per_turn": ("8", "12"),
    "acoustics.singular_order": ("2", "3"),
}
"""Knobs of the other stages that move nothing and save nothing, by which the base is known there."""


def cost(seconds):
    """Wall time is what other work on the machine makes of it."""
    return Cost(7.0, seconds, 500.0)


def row(knob, value, overall, worst, **stages):
    costs = {stage: cost(stages.get(stage, seconds)) for stage, seconds in BASE.items()}
    return Measurement(knob, value, costs, Deviation(overall, worst, 1000.0, {20.0: worst}))


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


@pytest.fixture
def sweep():
    base = Measurement("base", "reference", {stage: cost(s) for stage, s in BASE.items()}, None)
    rows = (
        row("gear.width_layers", "3", 0.5, -2.0, mesh_law_stage=15.0),
        row("gear.width_layers", "4", 0.02, 0.1, mesh_law_stage=30.0),
        row("gear.row_aspect", "2.5", 0.01, -0.05, mesh_law_stage=54.0),
        row("gear.deflections_per_doubling", "4", 0.0, 0.3, mesh_law_stage=59.9),
        row("dynamics.path_correction", "True", 0.4, 0.4),
        row("housing.element_size", "0.013", -0.2, 0.4, housing=12.0),
        row("acoustics.precision", "single", 0.0, 0.0, transfer_vectors=7.0),
        row("dynamics.stored_samples_per_period", "2.56", 0.0, 0.0, housing=1.0),
        row("gear.contact_residual", "1e-05", 0.0, 0.0),
        row("gear.contact_residual", "1e-07", 0.0, 0.0),
        *(row(knob, value, 0.0, 0.0) for knob, values in CONVERGED.items() for value in values),
        row("preset", "draft", 1.0, 2.5, mesh_law_stage=50.0, housing=20.0),
    )
    return Tradeoff("single-stage", "reference", (base, *rows))


@pytest.fixture(autouse=True)
def scene(monkeypatch):
    """What the stages of every case take, and for which fidelity that was asked."""
    asked = []

    def planned_steps(scene):
        case = scene.case
        asked.append(scene.fidelity)
        silent = not {"pressure", "sound_power", "directivity"}.intersection(case.quantities)
        names = ["transfer vectors"] if isinstance(case, RadiatorCase) else list(SCENE)
        return tuple(
            PlannedStep(STEP[name], name, "", SCENE[name], 1.0)
            for name in names
            if name != "transfer vectors" or not silent
        )

    monkeypatch.setattr(planner, "planned_steps", planned_steps)
    return asked


@pytest.fixture(autouse=True)
def swept_case(monkeypatch):
    """Every case counts as the one that was swept."""
    monkeypatch.setattr(planner, "is_swept", lambda cases, sweep: True)


@pytest.fixture
def two_stages(request):
    return nvh.load_case(request.config.rootpath / "cases" / "gearbox" / "slotted.toml")


def test_one_decibel_buys_the_gentle_settings_and_their_errors_add_up(case, sweep, scene):
    choice = cheapest(case, 1.0, sweep)
    assert choice.settings == {
        "acoustics.precision": "single",
        "gear.width_layers": "4",
        "housing.element_size": "0.013",
        "gear.row_aspect": "2.5",
    }
    assert choice.expected_error_db == pytest.approx(0.1 + 0.4 + 0.05)
    assert choice.fidelity.gear.width_layers == 4
    assert choice.fidelity.gear.row_aspect == 2.5
    assert choice.fidelity.gear.deflections_per_doubling == REFERENCE.gear.deflections_per_doubling
    assert choice.fidelity.housing.element_size == 0.013
    assert choice.fidelity.acoustics.precision == "single"
    assert choice.fidelity.dynamics == REFERENCE.dynamics
    assert "gear.width_layers = 4 (0.1 dB)" in str(choice)
    assert "gear.row_aspect" not in cheapest(case, 0.75, sweep).settings  # 0.55 dB exceed the share of 0.75 dB
    assert set(scene) == {REFERENCE}


def test_seconds_are_those_of_the_scene_times_what_the_sweep_leaves_of_each_stage(case, sweep):
    """Wall times of the sweep, all alike here, are not looked at."""
    choice = cheapest(case, 1.0, sweep)
    assert choice.expected_seconds == pytest.approx(60 * (30 / 60) * (54 / 60) + 60 * (12 / 30) + 6 + 74 * (7 / 10))
    assert choice.base_seconds == 200.0


def test_several_cases_are_run_alike_and_their_times_add_up(case, sweep):
    one, both = cheapest(case, 1.0, sweep), cheapest([case, replace(case, name="other")], 1.0, sweep)
    assert both.fidelity == one.fidelity
    assert cheapest(iter([case]), 1.0, sweep) == one
    assert both.expected_seconds == pytest.approx(2 * one.expected_seconds)


def test_a_wide_tolerance_turns_further_and_never_two_settings_of_one_knob(case, sweep):
    """8 layers save more per error, 6 more in all."""
    choice = cheapest(case, 5.0, sweep)
    assert choice.settings["gear.width_layers"] == "3"
    assert choice.fidelity.gear.width_layers == 3
    assert choice.expected_error_db == pytest.approx(2.0 + 0.4 + 0.05)
    assert choice.expected_seconds == pytest.approx(60 * (15 / 60) * (54 / 60) + 60 * (12 / 30) + 6 + 74 * (7 / 10))
    assert choice.expected_seconds < cheapest(case, 1.0, sweep).expected_seconds


def test_a_preset_is_taken_where_it_keeps_to_the_tolerance_and_is_quicker(case, sweep):
    quick = row("preset", "standard", 0.2, -0.6, mesh_law_stage=10.0, housing=6.0)
    swept = replace(sweep, measurements=(*sweep.measurements, quick))
    choice = cheapest(case, 1.0, swept)
    assert choice.settings == {"preset": "standard"}
    assert knobs_by_package(choice.fidelity) == knobs_by_package(STANDARD)
    assert choice.expected_error_db == pytest.approx(0.6)
    assert choice.expected_seconds == pytest.approx(60 * (10 / 60) + 60 * (6 / 30) + 6 + 74)
    assert "preset = standard (0.6 dB)" in str(choice)
    assert "preset" not in cheapest(case, 0.8, swept).settings  # 0.6 dB exceed the share of 0.8 dB
    unknown = row("preset", "of another version", 0.0, 0.0, mesh_law_stage=1.0)
    assert cheapest(case, 1.0, replace(swept, measurements=(*swept.measurements, unknown))) == choice


def test_no_choice_within_the_share_of_the_tolerance_would_be_quicker_by_more_than_the_smallest_gain(case, sweep):
    """Against all combinations."""
    settings = {"gear.width_layers": [(1, 0), (0.25, 2), (0.5, 0.1)], "gear.row_aspect": [(1, 0), (0.9, 0.05)]}
    for tolerance in (0.3, 0.5, 0.75, 1.0, 3.0, 4.0, 5.0):
        quickest = min(
            60 * a * b + 60 * c + 6 + 74 * 0.7
            for (a, e), (b, f) in product(*settings.values())
            for c, g in ((1, 0), (0.4, 0.4))
            if e + f + g <= 0.7 * tolerance
        )
        assert cheapest(case, tolerance, sweep).expected_seconds <= quickest + planner.SMALLEST_GAIN * 200


def test_a_small_tolerance_leaves_all_but_what_costs_nothing(case, sweep):
    choice = cheapest(case, 0.11, sweep)
    assert choice.settings == {"acoustics.precision": "single", "gear.row_aspect": "2.5"}
    nothing = replace(sweep, measurements=(sweep.measurements[0], *sweep.measurements[-9:-1]))
    assert knobs_by_package(cheapest(case, 0.01, nothing).fidelity) == knobs_by_package(REFERENCE)
    assert "every knob as in reference: no other setting saves 1 %" in str(cheapest(case, 0.01, nothing))


def test_a_tolerance_finer_than_the_base_is_known_is_refused_with_the_best_there_is(case, sweep):
    """The last step of the only knob with two steps, 8 layers to those of the base, moved the result by 0.1 dB."""
    with pytest.raises(InputError, match=r"0.09 dB is not reached.* reference, is itself known to 0.1 dB"):
        cheapest(case, 0.09, sweep)
    assert cheapest(case, 0.1, sweep).base_error_db == pytest.approx(0.1)
    second = (row("gear.row_aspect", "1.5", 0.0, -0.24), *sweep.measurements[-1:])
    assert planner.base_error(replace(sweep, measurements=(*sweep.measurements[:-1], *second)), case) == pytest.approx(
        0.26
    )


def test_a_stage_of_which_the_sweep_tells_nothing_is_refused(case, sweep, sphere):
    """No error would be added up there, and the base would seem exact."""
    without = tuple(row for row in sweep.measurements if row.knob != "acoustics.singular_order")
    with pytest.raises(InputError, match="no converging knob of acoustics"):
        cheapest(sphere, 1.0, replace(sweep, measurements=without))
    asked = replace(case, quantities=("bearing_forces",), field_points=())
    cheapest(asked, 1.0, replace(sweep, measurements=without))


def test_the_least_tolerance_that_a_refusal_names_is_not_refused(case, sweep):
    """0.1204 dB in two digits are 0.12, of which as much is missing."""
    coarse = replace(sweep, measurements=(*sweep.measurements, row("gear.row_aspect", "1.5", 0.0, 0.06704)))
    assert planner.base_error(coarse, case) == pytest.approx(0.1204, abs=1e-5)
    with pytest.raises(InputError) as refused:
        cheapest(case, 0.1, coarse)
    least = float(str(refused.value).split("ask for ")[1].split(" dB")[0])
    assert least == 0.13
    cheapest(case, least, coarse)


def test_thin_walls_of_which_the_base_warns_itself_leave_all_that_warns_of_nothing_more(case, sweep):
    """9 mm elements are too stiff in walls of 1.7 mm, 13 mm elements still more."""
    thin = replace(case, housing=replace(case.housing, wall=1.7e-3, end_wall=1.7e-3))
    everything = set(cheapest(case, 1.0, sweep).settings)
    assert set(cheapest(thin, 1.0, sweep).settings) == everything - {"housing.element_size"}


def test_what_the_base_cannot_do_is_refused(case, sweep):
    soft = replace(case.housing.material, young=3e9)
    thin = replace(case.housing, wall=1e-3, end_wall=1e-3, material=soft)
    with pytest.raises(InputError, match="per bending wavelength"):
        cheapest(replace(case, housing=thin, band=replace(case.band, high=20_000.0)), 60.0, sweep)


def test_cheaper_levels_of_radiation_of_which_a_run_warns_are_never_chosen(case, sweep):
    row_ = row("acoustics.radiation", "rayleigh", 0.0, 0.0, transfer_vectors=0.1)
    swept = replace(sweep, measurements=(*sweep.measurements, row_))
    assert "acoustics.radiation" not in cheapest(case, 99.0, swept).settings


@pytest.mark.parametrize(
    ("given", "seconds", "knobs"),
    [
        ((), {"housing", "mesh law stage", "bearing forces", "transfer vectors", "velocity, pressure"}, "gha"),
        (("mesh_laws",), {"housing", "bearing forces", "transfer vectors", "velocity, pressure"}, "ha"),
        (("bearing_forces",), {"housing", "transfer vectors", "velocity, pressure"}, "ha"),
        (("housing",), {"mesh law stage", "bearing forces", "transfer vectors", "velocity, pressure"}, "ga"),
        (("mesh_laws", "housing", "transfer_vectors"), {"bearing forces", "velocity, pressure"}, ""),
    ],
)
def test_what_is_handed_in_is_neither_counted_nor_turned(case, sweep, monkeypatch, given, seconds, knobs):
    monkeypatch.undo()
    planned = {step.name: step.seconds for step in plan(case, fidelity=REFERENCE).steps}
    points = [row("acoustics.interpolation_points", value, 0.0, 0.0) for value in ("4", "6")]
    choice = cheapest(case, 6.0, replace(sweep, measurements=(*sweep.measurements, *points)), supplied=given)
    assert choice.base_seconds == pytest.approx(sum(planned[name] for name in seconds))
    assert {name[0] for name in choice.settings} == set(knobs)


def test_no_case_is_refused(sweep):
    with pytest.raises(InputError, match="no case"):
        cheapest([], 1.0, sweep)


def test_in_another_case_errors_grow_as_much_as_they_did_where_they_were_held_out(case, sweep, monkeypatch):
    monkeypatch.setattr(planner, "is_swept", lambda cases, sweep: False)
    choice = cheapest(case, 6.0, sweep)
    assert choice.settings == {
        "acoustics.precision": "single",
        "gear.width_layers": "4",
        "housing.element_size": "0.013",
        "gear.row_aspect": "2.5",
    }
    assert choice.expected_error_db == pytest.approx(MARGIN * (0.1 + 0.4 + 0.05))
    assert choice.base_error_db == pytest.approx(0.1)
    assert "margin for other cases" in str(choice)
    assert cheapest(case, 50.0, sweep).errors["gear.width_layers"] == pytest.approx(MARGIN * 2.0)
    with pytest.raises(InputError, match=r"known to 0.1 dB"):
        cheapest(case, 0.09, sweep)


def test_only_the_very_case_that_was_swept_goes_without_the_margin(case, sweep, monkeypatch):
    monkeypatch.undo()
    recorded = replace(sweep, origin=SweepOrigin(case_identity(case)))
    assert planner.is_swept([replace(case, folder="elsewhere")], recorded)
    assert not planner.is_swept([case, replace(case, name="other")], recorded)
    assert not planner.is_swept([case], sweep)


def test_more_field_points_find_larger_errors_of_the_acoustics_and_no_others(case, sweep):
    rows = (
        row("acoustics.quadrature_order", "3", 0.1, 0.1, transfer_vectors=5.0),
        row("gear.width_layers", "4", 0.1, 0.1, mesh_law_stage=30.0),
    )
    sweep = replace(sweep, measurements=(*sweep.measurements, *rows))
    there = replace(case.field_points[0], name="there", position=(2.0, 0.0, 0.0))
    errors = [
        cheapest(replace(case, field_points=points), 5.0, sweep).errors
        for points in (case.field_points, (*case.field_points, *(replace(there, name=f"{i}") for i in range(8))))
    ]
    assert errors[1]["acoustics.quadrature_order"] == pytest.approx(3.0 * errors[0]["acoustics.quadrature_order"])
    assert errors[1]["gear.width_layers"] == pytest.approx(errors[0]["gear.width_layers"])


def test_names_that_a_run_does_not_know_are_refused(case, sweep):
    with pytest.raises(InputError, match=r"given = mesh_law: a run starts from .*mesh_laws, .*, by these names"):
        cheapest(case, 5.0, sweep, supplied=["mesh_law"])


@pytest.mark.parametrize("tolerance", [0.5, 1.0, 3.0])
def test_wide_gears_do_not_get_the_layers_that_narrow_ones_get(two_stages, sweep, monkeypatch, tolerance):
    """16/2.7 modules wide as swept, 3 layers of blanks cost 0.1 dB; the second stage's gears are 14.9 modules wide."""
    monkeypatch.setattr(planner, "is_swept", lambda cases, sweep: False)
    rows = [one for one in sweep.measurements if one.knob != "gear.width_layers"]
    rows[1:1] = [row("gear.width_layers", "3", -0.05, -0.1, mesh_law_stage=15.0)]
    narrow = replace(sweep, measurements=tuple(rows))
    assert cheapest(two_stages, 1.0, narrow).settings["gear.width_layers"] == "3"
    wide = replace(narrow, origin=SweepOrigin(extent={"width": [16 / 2.7], "overlap": [0.3275], "wave": 0.1116}))
    assert "gear.width_layers" not in cheapest(two_stages, tolerance, wide).settings


@pytest.mark.parametrize(("tolerance", "slices"), [(1.5, "32"), (2.2, "16")])
def test_slices_are_not_taken_whose_error_band_grows_by_more_than_the_tolerance(case, sweep, tolerance, slices):
    """Measured to cost nothing, 16 slices leave the 10th harmonic 2.3 dB open, 32 leave 0.5 dB, 48 leave 0.3 dB."""
    rows = [one for one in sweep.measurements if one.knob != "gear.slices"]
    saved = {"8": 10.0, "16": 20.0, "32": 30.0}
    rows[1:1] = [row("gear.slices", value, 0.0, 0.0, mesh_law_stage=left) for value, left in saved.items()]
    free = replace(sweep, measurements=tuple(rows))
    there = replace(case, operation=replace(case.operation, input_speed=1137 * np.pi / 30))
    assert cheapest(there, tolerance, free).settings["gear.slices"] == slices
    limits = {
        count: open_below(replace(REFERENCE, gear=replace(REFERENCE.gear, slices=int(count))), there)[0]
        for count in saved
    }
    assert all(
        (below < tolerance + open_below(REFERENCE, there)[0]) == (int(n) >= int(slices)) for n, below in limits.items()
    )
    given = cheapest(there, tolerance, free, supplied=("mesh_laws",))
    assert "gear.slices" not in given.settings
    coarse = replace(REFERENCE, gear=replace(REFERENCE.gear, bodies="analytic"))
    assert open_below(coarse, there) == [np.inf]


def test_harmonics_of_which_the_base_knows_less_than_the_tolerance_bind_nothing(two_stages, sweep):
    """The tenth of the second stage, whose gears are wide, is 1.4 dB open at `reference`, 3.6 dB with 32 slices."""
    assert open_below(REFERENCE, two_stages) == pytest.approx([0.15, 1.37], abs=0.01)
    assert open_below(replace(DRAFT, gear=DRAFT.gear.even_layers(6)), two_stages)[1] == np.inf
    rows = [row("gear.slices", "32", 0.0, 0.0, mesh_law_stage=15.0)]
    free = replace(sweep, measurements=(sweep.measurements[0], *rows, *sweep.measurements[3:]))
    assert cheapest(two_stages, 1.0, free).settings["gear.slices"] == "32"
    assert "gear.slices" not in cheapest(two_stages, 2.0, free).settings


def test_models_beyond_the_yardstick_are_marked_in_the_table(sweep):
    lines = markdown(sweep).splitlines()
    assert [line.split("|")[2].strip() for line in lines if "path_correction" in line] == ["True \\*"]
    assert "is no error" in lines[-1]
    assert "8 \\*" not in markdown(sweep)


def test_models_beyond_the_yardstick_are_not_turned_by_what_they_differ_from_it(case, sweep):
    quick = row("dynamics.path_correction", "True", 0.0, 0.0, housing=1.0)
    assert (
        "dynamics.path_correction"
        not in cheapest(case, 5.0, replace(sweep, measurements=(*sweep.measurements, quick))).settings
    )


def test_settings_that_the_chain_would_refuse_for_the_band_are_not_chosen(case, sweep):
    row_ = row("dynamics.time_step", "3e-05", 0.0, 0.0, housing=1.0, transfer_vectors=1.0)
    offered = replace(sweep, measurements=(*sweep.measurements, row_))
    assert cheapest(case, 1.0, offered).settings["dynamics.time_step"] == "3e-05"
    high = replace(case, band=replace(case.band, high=6000.0))  # 30 µs are 5.6 points per period
    assert "dynamics.time_step" not in cheapest(high, 1.0, offered).settings
    assert "dynamics.time_step" not in cheapest([case, high], 1.0, offered).settings
    wide = replace(case, band=replace(case.band, high=19_000.0))  # 13 mm are 3.9 elements per bending wavelength
    assert "housing.element_size" not in cheapest(wide, 1.0, sweep).settings


@pytest.mark.parametrize(
    ("quantity", "knobs"),
    [
        ("bearing_forces", set()),
        ("surface_velocity", {"acoustics.elements_per_wavelength+coarsest_elements_per_wavelength"}),
        ("sound_power", {"acoustics.elements_per_wavelength+coarsest_elements_per_wavelength", "acoustics.precision"}),
        ("directivity", {"acoustics.elements_per_wavelength+coarsest_elements_per_wavelength", "acoustics.precision"}),
    ],
)
def test_only_knobs_of_what_is_asked_for_are_turned(case, sweep, quantity, knobs):
    faces = row("acoustics.elements_per_wavelength+coarsest_elements_per_wavelength", "3, 2", 0.0, 0.0, housing=3.0)
    finer = row("acoustics.elements_per_wavelength+coarsest_elements_per_wavelength", "4, 2", 0.0, 0.0)
    swept = replace(sweep, measurements=(*sweep.measurements[:-1], faces, finer, sweep.measurements[-1]))
    points = case.field_points if quantity == "directivity" else ()
    asked = replace(case, quantities=(quantity,), field_points=points)
    turned = cheapest(asked, 1.0, swept).settings
    assert {name for name in turned if name.startswith("acoustics")} == knobs
    assert "gear.width_layers" in turned


def test_seconds_of_what_is_not_asked_for_are_not_counted(case, sweep):
    asked = replace(case, quantities=("bearing_forces",), field_points=())
    assert cheapest(asked, 1.0, sweep).base_seconds == 126.0


def test_what_the_case_does_not_look_at_is_not_turned(case, sweep, sphere):
    assert "dynamics.stored_samples_per_period" not in cheapest(case, 5.0, sweep).settings
    assert set(cheapest(sphere, 5.0, sweep).settings) == {"acoustics.precision"}


def test_a_base_that_is_no_preset_or_no_longer_what_it_was_is_refused(case, sweep):
    with pytest.raises(InputError, match="is no preset"):
        cheapest(case, 1.0, replace(sweep, base="mine"))
    then = json.loads(json.dumps(knobs_by_package(REFERENCE)))
    assert cheapest(case, 1.0, replace(sweep, origin=SweepOrigin(knobs=then))).settings
    then["gear"]["slices"] = 47
    with pytest.raises(InputError, match=r"other gear.slices: measure it again"):
        cheapest(case, 1.0, replace(sweep, origin=SweepOrigin(knobs=then)))
    with pytest.raises(InputError, match=r"other tooth.count: measure it again"):
        cheapest(case, 1.0, replace(sweep, origin=SweepOrigin(knobs={"tooth": {"count": 3}})))


@pytest.fixture
def shipped_table(sweep, tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "SHIPPED", tmp_path / "table.json")
    (tmp_path / "table.json").write_text(as_json(replace(sweep, origin=SweepOrigin())))


def test_run_takes_what_the_planner_chooses_and_says_so(request, shipped_table, tmp_path, capsys):
    case = str(request.config.rootpath / "cases/sphere/pulsating.toml")
    assert main(["run", case, "--tolerance-db", "1", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().err
    assert "within 1 dB: about 0 dB from reference" in said
    assert "acoustics.precision = single" in said
    stored = hdf5.load(tmp_path / "pressure.h5").provenance["fidelity"]
    assert stored["precision"] == "single"
    assert stored["quadrature_order"] == REFERENCE.acoustics.quadrature_order


def test_a_run_whose_band_is_wider_than_the_tolerance_says_so(request, shipped_table, tmp_path, capsys):
    case = str(request.config.rootpath / "cases/sphere/pulsating.toml")
    for tolerance, wider in (("0.001", True), ("20", False)):
        assert main(["run", case, "--tolerance-db", tolerance, "--out", str(tmp_path)]) == 0
        said = [line for line in capsys.readouterr().err.splitlines() if "error band of this run" in line]
        assert len(said) == wider
        assert all("dB open to one side, more than the 0.001 dB asked for" in line for line in said)


def test_compare_runs_all_cases_as_the_planner_chooses(request, shipped_table, sweep, monkeypatch, capsys):
    ran = []

    def compare(cases, *, fidelity, answered, **_):
        ran.append((cases, fidelity))
        found = {"overall_dBA": 76.21, "error_band_dBA": [None, 79.9]}
        answered(summary := {"configurations": {"solid": found}, "modelling": {}})
        return summary

    monkeypatch.setattr("nvhchain.report.compare", compare)
    monkeypatch.setattr("nvhchain.chain.prefetch.operators_ahead", lambda *_: nullcontext())
    folder = request.config.rootpath / "cases"
    files = [str(folder / name) for name in ("small/single_stage.toml", "gearbox/solid.toml")]
    assert main(["compare", *files, "--tolerance-db", "1"]) == 0
    ((cases, fidelity),) = ran
    assert [case.name for case in cases] == ["single-stage", "solid"]
    assert fidelity == cheapest(cases, 1.0, sweep).fidelity
    said = capsys.readouterr()
    assert "400 s" in said.err  # twice the scene above
    assert "solid: the error band of this run has no lower limit, more than the 1 dB asked for" in said.err
    assert said.out.startswith("solid: 76.2 dB(A) (95 % limits below 79.9)\nFigures, sound and tables: ")
