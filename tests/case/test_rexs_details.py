"""What a gear unit states in detail: inside of bearings, stiffness at the operating point, masses, tooth thickness."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nvhchain.bearings import DeepGroove
from nvhchain.bearings.springs import StiffnessMatrix
from nvhchain.case import load_case
from nvhchain.case.rexs import export_rexs, import_rexs
from nvhchain.case.rexs.designation import light_sizes, named_sizes
from nvhchain.gear.drawing.measures import dimension_over_balls
from nvhchain.interop import read_rexs
from nvhchain.testing.rexs_units import gear_train, imported

CASES = Path(__file__).parents[2] / "cases"


@pytest.mark.parametrize(
    ("designation", "sizes"),
    [
        ("33014", (70, 110, 31)),
        ("32210-A", (50, 90, 24.75)),
        ("61808", (40, 52, 7)),
        ("6205-2RS", (25, 52, 15)),
        ("NU 210 E", (50, 90, 20)),
        ("NJ2206", (30, 62, 20)),
        ("22210 E", (50, 90, 23)),
        ("3208", (40, 80, 30.2)),
        ("7208-B", (40, 80, 18)),
        ("NA4908", (40, 62, 22)),
        ("NSK 6205", (25, 52, 15)),
        ("50x58x25", (50, 58, 25)),
        ("16008", (40, 68, None)),
        ("T2ED045", None),
    ],
)
def test_sizes_follow_from_the_designation(designation, sizes):
    """Of manufacturers' catalogues; a width that the table does not have is left open."""
    found = named_sizes(designation)
    if sizes is None:
        assert found is None
    else:
        assert found[:2] == pytest.approx([1e-3 * size for size in sizes[:2]])
        assert found[2] == (None if sizes[2] is None else pytest.approx(1e-3 * sizes[2]))


def test_a_bearing_without_designation_is_of_the_light_series():
    assert light_sizes(0.040) == pytest.approx((0.040, 0.080, 0.018))
    assert light_sizes(0.038) == pytest.approx((0.038, 0.076, 0.0171))


def detailed(unit, **row):
    """Give the first bearing of a unit nine balls of 7.5 mm, in a row with further attributes."""
    bearing = unit.numbers("rolling_bearing_with_catalog_geometry")[0]
    made = unit.add("rolling_bearing_row", number_of_rolling_elements=(9, "none"), **row)
    ball = unit.add("rolling_element", diameter_of_rolling_element=(7.5, "mm"))
    unit.relate("ordered_assembly", assembly=bearing, part=made)
    unit.relate("ordered_assembly", assembly=made, part=ball)
    return unit


def test_detailed_geometry_of_a_bearing_is_taken_and_written(tmp_path):
    """Pitch circle and groove radii of the file replace those of the drawing, and return from an export."""
    circles = {
        "reference_diameter": (41.0, "mm"),
        "raceway_radius_of_inner_ring": (3.825, "mm"),
        "raceway_radius_of_outer_ring": (3.9, "mm"),
    }
    case, page = imported(detailed(gear_train((20, 31)), **circles), tmp_path / "first")
    plain, _ = imported(detailed(gear_train((20, 31))), tmp_path / "plain")
    model = case.bearings[0].model
    found = model.pitch_diameter, model.inner_groove_radius, model.outer_groove_radius
    assert found == pytest.approx((41e-3, 3.825e-3, 3.9e-3))
    assert "pitch diameter" in page
    stiffer, usual = (of.bearings[0].model.evaluate(np.array([2e-5, 0, 0, 0, 0]))[1][0, 0] for of in (case, plain))
    assert stiffer > 1.05 * usual
    export_rexs(case, tmp_path / "back.rexs")
    back = load_case(import_rexs(tmp_path / "back.rexs", tmp_path / "back").case).bearings[0].model
    assert isinstance(back, DeepGroove)
    assert (back.pitch_diameter, back.inner_groove_radius, back.outer_groove_radius) == pytest.approx(found)


def test_detailed_geometry_that_contradicts_itself_is_named_and_left(tmp_path):
    case, page = imported(detailed(gear_train((20, 31)), reference_diameter=(90.0, "mm")), tmp_path)
    assert case.bearings[0].model.pitch_diameter is None
    assert "pitch\\_diameter = 90 mm is outside" in page


def operating(unit):
    """Give the first bearing of a unit a stiffness at the operating point that couples pushes and tilts."""
    values = {
        **{"f_v_d_v": (3e8, "N / m"), "f_w_d_w": (1e8, "N / m"), "f_u_d_u": (5e7, "N / m")},
        **{"f_v_d_w": (4e7, "N / m"), "m_v_rot_v": (2e6, "N mm / rad"), "m_w_rot_w": (3e6, "N mm / rad")},
        **{"f_v_rot_w": (1e5, "N / rad"), "m_w_d_v": (1e5, "N")},
    }
    bearing = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[0])
    bearing.update({f"operating_point_stiffness_{name}": value for name, value in values.items()})
    return unit


