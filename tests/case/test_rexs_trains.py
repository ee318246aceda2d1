"""Trains of imported gears: idlers, their backlash and hands, shafts whose places follow from others."""

import numpy as np
import pytest

from nvhchain.case.rexs.backlash import recommended_backlash
from nvhchain.testing.rexs_units import gear_train, idler_unit, imported


@pytest.mark.parametrize(("stated", "narrow"), [((200.0, 200.0), None), ((200.0, 80.0), None), ((), None), ((), 60e-6)])
def test_an_idler_leaves_both_its_stages_their_backlash(tmp_path, stated, narrow):
    """It shares its allowance with both mates; with one of known thickness too."""
    unit = idler_unit()
    for stage, backlash in zip(unit.numbers("cylindrical_stage"), stated, strict=False):
        unit.attributes(stage).update({f"{end}imum_normal_backlash": (backlash, "mum") for end in ("min", "max")})
    first = unit.attributes(unit.numbers("cylindrical_gear")[0])
    if narrow:
        first.update({f"chordal_tooth_thickness_{end}_deviation": (-1e3 * narrow, "mm") for end in ("upper", "lower")})
    case, _ = imported(unit, tmp_path)
    least = [recommended_backlash(0.003, stage.centre_distance) for stage in case.stages]
    wanted = [1e-6 * backlash for backlash in stated] or least
    assert [pair.backlash for pair in case.pairs] == pytest.approx(wanted, rel=1e-5)
    assert not narrow or case.gears[0].geometry.thickness_allowance == pytest.approx(narrow)


def test_an_idler_between_gears_of_known_thickness_is_thin_enough_for_both(tmp_path):
    unit = idler_unit()
    gears = unit.numbers("cylindrical_gear")
    for gear, thinner in ((gears[0], 0.3), (gears[3], 0.02)):
        unit.attributes(gear).update(
            {f"chordal_tooth_thickness_{end}_deviation": (-thinner, "mm") for end in ("upper", "lower")}
        )
    case, _ = imported(unit, tmp_path)
    least = [recommended_backlash(0.003, stage.centre_distance) for stage in case.stages]
    assert all(pair.backlash > 0.999 * smallest for pair, smallest in zip(case.pairs, least, strict=True))
    assert case.pairs[1].backlash == pytest.approx(least[1], rel=1e-5)


def without_places(unit):
    """The unit with shafts whose places follow from their stages, bearings and couplings."""
    for shaft in unit.numbers("shaft"):
        for name in ("support_vector", "u_axis_vector", "w_axis_vector", "reference_component_for_position"):
            unit.attributes(shaft).pop(name, None)
    return unit


@pytest.mark.parametrize("placed", [True, False])
def test_needles_stand_at_both_their_coordinates(tmp_path, placed):
    """42 mm on the ring and 80 mm on its pin, which begins 38 mm before the ring, whether places are stated or not."""
    unit = idler_unit()
    needles = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[-1])
    needles["u_coordinate_on_shaft_inner_side"] = (80.0, "mm")
    needles["u_coordinate_on_shaft_outer_side"] = (42.0, "mm")
    ring, pin = unit.numbers("shaft")[1], unit.numbers("shaft")[3]
    held = {ends[0][1] for kind, ends in unit.relations if kind == "side" and ("inner_part", pin) in ends}
    for bearing in held & set(unit.numbers("rolling_bearing_with_catalog_geometry")[:-1]):
        own = unit.attributes(bearing)
        own["u_coordinate_on_shaft_inner_side"] = (own["u_coordinate_on_shaft_inner_side"][0] + 38.0, "mm")
    unit.attributes(unit.numbers("shaft_section")[-1])["u_coordinate_on_shaft"] = (38.0, "mm")
    if placed:
        unit.attributes(pin)["support_vector"] = (list(unit.attributes(ring)["support_vector"][0]), "mm")
        unit.attributes(pin)["support_vector"][0][0] -= 38.0
    else:
        without_places(unit)
    case, _ = imported(unit, tmp_path)
    (needle,) = case.shaft_bearings
    idler = next(gear for gear in case.gears if gear.shaft == "S2")
    assert needle.z == pytest.approx(idler.z, abs=1e-9)


def test_a_coupled_shaft_without_a_place_begins_where_its_coupling_says(tmp_path):
    unit = gear_train((20, 31))
    stub = unit.add("shaft", "Stub")
    section = unit.add(
        "shaft_section", length=(100.0, "mm"), outer_diameter_begin=(20.0, "mm"), outer_diameter_end=(20.0, "mm")
    )
    unit.relate("assembly", assembly=unit.numbers("gear_unit")[0], part=stub)
    unit.relate("assembly", assembly=stub, part=section)
    coupling = unit.add(
        "coupling",
        "Flange",
        u_coordinate_on_shaft_inner_side=(84.0, "mm"),
        u_coordinate_on_shaft_outer_side=(10.0, "mm"),
    )
    first = unit.numbers("shaft")[0]
    unit.relate("side", assembly=coupling, inner_part=first, outer_part=stub)
    alone, _ = imported(gear_train((20, 31)), tmp_path / "alone")
    case, _ = imported(unit, tmp_path)
    start = [min(segment.start for segment in one.shafts[0].segments) for one in (alone, case)]
    end = max(segment.end for segment in case.shafts[0].segments)
    assert end - start[1] == pytest.approx(84e-3 - 10e-3 + 100e-3, abs=1e-6)


def in_a_row(helix, version="1.4"):
    """Three gears in a row; the middle one turns on its shaft, as all do."""
    unit = gear_train((20, 31), (31, 25), helix=helix, version=version)
    _, second, third, fourth = unit.numbers("cylindrical_gear")
    for gear in (third, fourth):
        unit.attributes(gear)["u_coordinate_on_shaft"] = (42.0, "mm")
    swap = {("gear_1", third): ("gear_1", second)}
    unit.relations = [(kind, [swap.get(end, end) for end in ends]) for kind, ends in unit.relations]
    return unit


def test_power_leaves_at_the_end_of_the_train_though_its_idler_is_slower(tmp_path):
    unit = in_a_row(0.0)
    loads = unit.numbers("external_load")
    unit.relations = [(kind, ends) for kind, ends in unit.relations if ("part", loads[-1]) not in ends]
    unit.components = {number: one for number, one in unit.components.items() if number != loads[-1]}
    case, page = imported(unit, tmp_path)
    assert (case.input_shaft, case.output_shaft) == ("S1", "S3")
    assert "the slowest end; no load names it" in page


def test_helical_gears_in_a_row_without_stated_hands_turn_every_other_way(tmp_path):
    unit = in_a_row(10.0, version="1.2")
    for gear in unit.numbers("cylindrical_gear"):
        unit.attributes(gear)["helix_angle_reference_diameter"] = (10.0, "deg")
    case, page = imported(unit, tmp_path)
    hands = [np.sign(case.gears[i].geometry.helix_angle) for i in (0, 1, 2)]
    assert hands == [1.0, -1.0, 1.0]
    assert "REXS before 1.3 states no hand" in page


def test_a_first_gear_without_helix_angle_takes_that_of_its_mate(tmp_path):
    unit = in_a_row(10.0, version="1.2")
    first, second, _, fourth = unit.numbers("cylindrical_gear")
    unit.attributes(first).pop("helix_angle_reference_diameter")
    for gear in (second, fourth):
        unit.attributes(gear)["helix_angle_reference_diameter"] = (10.0, "deg")
    case, _ = imported(unit, tmp_path)
    assert [np.sign(gear.geometry.helix_angle) for gear in case.gears] == [1.0, -1.0, 1.0]
