"""Bearings of an imported gear unit: kinds, pairs, ribs, what holds the shaft, and what cannot carry its load."""

import re

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.testing.rexs_units import gear_train, imported


def test_the_preload_of_tapered_bearings_is_taken(tmp_path):
    unit = gear_train((20, 31))
    for number, bearing in enumerate(unit.numbers("rolling_bearing_with_catalog_geometry")):
        unit.attributes(bearing).update(
            bearing_type=("radial_tapered_roller_bearing", "none"),
            axial_force_absorption=(("negative", "positive")[number % 2], "none"),
            preload_distance=(4.0, "mum"),
        )
    case, page = imported(unit, tmp_path)
    assert [bearing.model.axial_clearance for bearing in case.bearings] == pytest.approx([-4e-6] * 4)
    assert "linear springs" not in page
    # both bearings of a shaft push against each other, whatever the torque
    front, rear, *_ = case.equilibrium.bearing_load
    assert front[2] * rear[2] < 0


def test_bearings_beside_each_other_share_a_seat(tmp_path):
    unit = gear_train((20, 31))
    first = unit.numbers("rolling_bearing_with_catalog_geometry")[0]
    kind, name, attributes = unit.components[first]
    twin = unit.add(kind, name, **{**attributes, "u_coordinate_on_shaft_inner_side": (4.0, "mm")})
    unit.relate("side", assembly=twin, inner_part=unit.numbers("shaft")[0], outer_part=unit.numbers("gear_casing")[0])
    case, page = imported(unit, tmp_path)
    assert len(case.bearings) == 4
    assert "beside each other" in page


@pytest.mark.parametrize(
    ("ways", "arrangement"),
    [(("positive", "negative"), "back_to_back"), (("negative", "positive"), "face_to_face")],
)
def test_alike_bearings_beside_each_other_are_a_pair(tmp_path, ways, arrangement):
    """Two tapered bearings locate the shaft, a cylindrical one floats; O and X differ by the directions they carry."""
    unit = gear_train((20, 31))
    first, last = unit.numbers("rolling_bearing_with_catalog_geometry")[:2]
    unit.attributes(last).update(
        bearing_type=("radial_roller_bearing", "none"), axial_force_absorption=("no_direction", "none")
    )
    unit.attributes(first).update(
        bearing_type=("radial_tapered_roller_bearing", "none"), axial_force_absorption=(ways[0], "none")
    )
    kind, name, attributes = unit.components[first]
    place = attributes["u_coordinate_on_shaft_inner_side"][0] + attributes["width"][0]
    beside = {"u_coordinate_on_shaft_inner_side": (place, "mm"), "axial_force_absorption": (ways[1], "none")}
    twin = unit.add(kind, name, **{**attributes, **beside})
    unit.relate("side", assembly=twin, inner_part=unit.numbers("shaft")[0], outer_part=unit.numbers("gear_casing")[0])
    case, page = imported(unit, tmp_path)
    pair = case.bearings[0].model
    assert (type(pair).__name__, pair.arrangement, pair.thrust) == ("Tapered", arrangement, 0)
    assert pair.row_distance == pytest.approx(1e-3 * attributes["width"][0])
    assert "alike bearings beside each other are a pair" in page
    push = case.equilibrium.bearing_load[0][2]
    assert abs(push) == pytest.approx(abs(case.mesh_forces[0] * _base_sine(case)), rel=1e-8)


def ribbed(unit, number, **others):
    """Make a bearing of a unit a cylindrical one with ribs on both sides, and set beside it `number` alike ones."""
    first = unit.numbers("rolling_bearing_with_catalog_geometry")[0]
    kind, name, attributes = unit.components[first]
    attributes.update(
        bearing_type=("radial_roller_bearing", "none"), axial_force_absorption=("both_directions", "none")
    )
    place, width = (attributes[key][0] for key in ("u_coordinate_on_shaft_inner_side", "width"))
    for one in range(number):
        beside = {"u_coordinate_on_shaft_inner_side": (place + (one + 1) * width, "mm")}
        twin = unit.add(kind, name, **{**attributes, **beside, **others})
        unit.relate(
            "side", assembly=twin, inner_part=unit.numbers("shaft")[0], outer_part=unit.numbers("gear_casing")[0]
        )
    return unit


