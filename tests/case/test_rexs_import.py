"""Import of REXS: the case that is written, its page, and what contradicts itself."""

import re
import resource
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from nvhchain.bearings import Cylindrical
from nvhchain.case.rexs.backlash import recommended_backlash
from nvhchain.cli import main
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import GearGeometry, base_tangent_length, dimension_over_balls
from nvhchain.testing.rexs_units import coaxial_unit, gear_train, idler_unit, imported
from tests.dynamics.unbalance import unbalance


@pytest.mark.slow
def test_two_commands_lead_to_a_plan(tmp_path, capsys):
    path = gear_train((20, 31)).save(tmp_path / "two shafts.rexs")
    assert main(["import", str(path), "--out", str(tmp_path / "case")]) == 0
    said = capsys.readouterr().out
    assert "assumed: housing, drawn by rule" in said
    case = tmp_path / "case" / "two shafts.toml"
    assert main(["check", str(case)]) == 0
    assert main(["plan", str(case), "--fidelity", "draft"]) == 0
    assert "The housing is drawn by rule" in capsys.readouterr().out


def test_results_of_the_file_stand_beside_those_of_the_drawn_gears(tmp_path):
    unit = gear_train((20, 31))
    for gear, diameter in zip(unit.numbers("cylindrical_gear"), (68.117, 102.281), strict=True):
        unit.attributes(gear)["tip_diameter"] = (diameter, "mm")
    stage = unit.attributes(unit.numbers("cylindrical_stage")[0])
    stage["radial_contact_ratio"] = (1.7, "none")
    stage["overlap_contact_ratio"] = (24 * np.sin(np.radians(15)) / (np.pi * 3.0), "none")
    case, page = imported(unit, tmp_path)
    found = case.pairs[0].transverse_contact_ratio
    assert f"| transverse contact ratio | 1.7 | {found:.7g} |" in page.replace("  ", " ")
    assert re.search(r"overlap ratio .* yes \|", page)
    assert re.search(r"transverse contact ratio \| file 1.7, drawn", page), (
        "a contradiction is listed with both numbers"
    )


def test_gears_of_different_width_and_plane_meet_on_their_common_face(tmp_path):
    unit = gear_train((20, 31))
    first = unit.attributes(unit.numbers("cylindrical_gear")[0])
    first["face_width"] = (30.0, "mm")
    first["u_coordinate_on_shaft"] = (first["u_coordinate_on_shaft"][0] + 4.0, "mm")  # 23…53 beside 26…50 mm… shifted
    case, page = imported(unit, tmp_path)
    pinion, wheel = case.gears
    assert pinion.z == pytest.approx(wheel.z + 4e-3)
    assert (pinion.geometry.face_width, wheel.geometry.face_width) == (0.03, 0.024)
    low, high = max(42 + 4 - 15, 42 - 12), min(42 + 4 + 15, 42 + 12)
    assert case.pairs[0].face_width == pytest.approx(1e-3 * (high - low))
    assert "the mid-planes differ" in page


def test_gears_that_do_not_meet_are_refused(tmp_path):
    unit = gear_train((20, 31))
    unit.attributes(unit.numbers("cylindrical_gear")[0])["u_coordinate_on_shaft"] = (90.0, "mm")
    with pytest.raises(InputError, match="do not meet"):
        imported(unit, tmp_path)


def test_backlash_is_that_of_the_file_or_the_recommended_one(tmp_path):
    case, page = imported(gear_train((20, 31)), tmp_path)
    wanted = recommended_backlash(0.003, case.stages[0].centre_distance)
    assert case.pairs[0].backlash == pytest.approx(wanted, rel=1e-5)
    assert "ISO/TR 10064-2" in page
    unit = gear_train((20, 31))
    for gear in unit.numbers("cylindrical_gear"):
        unit.attributes(gear).update(
            upper_backlash_allowance_referenced_to_span=(-50.0, "mum"),
            lower_backlash_allowance_referenced_to_span=(-90.0, "mum"),
        )
    (tmp_path / "other").mkdir()
    case, _ = imported(unit, tmp_path / "other")
    assert case.pairs[0].backlash == pytest.approx(2 * 70e-6, rel=1e-3)  # along the base tangent