def test_the_stiffness_at_the_operating_point_is_taken_whole(tmp_path):
    """A mean of both directions made 2e8 N/m of 3e8 and 1e8 N/m, and free tilts; it returns from an export."""
    case, page = imported(operating(gear_train((20, 31))), tmp_path / "first")
    found = case.bearings[0].model.stiffness
    expected = np.diag([3e8, 1e8, 5e7, 2e3, 3e3])
    expected[0, 1] = expected[1, 0] = 4e7
    expected[0, 4] = expected[4, 0] = 1e5
    assert found == pytest.approx(expected)
    assert "5 × 5 matrix" in page
    export_rexs(case, tmp_path / "back.rexs")
    back = load_case(import_rexs(tmp_path / "back.rexs", tmp_path / "back").case)
    assert back.bearings[0].model.stiffness == pytest.approx(expected)
    assert np.isfinite(case.equilibrium.bearing_load).all()


def test_the_stiffness_at_the_operating_point_turns_with_its_shaft(tmp_path):
    """A shaft whose v axis lies along w of the first one: the stiff direction lies along y of the case."""
    unit = gear_train((20, 31))
    values = zip("uvw", (5e7, 3e8, 1e8), strict=True)
    bearing = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[2])
    bearing.update({f"operating_point_stiffness_f_{axis}_d_{axis}": (k, "N / m") for axis, k in values})
    unit.attributes(unit.numbers("shaft")[1])["w_axis_vector"] = ([0.0, -1.0, 0.0], "mm")
    case, _ = imported(unit, tmp_path)
    assert np.diag(case.bearings[2].model.stiffness)[:3] == pytest.approx([1e8, 3e8, 5e7])


def test_a_stiffness_at_the_operating_point_without_symmetry_is_named(tmp_path):
    unit = operating(gear_train((20, 31)))
    bearing = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[0])
    bearing["operating_point_stiffness_f_w_d_v"] = (-4e7, "N / m")
    case, page = imported(unit, tmp_path)
    assert case.bearings[0].model is None
    assert "differs from its transpose by 26.7 %" in page


def test_two_equal_springs_stay_springs(tmp_path):
    unit = gear_train((20, 31))
    values = {f"operating_point_stiffness_f_{axis}_d_{axis}": (2e8, "N / m") for axis in "uvw"}
    unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[0]).update(values)
    case, _ = imported(unit, tmp_path)
    assert not isinstance(case.bearings[0].model, StiffnessMatrix)
    assert case.bearings[0].radial_stiffness == pytest.approx(2e8)


def test_additional_masses_turn_with_their_shaft(tmp_path):
    unit = gear_train((20, 31))
    inertias = {f"moment_of_inertia_{axis}_axis": (value, "kg m^2") for axis, value in (("u", 4e-3), ("v", 3e-3))}
    mass = unit.add(
        "additional_mass", "flange", u_coordinate_on_shaft=(5.0, "mm"), mass_of_component=(2.5, "kg"), **inertias
    )
    unit.relate("assembly", assembly=unit.numbers("shaft")[0], part=mass)
    case, page = imported(unit, tmp_path / "first")
    (body,) = case.shafts[0].bodies
    assert (body.mass, body.polar_inertia, body.transverse_inertia) == (2.5, 4e-3, 3e-3)
    assert body.z - case.shafts[0].segments[0].start == pytest.approx(5e-3, abs=1e-8)
    assert "additional mass" in page.partition("## Taken")[2]
    assert not any("bodies" in text for text in export_rexs(case, tmp_path / "back.rexs"))
    back = load_case(import_rexs(tmp_path / "back.rexs", tmp_path / "back").case).shafts[0]
    assert (back.bodies[0].mass, back.bodies[0].polar_inertia) == (2.5, pytest.approx(4e-3))
    assert back.bodies[0].z - back.segments[0].start == pytest.approx(5e-3, abs=1e-8)


def thinned(tmp_path, **attributes):
    """Return the thickness allowances (m) of both gears, with attributes of the first one."""
    unit = gear_train((20, 31))
    unit.attributes(unit.numbers("cylindrical_gear")[0]).update(attributes)
    case, page = imported(unit, tmp_path)
    return [gear.geometry.thickness_allowance for gear in case.gears], page