def ribs(page):
    """Return the stiffness (N/m) of the ribs that a page has."""
    return [float(found) for found in re.findall(r"stiffness of the ribs \| ([\d.e+]+) N/m", page)]


def test_alike_bearings_with_ribs_are_a_pair_whatever_their_loads_are(tmp_path):
    """The assumed stiffness of ribs follows the load of each bearing; the pair has both."""
    case, page = imported(ribbed(gear_train((20, 31)), 1), tmp_path)
    one, other = ribs(page)
    assert one != other
    pair = case.bearings[0].model
    assert (type(pair).__name__, pair.arrangement) == ("Cylindrical", "tandem")
    assert pair.axial_stiffness == pytest.approx(one + other, rel=1e-6)


def test_a_cylindrical_bearing_keeps_its_ribs_with_constant_stiffness(tmp_path):
    """The bearing beside it differs, and so both get constant stiffness; the seat still locates its shaft."""
    case, page = imported(ribbed(gear_train((20, 31)), 1, width=(18.0, "mm")), tmp_path)
    assert case.bearings[0].model is None
    assert case.bearings[0].axial_stiffness == pytest.approx(sum(ribs(page)), rel=0.01)
    assert case.bearings[0].axial_stiffness == pytest.approx(0.1 * case.bearings[0].radial_stiffness, rel=0.01)


def test_an_overloaded_cylindrical_bearing_keeps_its_ribs(tmp_path):
    unit = ribbed(gear_train((20, 31)), 0)
    with_elements(unit, 4, 1.0)
    unit.attributes(unit.numbers("rolling_element")[0])["length_of_rolling_element"] = (1.0, "mm")
    case, page = imported(unit, tmp_path)
    assert page.count("constant stiffness in place of them") == 1
    assert case.bearings[0].model is None
    assert case.bearings[0].axial_stiffness == pytest.approx(0.1 * case.bearings[0].radial_stiffness, rel=0.01)


def test_three_alike_bearings_have_three_times_the_stiffness_and_are_no_pair(tmp_path):
    case, page = imported(ribbed(gear_train((20, 31)), 2), tmp_path)
    assert len(ribs(page)) == 3
    assert case.bearings[0].axial_stiffness == pytest.approx(sum(ribs(page)), rel=0.01)
    assert case.bearings[0].axial_stiffness == pytest.approx(0.1 * case.bearings[0].radial_stiffness, rel=0.01)
    assert "are a pair" not in page
    assert page.count("beside each other") == 1


def with_elements(unit, count, size):
    """Add balls to the first bearing of a unit."""
    bearing = unit.numbers("rolling_bearing_with_catalog_geometry")[0]
    row = unit.add("rolling_bearing_row", number_of_rolling_elements=(count, "none"), pressure_angle=(15.0, "deg"))
    ball = unit.add("rolling_element", diameter_of_rolling_element=(size, "mm"))
    unit.relate("ordered_assembly", assembly=bearing, part=row)
    unit.relate("ordered_assembly", assembly=row, part=ball)
    return unit.attributes(bearing)


def test_bearings_of_the_file_keep_their_rolling_elements(tmp_path):
    unit = gear_train((20, 31))
    with_elements(unit, 9, 7.5)["axial_force_absorption"] = ("negative", "none")
    second = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[1])
    second["radial_static_load_rating"] = (9.5, "kN")
    case, page = imported(unit, tmp_path)
    first, rated, plain = (bearing.model for bearing in case.bearings[:3])
    assert (type(first).__name__, first.elements, first.thrust) == ("AngularContact", 9, -1)
    assert (first.element_diameter, first.contact_angle) == pytest.approx((7.5e-3, np.radians(15)))
    assert (rated.elements, rated.static_load_rating, rated.dynamic_load_rating) == (None, 9500.0, 16600.0)
    assert plain.elements == round(0.6 * np.pi * 40 / 7.2)
    assert "load ratings of the file by ISO 76" in page
    assert "0.3 (D - d), 60 % filled" in page