def test_deviations_over_balls_are_kept_beside_a_recommended_backlash(tmp_path):
    unit = gear_train((20, 31))
    for gear, deviation in zip(unit.numbers("cylindrical_gear"), (-0.03, -0.05), strict=True):
        unit.attributes(gear).update(
            diameter_of_measuring_ball_or_pin=(5.25, "mm"),
            upper_backlash_allowance_balls_or_pins=(deviation, "mm"),
            lower_backlash_allowance_balls_or_pins=(deviation, "mm"),
        )
    case, page = imported(unit, tmp_path)
    for gear, deviation in zip(case.gears, (-0.03e-3, -0.05e-3), strict=True):
        full = dimension_over_balls(replace(gear.geometry, thickness_allowance=0.0), 5.25e-3)
        assert dimension_over_balls(gear.geometry, 5.25e-3) - full == pytest.approx(deviation, abs=1e-9)
    assert "no tooth thickness given" not in page


def test_a_backlash_far_from_the_tooth_thickness_beside_it_is_named(tmp_path):
    unit = gear_train((20, 31))
    for gear in unit.numbers("cylindrical_gear"):
        unit.attributes(gear)["chordal_tooth_thickness_upper_deviation"] = (-0.03, "mm")
    unit.attributes(unit.numbers("cylindrical_stage")[0])["minimum_normal_backlash"] = (0.3, "mm")
    _, page = imported(unit, tmp_path)
    assert re.search(r"backlash \| 300 µm stated, 56.\d* µm by the tooth thickness", page)


@pytest.mark.parametrize(("thicker", "kind"), [(0.4e-3, "Assumed"), (20e-3, "Contradictions")])
def test_a_jam_becomes_no_backlash_and_is_said(tmp_path, thicker, kind):
    unit = gear_train((20, 31))
    for gear in unit.numbers("cylindrical_gear"):
        unit.attributes(gear)["normal_tooth_thickness_at_reference_diameter"] = (3 * np.pi / 2 + thicker, "mm")
    unit.version = "1.5"
    case, page = imported(unit, tmp_path)
    assert abs(case.pairs[0].backlash) < 1e-9
    section = page.split(f"## {kind}")[1].split("##")[0]
    assert "| backlash | 0 instead of -" in section


def test_an_undercut_gear_is_drawn_as_it_is_where_the_mating_tip_stays_above_it(tmp_path):
    case, page = imported(gear_train((16, 31), helix=0.0), tmp_path)
    assert case.gears[0].geometry.dedendum == 1.25
    assert case.gears[0].geometry.undercut > 0
    assert "| undercut | form diameter" in page


def test_a_tip_that_reaches_below_the_undercut_is_refused_with_numbers(tmp_path):
    with pytest.raises(InputError, match=r"mm below the start of its involute \(.* form circle of radius .* undercut"):
        imported(gear_train((12, 31), helix=0.0), tmp_path)


@pytest.mark.parametrize("version", ["1.7", "1.1"])
def test_chamfers_and_protuberances_of_a_file_are_drawn(tmp_path, version):
    """Up to 1.6 gears refer to their tools in order; later a manufacturing step joins them."""
    unit = gear_train((25, 31))
    for flank in unit.numbers("cylindrical_gear_flank")[:2]:
        unit.attributes(flank)["tooth_tip_chamfer"] = (0.2, "mm")
    tip = 3.0 * (25 / np.cos(np.radians(15)) + 2)
    unit.attributes(unit.numbers("cylindrical_gear")[0])["tip_diameter"] = (tip, "mm")
    tool = unit.add(
        "rack_shaped_tool",
        addendum_coefficient_reference_profile=(1.4, "none"),
        tip_radius_factor=(0.3, "none"),
        protuberance_amount=(0.12, "mm"),
        protuberance_angle=(8.0, "deg"),
    )
    settings = unit.add("cylindrical_gear_manufacturing_settings", machining_allowance=(0.1, "mm"))
    if version == "1.7":
        flank = unit.numbers("cylindrical_gear_flank")[0]
        unit.relate("manufacturing_step", workpiece=flank, tool=tool, manufacturing_settings=settings)
    else:
        pinion = unit.numbers("cylindrical_gear")[0]
        unit.relate("ordered_reference", origin=pinion, referenced=tool)
        unit.relate("ordered_reference", origin=pinion, referenced=settings)
    case, page = imported(unit, tmp_path)
    drawn = case.gears[0].geometry
    assert drawn.dedendum == pytest.approx(1.4)
    assert drawn.tip_chamfer == pytest.approx(0.2e-3, abs=1e-12)
    assert drawn.tip_circle_radius == pytest.approx(0.5e-3 * tip)
    assert drawn.protuberance.remaining == pytest.approx(0.02e-3, abs=1e-12)
    assert np.degrees(drawn.protuberance.angle) == pytest.approx(8.0)
    assert "of which 0.1 mm are machined off" in page


