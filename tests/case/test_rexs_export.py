"""Export of cases as REXS: what returns from the file is what went in, and the rest is named."""

from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

from nvhchain.bearings import AngularContact, Cylindrical
from nvhchain.case import Deviations, load_case
from nvhchain.case.rexs import export_rexs, import_rexs
from nvhchain.cli import main
from nvhchain.dynamics import SideLoad
from nvhchain.gear import Misalignment
from nvhchain.gear.drawing.micro_geometry import Flank, MicroGeometry, Relief
from nvhchain.interop.rexs import read_rexs
from nvhchain.testing.rexs_units import coaxial_unit, idler_unit

CASES = Path(__file__).parents[2] / "cases"


def returned(case, folder):
    """The case after a way through REXS."""
    export_rexs(case, folder / "unit.rexs")
    return load_case(import_rexs(folder / "unit.rexs", folder / "case").case)


@pytest.mark.parametrize("name", ["gearbox/solid.toml", "small/drawn_gears.toml"])
def test_gears_shafts_bearings_and_load_return_from_the_file(tmp_path, name):
    case = load_case(CASES / name)
    back = returned(case, tmp_path)
    shift = back.bearings[0].z - case.bearings[0].z
    for one, other in zip(case.gears, back.gears, strict=True):
        assert (one.name, one.shaft) == (other.name, other.shaft)
        assert one.z + shift == pytest.approx(other.z, abs=2e-9)
        for field in ("teeth", "normal_module", "helix_angle", "face_width", "profile_shift", "dedendum"):
            assert getattr(one.geometry, field) == pytest.approx(getattr(other.geometry, field), rel=1e-8, abs=1e-12)
        for field in ("tip_circle_radius", "tip_chamfer", "form_radius", "normal_thickness"):
            assert getattr(one.geometry, field) == pytest.approx(getattr(other.geometry, field), abs=2e-9)
    for one, other in zip(case.pairs, back.pairs, strict=True):
        assert one.transverse_contact_ratio == pytest.approx(other.transverse_contact_ratio, rel=1e-6)
        assert one.backlash == pytest.approx(other.backlash, abs=1e-8)
        assert one.sense == other.sense
    for one, other in zip(case.bearings, back.bearings, strict=True):
        assert (one.name, one.shaft) == (other.name, other.shaft)
        assert (one.radial_stiffness, one.axial_stiffness) == pytest.approx(
            (other.radial_stiffness, other.axial_stiffness), rel=1e-3
        )
    for one, other in zip(case.shafts, back.shafts, strict=True):
        assert np.allclose(one.axis, other.axis, atol=2e-9)
        assert one.inertia().mass == pytest.approx(other.inertia().mass, rel=1e-6)
    for field in ("input_speed", "input_torque"):
        assert getattr(case.operation, field) == pytest.approx(getattr(back.operation, field), rel=1e-8)
    assert (case.input_shaft, case.output_shaft) == (back.input_shaft, back.output_shaft)


def test_side_loads_return_from_the_file(tmp_path):
    case = load_case(CASES / "small/drawn_gears.toml")
    first = case.shafts[0]
    pull = SideLoad(first.segments[0].start + 0.004, (30.0, -50.0, 20.0), (3.0, -4.0))
    case = replace(case, shafts=(replace(first, loads=(pull,)), *case.shafts[1:]))
    back = returned(case, tmp_path)
    (found,) = back.shafts[0].loads
    assert found.z - pull.z == pytest.approx(back.bearings[0].z - case.bearings[0].z, abs=2e-9)
    assert (found.force, found.moment) == (pytest.approx(pull.force), pytest.approx(pull.moment))
    assert not back.shafts[1].loads


def test_rolling_bearings_return_from_the_file(tmp_path):
    """With the same rolling elements, clearance and direction, and so with the same load on every bearing."""
    case = load_case(CASES / "small/catalogue_bearings.toml")
    back = returned(case, tmp_path)
    for one, other in zip(case.bearings, back.bearings, strict=True):
        assert type(one.model) is type(other.model)
        inside, found = one.model.internal, other.model.internal
        assert (inside.count, inside.angle) == (found.count, pytest.approx(found.angle))
        assert (inside.diameter, inside.length) == pytest.approx((found.diameter, found.length), abs=2e-9)
        for play in ("clearance", "axial_clearance"):
            assert getattr(one.model, play, 0.0) == pytest.approx(getattr(other.model, play, 0.0), abs=1e-12)
        assert getattr(one.model, "thrust", 0) == getattr(other.model, "thrust", 0)


