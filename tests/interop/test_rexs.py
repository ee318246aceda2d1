"""Reader of REXS: forms and versions of the file, places, loads, and files that are damaged or hostile."""

import base64
import struct
import zipfile
from dataclasses import replace
from math import degrees, pi

import pytest

from nvhchain.errors import FileFormatError, InputError, Mistakes, mistakes
from nvhchain.interop.rexs import read_rexs
from nvhchain.interop.rexs.contents.files import LARGEST
from nvhchain.testing.rexs_units import gear_train


def plain(unit):
    """The unit without its record, which is an object of its own."""
    return replace(unit, findings=None)


def test_a_two_stage_unit_is_read_in_si(tmp_path):
    unit = read_rexs(gear_train((20, 31), (18, 40)).save(tmp_path / "u.rexs"))
    assert [gear.teeth for gear in unit.gears] == [20, 31, 18, 40]
    assert [round(degrees(gear.helix_angle), 9) for gear in unit.gears] == [15, -15, 15, -15]
    assert unit.gears[0].z == pytest.approx(0.022, abs=1e-12)  # 42 mm on a shaft that begins at -20 mm
    assert unit.stages[1].pinion == unit.gears[2].name
    assert (unit.input_shaft, unit.output_shaft, unit.input_rotation) == ("S1", "S3", 1)
    assert (unit.loads[0].speed, unit.loads[0].torque) == pytest.approx((60 * pi, 60.0))
    assert unit.bearings[0].outer_diameter == pytest.approx(0.052)
    assert unit.bearings[0].catalogue["radial_dynamic_load_rating"] == "16.6 kN"


def test_xml_json_and_zip_hold_the_same_unit(tmp_path):
    made = gear_train((20, 31))
    xml, text = made.save(tmp_path / "u.rexs"), made.save(tmp_path / "u.rexsj")
    packed = tmp_path / "u.rexsz"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(xml, "inside.rexs")
        archive.writestr("notes.txt", "drawing")
        archive.writestr("__MACOSX/._inside.rexs", "metadata")
    first = read_rexs(xml)
    assert plain(first) == plain(read_rexs(text)) == plain(read_rexs(packed))


def test_names_of_version_1_1_mean_those_of_2_0(tmp_path):
    old, new = gear_train((20, 31), version="1.1"), gear_train((20, 31), version="2.0.0")
    for number, (kind, name, attributes) in list(old.components.items()):
        if kind == "cylindrical_gear_flank":
            old.components[number] = ("flank_geometry", name, attributes)
        if kind == "cylindrical_gear":
            attributes["helix_angle_reference_diameter"] = (15.0, "°")  # no hand before 1.3
            attributes["reference_circle_diameter"] = (62.1, "mm")
            del attributes["normal_module"]
            count = attributes["number_of_teeth"][0]
            attributes["reference_circle_diameter"] = (count * 3.0 / 0.9659258262890683, "mm")
    one, other = (read_rexs(u.save(tmp_path / f"{i}.rexs")) for i, u in enumerate((old, new)))
    assert (one.version, other.version) == ("1.1", "2.0")
    for a, b in zip(one.gears, other.gears, strict=True):
        assert a.helix_angle == pytest.approx(b.helix_angle, abs=1e-12)
        assert a.module == pytest.approx(b.module, rel=1e-9)
        assert a.profile_shift == b.profile_shift == 0.0


def test_places_follow_reference_components_and_turned_axes(tmp_path):
    """A unit whose shafts lie along y of the world is the same unit."""
    straight, turned = gear_train((20, 31)), gear_train((20, 31))
    turned.attributes(turned.numbers("gear_unit")[0]).update(
        support_vector=([5.0, 7.0, -3.0], "mm"), u_axis_vector=([0.0, 1.0, 0.0], "mm")
    )
    one, other = (read_rexs(u.save(tmp_path / f"{i}.rexs")) for i, u in enumerate((straight, turned)))
    gap = [b - a for a, b in zip(one.shafts[0].axis, one.shafts[1].axis, strict=True)]
    assert [b - a for a, b in zip(other.shafts[0].axis, other.shafts[1].axis, strict=True)] == pytest.approx(gap)