def test_profile_shift_and_allowance_follow_from_the_measures_of_a_file(tmp_path):
    unit = gear_train((25, 31), helix=0.0)
    pinion, wheel = unit.numbers("cylindrical_gear")
    reference = GearGeometry(25, 3e-3, np.radians(20), 0.0, 24e-3, 10e-3, thickness_allowance=60e-6)
    unit.attributes(pinion).update(
        span_measurement=(1e3 * base_tangent_length(reference, 3), "mm"),
        number_of_teeth_for_span_measurement=(3, "none"),
    )
    mate = GearGeometry(31, 3e-3, np.radians(20), 0.0, 24e-3, 10e-3, profile_shift=-0.02)
    unit.attributes(wheel).update(
        size_over_balls=(1e3 * dimension_over_balls(mate, 5.25e-3), "mm"),
        diameter_of_measuring_ball_or_pin=(5.25, "mm"),
    )
    for flank in unit.numbers("cylindrical_gear_flank")[2:]:
        del unit.attributes(flank)["addendum_modification_coefficient"]
    case, page = imported(unit, tmp_path)
    drawn = [gear.geometry for gear in case.gears]
    assert drawn[0].thickness_allowance == pytest.approx(60e-6, abs=1e-10)
    assert drawn[1].profile_shift == pytest.approx(-0.02, abs=1e-8)
    assert "over balls of 5.25 mm" in page


def test_profile_shifts_follow_from_the_centre_distance(tmp_path):
    unit = gear_train((20, 31))
    for flank in unit.numbers("cylindrical_gear_flank"):
        del unit.attributes(flank)["addendum_modification_coefficient"]
    stage = unit.attributes(unit.numbers("cylindrical_stage")[0])
    stage["center_distance"] = (stage["center_distance"][0] + 1.0, "mm")
    last = unit.attributes(unit.numbers("shaft")[1])["support_vector"][0]
    last[1] += 1.0
    case, page = imported(unit, tmp_path / "stated")
    del stage["center_distance"]
    assert imported(unit, tmp_path / "shafts")[0].gears == case.gears
    shifts = [gear.geometry.profile_shift for gear in case.gears]
    assert shifts[0] == shifts[1] > 0.1
    wanted = recommended_backlash(0.003, case.stages[0].centre_distance)
    assert case.pairs[0].backlash == pytest.approx(wanted, rel=1e-5)
    assert "profile shift x" in page


def test_flank_modifications_of_both_flanks_are_taken(tmp_path):
    unit = gear_train((20, 31))
    flanks = unit.numbers("cylindrical_gear_flank")[:2]
    gear = unit.numbers("cylindrical_gear")[0]
    data = unit.add("cylindrical_stage_gear_data", loaded_tooth_flank=("right", "none"))
    unit.relate("stage_gear_data", stage=unit.numbers("cylindrical_stage")[0], gear=gear, stage_gear_data=data)
    for flank, depth in zip(flanks, (10.0, 25.0), strict=True):
        relief = unit.add(
            "tip_relief",
            tip_relief_depth=(depth, "mum"),
            tip_relief_datum_length=(2.0, "mm"),
            shape_of_relief=("linear", "none"),
        )
        crowning = unit.add(
            "helix_crowning",
            helix_crowning_amount_datum_face=(4.0, "mum"),
            helix_crowning_amount_non_datum_face=(6.0, "mum"),
        )
        slope = unit.add("helix_slope", helix_slope=(3.0, "mum"))
        for part in (relief, crowning, slope):
            unit.relate("reference", origin=flank, referenced=part)
    case, page = imported(unit, tmp_path)
    micro = case.gears[0].geometry.micro
    assert (micro.drive.tip_relief.amount, micro.coast.tip_relief.amount) == pytest.approx((25e-6, 10e-6))
    assert (micro.drive.tip_relief.length, micro.drive.tip_relief.shape) == (pytest.approx(2e-3), "linear")
    assert micro.drive.lead_crowning == pytest.approx(5e-6)
    assert "helix\\_slope" in page.split("## Excluded")[1]