@pytest.mark.filterwarnings("ignore:stage .* the faces share")
@pytest.mark.parametrize("along", [1, -1])
def test_a_tapered_bearing_carries_the_direction_of_its_shaft(tmp_path, along):
    """The file gives it along the axis of the shaft, the case along z."""
    unit = gear_train((20, 31), helix=0.0)
    shaft = unit.attributes(unit.numbers("shaft")[1])
    if along < 0:  # the same shaft, seen from its other end
        shaft["support_vector"][0][0] += 104.0
        shaft["u_axis_vector"] = ([-1.0, 0.0, 0.0], "mm")
    front, rear = unit.numbers("rolling_bearing_with_catalog_geometry")[2:]
    for bearing, way in ((front, "positive"), (rear, "negative")):
        unit.attributes(bearing).update(
            bearing_type=("radial_tapered_roller_bearing", "none"), axial_force_absorption=(way, "none")
        )
    case, _ = imported(unit, tmp_path)
    assert [bearing.model.thrust for bearing in case.bearings[2:]] == [along, -along]


@pytest.mark.parametrize(
    ("kind", "made"),
    [("radial_grooved_ball_bearing", "DeepGroove"), ("radial_self_aligning_roller_bearing", "Spherical")],
)
def test_a_floating_bearing_keeps_its_rolling_elements_and_carries_no_thrust(tmp_path, kind, made):
    """Locating and floating bearing of one type are the most common arrangement of all."""
    unit = gear_train((20, 31))
    for number, bearing in enumerate(unit.numbers("rolling_bearing_with_catalog_geometry")):
        unit.attributes(bearing).update(
            bearing_type=(kind, "none"),
            axial_force_absorption=(("both_directions", "no_direction")[number % 2], "none"),
        )
    case, page = imported(unit, tmp_path)
    assert [(type(b.model).__name__, b.model.floating) for b in case.bearings] == [(made, False), (made, True)] * 2
    assert "constant stiffness" not in page
    push = [load[2] for load in case.equilibrium.bearing_load]
    assert push[1] == push[3] == 0.0
    thrust = abs(case.mesh_forces[0] * _base_sine(case))
    assert np.abs([push[0], push[2]]) == pytest.approx([thrust, thrust], rel=1e-8)


def _base_sine(case):
    """Return sin β_b of the first gear."""
    of = case.gears[0].geometry
    return np.sin(of.helix_angle) * np.cos(of.normal_pressure_angle)


@pytest.mark.parametrize("along", ["positive", "negative"])
def test_an_angular_contact_bearing_by_its_own_name_is_one(tmp_path, along):
    unit = gear_train((20, 31))
    pair = unit.numbers("rolling_bearing_with_catalog_geometry")[:2]
    for bearing, way in zip(pair, (along, "positive" if along == "negative" else "negative"), strict=True):
        unit.attributes(bearing).update(
            bearing_type=("angular_contact_ball_bearing", "none"), axial_force_absorption=(way, "none")
        )
    case, _ = imported(unit, tmp_path)
    sign = 1 if along == "positive" else -1
    assert [type(bearing.model).__name__ for bearing in case.bearings[:2]] == ["AngularContact"] * 2
    assert [bearing.model.thrust for bearing in case.bearings[:2]] == [sign, -sign]
    assert case.bearings[0].model.contact_angle == pytest.approx(np.radians(25.0))


