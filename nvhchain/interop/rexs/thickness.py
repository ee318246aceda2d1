"""Tooth thickness of the gears of a document: as measured, by its deviations, or by the series of DIN 3967."""

from __future__ import annotations

import re
from bisect import bisect_left
from math import asin, cos
from typing import Any

from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.contents.values import Values
from nvhchain.interop.rexs.parts import Parts

_SERIES = "tooth_thickness_deviation_tolerance_series_din_3967_1978"

# fmt: off
_DIAMETERS = (10, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6300, 10000)
_UPPER = {
    "a": (100, 135, 180, 250, 330, 450, 600, 820, 1100, 1500, 2000),
    "ab": (85, 110, 150, 200, 280, 370, 500, 680, 920, 1250, 1650),
    "b": (70, 95, 125, 170, 230, 310, 420, 560, 760, 1020, 1350),
    "bc": (58, 75, 105, 140, 190, 260, 340, 460, 620, 840, 1150),
    "c": (48, 65, 85, 115, 155, 210, 290, 390, 520, 700, 940),
    "cd": (40, 54, 70, 95, 130, 175, 240, 320, 430, 580, 780),
    "d": (33, 44, 60, 80, 110, 145, 200, 270, 360, 480, 640),
    "e": (22, 30, 40, 56, 75, 100, 135, 180, 250, 330, 450),
    "f": (10, 14, 19, 26, 35, 48, 64, 85, 115, 155, 210),
    "g": (5, 7, 9, 12, 17, 22, 30, 41, 56, 75, 100),
    "h": (0,) * 11,
}
_TOLERANCE = {
    21: (3, 5, 6, 8, 10, 12, 16, 20, 25, 30, 40),
    22: (5, 8, 10, 12, 16, 20, 25, 30, 40, 50, 60),
    23: (8, 12, 16, 20, 25, 30, 40, 50, 60, 80, 100),
    24: (12, 20, 25, 30, 40, 50, 60, 80, 100, 130, 160),
    25: (20, 30, 40, 50, 60, 80, 100, 130, 160, 200, 250),
    26: (30, 50, 60, 80, 100, 130, 160, 200, 250, 300, 400),
    27: (50, 80, 100, 130, 160, 200, 250, 300, 400, 500, 600),
    28: (80, 130, 160, 200, 250, 300, 400, 500, 600, 800, 1000),
    29: (130, 200, 250, 300, 400, 500, 600, 800, 1000, 1300, 1600),
    30: (200, 300, 400, 500, 600, 800, 1000, 1300, 1600, 2000, 2400),
}
# fmt: on
"""DIN 3967: amount of the upper allowance and tolerance of the tooth thickness (µm) up to reference diameters (mm)."""


def thickness_of(parts: Parts, component: Component, angle: float, helix: float, pitch: float) -> dict[str, Any]:
    """Return the fields of an imported gear that say how thick its teeth are.

    angle, helix : normal pressure angle and helix angle (rad).
    pitch : reference diameter (m).
    """
    values = parts.values(component)
    upper, lower = (
        values.number(f"{end}_backlash_allowance_balls_or_pins", "m", low=-0.02, high=0.02)
        for end in ("upper", "lower")
    )
    given = [value for value in (upper, lower) if value is not None]
    span, size, allowance = _span(values), _ball_size(values), _allowance(parts, component, angle)
    thickness = _thickness(values, helix)
    if allowance is None and thickness is None and not given:
        allowance = _series_reduction(parts, component, pitch, measured=span is not None or size is not None)
        if allowance is None:
            thickness = _chordal_thickness(values, helix, pitch)
    return {
        "allowance": allowance,
        "thickness": thickness,
        "span": span,
        "ball_size": size,
        "ball_deviation": sum(given) / len(given) if given else None,
        "ball": values.number("diameter_of_measuring_ball_or_pin", "m", low=0.0, high=1.0) or None,
    }


def _span(values: Values) -> tuple[float, int] | None:
    """Return the base tangent length (m) and the teeth that it spans."""
    length = values.number("span_measurement", "m", low=0.0, high=20.0)
    teeth = values.number("number_of_teeth_for_span_measurement")
    return (length, round(teeth)) if length and teeth and teeth >= 1 else None


def _ball_size(values: Values) -> tuple[float, float, str] | None:
    """Return the dimension over balls or pins (m), their diameter (m) and their kind."""
    ball = values.number("diameter_of_measuring_ball_or_pin", "m", low=0.0, high=1.0)
    for name, gauge in (("size_over_balls", "balls"), ("size_over_pins", "pins"), ("diametral_measurement", "balls")):
        size = values.number(name, "m", low=0.0, high=20.0)
        if size and ball:
            return size, ball, gauge
    return None


def _allowance(parts: Parts, component: Component, angle: float) -> float | None:
    """Return the mean reduction of the normal tooth thickness (m) by its deviations."""
    values, name = parts.values(component), parts.names[component.id]
    for ends, factor, source in (
        ("{}_backlash_allowance_referenced_to_span", 1.0 / cos(angle), "mean deviation of the base tangent length"),
        ("chordal_tooth_thickness_{}_deviation", 1.0, "mean deviation of the tooth thickness"),
    ):
        both = [values.number(ends.format(end), "m", low=-0.02, high=0.02) for end in ("upper", "lower")]
        given = [value for value in both if value is not None]
        if given:
            allowance = -factor * sum(given) / len(given)
            parts.findings.add("taken", name, "thickness allowance", f"{1e6 * allowance:.4g} µm", source)
            return allowance
    return None


def _series_reduction(parts: Parts, component: Component, pitch: float, *, measured: bool) -> float | None:
    """Return the mean reduction of the normal tooth thickness (m) by the series of DIN 3967; a measure counts more."""
    name, text = parts.names[component.id], parts.values(component).text(_SERIES).strip().lower()
    series = re.fullmatch(r"([a-h]{1,2})\s*(\d\d)|(\d\d)\s*([a-h]{1,2})", text)
    if series is None:
        return None
    letters, number = series[1] or series[4], int(series[2] or series[3])
    row = bisect_left(_DIAMETERS, 1e3 * pitch)
    known = letters in _UPPER and number in _TOLERANCE and row < len(_DIAMETERS)
    if measured or not known:
        why = "the measured thickness is taken" if known else "not a series of DIN 3967"
        parts.findings.add("excluded", name, "thickness allowance", text, why)
        return None
    allowance = 1e-6 * (_UPPER[letters][row] + 0.5 * _TOLERANCE[number][row])
    text = f"DIN 3967 {letters} {number} at {1e3 * pitch:.5g} mm, middle of the tolerance"
    parts.findings.add("taken", name, "thickness allowance", f"{1e6 * allowance:.4g} µm", text)
    return allowance


def _thickness(values: Values, helix: float) -> float | None:
    """Return the normal tooth thickness at the reference circle (m)."""
    normal = values.number("normal_tooth_thickness_at_reference_diameter", "m", low=1e-5)
    transverse = values.number("transverse_tooth_thickness_at_reference_diameter", "m", low=1e-5)
    return normal if normal is not None else transverse * cos(helix) if transverse is not None else None


def _chordal_thickness(values: Values, helix: float, pitch: float) -> float | None:
    """Return the normal tooth thickness at the reference circle (m) by its chord."""
    chord, virtual = values.number("normal_chordal_tooth_thickness", "m", low=1e-5), pitch / cos(helix) ** 2
    return virtual * asin(chord / virtual) if chord is not None and chord < virtual else None