@pytest.mark.parametrize(
    ("arrangement", "apart"), [("face_to_face", 30.2e-3), ("back_to_back", 30.2e-3), ("back_to_back", 15.1e-3)]
)
def test_pairs_return_from_the_file(tmp_path, arrangement, apart):
    """Two bearings of one row each, and a bearing of two rows where the rows are within its width."""
    case = load_case(CASES / "small/catalogue_bearings.toml")
    size = {"bore": 25e-3, "outer_diameter": 52e-3, "width": 30.2e-3}
    rated = {"dynamic_load_rating": 36.5e3, "static_load_rating": 26e3}
    inside = {"elements": 13, "element_diameter": 9e-3, "contact_angle": 0.7}
    pair = AngularContact(**size, **inside, arrangement=arrangement, row_distance=apart, axial_clearance=-4e-6)
    free = Cylindrical(**size, **rated)
    first, second, *others = case.bearings
    bearings = (replace(first, model=pair), replace(second, model=free), *others)
    back = returned(replace(case, bearings=bearings), tmp_path)
    assert len(back.bearings) == len(bearings)
    found = back.bearings[0].model
    assert (type(found), found.arrangement, found.thrust) == (AngularContact, arrangement, 0)
    assert (found.row_distance, found.axial_clearance) == (pytest.approx(apart), pytest.approx(-4e-6))
    push = np.array([3e-5, 0.0, 1e-5, 1e-4, 2e-4])
    assert found.evaluate(push)[0] == pytest.approx(pair.evaluate(push)[0], rel=1e-4)


def test_bearings_between_shafts_return_from_the_file(tmp_path):
    coaxial_unit().save(tmp_path / "coaxial.rexs")
    case = load_case(import_rexs(tmp_path / "coaxial.rexs", tmp_path / "first").case)
    (back,) = returned(case, tmp_path).shaft_bearings
    (link,) = case.shaft_bearings
    assert (back.shaft, back.outer_shaft) == (link.shaft, link.outer_shaft)
    assert back.radial_stiffness == pytest.approx(link.radial_stiffness, rel=1e-3)


def test_flank_modifications_return_from_the_file(tmp_path):
    case = load_case(CASES / "small/single_stage.toml")
    drive = Flank(2e-6, 5e-6, tip_relief=Relief(20e-6, 1.5e-3, "linear"), root_relief=Relief(8e-6, 1e-3, "parabolic"))
    coast = Flank(0.0, 3e-6)
    pinion = case.gears[0]
    pinion = replace(pinion, geometry=replace(pinion.geometry, micro=MicroGeometry(drive, coast)))
    back = returned(replace(case, gears=(pinion, case.gears[1])), tmp_path).gears[0].geometry.micro
    for one, other in ((drive, back.drive), (coast, back.coast)):
        assert astuple(one)[:2] == pytest.approx(astuple(other)[:2])
        for end in ("tip_relief", "root_relief"):
            given, found = getattr(one, end), getattr(other, end)
            assert given is None or astuple(given) == (
                pytest.approx(found.amount),
                pytest.approx(found.length),
                found.shape,
            )


def test_a_driven_pinion_keeps_its_loaded_flank(tmp_path):
    """Under a negative torque the coast flanks carry; in the file power comes from the other side, on the same ones."""
    case = load_case(CASES / "small/single_stage.toml")
    relieved = MicroGeometry(drive=Flank(tip_relief=Relief(30e-6, 1.5e-3, "linear")))
    pinion = replace(case.gears[0], geometry=replace(case.gears[0].geometry, micro=relieved))
    coasting = replace(case, gears=(pinion, case.gears[1]), operation=replace(case.operation, input_torque=-50.0))
    back = returned(coasting, tmp_path)
    assert (back.input_shaft, back.operation.input_torque) == ("B", pytest.approx(75.0))
    micro = next(gear for gear in back.gears if gear.name == "pinion").geometry.micro
    assert (micro.drive.tip_relief, micro.coast.tip_relief.amount) == (None, pytest.approx(30e-6))


