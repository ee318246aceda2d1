"""Cases with units and parts that do not fit: refused with their field, never by a traceback."""

from __future__ import annotations

import dataclasses
import random
import re
import typing

import pytest

from nvhchain.case import GearboxCase, RadiatorCase, load_case
from nvhchain.cli import main
from nvhchain.dimensions import UNITS, si_unit
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.interop import ForceChannels

SMALL = "cases/small/single_stage.toml"
SHIPPED = [
    "cases/gearbox/solid.toml",
    "cases/gearbox/slotted.toml",
    "cases/gearbox/run_up_solid.toml",
    SMALL,
    "cases/sphere/on_floor.toml",
    "cases/sphere/pulsating.toml",
]
KEY = re.compile(r"(?m)(?:^|(?<=[{,] ))(\w+)(?= = )")


SPACE, BORE = "radius_mm = 54", "bore_radius_mm = 12"
PIECE = "{ start_mm = -20, end_mm = 130, outer_diameter_mm = 24 }"


def refusal(path):
    """Message of a case that is refused, None of one that loads; any other error is one of the test."""
    try:
        load_case(path)
    except InputError as error:
        return str(error)
    return None


@pytest.mark.parametrize("shipped", SHIPPED)
def test_a_unit_that_does_not_fit_is_refused_with_its_field(shipped, tmp_path, request):
    source = request.config.rootpath / shipped
    text = re.sub(r'base = "(\w+\.toml)"', lambda hit: f'base = "{source.parent / hit[1]}"', source.read_text())
    rng, tried = random.Random(shipped), 0
    keys = list(KEY.finditer(text))
    for key in rng.sample(keys, min(len(keys), 60)):
        name = key[1]
        unit = next((unit for unit in UNITS if name.endswith(f"_{unit}")), None)
        plain = name if unit is None else name.removesuffix(f"_{unit}")
        others = [other for other in UNITS if unit is None or UNITS[other][0] != UNITS[unit][0]]
        if unit is None and plain in ("position", "centre", "point", "radius", "coupled_inertia"):
            others = ["rpm", "deg", "GPa"]
        wrong = f"{plain}_{rng.choice(others)}"
        case = tmp_path / "case.toml"
        case.write_text(text[: key.start()] + wrong + text[key.end() :])
        refused = refusal(case)
        assert refused is not None, wrong
        assert wrong in refused
        tried += 1
    assert tried >= 5


@pytest.mark.slow
def test_changed_values_are_refused_in_one_line_or_load(tmp_path, request):
    text = (request.config.rootpath / SMALL).read_text()
    values = list(re.finditer(r'(?<= = )("[^"]*"|-?[\d.]+|\[[^\[\]{}]*\])', text))
    odd = ["1e12", "-1", "0", "nan", "inf", "1e-30", "1e308", "9" * 30, "true", "[]", "[[]]", "{}"]
    odd += ['""', '"A"', '"\\u001b[2J"']
    rng, refused, case = random.Random(8), 0, tmp_path / "case.toml"
    for _ in range(150):
        value = rng.choice(values)
        case.write_text(text[: value.start()] + rng.choice(odd) + text[value.end() :])
        message = refusal(case)
        refused += message is not None
        assert message is None or message.startswith(str(case))
    assert refused > 120


@pytest.mark.parametrize(
    ("change", "fields"),
    [
        ({SPACE: "radius_mm = 42"}, ["gear wheel", "gear_spaces"]),
        ({"face_width_mm = 16": "face_width_mm = 95"}, ["gear pinion", "face_width", "outside the housing"]),
        ({BORE: "bore_radius_mm = 11.5"}, ["gear pinion", "bore_radius", "shaft A"]),
        ({"[0, 0, 33], radius_mm = 22": "[0, 0, 33], radius_mm = 11"}, ["housing.bores: A1", "shaft A"]),
        ({"outer_diameter_mm = 24": "outer_diameter_mm = 110"}, ["shaft A: segments[0]", "shaft B: segments[0]"]),
        ({PIECE: f"{PIECE}, {PIECE}"}, ["shaft A: segments[0] and shaft A: segments[1]"]),
        (
            {
                "flexible_shafts = false": "flexible_shafts = true",
                PIECE: f"{PIECE.replace('130', '60')}, {PIECE.replace('-20', '80')}",
            },
            ["shaft A: no segment covers z = 60…80 mm"],
        ),
        ({"resolution = 30": "resolution = 1e12"}, ["band resolution"]),
        ({"high = 4000": "high = 1e12"}, ["band", "20000 Hz"]),
        ({BORE: "bore_radius_mm = 11.5", SPACE: "radius_mm = 42"}, ["gear pinion", "gear wheel"]),
        ({"poisson": "poisson_mm", 'name = "B2"\nshaft': 'name_rpm = "B2"\nshaft'}, ["poisson_mm", "name_rpm"]),
    ],
)
def test_what_cannot_be_built_is_refused_with_all_its_fields(change, fields, tmp_path, capsys, request):
    text = (request.config.rootpath / SMALL).read_text()
    for old, new in change.items():
        assert old in text
        text = text.replace(old, new, 1)
    case = tmp_path / "case.toml"
    case.write_text(text)
    assert main(["check", str(case)]) == 2
    said = capsys.readouterr().err
    assert all(field in said for field in fields), said
    assert all(line.startswith("nvhchain: ") for line in said.splitlines())


