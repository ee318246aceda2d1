"""Gear drawings in case files: every blank and modification of the gear package can be written as a table."""

import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.gear import Holes, ThinRim


@pytest.fixture
def load(request, tmp_path):
    solid = request.config.rootpath / "cases" / "gearbox" / "solid.toml"

    def case(text):
        path = tmp_path / "case.toml"
        path.write_text(f'base = "{solid}"\n{text}')
        return nvh.load_case(path)

    return case


def gear2(case):
    return next(gear for gear in case.gears if gear.name == "gear2")


def test_thin_rim_and_holes_are_blanks_of_a_case(load):
    thin = load(
        '[[gears]]\nname = "gear2"\n[gears.blank]\ntype = "thin_rim"\n'
        "web_thickness_mm = 8\nhub_radius_mm = 30\nrim_radius_mm = 52"
    )
    assert isinstance(gear2(thin).blank, ThinRim)
    assert gear2(thin).blank.rim_radius == pytest.approx(0.052)
    holes = load(
        '[[gears]]\nname = "gear2"\n[gears.blank]\ntype = "holes"\ncount = 8\npitch_radius_mm = 42\nhole_radius_mm = 6'
    )
    assert isinstance(gear2(holes).blank, Holes)
    assert gear2(holes).body.sector == 25


def test_crowning_and_relief_are_written_in_micrometres(load):
    case = load(
        '[[gears]]\nname = "gear2"\n[gears.geometry.micro.drive]\n'
        'profile_crowning_um = 10\ntip_relief = { amount_um = 15, length_mm = 2, shape = "linear" }'
    )
    drive = gear2(case).geometry.micro.drive
    assert drive.profile_crowning == pytest.approx(10e-6)
    assert drive.tip_relief.amount == pytest.approx(15e-6)


def test_a_stage_may_be_misaligned(load):
    case = load('[[stages]]\nname = "stage1"\nmisalignment = { in_plane_mrad = 0.9 }')
    assert case.pairs[0].misalignment.in_plane == pytest.approx(0.9e-3)
    assert case.pairs[1].misalignment.in_plane == 0.0


def test_hole_through_the_rim_is_refused_with_the_field(load):
    with pytest.raises(InputError, match=r"gears\[1\]"):
        load(
            '[[gears]]\nname = "gear2"\n[gears.blank]\ntype = "holes"\ncount = 8\npitch_radius_mm = 58\n'
            "hole_radius_mm = 8"
        )
