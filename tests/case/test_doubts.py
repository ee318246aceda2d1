"""Values that are valid each and make no sense together, and cases derived from a base: message, line, remedy."""

import pytest

from nvhchain.case import load_case
from nvhchain.errors import AccuracyWarning, Mistakes


@pytest.fixture
def small(request):
    return (request.config.rootpath / "cases" / "small" / "single_stage.toml").read_text()


def refused(path, text, base=None):
    """Lines of the refusal of a case, or of one derived from `base`."""
    if base is not None:
        (path / "base.toml").write_text(base)
    (path / "case.toml").write_text(text)
    with pytest.raises(Mistakes) as wrong:
        load_case(path / "case.toml")
    return [line.removeprefix(f"{path}/") for line in wrong.value.each]


def test_bearings_in_newtons_per_millimetre_are_refused_with_the_value_in_si(tmp_path, small):
    """One in a thousandth of its stiffness gave 51.5 dB(A) for 48.8, all four 30.3, without a word."""
    (line,) = refused(tmp_path, small.replace("radial_stiffness = 1.63e8", "radial_stiffness = 1.63e5", 1))
    assert line.startswith("case.toml:79: bearing A1: radial_stiffness = 163000 N/m gives way by 7.25 mm under 1182 N")
    assert line.endswith("if it is in N/mm, write 1.63e+08")
    lines = refused(tmp_path, small.replace("axial_stiffness = 5.05e7", "axial_stiffness = 5.05e4"))
    assert [line.partition(" = ")[0].partition(": ")[2] for line in lines] == [
        "bearing A1: axial_stiffness",
        "bearing B1: axial_stiffness",
    ]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("axis_mm = [68.54129, 0]", "axis = [68.54129, 0]", "axis"),
        ("z_mm = 33", 'z_mm = "a"', "z_mm"),
        ("teeth = 20", "teeth = 3", "teeth"),
    ],
)
def test_stand_ins_invent_no_missing_field(tmp_path, small, old, new, said):
    lines = refused(tmp_path, small.replace(old, new, 1))
    assert any(said in line for line in lines)
    assert not any("is missing" in line for line in lines)


@pytest.mark.parametrize("wrong", ['"-10°"', "[1]"])
def test_two_broken_gears_are_named_both(tmp_path, small, wrong):
    text = small.replace("teeth = 20", "teeth = 0").replace("helix_angle_deg = -10", f"helix_angle_deg = {wrong}")
    found = " ".join(refused(tmp_path, text))
    assert "teeth = 0" in found
    assert "helix_angle_deg" in found


def test_a_soft_bearing_beside_stiff_ones_is_no_mistake(tmp_path, small):
    """Such as a thrust bearing, or one that holds its shaft along the axis alone."""
    third = '[[bearings]]\nname = "A3"\nshaft = "A"\nz_mm = 60\nradial_stiffness = 1e4\naxial_stiffness = 1e8\n'
    text = small.replace("[housing]\n", f"{third}\n[housing]\n").replace(
        "bores = [", 'bores = [{ name = "A3", centre_mm = [0, 0, 60], radius_mm = 22 },'
    )
    lines = refused(tmp_path, text)
    assert not any("gives way" in line for line in lines)


def test_a_microphone_in_millimetres_and_gears_that_hardly_meet_are_doubted(tmp_path, small):
    (tmp_path / "far.toml").write_text(small.replace("[0.02, -0.01, 0.62]", "[20, -10, 620]"))
    with pytest.warns(AccuracyWarning, match=r"position is 620.* m away .* write position_mm"):
        load_case(tmp_path / "far.toml")
    (tmp_path / "beside.toml").write_text(small.replace("z_mm = 75", "z_mm = 62", 1))
    with pytest.warns(AccuracyWarning, match=r"faces share 3 of 16 mm along the axis"):
        load_case(tmp_path / "beside.toml")


def test_a_band_in_kilohertz_is_refused_before_the_work(tmp_path, small):
    (line,) = refused(tmp_path, small.replace("low = 100", "low = 0.1").replace("high = 4000", "high = 4"))
    assert "holds no line" in line
    assert line.endswith("if it is in kHz, write low = 100, high = 4000")


