"""Tables become dataclasses by field name; every mistake is named with its field, value and remedy."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from nvhchain.case._table import build
from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, require


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