def test_a_shaft_drawn_backwards_keeps_its_gear_in_the_world(tmp_path):
    unit = gear_train((20, 31))
    shaft = unit.numbers("shaft")[1]
    length = unit.attributes(unit.numbers("shaft_section")[1])["length"][0]
    attributes = unit.attributes(shaft)
    attributes["u_axis_vector"] = ([-1.0, 0.0, 0.0], "mm")
    attributes["support_vector"] = ([length - 20.0, attributes["support_vector"][0][1], 0.0], "mm")
    gear = unit.attributes(unit.numbers("cylindrical_gear")[1])
    gear["u_coordinate_on_shaft"] = (length - gear["u_coordinate_on_shaft"][0], "mm")
    read = read_rexs(unit.save(tmp_path / "u.rexs"))
    assert read.gears[1].z == pytest.approx(read.gears[0].z, abs=1e-12)
    assert read.shafts[1].sections[0].start == pytest.approx(-0.02, abs=1e-12)


@pytest.mark.parametrize(
    ("unit", "factor"), [("m", 1e-3), ("mum", 1e3), ("mm", 1.0)], ids=["metres", "micrometres", "millimetres"]
)
def test_lengths_follow_their_unit(tmp_path, unit, factor):
    made = gear_train((20, 31))
    gear = made.attributes(made.numbers("cylindrical_gear")[0])
    gear["face_width"] = (24.0 * factor, unit)
    assert read_rexs(made.save(tmp_path / "u.rexs")).gears[0].face_width == pytest.approx(0.024, rel=1e-12)


@pytest.mark.parametrize("spelling", [("rpm", "degree"), ("U/min", "Deg"), ("min^-1", "°"), ("rev / min", "degrees")])
def test_units_are_read_in_other_spellings(tmp_path, spelling):
    names = dict(zip(("1 / min", "deg"), spelling, strict=True)) | {"mm": "MM", "N m": "N·m"}
    unit, other = gear_train((20, 31)), gear_train((20, 31))
    for attributes in (*(a for *_, a in other.components.values()), *other.load_cases[0].values()):
        attributes.update({key: (value, names.get(of, of)) for key, (value, of) in attributes.items()})
    one, same = (read_rexs(u.save(tmp_path / f"{i}.rexs")) for i, u in enumerate((unit, other)))
    assert one.gears == same.gears
    assert (one.shafts, one.stages, one.loads) == (same.shafts, same.stages, same.loads)


def test_a_unit_that_nobody_has_is_one_mistake(tmp_path):
    unit = gear_train((20, 31))
    for *_, attributes in unit.components.values():
        attributes.update({key: (value, "furlong") for key, (value, of) in attributes.items() if of == "mm"})
    with pytest.raises(InputError) as refused:
        read_rexs(unit.save(tmp_path / "u.rexs"))
    assert str(refused.value).count("furlong") == 1
    assert "is missing" not in str(refused.value)


def test_a_coded_array_is_decoded(tmp_path):
    made = gear_train((20, 31))
    text = base64.b64encode(struct.pack("<3d", 1.0, 0.0, 0.0)).decode()
    source = made.xml().replace(
        "<array><c>1.0</c><c>0.0</c><c>0.0</c></array>", f'<array code="float64">{text}</array>', 1
    )
    (tmp_path / "u.rexs").write_text(source)
    made.save(tmp_path / "v.rexs")
    assert plain(read_rexs(tmp_path / "u.rexs")) == plain(read_rexs(tmp_path / "v.rexs"))


def test_the_driving_shaft_is_the_one_that_takes_in_power(tmp_path):
    made = gear_train((20, 31))
    first, last = made.numbers("external_load")
    made.load_cases[0] = {
        made.numbers("shaft")[0]: {"rotational_speed": (-900.0, "1 / min")},
        last: {"torque_around_u_axis": (80.0, "N m")},
        first: {"torque_around_u_axis": (51.6129, "N m")},
    }
    unit = read_rexs(made.save(tmp_path / "u.rexs"))
    assert (unit.input_shaft, unit.output_shaft) == ("S2", "S1")  # turns and torque have one sign on S2 alone
    assert unit.loads[0].torque == 80.0
    assert unit.loads[0].speed == pytest.approx(30 * pi * 20 / 31)


@pytest.mark.parametrize("speed", [1800.0, -1800.0])
def test_torques_without_sign_enter_at_the_fastest_shaft(tmp_path, speed):
    """REXS 1.0 has torques without sign; here the load of the output shaft comes first."""
    unit = gear_train((20, 31), (18, 40), version="1.0")
    first, *_, last = unit.numbers("shaft")
    loads = unit.numbers("external_load")
    ends = {("assembly", first): ("assembly", last), ("assembly", last): ("assembly", first)}
    unit.relations = [
        (kind, [ends.get(end, end) for end in of] if {end for _, end in of} & set(loads) else of)
        for kind, of in unit.relations
    ]
    torques = (60.0 * 31 / 20 * 40 / 18, 60.0)
    unit.load_cases[0] = {first: {"rotational_speed": (speed, "1 / min")}} | {
        load: {"torque_around_u_axis": (torque, "N m")} for load, torque in zip(loads, torques, strict=True)
    }
    read = read_rexs(unit.save(tmp_path / "u.rexs"))
    assert (read.input_shaft, read.output_shaft, read.input_rotation) == ("S1", "S3", int(speed / 1800))
    assert read.loads[0].torque == pytest.approx(60.0)