def test_what_overlaps_by_rounding_passes_and_is_said(tmp_path, request):
    text = (request.config.rootpath / SMALL).read_text().replace("bore_radius_mm = 12", "bore_radius_mm = 11.95")
    case = tmp_path / "case.toml"
    case.write_text(text)
    with pytest.warns(AccuracyWarning, match=r"gear pinion: bore_radius = 11\.95 mm .* rounding of a drawing"):
        load_case(case)


@pytest.mark.parametrize(
    "change",
    [
        ("frequencies = [200, 500, 1000]", "frequencies = [200, 500, 1e12]"),
        ("pulsation = 1.0", "pulsation = 1e12"),
        ("radius_mm = 10", "radius_deg = 10"),
    ],
)
def test_nonsense_of_a_radiator_is_refused_with_its_field(change, tmp_path, request):
    text = (request.config.rootpath / "cases/sphere/on_floor.toml").read_text()
    assert change[0] in text
    case = tmp_path / "case.toml"
    case.write_text(text.replace(*change))
    assert change[1].split(" = ")[0] in refusal(case)


SI_ONLY = set(
    [
        "addendum",
        "amplitude",
        "axial_damping",
        "axial_load",
        "axial_stiffness",
        "bearing_stiffness",
        "confidence",
        "damping",
        "dedendum",
        "density",
        "displacement",
        "drag_torque",
        "duration",
        "dynamic_load_rating",
        "force",
        "frequencies",
        "frequency",
        "friction",
        "full_scale",
        "high",
        "input_torque",
        "level",
        "load_ratio",
        "loss_factor",
        "moment",
        "loss_factor_frequency",
        "low",
        "mass",
        "matrix",
        "mesh_torque",
        "modal_damping",
        "normal",
        "order",
        "poisson",
        "profile_shift",
        "pulsation",
        "rack_tip_radius",
        "radial_damping",
        "radial_load",
        "radial_stiffness",
        "ratio",
        "resample_rate",
        "resolution",
        "rotation",
        "sample_rate",
        "scale",
        "speed_of_sound",
        "static_load_rating",
        "stiffness_damping",
        "torque_unbalance",
        "used",
        "velocity",
        "x_axis",
        "z_axis",
    ]
)
"""Fields of numbers whose keys take no unit: ratios, directions, levels, and what is in N, kg, Pa, Hz or s."""


def test_every_field_of_numbers_declares_its_dimension_or_takes_no_unit():
    waiting: list = [GearboxCase, RadiatorCase, ForceChannels]
    bare, seen = set(), set()
    while waiting:
        hint = waiting.pop()
        waiting += typing.get_args(hint)
        if not dataclasses.is_dataclass(hint) or hint in seen:
            continue
        seen.add(hint)
        for name, field in typing.get_type_hints(hint, include_extras=True).items():
            waiting.append(field)
            if "float" in str(field) and si_unit(field) is None:
                bare.add(name)
    assert bare == SI_ONLY


def test_every_mistake_of_a_case_has_a_line_of_its_own(tmp_path, capsys, request):
    text = (request.config.rootpath / SMALL).read_text().replace("face_width", "face_widht")
    (tmp_path / "case.toml").write_text(text)
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2  # of two gears, whose width is misspelt but not missing
    assert all(line.startswith(f"nvhchain: {tmp_path / 'case.toml'}") for line in lines)
