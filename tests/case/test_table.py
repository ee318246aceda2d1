"""Tables become dataclasses by field name; every mistake is named with its field, value and remedy."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import pytest

from nvhchain.case import load_case
from nvhchain.case.toml.table import build
from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, Mistakes, require


@dataclass(frozen=True)
class Solid:
    pass


@dataclass(frozen=True)
class Slots:
    count: int


@dataclass(frozen=True)
class Wheel:
    width: Length
    blank: Solid | Slots = Solid()
    angle: Angle = 0.0
    axis: tuple[Length, Length] = (0.0, 0.0)
    names: tuple[str, ...] = ()
    bore: Length | None = None

    def __post_init__(self):
        require(self.width > 0, f"width = {self.width} m must be positive: give the face width")


def test_units_in_the_key_are_converted_to_si():
    wheel = build(Wheel, {"width_mm": 22, "angle_deg": 180, "axis_mm": [1, 2], "bore_um": 3}, "w")
    assert (wheel.width, wheel.angle, wheel.axis, wheel.bore) == (0.022, math.pi, (0.001, 0.002), 3e-6)


def test_a_union_is_chosen_by_its_type():
    assert build(Wheel, {"width": 1.0, "blank": {"type": "slots", "count": 5}}, "w").blank == Slots(5)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"width_deg": 1.0}, r"w\.width_deg: _deg does not fit; 'width' is in m: width, width_mm, width_um will do"),
        ({"width": 1.0, "names_mm": []}, r"w\.names_mm: _mm does not fit; 'names' takes no unit: write names"),
        ({"width": 1.0, "blank_mm": {}}, r"w\.blank_mm: _mm does not fit"),
        ({"width": "x", "axis": 3, "angel": 1}, r"w\.width = 'x' must .*; w\.axis = 3 must .*; w\.angel: unknown"),
        ({"width": 1.0, "widht": 2.0}, r"w\.widht: unknown field; did you mean 'width'"),
        ({"width": 1.0, "widht_mm": 2.0}, r"w\.widht_mm: unknown field; did you mean 'width_mm'"),
        ({"idth": 2.0}, r"^w\.idth: unknown field; did you mean 'width'\?$"),
        ({"width_mm": -22}, r"w: width = -0\.022 m must be positive"),
        ({}, "required field 'width' is missing"),
        ({"width": "22"}, r"w\.width = '22' must be a finite number"),
        ({"width": True}, "must be a finite number"),
        ({"width": float("nan")}, "must be a finite number"),
        ({"width": 1.0, "width_mm": 3}, "given twice"),
        ({"width": 1.0, "axis": [1.0]}, r"w\.axis has 1 entries, but 2"),
        ({"width": 1.0, "blank": {"type": "cheese"}}, "choose one of solid, slots"),
        ({"width": 1.0, "blank": {"type": "slots", "count": 5.5}}, "must be of type int"),
        ({"width": 1.0, "names": "abc"}, "must be a list"),
        ([1.0], "must be a table"),
    ],
)
def test_mistakes_are_named(table, message):
    with pytest.raises(InputError, match=message):
        build(Wheel, table, "w")


def test_six_mistakes_in_three_lists_are_reported_at_once_with_entry_and_field(tmp_path, request):
    text = (request.config.rootpath / "cases" / "small" / "single_stage.toml").read_text()
    for old, new in {
        "centre_distance_mm = 68.54129": 'centre_distance_mm = "far"\ncolour = 1',
        "coupled_inertia = 0.01": "coupled_inertia = -1",
        "axis_mm = [68.54129, 0]": "axis_mm = [68.54129]",
        "radial_damping = 1200 # N s/m\naxial_damping = 400": "radial_damping = -1\naxial_damping = -2",
    }.items():
        assert old in text
        text = text.replace(old, new, 1)
    case = tmp_path / "case.toml"
    case.write_text(text)
    with pytest.raises(Mistakes) as refused:
        load_case(case)
    found = [re.sub(r"^.*?case\.toml:\d+: ", "", line).split(" = ")[0] for line in refused.value.each]
    assert found == [
        "stages[0] (stage).centre_distance_mm",
        "stages[0] (stage).colour: unknown field; known fields: name, pinion, wheel, centre_distance, misalignment, "
        "tolerances, normal_backlash, circumferential_backlash",
        "shafts[0] (A): shaft A: coupled_inertia",
        "shafts[1] (B).axis_mm has 1 entries, but 2 are needed",
        "bearings[0] (A1): bearing A1: radial_damping",
        "bearings[0] (A1): bearing A1: axial_damping",
    ]
    assert all(line in str(refused.value) for line in refused.value.each)


def test_parts_that_are_unknown_are_reported_at_once(tmp_path, request):
    text = (request.config.rootpath / "cases" / "small" / "single_stage.toml").read_text()
    text = text.replace('name = "A2"\nshaft = "A"', 'name = "A2"\nshaft = "C"').replace(
        'wheel = "wheel"', 'wheel = "big"'
    )
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(InputError, match=r"bearing A2: shaft 'C' is unknown; .*stage stage: wheel 'big' is unknown"):
        load_case(tmp_path / "case.toml")


def test_a_former_name_of_a_field_is_read():
    @dataclass(frozen=True)
    class Body:
        mounting_plane: float = 0.0

    assert build(Body, {"engine_plane": 2.0}, "housing").mounting_plane == 2.0
    with pytest.raises(InputError, match="given twice"):
        build(Body, {"engine_plane": 2.0, "mounting_plane": 3.0}, "housing")