def test_a_unit_of_two_consumers_is_refused_by_their_names(tmp_path):
    """One of them would lose its load, and the stage to it."""
    unit = gear_train((20, 31), (18, 33))
    first, second, _ = unit.numbers("shaft")
    _, last = unit.numbers("external_load")
    added = unit.add("external_load", transmits_torque=(True, "none"))
    unit.relate("assembly", assembly=second, part=added)
    unit.load_cases[0] = {
        first: {"rotational_speed": (1800.0, "1 / min")},
        last: {"torque_around_u_axis": (-100.0, "N m")},
        added: {"torque_around_u_axis": (40.0, "N m")},
    }
    with pytest.raises(InputError, match="power leaves at shafts S3, S2: a case has one input and one output"):
        read_rexs(unit.save(tmp_path / "u.rexs"))
    unit.load_cases[0][added] = {"torque_around_u_axis": (0.0, "N m")}
    read = read_rexs(unit.save(tmp_path / "u.rexs"))
    assert (read.input_shaft, read.output_shaft) == ("S1", "S3")


@pytest.mark.parametrize("known", [0, 1])
def test_power_becomes_a_torque_by_the_speed_of_any_shaft(tmp_path, known):
    """P = T ω: 12 kW at 1800 rpm of the input are 63.662 N m, whichever shaft has its speed in the file."""
    unit = gear_train((20, 31))
    shafts, (first, _) = unit.numbers("shaft"), unit.numbers("external_load")
    speed = (1800.0, -1800.0 * 20 / 31)[known]
    unit.load_cases[0] = {
        shafts[known]: {"rotational_speed": (speed, "1 / min")},
        first: {"power": (12.0, "kW")},
    }
    read = read_rexs(unit.save(tmp_path / "u.rexs"))
    assert (read.input_shaft, read.input_rotation) == ("S1", 1)
    assert read.loads[0].torque == pytest.approx(12e3 / (60 * pi), rel=1e-12)
    assert read.loads[0].speed == pytest.approx(60 * pi, rel=1e-12)


def test_another_load_case_is_chosen_by_number(tmp_path):
    made = gear_train((20, 31))
    shaft, load = made.numbers("shaft")[0], made.numbers("external_load")[0]
    made.load_cases.append(
        {shaft: {"rotational_speed": (600.0, "1 / min")}, load: {"torque_around_u_axis": (90.0, "N m")}}
    )
    path = made.save(tmp_path / "u.rexs")
    assert [load.torque for load in read_rexs(path, load_case="2").loads] == [90.0, 60.0]
    with pytest.raises(InputError, match="load case '7' is not in the file: choose one of 1, 2"):
        read_rexs(path, load_case="7")


def test_other_load_cases_coast_or_turn_the_other_way(tmp_path):
    """Power of the input by load case: driving, coasting, driving in reverse; the last has its torque at the output."""
    made = gear_train((20, 31))
    shaft, (load, out) = made.numbers("shaft")[0], made.numbers("external_load")
    for speed, at, torque in ((900.0, load, -40.0), (-900.0, load, -50.0), (900.0, out, -31.0), (900.0, out, 62.0)):
        made.load_cases.append(
            {shaft: {"rotational_speed": (speed, "1 / min")}, at: {"torque_around_u_axis": (torque, "N m")}}
        )
    first = made.load_cases[0]
    first[out] = {"torque_around_u_axis": (93.0, "N m")}  # against the wheel's rotation
    loads = read_rexs(made.save(tmp_path / "u.rexs")).loads
    assert [load.torque for load in loads] == pytest.approx([60.0, -40.0, 50.0, -20.0, 40.0])
    assert [load.reversed for load in loads] == [False, False, True, False, False]
    assert all(load.speed > 0 for load in loads)


