"""Bearings in a case file: catalogue words, several mistakes at once, lines of check and plan, stiffness of the run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nvhchain import gear
from nvhchain.bearings import Cylindrical, DeepGroove, StiffnessMatrix, Tapered
from nvhchain.case import load_case
from nvhchain.chain import run
from nvhchain.chain.loaded import balanced, compliances, loaded_case
from nvhchain.cli import main
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import DRAFT
from nvhchain.files.result_cache import ResultCache
from nvhchain.gear import tabulated
from nvhchain.scene import check_case, plan
from nvhchain.scene.bearing_lines import bearing_lines
from tests.dynamics.unbalance import unbalance

CASES = Path(__file__).parents[2] / "cases"
CASE = CASES / "small" / "catalogue_bearings.toml"
OVERLOAD = ["operation.input_torque=1000", "bearings.B1.model.static_load_rating=9000"]
REACH = np.array([-1e-3, -1e-4, 0.0, 1e-3])


def test_the_example_is_read_in_the_units_of_its_keys():
    case = load_case(CASE)
    kinds = [type(bearing.model) for bearing in case.bearings]
    assert kinds == [Tapered, Tapered, DeepGroove, Cylindrical]
    ball = case.bearings[2].model
    assert (ball.bore, ball.outer_diameter, ball.clearance) == pytest.approx((0.03, 0.062, 1e-5))
    assert ball.internal.count == 9
    assert abs(1e3 * ball.internal.diameter / 9.525 - 1.0) < 0.01
    assert case.load_dependent


@pytest.mark.parametrize("share", [0.01, 0.1, 1.0, 1.5])
@pytest.mark.parametrize("name", ["gearbox/solid.toml", "gearbox/slotted.toml", "small/single_stage.toml",
                                  "small/rattle.toml", "small/catalogue_bearings.toml"])  # fmt: skip
def test_every_case_finds_its_equilibrium_in_twenty_steps(name, share):
    from nvhchain.dynamics import equilibrium

    case = load_case(CASES / name)
    found = equilibrium(case.gearbox_with_gears, case.straight_laws, None, input_torque=share * case.static_torque)
    assert found.steps <= 20
    assert unbalance(found, case.straight_laws, share * case.static_torque) <= 1e-8


def test_a_line_has_load_and_stiffness_and_one_all_that_was_derived():
    case = load_case(CASE)
    lines = bearing_lines(case)
    assert len(lines) == 4 + 3  # two of the bearings are alike inside
    assert max(map(len, lines[:4])) <= 160
    assert max(map(len, lines)) <= 240
    load = case.equilibrium.bearing_load[2]
    assert f"bearing B1 at 60 N m: {1e-3 * np.hypot(*load[:2]):.3g} kN radial, 0.386 kN axial" in lines[2]
    for text in ("N/m radial", "N/m axial", "an element carries"):
        assert text in lines[2]
    assert lines[4].startswith("bearing(s) A1, A2: tapered roller bearing: contact angle 13.86°")
    for text in ("bearing(s) B1:", "9 balls", "pitch diameter 46 mm", "groove radii 0.52 and 0.53"):
        assert text in lines[5]
    assert bearing_lines(load_case(CASES / "small" / "single_stage.toml")) == ()


def test_loads_that_are_rounding_are_printed_as_zero():
    """Spur gears push no bearing along its axis; 7e-25 kN stood there."""
    spur = [f"gears.{name}.geometry.helix_angle_deg=0" for name in ("pinion", "wheel")]
    case = load_case(CASE, changes=spur)
    assert 0 < abs(case.equilibrium.bearing_load[2, 2]) < 1e-6
    assert " kN radial, 0 kN axial" in bearing_lines(case)[2]


def test_check_and_plan_print_the_lines(capsys):
    assert main(["check", str(CASE)]) == 0
    printed = capsys.readouterr().out
    assert sum("kN radial" in line for line in printed.splitlines()) == 4
    assert "bearing A1 at 60 N m" in str(plan(load_case(CASE)))


@pytest.mark.parametrize(
    ("changes", "texts"),
    [
        (
            ["bearings.B1.model.static_load_rating=1e3", "bearings.A1.model.thrust=0"],
            [
                "(A1).model: tapered roller bearing: thrust = 0",
                "(B1).model: deep groove ball bearing: dynamic_load_rating",
            ],
        ),
        (["bearings.B1.model.bore=30"], ["bore = 30.0 m is outside 0.001…5 m: give it in m, or in mm as bore_mm"]),
        (["bearings.B2.model.element_length_mm=30"], ["longer than the width of 16 mm"]),
        (["bearings.B1.model={type='needle'}"], ["model.type = 'needle': choose one of deep_groove"]),
        (["bearings.B1.radial_stiffness=1e8"], ["belong to a bearing without model"]),
    ],
)
def test_mistakes_are_named_with_bearing_value_and_remedy(changes, texts):
    with pytest.raises(InputError) as caught:
        load_case(CASE, changes=changes)
    for text in texts:
        assert text in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (OVERLOAD, "bearing B1: its most loaded element carries"),
        (
            ["bearings.A1.model.thrust=1"],
            "shaft A finds no equilibrium at 60 N m: none of its bearings A1, A2 carries an axial force along −z",
        ),
        (
            ["bearings.B1.model={type='cylindrical', bore_mm=30, outer_diameter_mm=62, static_load_rating=36500}"],
            "none of its bearings B1, B2 carries its thrust of -385.9 N: turn the thrust of one",
        ),
    ],
)
def test_check_refuses_a_load_that_the_bearings_do_not_carry(changes, text, capsys):
    options = [part for change in changes for part in ("--set", change)]
    assert main(["check", str(CASE), *options]) == 2
    printed = capsys.readouterr().err
    assert text in printed
    assert len(printed.strip().splitlines()) == 1


def test_a_case_whose_bearings_do_not_carry_is_refused_before_any_work():
    case = load_case(CASE, changes=OVERLOAD)
    with pytest.raises(InputError, match="its most loaded element carries"):
        check_case(case)


def test_bearings_without_damping_take_the_usual_one_and_it_is_printed():
    changes = [f"bearings.A1.{way}_damping=0" for way in ("radial", "axial")]
    case = load_case(CASE, changes=changes)
    found = {bearing.name: bearing.stiffness_damping for bearing in case.gearbox.bearings}
    assert found == {"A1": 1.25e-5, "A2": 0.0, "B1": 0.0, "B2": 0.0}
    assert "bearing(s) A1 have no damping in the case and take 1.25e-05 s" in bearing_lines(case)[-1]
    assert load_case(CASE).gearbox.bearings == load_case(CASE).bearings


def test_a_run_warns_of_the_usual_damping(tmp_path):
    changes = [f"bearings.A1.{way}_damping=0" for way in ("radial", "axial")]
    changes += ["quantities=['bearing_forces']", "options.rigid_housing=true", "band.high=2000"]
    case = load_case(CASE, changes=changes)
    laws = tuple(tabulated(pair, np.zeros(1), REACH, 2e8 * np.maximum(REACH, 0.0)[None, :]) for pair in case.pairs)
    with pytest.warns(AccuracyWarning, match=r"bearing\(s\) A1 have no damping"):
        made = run(case, fidelity=DRAFT, mesh_laws=laws)
    mean = made.bearing_forces.force.mean(axis=0)
    assert np.abs(mean - case.equilibrium.bearing_load[:, :3]).max() < 1e-5 * np.abs(mean).max()


def test_the_misalignment_under_load_is_that_of_the_equilibrium():
    case = load_case(CASE, changes=["options.loaded_misalignment=true", "options.rigid_housing=true"])
    flanks, (force,), (pair,) = compliances(case, DRAFT, ResultCache(None)), case.mesh_forces, case.pairs
    (stage,) = loaded_case(case, None, DRAFT, flanks).stages
    made = [stage.misalignment.in_plane, stage.misalignment.normal]
    load = gear.load_distribution(
        replace(pair, misalignment=stage.misalignment),
        nominal_force=force,
        fidelity=DRAFT.gear,
        compliances=flanks[0](lambda done, total: None),
    )
    moment = np.array([force * np.cos(pair.base_helix_angle) * load.offset.mean()])
    held = balanced(case, None, DRAFT, moment).misalignment[0]
    apart = np.abs(held - case.equilibrium.misalignment[0]).max()
    assert np.abs(made - held).max() < 0.3 * apart
    assert np.abs(made - held).max() < 5e-3 * np.abs(held).max()


def test_a_matrix_and_a_table_may_be_given(tmp_path):
    rows = np.diag([2e8, 1.5e8, 5e7, 1e4, 1e4]).tolist()
    text = f"""base = "{CASES / "small" / "single_stage.toml"}"
[[bearings]]
name = "A1"
model = {{ type = "stiffness_matrix", matrix = {rows} }}
[[bearings]]
name = "A2"
[bearings.model]
type = "stiffness_table"
radial_load = [0, 1000, 5000]
radial_stiffness = [1e8, 2e8, 3e8]
axial_load = [0]
axial_stiffness = [5e7]
"""
    path = tmp_path / "given.toml"
    path.write_text(text, encoding="utf-8")
    case = load_case(path)
    assert isinstance(case.bearings[0].model, StiffnessMatrix)
    radial = case.equilibrium.stiffness[:3, :2, :2].trace(axis1=1, axis2=2) / 2
    assert radial[0] == pytest.approx(1.75e8)
    assert 1e8 < radial[1] < 3e8
    assert radial[2] == pytest.approx(1.63e8)
