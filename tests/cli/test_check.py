"""Every mistake of a case file at once, each with its file and line."""

import re

import meshio
import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import RadiatorCase, Sphere, load_case
from nvhchain.case.operation import FieldPoint
from nvhchain.case.toml.lines import placed
from nvhchain.cli import main
from nvhchain.errors import InputError

SMALL = "cases/small/single_stage.toml"


@pytest.fixture
def checked(tmp_path, capsys, request):
    """Check the small case with changed lines; return path, text and the printed lines."""

    def check(*changes, base=SMALL, code=2):
        text = (request.config.rootpath / base).read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "case.toml"
        path.write_text(text)
        assert main(["check", str(path)]) == code
        printed = capsys.readouterr()
        return path, text.splitlines(), (printed.err + printed.out).splitlines()

    return check


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("face_width_mm = 16", "face_width = 30", None, "if it is in mm, write face_width_mm = 30"),
        ("z_mm = 33", "z = 33", None, "write z_mm = 33"),
        ("young_GPa = 72", "young = 72", None, "write young_GPa = 72"),
        ("input_torque = 60", "input_torque_Nmm = 60000", None, "'Nmm' is no unit of 'input_torque'"),
        ("input_torque = 60", "input_torque = 60000", None, "if it is in N mm, write 60"),
        ('input_shaft = "A"', 'input_shaft = "AA"', None, "input_shaft: shaft 'AA' is unknown; did you mean 'A'?"),
        ('output_shaft = "B"', 'output_shaft = "Q"', None, "output_shaft: shaft 'Q' is unknown; known: A, B"),
        ('name = "B2"\nshaft = "B"', 'name = "B2"\nshaft = "Bb"', 'shaft = "Bb"', "bearing B2: shaft 'Bb' is unknown"),
        ('pinion = "pinion"', 'pinion = "pinon"', None, "did you mean 'pinion'?"),
        (
            "[68.54129, 0], radius_mm = 54",
            "[68.54129, 0], radius_mm = 42",
            "[[gears]]",
            "gear wheel: its tip radius of 43.8",
        ),
        ("[0, 0, 33], radius_mm = 22", "[0, 0, 33], radius_mm = 11", None, "housing.bores: A1: radius = 11 mm"),
        ("teeth = 20", "teeth = 20.5", None, "must be of type int"),
        ("kind =", "kind = = ", None, "not valid TOML"),
    ],
)
def test_a_mistake_is_named_with_its_line(checked, old, new, line, words):
    path, text, printed = checked((old, new))
    found = [re.match(rf"nvhchain: {re.escape(str(path))}:(\d+): (.*)", each) for each in printed]
    assert all(found), printed
    said = next(hit for hit in found if words in hit[2])
    number = int(said[1])
    assert (line or new.splitlines()[-1]) in text[number - 1]


def test_all_mistakes_of_a_file_are_reported_at_once(checked):
    changes = [
        ("teeth = 20", "teeth = 3"),
        ("normal_module_mm = 2.7", "normal_module = 2.7"),
        ("low = 100", "low = -3"),
        ("input_speed_rpm = 1800", "input_speed = 99999"),
        ('output_shaft = "B"', 'output_shaft = "C"'),
        ('name = "A2"\nshaft = "A"', 'name = "A2"\nshaft = "AA"'),
        ("wall_mm = 5", "wall = 5000"),
        ("bolts = 8", "bolts = 9999"),
        ("helix_angle_deg = -10", "helix_angle = -10"),
    ]
    path, text, printed = checked(*changes)
    numbers = {int(line.removeprefix(f"nvhchain: {path}:").partition(":")[0]) for line in printed}
    for _, new in changes:
        lines = {n for n, line in enumerate(text, 1) if line.partition(" #")[0].strip() == new.splitlines()[-1]}
        assert numbers & lines, (new, printed)


def test_mistakes_of_the_whole_gearbox_come_together(checked):
    _, _, printed = checked(
        ("position = [0.02, -0.01, 0.62]", "position = [0.02, -0.01, 0.08]"),
        ("centre_distance_mm = 68.54129", "centre_distance_mm = 70"),
        ("[68.54129, 0], radius_mm = 54", "[68.54129, 0], radius_mm = 42"),
    )
    assert sorted(
        word for line in printed for word in ("inside the housing", "centre_distance", "tip radius") if word in line
    ) == [
        "centre_distance",
        "inside the housing",
        "tip radius",
    ]


def test_a_mistake_in_a_base_file_is_found_there(tmp_path, request, capsys):
    base = (request.config.rootpath / SMALL).read_text().replace("face_width_mm = 16", "face_width_mm = 16000", 1)
    (tmp_path / "base.toml").write_text(base)
    (tmp_path / "case.toml").write_text('base = "base.toml"\n\n[[gears]]\nname = "wheel"\nz = 99\n')
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    lines = capsys.readouterr().err.splitlines()
    width = 1 + base.splitlines().index("face_width_mm = 16000")
    assert any(line.startswith(f"nvhchain: {tmp_path / 'base.toml'}:{width}: gears[0] (pinion)") for line in lines)
    (tmp_path / "base.toml").write_text((request.config.rootpath / SMALL).read_text())
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert any(line.startswith(f"nvhchain: {tmp_path / 'case.toml'}:") for line in lines)