def test_torques_without_sign_drive_in_reverse_too(tmp_path):
    made = gear_train((20, 31), version="1.0")
    shaft, (load, out) = made.numbers("shaft")[0], made.numbers("external_load")
    made.load_cases = [
        {
            shaft: {"rotational_speed": (speed, "1 / min")},
            load: {"torque_around_u_axis": (60.0, "N m")},
            out: {"torque_around_u_axis": (93.0, "N m")},
        }
        for speed in (1800.0, -1800.0)
    ]
    made.load_cases[0][out] = {"torque_around_u_axis": (-93.0, "N m")}  # power enters at both ends
    loads = read_rexs(made.save(tmp_path / "u.rexs")).loads
    assert [(load.torque, load.reversed) for load in loads] == [(60.0, False), (60.0, True)]


@pytest.mark.parametrize("speed", [1800.0, None])
def test_a_later_load_case_coasts_though_the_first_has_its_torque_at_the_output_only(tmp_path, speed):
    """At the wheel, a positive torque brakes: S2 turns against S1. The last case has no speed of its own."""
    made = gear_train((20, 31))
    shaft, (load, out) = made.numbers("shaft")[0], made.numbers("external_load")
    turning = {shaft: {"rotational_speed": (1800.0, "1 / min")}}
    made.load_cases = [
        turning | {out: {"torque_around_u_axis": (93.0, "N m")}},
        (turning if speed else {}) | {load: {"torque_around_u_axis": (-40.0, "N m")}},
    ]
    read = read_rexs(made.save(tmp_path / "u.rexs"))
    assert (read.input_shaft, read.output_shaft) == ("S1", "S2")
    assert [load.torque for load in read.loads] == pytest.approx([60.0, -40.0])


def test_coupled_shafts_are_one_and_bearings_between_shafts_stay(tmp_path):
    made = gear_train((20, 31), (18, 40))
    y = made.attributes(made.numbers("shaft")[2])["support_vector"][0][1]
    stub = made.add(
        "shaft", "Stub", support_vector=([140.0, y, 0.0], "mm"), reference_component_for_position=(1, "none")
    )
    section = made.add("shaft_section", length=(60.0, "mm"), outer_diameter_begin=(25.0, "mm"))
    made.relate("assembly", assembly=stub, part=section)
    coupling = made.add("coupling", "Flange")
    made.relate("side", assembly=coupling, inner_part=made.numbers("shaft")[2], outer_part=stub)
    unit = read_rexs(made.save(tmp_path / "u.rexs"))
    assert [shaft.name for shaft in unit.shafts] == ["S1", "S2", "S3"]
    assert unit.shafts[2].sections[-1].end == pytest.approx(0.2)


# --- refusals


def refused(made, path):
    """Return the lines of the refusal of a unit."""
    with pytest.raises(InputError) as caught:
        read_rexs(made.save(path / "u.rexs"))
    return str(caught.value)


@pytest.mark.parametrize("kind", ["bevel_stage", "worm_stage", "planetary_stage", "ring_gear"])
def test_stages_that_the_chain_cannot_model_are_refused_by_name(tmp_path, kind):
    made = gear_train((20, 31))
    made.add(kind, "the odd one")
    text = refused(made, tmp_path)
    assert all(words in text for words in ("are not modelled", f"{kind} ", "leave it out"))
    assert ";" not in text, "one line"


def test_all_mistakes_are_stated_at_once(tmp_path):
    made = gear_train((20, 31))
    first, second = made.numbers("cylindrical_gear")
    del made.attributes(first)["face_width"]
    made.attributes(second)["number_of_teeth"] = ("many", "none")
    made.attributes(made.numbers("shaft_section")[0])["length"] = (1.0, "furlong")
    text = refused(made, tmp_path)
    assert "face_width is missing" in text
    assert "number_of_teeth = 'many' is no finite number" in text
    assert "'furlong' is none of REXS: correct it, first at length of shaft_section" in text


def test_a_unit_of_another_quantity_is_refused(tmp_path):
    made = gear_train((20, 31))
    made.attributes(made.numbers("cylindrical_gear")[0])["face_width"] = (24.0, "N m")
    assert "face_width is in 'N m', which is no unit for m" in refused(made, tmp_path)


def test_a_circle_of_references_is_refused(tmp_path):
    made = gear_train((20, 31))
    one, other = made.numbers("shaft")
    made.attributes(one)["reference_component_for_position"] = (other, "none")
    made.attributes(other)["reference_component_for_position"] = (one, "none")
    assert refused(made, tmp_path).count("runs in a circle") == 1, "one line for a circle"