def test_a_coaxial_unit_gets_an_inner_wall_and_a_bearing_between_its_shafts(tmp_path):
    case, _ = imported(coaxial_unit(), tmp_path)
    assert [b.outer_shaft for b in case.shaft_bearings] == ["S3"]
    assert len(case.housing.inner_walls) == 1
    wall = case.housing.inner_walls[0]
    assert [b.name for b in case.housing.bores_in(2)] == [b.name for b in case.bearings if abs(b.z - wall.z) < 0.02]
    assert case.shafts[0].axis == case.shafts[2].axis


def test_a_centre_distance_that_parts_concentric_shafts_is_refused(tmp_path):
    unit = coaxial_unit()
    stage = unit.attributes(unit.numbers("cylindrical_stage")[0])
    stage["center_distance"] = (stage["center_distance"][0] + 0.5, "mm")
    with pytest.raises(InputError, match=r"its shafts S1 and S3 are 0.5 mm apart, not coaxial: correct support_vector"):
        imported(unit, tmp_path)


def test_an_idler_on_needles_keeps_its_pin(tmp_path):
    """The pin carries no gear and stands still; the needles carry twice the tangential force, 2 · 60 N m/30 mm."""
    case, _ = imported(idler_unit(), tmp_path)
    (needles,) = case.shaft_bearings
    assert (needles.shaft, needles.outer_shaft, type(needles.model)) == ("Pin", "S2", Cylindrical)
    assert "Pin" not in case.shaft_orders
    assert np.linalg.norm(case.equilibrium.shaft_bearing_load[0][:3]) == pytest.approx(4000.0, rel=1e-8)
    assert unbalance(case.equilibrium, case.straight_laws, case.static_torque) < 1e-8


def test_a_bearing_whose_side_is_a_gear_holds_the_shaft_of_the_gear(tmp_path):
    unit = idler_unit()
    ring, gear = unit.numbers("shaft")[1], unit.numbers("cylindrical_gear")[1]
    unit.relations = [
        (kind, [(role, gear if role == "outer_part" and end == ring else end) for role, end in ends])
        for kind, ends in unit.relations
    ]
    case, _ = imported(unit, tmp_path)
    assert case.shaft_bearings[0].outer_shaft == "S2"


@pytest.mark.parametrize("stages", [((20, 31),), ((20, 31), (18, 40)), ((20, 31), (20, 40), (21, 35))])
def test_a_housing_is_drawn_around_two_to_four_shafts(tmp_path, stages):
    case, page = imported(gear_train(*stages), tmp_path)
    casting = case.housing
    assert len(casting.bores) == len(case.bearings) == 2 * (len(stages) + 1)
    for gear in case.gears:
        space = next(
            s
            for s in casting.gear_spaces
            if np.allclose(s.centre, dict((x.name, x.axis) for x in case.shafts)[gear.shaft])
        )
        assert space.radius - gear.geometry.tip_circle_radius >= 10e-3 - 1e-9
        assert gear.z - gear.geometry.face_width / 2 - casting.bell_depth - casting.end_wall >= 8e-3 - 1e-9
    assert "| bolts |" in page


def test_rigid_seats_give_bearing_forces_alone(tmp_path):
    case, _ = imported(gear_train((20, 31)), tmp_path, housing="rigid")
    assert case.options.rigid_housing
    assert case.quantities == ("bearing_forces",)


def test_speed_and_torque_that_the_file_has_not_are_assumed_and_said(tmp_path):
    unit = gear_train((20, 31))
    unit.load_cases.clear()
    case, page = imported(unit, tmp_path)
    assert case.operation.input_speed == pytest.approx(50 * np.pi)
    assert any("input speed and the input torque" in sentence for sentence in case.assumptions)
    assert "1500 rpm" in page


def test_a_load_case_that_turns_the_other_way_is_marked(tmp_path):
    unit = gear_train((20, 31))
    first, load = unit.numbers("shaft")[0], unit.numbers("external_load")[0]
    reverse = {first: {"rotational_speed": (-900.0, "1 / min")}, load: {"torque_around_u_axis": (-50.0, "N m")}}
    unit.load_cases.append(reverse)
    _, page = imported(unit, tmp_path)
    assert "| 2 | 900 | 50 | - | turns the other way |" in page
    assert page.count("turns the other way") == 1