def test_an_idler_is_driven_on_one_flank_and_drives_with_the_other(tmp_path):
    idler_unit().save(tmp_path / "idler.rexs")
    case = load_case(import_rexs(tmp_path / "idler.rexs", tmp_path / "first").case)
    idler = next(gear for gear in case.gears if gear.name == case.stages[0].wheel == case.stages[1].pinion)
    relieved = MicroGeometry(drive=Flank(tip_relief=Relief(30e-6, 1.5e-3, "linear")))
    changed = replace(idler, geometry=replace(idler.geometry, micro=relieved))
    case = replace(case, gears=tuple(changed if gear is idler else gear for gear in case.gears))
    (tmp_path / "again").mkdir()
    for one in (case, returned(case, tmp_path / "again")):
        reliefs = [pair.geometry.micro.drive.tip_relief for pair in (one.pairs[0].wheel, one.pairs[1].pinion)]
        assert [relief and relief.amount for relief in reliefs] == [pytest.approx(30e-6), None]
    stated = next(gear for gear in read_rexs(tmp_path / "again" / "unit.rexs").gears if gear.name == idler.name)
    assert list(stated.loaded_flanks.values()) == ["left", "right"]


def test_deviations_of_an_idler_change_flanks_with_it(tmp_path):
    idler_unit().save(tmp_path / "idler.rexs")
    case = load_case(import_rexs(tmp_path / "idler.rexs", tmp_path / "first").case)
    gears = [
        replace(gear, deviations=Deviations(tolerance_class=6, seed=1)) if gear.name == case.stages[0].wheel else gear
        for gear in case.gears
    ]
    first, second = replace(case, gears=tuple(gears)).deviations
    for one, other in (("drive", "coast"), ("coast", "drive")):
        driven, drives = getattr(first.wheel, one), getattr(second.pinion, other)
        assert np.array_equal(driven.pitch, drives.pitch)
        assert np.ptp(driven.pitch) > 0


def test_what_the_format_does_not_hold_is_named(tmp_path, capsys):
    out = tmp_path / "slotted.rexs"
    knob = ["--set", "fidelity.gear.slices=9"]  # concerns runs, not the file
    assert main(["export", str(CASES / "gearbox/slotted.toml"), "--out", str(out), *knob]) == 0
    assert "not in it: housing" in (said := capsys.readouterr().out)
    assert "blank of gear gear2" in said
    assert main(["export", str(CASES / "gearbox/slotted.toml"), "--out", str(tmp_path / "x.xml")]) == 2
    assert "end it in .rexs" in capsys.readouterr().err
    assert main(["export", str(CASES / "sphere/pulsating.toml"), "--out", str(out)]) == 2
    assert "is a radiator" in capsys.readouterr().err


def test_values_of_shafts_bearings_and_stages_that_are_lost_are_named(tmp_path):
    case = load_case(CASES / "small/single_stage.toml")
    first, second = case.shafts[0].segments[0], replace(case.shafts[0].segments[0], start=0.0, young=70e9)
    shaft = replace(case.shafts[0], segments=(replace(first, end=0.0), second))
    more = {"dynamic_load_rating": 3e4, "axial_stiffness": 2e8, "misalignment": (1e-3, 0.0)}
    rows = Cylindrical(bore=24e-3, outer_diameter=52e-3, width=15e-3, static_load_rating=3e4, **more)
    bearing = replace(case.bearings[0], model=rows)
    gear, stage = replace(case.gears[0], deviations=Deviations(tolerance_class=6)), case.stages[0]
    stage = replace(stage, misalignment=Misalignment(in_plane=1e-4))
    case = replace(
        case,
        shafts=(shaft, case.shafts[1]),
        bearings=(bearing, *case.bearings[1:]),
        gears=(gear, case.gears[1]),
        stages=(stage,),
    )
    lost = export_rexs(case, tmp_path / "unit.rexs")
    for text in (
        "deviations of gear pinion",
        "misalignment and tolerances of stage stage",
        "materials of shaft A but that of its first segment",
        "misalignment of bearing A1",
        "axial stiffness of the ribs of bearing A1",
    ):
        assert text in lost
