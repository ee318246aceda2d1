"""Bearings of a document: between a shaft and the casing, or between two shafts."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, degrees, radians
from typing import Any

import numpy as np

from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.contents.values import Values
from nvhchain.interop.rexs.parts import BEARINGS, Parts
from nvhchain.interop.rexs.places import Line, base_frame, frame_of
from nvhchain.interop.rexs.shafts import place_on_shaft
from nvhchain.interop.rexs.unit import ImportedBearing

_KEPT = [
    "bearing_type",
    "catalogue_designation",
    "manufacturer",
    "radial_dynamic_load_rating",
    "radial_static_load_rating",
    "axial_dynamic_load_rating",
    "axial_static_load_rating",
    "fatigue_limit_load",
    "radial_bearing_clearance",
    "axial_bearing_clearance",
    "operating_radial_bearing_clearance",
    "operating_axial_bearing_clearance",
    "mounted_radial_bearing_clearance",
    "radial_clearance_class",
    "preload_force",
    "preload_distance",
    "number_of_bearing_rows",
    "distance_between_bearing_rows",
    "bending_stiffness",
    "axial_factor_y_1",
    "axial_factor_y_2",
]
_KEPT_OF_ROW = [
    "number_of_rolling_elements",
    "pressure_angle",
    "reference_diameter_rolling_bearing",
    "raceway_radius_of_inner_ring",
    "raceway_radius_of_outer_ring",
    "significant_contact_length_inner_ring",
    "significant_contact_length_outer_ring",
]
_KEPT_OF_ELEMENT = (
    "diameter_of_rolling_element",
    "length_of_rolling_element",
    "roller_angle",
    "roller_crowning_radius",
)

_FORCES, _MOTIONS = ("f_u", "f_v", "f_w", "m_v", "m_w"), ("d_u", "d_v", "d_w", "rot_v", "rot_w")
_CASE_MOTIONS = [1, 2, 0, 4, 5]
"""Motions x, y, z, θx, θy of the case in u, v, w and the rotations about them."""

_UNLIKE = 0.01
"""Largest difference of a matrix from its transpose, relative to its largest entry with a lever of 0.1 m."""

_RINGS = ("inner", "outer")

_TAPERS = radians(5.0), radians(45.0)
"""Smallest and largest contact angle of tapered rollers."""


def read_bearings(parts: Parts, lines: Mapping[int, Line]) -> list[ImportedBearing]:
    """Return all bearings; those of one shaft only, or without a place, are mistakes."""
    found = []
    for component in parts.document.typed(*BEARINGS):
        bearing = _bearing(parts, component, lines)
        if bearing is not None:
            found.append(bearing)
    return found


def _bearing(parts: Parts, component: Component, lines: Mapping[int, Line]) -> ImportedBearing | None:
    record = parts.findings
    sides = parts.document.related("side", "assembly", component.id)
    inner = next((end for side in sides if (end := side.end("inner_part")) is not None), None)
    outer = next((end for side in sides if (end := side.end("outer_part")) is not None), None)
    owner = parts.document.owner(component.id, "shaft")
    if inner is None and owner is not None:
        inner = owner.id
    ends = [(inner, "u_coordinate_on_shaft_inner_side"), (outer, "u_coordinate_on_shaft_outer_side")]
    shafts = [(on, name) for end, name in ends if (on := _shaft(parts, end)) is not None]
    if not shafts:
        record.refuse(f"{component.label}: stands on no shaft: add the relation `side` with a shaft as inner_part")
        return None
    if len(shafts) == 1 and (inner is None or outer is None):
        record.add("assumed", parts.names[component.id], "other side", "the casing", "none given")
    (first, name), *others = shafts
    place = place_on_shaft(parts, component, first, lines, name)
    if place is None:
        place = place_on_shaft(parts, component, first, lines)
    if place is None:
        if name not in parts.values(component):
            record.refuse(f"{component.label}: {name} is missing: add it")
        return None
    other = parts.rotor[others[0][0]] if others else None
    if other == parts.rotor[first]:
        record.add("excluded", parts.names[component.id], "bearing", "between coupled shafts", "carries nothing")
        return None
    values = parts.values(component)
    _record_rest(parts, component)
    bore, outside = (values.number(name, "m", low=0.0) or None for name in ("inner_diameter", "outer_diameter"))
    if bore and outside and bore >= outside:
        record.refuse(
            f"{component.label}: inner_diameter = {1e3 * bore:g} mm is not below outer_diameter = {1e3 * outside:g} "
            "mm: correct one of them"
        )
    radial = _stiffness(parts, component, "radial_stiffness", "v_d_v", "w_d_w")
    absorbs = values.flag("radial_force_absorption") is not False
    kind, axial = (
        values.text("bearing_type") or component.type,
        _stiffness(parts, component, "axial_stiffness", "u_d_u"),
    )
    if kind.startswith("axial_") and axial is None:
        record.refuse(
            f"{component.label}: {kind} is a thrust bearing, whose rolling elements the chain does not have: give its "
            "axial_stiffness, or leave it out"
        )
        return None
    if kind.startswith("axial_") and radial is None:
        radial = 0.0
    return ImportedBearing(
        name=parts.names[component.id],
        shaft=parts.names[parts.rotor[first]],
        outer_shaft="" if other is None else parts.names[other],
        z=place,
        kind=kind,
        bore=bore,
        outer_diameter=outside,
        width=values.number("width", "m", low=0.0) or None,
        radial_stiffness=radial if absorbs else 0.0,
        axial_stiffness=axial,
        matrix=_operating_matrix(parts, component, first, lines) if absorbs else None,
        axial=_turn_to_z(values.text("axial_force_absorption") or "both_directions", lines.get(first)),
        **_internal(parts, component),
        catalogue=_catalogue(parts, component),
    )


def _shaft(parts: Parts, end: int | None) -> int | None:
    """Return the shaft at one side of a bearing: the side itself, or what a gear there stands on."""
    if end is None or end in parts.rotor:
        return end
    owner = parts.document.owner(end, "shaft")
    return None if owner is None else owner.id


def _turn_to_z(axial: str, line: Line | None) -> str:
    """Return the axial support along z of the unit, for one along u of its shaft."""
    if line is None or line.direction > 0:
        return axial
    return {"positive": "negative", "negative": "positive"}.get(axial, axial)


def _internal(parts: Parts, component: Component) -> dict[str, Any]:
    """Return ratings, clearance, and the rolling elements of the first row."""
    own = parts.values(component)
    rows = parts.document.parts(component.id, "rolling_bearing_row")
    row = parts.values(rows[0]) if rows else Values(component, parts.findings, {})
    inside = parts.document.parts(rows[0].id, "rolling_element") if rows else []
    element = parts.values(inside[0]) if inside else row
    count, lines = row.number("number_of_rolling_elements"), own.number("number_of_bearing_rows")
    lengths = [row.number(f"significant_contact_length_{ring}_ring", "m", low=0.0, high=1.0) for ring in _RINGS]
    lengths.append(element.number("length_of_rolling_element", "m", low=0.0, high=1.0))
    grooves = {
        f"{ring}_groove_radius": row.number(f"raceway_radius_of_{ring}_ring", "m", low=0.0, high=1e3) or None
        for ring in _RINGS
    }
    preload = own.number("preload_distance", "m", low=-1e-3, high=1e-3) or 0.0
    clearances = (own.number(f"{state}radial_bearing_clearance", "m") for state in ("operating_", "mounted_", ""))
    return {
        "elements": round(count) if count is not None and 3 <= count <= 500 else None,
        "rows": round(lines) if lines is not None and 1 <= lines <= 8 else len(rows) or None,
        "row_distance": own.number("distance_between_bearing_rows", "m", low=0.0, high=1.0) or None,
        "element_diameter": element.number("diameter_of_rolling_element", "m", low=0.0, high=1.0) or None,
        "element_length": min((length for length in lengths if length), default=None),
        "pitch_diameter": row.number("reference_diameter_rolling_bearing", "m", low=0.0, high=10.0) or None,
        **grooves,
        "contact_angle": _contact_angle(parts, component, own, row),
        "dynamic_load_rating": own.number("radial_dynamic_load_rating", "N"),
        "static_load_rating": own.number("radial_static_load_rating", "N"),
        "clearance": next((value for value in clearances if value is not None), None),
        "axial_clearance": own.number("operating_axial_bearing_clearance", "m") or -preload,
    }


def _contact_angle(parts: Parts, component: Component, own: Values, row: Values) -> float | None:
    """Return the contact angle (rad) in the file, or that by e = 1.5 tan α or Y of ISO 281.

    Tapered rollers and self-aligning bearings have e. Y = 0.4 cot α of one row; Y₂ = 0.67 cot α of two rows of
    rollers, 0.65 cot α of balls.
    """
    stated = row.number("pressure_angle", "rad", low=-1.5, high=1.5)
    kind = own.text("bearing_type") or component.type
    two = "self_aligning" in kind or "spherical" in kind
    if stated or not (two or "tapered" in kind):
        return stated
    e, y = own.number("catalogue_value_e", low=0.0), own.number("axial_factor_y_2", low=0.0)
    share = 0.65 if two and "ball" in kind else 0.67 if two or (own.number("number_of_bearing_rows") or 1) > 1 else 0.4
    angle = atan(e / 1.5) if e else atan(share / y) if y else 0.0
    if not _TAPERS[0] <= angle <= _TAPERS[1]:
        return None
    name, source = parts.names[component.id], f"e = {e:g} = 1.5 tan α" if e else f"Y = {y:g} = {share:g} cot α"
    parts.findings.add("assumed", name, "contact angle", f"{degrees(angle):.3g}°", f"{source} (ISO 281)")
    return angle


def _record_rest(parts: Parts, component: Component) -> None:
    """Record what the file states of a bearing that has no effect: tilt stiffness, preload force, misalignment."""
    values, name = parts.values(component), parts.names[component.id]
    for quantity, unit, shown, factor in _UNUSED:
        value = values.number(quantity, unit)
        if value:
            parts.findings.add("excluded", name, quantity, f"{factor * value:.5g} {shown}", "not used")


_UNUSED = (
    ("bending_stiffness", "N m/rad", "N m/rad", 1.0),
    ("preload_force", "N", "N", 1.0),
    ("misalignment_in_v_direction", "m", "µm", 1e6),
    ("misalignment_in_w_direction", "m", "µm", 1e6),
    ("angular_misalignment_around_v_axis", "rad", "mrad", 1e3),
    ("angular_misalignment_around_w_axis", "rad", "mrad", 1e3),
)


def _stiffness(parts: Parts, component: Component, name: str, *operating: str) -> float | None:
    """Return the stiffness (N/m) at the operating point, or the stated one; None without."""
    values = parts.values(component)
    points = [values.number(f"operating_point_stiffness_f_{axes}", "N/m") for axes in operating]
    given = [value for value in points if value is not None and value > 0]
    if given:
        return sum(given) / len(given)
    stated = values.number(name, "N/m")
    return stated if stated is not None and stated > 0 else None


def _operating_matrix(
    parts: Parts, component: Component, shaft: int, lines: Mapping[int, Line]
) -> tuple[tuple[float, ...], ...] | None:
    """Return the stiffness at the operating point for x, y, z, θx, θy; None where it is that of two springs.

    An entry that the file leaves out is that across the diagonal, or zero.
    """
    values = parts.values(component)
    given: dict[tuple[int, int], float] = {}
    for i, force in enumerate(_FORCES):
        for j, motion in enumerate(_MOTIONS):
            unit = ("N/m", "N")[j > 2] if i < 3 else ("N", "N m/rad")[j > 2]
            value = values.number(f"operating_point_stiffness_{force}_{motion}", unit)
            if value is not None:
                given[i, j] = value
    if any((i, i) not in given for i in range(3)):
        return None
    whole = np.array([[given.get((i, j), given.get((j, i), 0.0)) for j in range(5)] for i in range(5)])
    lever = np.array([1.0, 1.0, 1.0, 10.0, 10.0])
    scaled = whole * np.outer(lever, lever)
    rest = scaled - np.diag(np.diag(scaled))
    if not rest.any() and whole[1, 1] == whole[2, 2] and not np.diag(whole)[3:].any():
        return None
    name, scale = parts.names[component.id], float(np.abs(scaled).max())
    unlike = float(np.abs(scaled - scaled.T).max())
    if unlike > _UNLIKE * scale:
        text = f"differs from its transpose by {100 * unlike / scale:.3g} % of its largest entry"
        parts.findings.add("differs", name, "stiffness at the operating point", text, "radial and axial means taken")
        return None
    base = base_frame(parts, lines)
    own = frame_of(parts, component) or frame_of(parts, parts.document.components[shaft])
    turn = np.eye(6)
    if base is not None and own is not None:
        turn[:3, :3] = turn[3:, 3:] = base.axes @ own.axes.T  # u, v, w of the bearing to those of the case
    six = np.zeros((6, 6))
    six[np.ix_([0, 1, 2, 4, 5], [0, 1, 2, 4, 5])] = 0.5 * (whole + whole.T)
    moved = (turn @ six @ turn.T)[np.ix_(_CASE_MOTIONS, _CASE_MOTIONS)]
    return tuple(map(tuple, moved.tolist()))


def _catalogue(parts: Parts, component: Component) -> dict[str, str]:
    """Return further data of a bearing, its rows and rolling elements, as they stand in the file."""
    found: dict[str, str] = {}
    if component.name and component.name != parts.names[component.id]:
        found["name"] = component.name[:80]
    rows = parts.document.parts(component.id, "rolling_bearing_row")
    elements = [element for row in rows for element in parts.document.parts(row.id, "rolling_element")]
    for owner, names in (
        (component, _KEPT),
        *((r, _KEPT_OF_ROW) for r in rows),
        *((e, _KEPT_OF_ELEMENT) for e in elements),
    ):
        for name in names:
            attribute = owner.attributes.get(name)
            if attribute is None or isinstance(attribute.value, list | tuple | dict) or str(attribute.value) == "":
                continue
            unit = "" if attribute.unit in ("", "none") else f" {attribute.unit}"
            found.setdefault(name, f"{str(attribute.value)[:60]}{unit}")
    return found