def test_names_that_are_no_file_names_are_made_safe(tmp_path):
    unit = gear_train((20, 31))
    kind, _, attributes = unit.components[unit.numbers("cylindrical_gear")[0]]
    unit.components[unit.numbers("cylindrical_gear")[0]] = (kind, 'a/b"c\n|*<b>', attributes)
    case, page = imported(unit, tmp_path)
    assert "/" not in case.gears[0].name
    assert '"' not in case.gears[0].name
    assert "<b>" not in page.replace("\\<b\\>", "")


def test_nothing_is_written_over_or_half(tmp_path, capsys):
    path = gear_train((20, 31)).save(tmp_path / "u.rexs")
    assert main(["import", str(path), "--out", str(tmp_path / "case")]) == 0
    assert main(["import", str(path), "--out", str(tmp_path / "case")]) == 2
    assert "exists: name another folder" in capsys.readouterr().err
    broken = gear_train((20, 31))
    broken.add("worm_stage", "W")
    assert main(["import", str(broken.save(tmp_path / "w.rexs")), "--out", str(tmp_path / "other")]) == 2
    assert "worm gears are not modelled: worm_stage" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def test_temporary_files_without_room_are_named_with_a_remedy(tmp_path, capsys):
    """The case is tried out there before its folder is made."""
    path = gear_train((20, 31)).save(tmp_path / "u.rexs")
    resource.setrlimit(resource.RLIMIT_FSIZE, (512, resource.RLIM_INFINITY))
    try:
        assert main(["import", str(path), "--out", str(tmp_path / "case")]) == 1
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    assert re.fullmatch(
        r"nvhchain: /\S+/u.toml: cannot be written \(.*\): raise the limit.*\n", capsys.readouterr().err
    )
    assert not (tmp_path / "case").exists()


def test_a_shaft_that_can_tilt_or_slide_is_refused(tmp_path):
    unit = gear_train((20, 31))
    bearings = unit.numbers("rolling_bearing_with_catalog_geometry")
    unit.relations = [(kind, ends) for kind, ends in unit.relations if ("assembly", bearings[0]) not in ends]
    del unit.components[bearings[0]]
    for bearing in bearings[2:]:
        unit.attributes(bearing)["axial_force_absorption"] = ("no_direction", "none")
    with pytest.raises(InputError, match=r"S1: has bearings in 1 plane.*S2: none of its 2 bearing"):
        imported(unit, tmp_path)


def test_a_chamfered_gear_reproduces_the_contact_ratios_of_its_file(tmp_path):
    """The tip form circle and the common face width of the file, not the outer ones, carry."""
    unit = gear_train((20, 31))
    stage = unit.numbers("cylindrical_stage")[0]
    for gear, form in zip(unit.numbers("cylindrical_gear"), (67.4, 101.6), strict=True):
        unit.attributes(gear).update(tip_diameter=(form + 0.6, "mm"), tip_form_diameter=(form, "mm"))
    case, _ = imported(unit, tmp_path)
    alpha = np.arctan(np.tan(np.radians(20)) / np.cos(np.radians(15)))
    radii = np.array([20, 31]) * 1.5e-3 / np.cos(np.radians(15))
    base, tips = radii * np.cos(alpha), np.array([67.4, 101.6]) / 2e3
    path = np.sqrt(tips**2 - base**2).sum() - radii.sum() * np.sin(alpha)
    ratio = path / (2 * np.pi * base[0] / 20)
    unit.attributes(stage).update(
        radial_contact_ratio=(round(ratio, 5), "none"),
        common_face_width=(22.0, "mm"),
        overlap_contact_ratio=(round(22 * np.sin(np.radians(15)) / (np.pi * 3.0), 5), "none"),
    )
    (tmp_path / "again").mkdir()
    case, page = imported(unit, tmp_path / "again")
    assert case.pairs[0].transverse_contact_ratio == pytest.approx(ratio, rel=1e-6)
    assert case.pairs[0].face_width == pytest.approx(0.022)
    assert "NO" not in page.split("## Comparison")[1].split("##")[0]