@pytest.mark.parametrize(("stated", "apart"), [({}, 15.1e-3), ({"distance_between_bearing_rows": (20.0, "mm")}, 20e-3)])
def test_a_double_row_angular_contact_bearing_carries_both_ways(tmp_path, stated, apart):
    """A 3208: 40 x 80 x 30.2 mm, C = 51 kN and C_0 = 44 kN of both rows together, 30°."""
    unit = gear_train((20, 31))
    first, last = unit.numbers("rolling_bearing_with_catalog_geometry")[:2]
    unit.attributes(first).update(
        bearing_type=("angular_contact_ball_bearing", "none"),
        axial_force_absorption=("both_directions", "none"),
        number_of_bearing_rows=(2, "none"),
        inner_diameter=(40.0, "mm"),
        outer_diameter=(80.0, "mm"),
        width=(30.2, "mm"),
        radial_static_load_rating=(44.0, "kN"),
        radial_dynamic_load_rating=(51.0, "kN"),
        **stated,
    )
    unit.attributes(last)["axial_force_absorption"] = ("no_direction", "none")
    case, page = imported(unit, tmp_path)
    model = case.bearings[0].model
    assert (model.arrangement, model.thrust, model.row_distance) == ("back_to_back", 0, pytest.approx(apart))
    assert ("mm apart" in page) == (not stated)
    assert (model.static_load_rating, model.dynamic_load_rating) == pytest.approx((22e3, 51e3 / 2**0.7))
    assert model.internal.static_rating == pytest.approx(22e3, rel=0.02)
    push = case.equilibrium.bearing_load[0][2]
    assert abs(push) == pytest.approx(abs(case.mesh_forces[0] * _base_sine(case)), rel=1e-8)


def test_a_thrust_bearing_beside_a_floating_one_locates_the_shaft(tmp_path):
    """A cylindrical roller bearing and a four-point bearing that is free radially share a seat."""
    unit = gear_train((20, 31))
    first = unit.numbers("rolling_bearing_with_catalog_geometry")
    for bearing in first[:2]:
        unit.attributes(bearing).update(
            bearing_type=("radial_roller_bearing", "none"), axial_force_absorption=("no_direction", "none")
        )
    beside = unit.attributes(first[0])
    place = beside["u_coordinate_on_shaft_inner_side"][0] + 17.0
    added = unit.add(
        "rolling_bearing_with_catalog_geometry",
        "QJ",
        **beside
        | {
            "bearing_type": ("four_point_contact_ball_bearing", "none"),
            "axial_force_absorption": ("both_directions", "none"),
            "radial_force_absorption": (False, "none"),
            "u_coordinate_on_shaft_inner_side": (place, "mm"),
        },
    )
    unit.relate("side", assembly=added, inner_part=unit.numbers("shaft")[0], outer_part=unit.numbers("gear_casing")[0])
    case, page = imported(unit, tmp_path)
    assert len(case.bearings) == 4
    assert case.bearings[0].axial_stiffness > 1e7
    assert "beside each other" in page


def test_the_default_damping_of_an_import_is_printed(tmp_path):
    case, _ = imported(gear_train((20, 31)), tmp_path)
    assert case.undamped == tuple(bearing.name for bearing in case.bearings)
    assert {bearing.stiffness_damping for bearing in case.gearbox.bearings} == {1.25e-5}


def test_a_bearing_that_cannot_carry_its_load_gets_a_constant_stiffness_alone(tmp_path):
    """Formula of Krämer for balls: 13e6 Z^(2/3) D_w^(1/3) F^(1/3) cos^(5/3) α."""
    unit = gear_train((20, 31))
    with_elements(unit, 4, 2.0)["axial_force_absorption"] = ("negative", "none")
    case, page = imported(unit, tmp_path)
    assert [bearing.model is None for bearing in case.bearings] == [True, False, False, False]
    assert page.count("constant stiffness in place of them") == 1
    load = 1e3 * float(re.search(r"4 elements of 2 mm at ([\d.]+) kN", page)[1])
    wanted = 13e6 * 4 ** (2 / 3) * 0.002 ** (1 / 3) * load ** (1 / 3) * np.cos(np.radians(15)) ** (5 / 3)
    assert case.bearings[0].radial_stiffness == pytest.approx(wanted, rel=2e-3)
    ratio = case.bearings[0].axial_stiffness / case.bearings[0].radial_stiffness
    assert ratio == pytest.approx(2 * np.tan(np.radians(15)) ** 2, rel=1e-3)
    forces = abs(case.mesh_forces[0])
    assert 0.3 * forces < load < forces, "one of two bearings beside the mesh"