def test_several_misplaced_bearings_are_named_at_once(tmp_path, small):
    text = small.replace("z_mm = 33", "z_mm = 60").replace("[0.02, -0.01, 0.62]", "[0.02, -0.01, 0.08]")
    found = " ".join(refused(tmp_path, text))
    for part in ("bearing A1 is 27.000 mm", "bearing B1 is 27.000 mm", "lies inside the housing"):
        assert part in found


def test_a_tooth_number_of_zero_hides_no_other_mistake(tmp_path, small):
    text = small.replace("teeth = 20", "teeth = 0").replace("helix_angle_deg = -10", "helix_angle_deg = 10")
    text = text.replace('{ name = "B1", centre', '{ name = "B7", centre').replace("radius_mm = 54", "radius_mm = 42")
    found = " ".join(refused(tmp_path, text))
    for part in ("teeth = 0", "bearing 'B1': the housing has no such bore", "opposite hands", "reaches into the wall"):
        assert part in found


def test_a_derived_case_may_state_a_value_of_its_base_in_another_unit(tmp_path, small):
    (tmp_path / "base.toml").write_text(small)
    changes = '[operation]\ninput_speed = 100\n[[gears]]\nname = "pinion"\ngeometry.face_width = 0.015\n'
    (tmp_path / "case.toml").write_text(f'base = "base.toml"\n{changes}')
    case = load_case(tmp_path / "case.toml")
    assert (case.operation.input_speed, case.gears[0].geometry.face_width) == (100.0, 0.015)
    twice = f'base = "base.toml"\n{changes}geometry.face_width_mm = 15\n'
    assert "given twice" in refused(tmp_path, twice)[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("[operation]\nspeed = 3\n", "case.toml:4: operation.speed: unknown field; did you mean 'input_speed'?"),
        ("[options]\nflexible_shaft = true\n", "case.toml:4: options.flexible_shaft: unknown field"),
        (
            '[[gears]]\nname = "pinon"\ngeometry.face_width_mm = 20\n',
            "case.toml:3: gears[2] (pinon): the base has no gear of this name, did you mean 'pinion'? A new one needs",
        ),
    ],
)
def test_mistakes_of_a_derived_case_stand_at_their_own_lines(tmp_path, small, change, said):
    (line,) = refused(tmp_path, f'base = "base.toml"\nname = "x"\n{change}', small)
    assert line.startswith(said)


def test_a_base_that_is_not_there_is_named_with_its_line(tmp_path, small):
    (tmp_path / "small.toml").write_text(small)
    (tmp_path / "case.toml").write_text('name = "x"\nbase = "smal.toml"\n')
    with pytest.raises(Exception, match=r"case.toml:2: base = 'smal.toml': no such file: did you mean 'small.toml'"):
        load_case(tmp_path / "case.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('input_shaft = "A"\noutput_shaft = "B"', 'input_shaft = "B"\noutput_shaft = "A"', "swap pinion and wheel"),
        ("centre_distance_mm = 68.54129", "centre_distance = 68.54129", "write centre_distance_mm = 68.5413"),
        ("start_mm = -20, end_mm = 130, outer_diameter_mm = 24", "start_mm = 50, end_mm = 130, outer_diameter_mm = 24",
         "but bearing A1 stands at 33 mm"),
        ("friction = 0.0", "friction = true", "friction = true: give a number, 0 for none, or 'auto'"),
        ("young_GPa = 72", "young_GPa = 72000", "steel has 2.1e11 Pa, which is young_GPa = 210"),
    ],
)  # fmt: skip
def test_messages_name_the_mistake_behind_what_is_noticed(tmp_path, small, old, new, said):
    assert old in small
    text = small.replace(old, new).replace("flexible_shafts = false", "flexible_shafts = true" if "50" in new else "")
    lines = refused(tmp_path, text)
    assert any(said in line for line in lines)
    assert len(lines) == 1