@pytest.mark.parametrize("series", ["cd25", "cd 25", "25cd"])
def test_the_series_of_din_3967_is_the_thickness_of_the_teeth(tmp_path, series):
    """Reference diameter 62.1 mm: upper allowance −70 µm, tolerance 40 µm (DIN 3967, tables 1 and 2)."""
    name = "tooth_thickness_deviation_tolerance_series_din_3967_1978"
    (found, _), page = thinned(tmp_path, **{name: (series, "none")})
    assert found == pytest.approx(90e-6)
    assert "DIN 3967 cd 25 at 62.117 mm, middle of the tolerance" in page


@pytest.mark.parametrize("teeth", [20, 21], ids=["even", "odd"])
def test_a_deviation_over_balls_is_one_of_the_thickness(tmp_path, teeth):
    unit = gear_train((teeth, 31))
    gear = unit.attributes(unit.numbers("cylindrical_gear")[0])
    gear.update(
        diameter_of_measuring_ball_or_pin=(5.25, "mm"),
        upper_backlash_allowance_balls_or_pins=(-0.100, "mm"),
        lower_backlash_allowance_balls_or_pins=(-0.140, "mm"),
    )
    case, page = imported(unit, tmp_path)
    assert "mean deviation over balls of 5.25 mm" in page
    thin = case.gears[0].geometry
    full = dimension_over_balls(replace(thin, thickness_allowance=0.0), 5.25e-3)
    assert full - dimension_over_balls(thin, 5.25e-3) == pytest.approx(0.12e-3, abs=1e-9)


def test_a_chord_is_the_thickness_of_the_teeth(tmp_path):
    """The chord of a circle of d/cos²β: 4.7 mm of arc are 4.6962 mm of chord at z = 20, m = 3 mm, β = 15°."""
    virtual = 60.0 / np.cos(np.radians(15)) ** 3
    chord = virtual * np.sin(4.5 / virtual)
    (found, _), _ = thinned(tmp_path, normal_chordal_tooth_thickness=(chord, "mm"))
    assert found == pytest.approx(1e-3 * (3 * np.pi / 2 - 4.5), rel=1e-6)


def test_deviations_count_beside_a_nominal_chord(tmp_path):
    """The chord of a gear without allowance stands beside its deviations; it made them 0."""
    virtual = 60.0 / np.cos(np.radians(15)) ** 3
    nominal = virtual * np.sin(1.5 * np.pi / virtual)
    deviations = {
        f"chordal_tooth_thickness_{end}_deviation": (x, "mm") for end, x in (("upper", -0.08), ("lower", -0.12))
    }
    (found, _), _ = thinned(tmp_path, normal_chordal_tooth_thickness=(nominal, "mm"), **deviations)
    assert found == pytest.approx(100e-6)


def test_a_measure_counts_more_than_a_series(tmp_path):
    measured, _ = thinned(
        tmp_path / "one", span_measurement=(23.1, "mm"), number_of_teeth_for_span_measurement=(3, "none")
    )
    series = {"tooth_thickness_deviation_tolerance_series_din_3967_1978": ("c25", "none")}
    both, page = thinned(
        tmp_path / "two", span_measurement=(23.1, "mm"), number_of_teeth_for_span_measurement=(3, "none"), **series
    )
    assert both == measured
    assert "the measured thickness is taken" in page


@pytest.mark.parametrize("kind", ["mass", "load"])
def test_shafts_reach_overhung_masses_and_loads(tmp_path, kind):
    """A coupling half or a pulley beyond the last bearing: the drawn piece is lengthened to it."""
    unit = gear_train((20, 31))
    if kind == "mass":
        place, made = (
            -30.0,
            unit.add("additional_mass", mass_of_component=(2.0, "kg"), moment_of_inertia_u_axis=(1e-3, "kg m^2")),
        )
    else:
        place, made = -15.0, unit.add("external_load", transmits_torque=(False, "none"), force_v_direction=(500.0, "N"))
    unit.attributes(made)["u_coordinate_on_shaft"] = (place, "mm")
    unit.relate("assembly", assembly=unit.numbers("shaft")[0], part=made)
    case, _ = imported(unit, tmp_path)
    (there,) = case.shafts[0].bodies if kind == "mass" else case.shafts[0].loads
    assert case.shafts[0].segments[0].start <= there.z + 1e-6


def test_a_matrix_of_two_unlike_springs_returns_from_the_file(tmp_path):
    case, _ = imported(gear_train((20, 31)), tmp_path / "first")
    springs = StiffnessMatrix(np.diag([3e8, 1e8, 5e7, 0.0, 0.0]).tolist())
    case = replace(case, bearings=(replace(case.bearings[0], model=springs), *case.bearings[1:]))
    export_rexs(case, tmp_path / "back.rexs")
    back = load_case(import_rexs(tmp_path / "back.rexs", tmp_path / "back").case).bearings[0].model
    assert np.diag(back.stiffness)[:3] == pytest.approx([3e8, 1e8, 5e7])