def test_bores_of_the_example_never_appear_for_missing_ones(tmp_path, request, capsys):
    text = re.sub(r"(?s)bores = \[.*?\n\]\n", "", (request.config.rootpath / SMALL).read_text())
    (tmp_path / "case.toml").write_text(text)
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    assert "housing: bores are missing" in capsys.readouterr().err


def test_every_field_point_inside_the_housing_is_named(tmp_path, request, capsys):
    point = '\n[[field_points]]\nname = "{}"\nposition = [0.0, 0.0, {}]\n'
    places = "".join(point.format(name, z) for name, z in (("deep", 0.07), ("deeper", 0.08), ("behind", -0.1)))
    (tmp_path / "case.toml").write_text((request.config.rootpath / SMALL).read_text() + places)
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    inside = re.findall(r"field point '(\w+)' at .* lies inside the housing", capsys.readouterr().err)
    assert inside == ["deep", "deeper"]


def test_bearings_without_damping_are_named(checked):
    damping = "radial_damping = 1200\naxial_damping = 400\n"
    _, _, printed = checked(("radial_damping = 1200 # N s/m\n", ""), ("axial_damping = 400", ""), (damping, ""), code=0)
    assert any("A1, A2 have no damping" in line for line in printed), printed


@pytest.mark.parametrize(("torque", "valid"), [(600.0, True), (-600.0, True), (6000.0, False), (-6000.0, False)])
def test_only_torques_that_break_the_teeth_are_refused(request, torque, valid):
    changes = [f"operation.input_torque={torque}"]
    if valid:
        assert load_case(request.config.rootpath / SMALL, changes=changes).operation.input_torque == torque
    else:
        with pytest.raises(InputError, match=r"breaks the teeth of stage stage: .* \(ISO 6336-3, order of magnitude"):
            load_case(request.config.rootpath / SMALL, changes=changes)


def test_a_radiator_with_a_supplied_surface_velocity_needs_no_motion():
    moving = RadiatorCase("a", Sphere(0.1), (200.0,), (FieldPoint("p", (0, 0, 1.0)),), pulsation=1.0)
    still = RadiatorCase("a", Sphere(0.1), (200.0,), (FieldPoint("p", (0, 0, 1.0)),))
    velocity = moving.surface_velocity(nvh.DRAFT.acoustics)
    heard = [
        nvh.run(case, fidelity=nvh.DRAFT, **given).pressure.pressure
        for case, given in ((moving, {}), (still, {"surface_velocity": velocity}))
    ]
    assert np.array_equal(*heard)
    with pytest.raises(InputError, match=r"at rest: give it a pulsation .* or the run its surface_velocity"):
        nvh.run(still, fidelity=nvh.DRAFT)


def test_lines_of_every_form_of_toml_are_found():
    text = '''# first
a.b = """x
[no] = 1"""  # a = 2
'q r' = [1,
  2, {x = 1, "y]" = 'z'}]
[t.u]
v = "#]\\"" # w
[[l]]
n = 1
[l.m]
k = {e = [{f = 1},
 {f = 2}]}
[[l]]
n = 2
'''
    import tomllib

    table = placed(tomllib.loads(text), text, "f")
    assert table.places == {"a": ("f", 2), "q r": ("f", 4), "t": ("f", 6), "l": ("f", 8)}
    assert table["q r"][2].places == {"x": ("f", 5), "y]": ("f", 5)}
    assert table["t"]["u"].places == {"v": ("f", 7)}
    assert [item.place for item in table["l"]] == [("f", 8), ("f", 13)]
    assert [item.places["f"][1] for item in table["l"][0]["m"]["k"]["e"]] == [11, 12]


def test_mistakes_behind_other_kinds_of_mistakes_are_reported_with_them(checked):
    _, _, printed = checked(
        ('name = "B2"\nshaft = "B"', 'name = "B2"\nshaft = "Bx"'),
        ("[68.54129, 0], radius_mm = 54", "[68.54129, 0], radius_mm = 42"),
        ("input_torque = 60", "input_torque = 200000"),
        ("low = 100", "low = -3"),
        ("helix_angle_deg = -10", "helx_angle_deg = -10"),
        ("centre_distance_mm = 68.54129", "centre_distance_mm = 70"),
        ("bolts = 8", "bolts = 9999"),
    )
    words = ("'Bx' is unknown", "tip radius", "breaks the teeth", "band -3", "helx_angle", "shafts are", "bolts = 9999")
    assert [sum(word in line for line in printed) for word in words] == [1] * len(words), printed
    assert len(printed) == len(words), printed


GEOMETRY = ("bores", "gear_spaces", "wall", "end_wall", "depth", "bell_depth")
PROPOSALS = {
    "bores": '{ name = "A1", centre_mm = [0, 0, 33], radius_mm = … }',
    "gear_spaces": "{ centre_mm = [68.54129, 0], radius_mm = 47 }",
    "depth": "bearing B2 is at z = 127 mm",
    "bell_depth": "bearing A1 is at z = 33 mm",
}