def test_gaps_and_short_ends_of_shafts_are_filled_so_that_they_can_bend(tmp_path):
    unit = gear_train((20, 31))
    first = unit.numbers("shaft_section")[0]
    length = unit.attributes(first)["length"][0]
    unit.attributes(first).update(length=(30.0, "mm"), u_coordinate_on_shaft=(25.0, "mm"))
    rest = unit.add(
        "shaft_section",
        u_coordinate_on_shaft=(58.0, "mm"),
        length=(length - 58.0, "mm"),
        outer_diameter_begin=(24.0, "mm"),
    )
    unit.relate("assembly", assembly=unit.numbers("shaft")[0], part=rest)
    case, page = imported(unit, tmp_path)
    segments = case.shafts[0].segments
    assert all(a.end == pytest.approx(b.start, abs=1e-9) for a, b in pairwise(segments))
    assert segments[0].start <= min(b.z for b in case.bearings if b.shaft == "S1")
    assert "filled with 24 mm" in page
    assert "lengthened to its outermost" in page
    assemble(case.gearbox_on_rigid_seats, case.straight_laws, None, fidelity=DRAFT.dynamics)


def test_a_coaxial_unit_can_bend(tmp_path):
    case, _ = imported(coaxial_unit(), tmp_path)
    assemble(case.gearbox_on_rigid_seats, case.straight_laws, None, fidelity=DRAFT.dynamics)


def test_side_loads_are_taken_in_the_frame_of_the_case_and_preload_is_listed(tmp_path):
    unit = gear_train((20, 31))
    load = unit.numbers("external_load")[1]
    unit.load_cases[0][load] = {"force_v_direction": (-1.2, "kN"), "torque_around_w_axis": (7.0, "N m")}
    unit.attributes(load)["u_coordinate_on_shaft"] = (2.0, "mm")
    bearing = unit.numbers("rolling_bearing_with_catalog_geometry")[0]
    unit.attributes(bearing)["preload_distance"] = (5.0, "mum")
    case, page = imported(unit, tmp_path)
    (found,) = [each for shaft in case.shafts for each in shaft.loads]
    assert (found.force, found.moment) == ((-1200.0, 0.0, 0.0), (0.0, 7.0))
    assert "-1200 | 0 | 0 | 0 | 7 |" in page
    assert "axial clearance | -5 µm |" in page.split("## Excluded")[1].split("##")[0]


def test_a_side_load_without_a_place_is_left_out_by_name(tmp_path):
    unit = gear_train((20, 31))
    load = unit.numbers("external_load")[1]
    unit.load_cases[0][load] = {"force_v_direction": (-1.2, "kN")}
    unit.attributes(load).pop("u_coordinate_on_shaft", None)
    case, page = imported(unit, tmp_path)
    assert not any(shaft.loads for shaft in case.shafts)
    assert "side load | 1200 N, 0 N m |" in page.split("## Excluded")[1].split("##")[0]


def test_narrow_walls_between_bearings_are_drawn_with_narrower_seats(tmp_path):
    """The FZG rig has bearings NU 406 of 90 mm on a centre distance of 91.5 mm: 1.5 mm between them."""
    unit = gear_train((20, 31))
    apart = 1e3 * imported(unit, tmp_path / "first")[0].stages[0].centre_distance
    for bearing in unit.numbers("rolling_bearing_with_catalog_geometry"):
        unit.attributes(bearing)["outer_diameter"] = (apart - 1.5, "mm")
    case, page = imported(unit, tmp_path / "second")
    one, other = (case.housing.bores[n] for n in (0, 2))
    assert one.radius + other.radius == pytest.approx(1e-3 * (apart - 2.0), abs=1e-7)
    assert re.search(r"seats narrower than bearings \| .* by 0\.5 mm", page)
    for bearing in unit.numbers("rolling_bearing_with_catalog_geometry"):
        unit.attributes(bearing)["outer_diameter"] = (apart + 1.0, "mm")
    with pytest.raises(InputError, match=r"overlap by 1 mm: correct their outer_diameter"):
        imported(unit, tmp_path / "third")


@pytest.mark.parametrize(("young", "wall"), [(70e3, 70e9), (2.1e8, 110e9)], ids=["aluminium", "rigid"])
def test_the_material_of_the_casing_is_that_of_the_file_unless_it_is_rigid(tmp_path, young, wall):
    unit = gear_train((20, 31))
    material = unit.add("material", elastic_modulus=(young, "N / mm^2"), density=(2.7, "kg / dm^3"))
    unit.relate("reference", origin=unit.numbers("gear_casing")[0], referenced=material)
    case, _ = imported(unit, tmp_path)
    assert case.housing.material.young == pytest.approx(wall)