def test_a_wrong_reference_of_a_place_that_is_not_needed_is_no_mistake(tmp_path):
    unit = gear_train((20, 31))
    bearing = unit.attributes(unit.numbers("rolling_bearing_with_catalog_geometry")[0])
    bearing.update(support_vector=([0.0, 0.0, 0.0], "mm"), reference_component_for_position=(999, "none"))
    assert len(imported(unit, tmp_path)[0].bearings) == 4


def test_a_mass_on_no_shaft_is_named(tmp_path):
    unit = gear_train((20, 31))
    mass = unit.add("additional_mass", "ring", mass_of_component=(2.0, "kg"))
    unit.relate("assembly", assembly=unit.numbers("gear_casing")[0], part=mass)
    case, page = imported(unit, tmp_path)
    assert not case.shafts[0].bodies
    assert "additional mass | on no shaft" in page


@pytest.mark.parametrize("ids", [(0, 1), (1, None)])
def test_load_cases_keep_numbers_from_zero_and_get_missing_ones(tmp_path, ids):
    unit = gear_train((20, 31))
    unit.load_cases.append(dict(unit.load_cases[0]))
    model = json.loads(unit.json())
    for case, number in zip(model["model"]["load_spectrum"]["load_cases"], ids, strict=True):
        case["id"] = number
    (tmp_path / "u.rexsj").write_text(json.dumps(model))
    assert [load.name for load in read_rexs(tmp_path / "u.rexsj").loads] == [str(ids[0]), str(ids[0] + 1)]


def test_numbers_without_a_unit_have_that_of_the_specification(tmp_path):
    """REXS gives power in kW, load ratings in kN and clearances in micrometres: W, N and mm were taken."""
    with_units, without = gear_train((20, 31)), gear_train((20, 31))
    for unit, names in ((with_units, ("kW", "kN", "mum")), (without, ("", "", ""))):
        load = unit.numbers("external_load")[0]
        unit.load_cases[0][load] = {"power": (11.3, names[0])}
        for bearing in unit.numbers("rolling_bearing_with_catalog_geometry"):
            unit.attributes(bearing).update(
                radial_static_load_rating=(9.5, names[1]), operating_radial_bearing_clearance=(12.0, names[2])
            )
    one, other = (read_rexs(unit.save(tmp_path / f"{i}.rexs")) for i, unit in enumerate((with_units, without)))
    assert one.loads == other.loads
    for a, b in zip(one.bearings, other.bearings, strict=True):
        assert (
            (a.static_load_rating, a.clearance) == (b.static_load_rating, b.clearance) == (9500.0, pytest.approx(12e-6))
        )


def test_load_cases_of_two_spectra_keep_their_own_numbers(tmp_path):
    """Equal numbers of two spectra were mixed: forces of the first came with the torque of the second."""
    unit = gear_train((20, 31))
    second = unit.xml().partition("<load_spectrum")[2]
    text = unit.xml().replace("</model>", f"<load_spectrum{second}")
    text = text.replace('<load_spectrum id="1">', '<load_spectrum id="2">', 2).replace(
        'id="2"><load_case', 'id="1"><load_case', 1
    )
    head, _, tail = text.rpartition(">60.0<")
    (tmp_path / "u.rexs").write_text(f"{head}>45.0<{tail}", encoding="utf-8")
    loads = read_rexs(tmp_path / "u.rexs").loads
    assert [(load.name, load.torque) for load in loads] == [("1.1", pytest.approx(60.0)), ("2.1", pytest.approx(45.0))]
    assert read_rexs(tmp_path / "u.rexs", load_case="2.1").loads[0].torque == pytest.approx(45.0)


def test_two_places_of_one_gear_are_named(tmp_path):
    unit = gear_train((20, 31))
    shaft, gear = unit.numbers("shaft")[0], unit.numbers("cylindrical_gear")[0]
    unit.attributes(gear).update(
        support_vector=([50.0, 0.0, 0.0], "mm"), reference_component_for_position=(shaft, "none")
    )
    _, page = imported(unit, tmp_path)
    assert "u\\_coordinate\\_on\\_shaft 42 mm, support\\_vector 50 mm" in page


def test_an_exported_unit_names_no_contradiction(tmp_path):
    case = load_case(CASES / "small/catalogue_bearings.toml")
    export_rexs(case, tmp_path / "u.rexs")
    page = import_rexs(tmp_path / "u.rexs", tmp_path / "case").page.read_text(encoding="utf-8")
    assert "## Contradictions" not in page