def test_mistakes_of_places_relations_units_and_bearings_have_a_line_each(tmp_path):
    made = gear_train((20, 31))
    one, other = made.numbers("shaft")
    made.attributes(one)["reference_component_for_position"] = (other, "none")
    made.attributes(other)["reference_component_for_position"] = (one, "none")
    gears = made.numbers("cylindrical_gear")
    made.relations = [
        (kind, ends) for kind, ends in made.relations if not any(e in gears and r == "part" for r, e in ends)
    ]
    made.attributes(gears[0])["face_width"] = (1.0, "furlong")
    bearing = next(n for n, (kind, *_) in made.components.items() if kind == "rolling_bearing_with_catalog_geometry")
    made.attributes(bearing)["inner_diameter"] = (90.0, "mm")
    with pytest.raises(Mistakes) as caught:
        read_rexs(made.save(tmp_path / "u.rexs"))
    lines = mistakes(caught.value)
    for words in ("runs in a circle", "'furlong' is none of REXS", "inner_diameter = 90 mm is not below outer_diam"):
        assert sum(words in line for line in lines) == 1
    assert sum("stands on no shaft" in line for line in lines) == 2
    assert all(": " in line and "\n" not in line for line in lines)


def test_gears_without_a_shaft_and_a_bearing_without_anything_are_refused(tmp_path):
    made = gear_train((20, 31))
    gears = made.numbers("cylindrical_gear")
    bearing = made.add("concept_bearing", "nowhere")
    made.relations = [
        (kind, ends) for kind, ends in made.relations if not any(e in gears and r == "part" for r, e in ends)
    ]
    text = refused(made, tmp_path)
    assert all(f"cylindrical_gear {gear} " in text for gear in gears)
    assert f"concept_bearing {bearing} (nowhere): stands on no shaft" in text


def test_a_relation_to_a_missing_component_is_refused(tmp_path):
    made = gear_train((20, 31))
    made.relate("assembly", assembly=999, part=1)
    assert "names component 999, which is not in the file" in refused(made, tmp_path)


def test_a_loop_of_power_is_refused(tmp_path):
    made = gear_train((20, 31), (18, 40))
    first, last = made.numbers("cylindrical_gear")[0], made.numbers("cylindrical_gear")[3]
    stage = made.add("cylindrical_stage", "closing", center_distance=(100.0, "mm"))
    made.relate("stage", stage=stage, gear_1=first, gear_2=last)
    assert "closes a loop of shafts" in refused(made, tmp_path)


def test_inclined_shafts_are_refused(tmp_path):
    made = gear_train((20, 31))
    made.attributes(made.numbers("shaft")[1])["u_axis_vector"] = ([1.0, 0.02, 0.0], "mm")
    assert "is not parallel to the first shaft" in refused(made, tmp_path)


BOMB = """<?xml version="1.0"?><!DOCTYPE model [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<model version="1.4"><components><component id="1" type="shaft" name="&b;"/></components></model>"""


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (BOMB.encode(), "a document type or entity"),
        (BOMB.encode("utf-16"), "a document type or entity"),
        (gear_train((20, 31)).xml()[:3000].encode(), "not valid XML"),
        (gear_train((20, 31)).json()[:3000].encode(), "not valid JSON"),
        (b"<a>" * 1000, "more than 40 nested"),
        (b"[" * 100_000, "is neither XML, JSON nor ZIP"),
        (b'{"model":' + b"[" * 100_000, "nested too deeply"),
        (b'{"model": {"version": "1.4", "components": 3}}', "without the objects of REXS"),
        (b"PK\x03\x04 broken", "a damaged"),
        (b"", "is neither XML, JSON nor ZIP"),
        (b"<model version='9.9'/>", "REXS 9.9 is unknown"),
        (b"<model version='one'/>", "is none of REXS"),
        (b"<gearbox/>", "its root element is <gearbox>"),
        (b"<model version='1.4'><components/></model>", "holds no components"),
        (b"<model version='1.4'><components><component id='x' type='shaft'/></components></model>", "no whole number"),
    ],
)
def test_damaged_and_hostile_files_are_refused_in_one_line(tmp_path, content, words):
    path = tmp_path / "u.rexs"
    path.write_bytes(content)
    with pytest.raises((FileFormatError, InputError), match=words) as caught:
        read_rexs(path)
    assert "\n" not in str(caught.value)


def test_a_zip_bomb_is_refused(tmp_path):
    path = tmp_path / "u.rexsz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("u.rexs", b"<model>" + b" " * (LARGEST + 10))
    with pytest.raises(InputError, match="larger than 64 MiB"):
        read_rexs(path)


def test_an_archive_of_two_models_is_refused(tmp_path):
    path = tmp_path / "u.rexsz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.rexs", "<model/>")
        archive.writestr("b.rexs", "<model/>")
    with pytest.raises(InputError, match="holds 2 models"):
        read_rexs(path)