@pytest.mark.parametrize(
    ("stated", "angle"), [({"catalogue_value_e": 0.83}, 28.96), ({"axial_factor_y_2": 0.72}, 29.05), ({}, None)]
)
def test_tapered_rollers_have_the_contact_angle_of_the_catalogue(tmp_path, stated, angle):
    """By e = 1.5 tan α and Y = 0.4 cot α of ISO 281; 31308 has 28.8°, twice that of a usual one."""
    unit = gear_train((20, 31))
    for number, bearing in enumerate(unit.numbers("rolling_bearing_with_catalog_geometry")):
        unit.attributes(bearing).update(
            bearing_type=("radial_tapered_roller_bearing", "none"),
            axial_force_absorption=(("negative", "positive")[number % 2], "none"),
            **{name: (value, "none") for name, value in stated.items()},
        )
    case, page = imported(unit, tmp_path)
    found = np.degrees([bearing.model.contact_angle for bearing in case.bearings])
    if angle is None:
        assert (found < 20.0).all()
        assert "usual of its type" in page
    else:
        assert found == pytest.approx([angle] * 4, abs=0.01)
        assert "(ISO 281)" in page


@pytest.mark.parametrize(("stated", "angle"), [({"catalogue_value_e": 0.24}, 9.09), ({"axial_factor_y_2": 4.2}, 9.06)])
def test_spherical_rollers_have_the_contact_angle_of_the_catalogue(tmp_path, stated, angle):
    """By e = 1.5 tan α and Y₂ = 0.67 cot α of ISO 281; both are those of 22212 E, SKF."""
    unit = gear_train((20, 31))
    for bearing in unit.numbers("rolling_bearing_with_catalog_geometry"):
        unit.attributes(bearing).update(
            bearing_type=("radial_self_aligning_roller_bearing", "none"),
            **{name: (value, "none") for name, value in stated.items()},
        )
    case, page = imported(unit, tmp_path)
    assert np.degrees([b.model.internal.angle for b in case.bearings]) == pytest.approx([angle] * 4, abs=0.05)
    assert "(ISO 281)" in page


@pytest.mark.parametrize(
    ("designation", "angle"),
    [
        ("7206-B", 40.0), ("7206 BECBP", 40.0), ("7206-B-XL-TVP", 40.0), ("7206 ACD/P4A", 25.0), ("7206 CD/P4A", 15.0),
        ("B7206-C-T-P4S", 15.0), ("B7206-E-T-P4S", 25.0), ("7206A", 30.0), ("7206A5TRDUMP3", 25.0),
        ("7206CTYNDULP4", 15.0), ("7206AD", 25.0), ("7206", 25.0),
        ("7206 Antrieb", 25.0), ("7206 Bearing left", 25.0),
    ],
)  # fmt: skip
def test_the_suffix_of_an_angular_contact_bearing_is_its_angle(tmp_path, designation, angle):
    unit = gear_train((20, 31))
    for number, bearing in enumerate(unit.numbers("rolling_bearing_with_catalog_geometry")):
        unit.attributes(bearing).update(
            catalogue_designation=(designation, "none"),
            bearing_type=("angular_contact_ball_bearing", "none"),
            axial_force_absorption=(("negative", "positive")[number % 2], "none"),
        )
    case, _ = imported(unit, tmp_path)
    assert np.degrees([bearing.model.contact_angle for bearing in case.bearings]) == pytest.approx([angle] * 4)


def test_thrust_bearings_are_refused_unless_their_stiffness_is_stated(tmp_path):
    """As radial bearings they would carry what they cannot, and not what they are for."""
    unit = gear_train((20, 31))
    own = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[0])
    own["bearing_type"] = ("axial_roller_bearing", "none")
    with pytest.raises(InputError, match=r"axial_roller_bearing is a thrust bearing, .* give its axial_stiffness"):
        imported(unit, tmp_path)
    own["axial_stiffness"] = (3e8, "N / m")
    own["radial_stiffness"] = (1e8, "N / m")
    case, _ = imported(unit, tmp_path)
    assert (case.bearings[0].model, case.bearings[0].axial_stiffness) == (None, 3e8)
