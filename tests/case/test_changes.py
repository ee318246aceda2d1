"""Changes of a case and of knobs by `--set`."""

from pathlib import Path

import numpy as np
import pytest

from nvhchain.case import load_case
from nvhchain.cli import main
from nvhchain.errors import InputError

CASE = Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml"


def test_values_of_tables_and_of_named_entries_are_replaced_in_any_unit():
    changes = [
        "operation.input_speed = 100",
        "gears.wheel.z_mm=80",
        "gears.pinion.z_mm=80",
        'gears."pinion".geometry.face_width_mm = 18',
        "shafts.A.coupled_inertia_kg_cm2 = 200",
        "name=other",
    ]
    before, case = load_case(CASE), load_case(CASE, changes=changes)
    assert case.operation.input_speed == 100.0
    assert (before.shafts[0].coupled_inertia, case.shafts[0].coupled_inertia) == (0.01, pytest.approx(0.02))
    assert [gear.z for gear in case.gears] == pytest.approx([0.080, 0.080])
    assert [gear.geometry.face_width for gear in case.gears] == pytest.approx([0.018, 0.016])
    assert (case.name, before.name) == ("other", "single-stage")
    assert case.housing == before.housing
    assert np.array_equal(case.shafts[0].axis, before.shafts[0].axis)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("gears.pinon.z_mm=3", "no 'pinon' in gears: did you mean 'pinion'? Known: pinion, wheel"),
        ("gears.pinion=3", "gears are tables"),
        ("operation", "is no assignment"),
        ("a b=3", "is no path of a value"),
        ("operation.input_speeds=3", "did you mean 'input_speed'"),
        ("operation.torque=30", "operation.torque: unknown field; did you mean 'input_torque'?"),
        ("bearings.A1.stiffness=1e8", "unknown field; did you mean 'radial_stiffness'?"),
        ("band.low=-3", "0 < low < high"),
        ('name="a\\u001bb"', "control character"),
    ],
)
def test_changes_that_change_nothing_valid_are_refused(change, message):
    with pytest.raises(InputError) as error:
        load_case(CASE, changes=[change])
    assert message in str(error.value)
    assert ";" not in str(error.value).partition("; did you mean")[2]  # one mistake


@pytest.mark.parametrize(
    "change",
    ["gears.wheel.geometry.face_width_mm=0", "operation.input_torque=6e6", "band.low=-3", "band.high=10", "foo=3"],
)
def test_a_message_names_the_change_and_others_keep_their_line(change):
    with pytest.raises(InputError) as error:
        load_case(CASE, changes=[change])
    assert str(error.value).startswith(f"{CASE} with {change}: ")
    with pytest.raises(InputError, match=r"single_stage\.toml:\d+: gear pinion: its tip radius"):
        load_case(CASE, changes=[change, "gears.pinion.geometry.teeth=200"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("fidelity.gear.slice=3", "knobs of fidelity.gear are profile_elements, "),
        ("fidelity.gears.slices=3", "packages are gear, dynamics, housing, acoustics"),
        ("fidelity.gear=3", "packages are gear, dynamics, housing, acoustics"),
        ("fidelity.gear.slices=0", "slices = 0 is outside 1…2000"),
    ],
)
def test_unknown_knobs_are_refused_by_the_command(change, message, capsys):
    assert main(["plan", str(CASE), "--set", change]) == 2
    assert message in capsys.readouterr().err


def test_changed_knobs_reach_the_plan(capsys):
    texts = []
    for change in ([], ["--set", "fidelity.gear.slices=30"], ["--set", "band.high=1000"]):
        assert main(["plan", str(CASE), "--fidelity", "draft", *change]) == 0
        texts.append(capsys.readouterr().out)
    assert len(set(texts)) == 3
    assert "30 slices" in texts[1]
    assert "30 slices" not in texts[0]


@pytest.mark.parametrize("digits", [20, 400, 5000])
def test_whole_numbers_of_hundreds_of_digits_are_named(tmp_path, digits):
    """They ended in a traceback of integers that are no floats, or have no text."""
    number = "1" + "0" * digits
    file = tmp_path / "long.toml"
    file.write_text(f'kind = "gearbox"\nname = "long"\nx = {number}\n')
    with pytest.raises(InputError, match=r"long\.toml.*lies beyond 64 bits: write it as a decimal"):
        load_case(file)
    file.write_text('kind = "gearbox"\n')
    with pytest.raises(InputError, match=r"^a\.b.*lies beyond 64 bits"):
        load_case(file, changes=[f"a.b={number}"])