@pytest.mark.parametrize("lacking", [(name,) for name in GEOMETRY] + [GEOMETRY])
def test_a_casting_takes_no_geometry_of_another_one(tmp_path, request, capsys, lacking):
    text = (request.config.rootpath / SMALL).read_text()
    for name in lacking:
        text, count = re.subn(rf"(?sm)^{name} = \[.*?\n\]\n|^{name}_mm = [^\n]*\n", "", text)
        assert count == 1
    (tmp_path / "case.toml").write_text(text)
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(lacking)
    for name in lacking:
        (line,) = (line for line in lines if re.search(rf"housing: {name} (is|are) missing: give ", line))
        assert PROPOSALS.get(name, "") in line
    with pytest.raises(TypeError, match="missing"):
        nvh.case.Casting(**{name: () for name in GEOMETRY if name not in lacking})


def test_bearings_without_stiffness_are_assumed_aloud(request, tmp_path, capsys):
    text = (request.config.rootpath / SMALL).read_text()
    without = text.replace("radial_stiffness = 1.63e8\naxial_stiffness = 5.05e7\n", "")
    assert without != text
    (tmp_path / "case.toml").write_text(without)
    assert main(["check", str(tmp_path / "case.toml")]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if "assumed stiffness" in line)
    assert "A2, B1, B2 take an assumed stiffness, 1.63e+08 N/m radially and 5.05e+07 N/m axially" in line
    case = load_case(request.config.rootpath / SMALL)
    assert not case.assumptions
    assert load_case(nvh.save_case(case, tmp_path / "saved.toml")).bearings == case.bearings


def test_a_folder_in_place_of_a_case_names_a_file_in_it(tmp_path, request, capsys):
    (tmp_path / "case.toml").write_text((request.config.rootpath / SMALL).read_text())
    assert main(["contributions", str(tmp_path)]) == 2
    assert f"{tmp_path} is a folder: name a file in TOML, such as {tmp_path / 'case.toml'}" in capsys.readouterr().err


def test_the_speed_is_stated_in_rpm_whatever_its_unit_in_the_file(checked):
    _, _, printed = checked(("input_speed_rpm = 1800", "input_speed = 1800"), code=0)
    assert any("the input turns at 17189 rpm under 60 N m" in line for line in printed)


def test_a_radiator_at_rest_is_valid_and_names_the_velocity_that_its_run_needs(tmp_path, capsys):
    text = 'kind = "radiator"\nname = "still"\nfrequencies = [200]\nbody = { type = "sphere", radius = 0.1 }\n'
    (tmp_path / "case.toml").write_text(f'{text}[[field_points]]\nname = "p"\nposition = [0, 0, 1]\n')
    assert main(["check", str(tmp_path / "case.toml")]) == 0
    assert "at rest: give the run its velocity with --use FILE" in capsys.readouterr().out


BALL = """kind = "radiator"
name = "ball"
frequencies = [200, 500]
pulsation = 1.0
body = { type = "sphere", radius = 0.1 }
[[field_points]]
name = "p"
position = [0, 0, 1]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radius = 0.1", "radius = 0.1, centre = [0, 0, 1e18]", "centre = (0.0, 0.0, 1e+18) m is beyond 10 km"),
        ("[0, 0, 1]", "[0, 0, 0.09]", "field point 'p' at (0.0, 0.0, 0.09) m lies inside the body: move it out"),
        ("[200, 500]", "[1e-300, 500]", "frequencies = 1e-300…500 Hz are outside 0.001…100000 Hz"),
    ],
)
def test_what_no_run_of_a_radiator_accepts_is_refused(tmp_path, capsys, old, new, words):
    """`run` met these after its transfer vectors: "divide by zero", triangles without area."""
    (tmp_path / "case.toml").write_text(BALL.replace(old, new))
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    assert words in capsys.readouterr().err


def test_a_microphone_inside_the_surface_of_a_file_is_refused(tmp_path, capsys):
    body = nvh.acoustics.sphere(0.1, 1)
    meshio.Mesh(body.vertices, [("triangle", body.triangles)]).write(tmp_path / "ball.stl")
    text = BALL.replace('{ type = "sphere", radius = 0.1 }', '{ type = "surface_file", file = "ball.stl" }')
    for position, code in (("[0, 0, 1]", 0), ("[0, 0, 0.05]", 2)):
        (tmp_path / "case.toml").write_text(text.replace("[0, 0, 1]", position))
        assert main(["check", str(tmp_path / "case.toml")]) == code
    assert "field point 0 at [0.0, 0.0, 0.05] m lies inside the body: move it outside" in capsys.readouterr().err


def test_changed_knobs_are_checked(tmp_path, capsys):
    (tmp_path / "case.toml").write_text(BALL)
    assert main(["check", str(tmp_path / "case.toml"), "--set", "fidelity.acoustics.masters=0"]) == 2
    assert "masters = 0 is outside" in capsys.readouterr().err
