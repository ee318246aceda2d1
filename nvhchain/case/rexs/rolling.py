"""Rolling bearings of a unit as those of the case, with their rolling elements."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import degrees, radians
from typing import Any

from nvhchain.bearings import AngularContact, Cylindrical, DeepGroove, Spherical, Tapered
from nvhchain.bearings.catalogue import Arrangement
from nvhchain.errors import InputError
from nvhchain.interop.rexs import GearUnit, ImportedBearing

RollingModel = DeepGroove | AngularContact | Cylindrical | Tapered | Spherical

_STEEPEST_GROOVE = 0.1
"""Contact angle (rad) up to which a grooved ball bearing is a deep groove bearing."""

RIBS = 0.1
"""Axial stiffness of the ribs of a roller bearing over its radial stiffness; an assumption."""

_ROW_DISTANCE = 0.5
"""Distance of the rows of a double-row angular contact bearing over its width; that of a 3208 is 0.5."""

_CIRCLES = ("pitch_diameter", "inner_groove_radius", "outer_groove_radius")
"""Internal geometry beside the elements."""

_MOUNTED = ("operating_radial_bearing_clearance", "mounted_radial_bearing_clearance")


@dataclass(frozen=True)
class Elements:
    """Rolling elements of a row.

    diameter, length : diameter and length (m).
    """

    count: float
    diameter: float
    length: float
    source: str


def rolling_model(
    unit: GearUnit,
    bearing: ImportedBearing,
    sizes: tuple[float, float, float],
    elements: Elements,
    angle: float,
    radial_stiffness: float,
) -> RollingModel | None:
    """Return the rolling bearing of the case for one of the file; None where its type has none.

    sizes : (float, float, float) bore, outer diameter and width (m).
    angle : contact angle (rad).
    radial_stiffness : estimated radial stiffness (N/m), to which that of ribs relates.
    """
    thrust = {"positive": 1, "negative": -1}.get(bearing.axial, 0)
    kind, own = _class(bearing, angle, thrust), dict[str, Any]()
    if kind is None:
        return None
    if kind in (AngularContact, Tapered):
        own = {"contact_angle": radians(round(degrees(angle), 6)), "thrust": thrust}
        own["axial_clearance"] = bearing.axial_clearance
        if not thrust:
            own |= {"arrangement": "back_to_back", "row_distance": bearing.row_distance}
            text, source = "back to back", "usual of double-row bearings"
            if bearing.row_distance is None:
                own["row_distance"] = round(_ROW_DISTANCE * sizes[2], 5)
                text = f"{1e3 * own['row_distance']:.4g} mm apart, {text}"
                source = "half the width of a double-row bearing"
            unit.findings.add("assumed", bearing.name, "rows", text, source)
    elif kind is Spherical:
        own = {"contact_angle": radians(round(degrees(angle), 6))}
    elif kind is Cylindrical and bearing.axial != "no_direction":
        own = {"axial_stiffness": float(f"{RIBS * radial_stiffness:.3g}"), "thrust": thrust}
        text = f"{own['axial_stiffness']:.3g} N/m"
        unit.findings.add("assumed", bearing.name, "stiffness of the ribs", text, "a tenth of the radial stiffness")
    if kind in (DeepGroove, Spherical) and bearing.axial == "no_direction":
        own["floating"] = True
    if hasattr(kind, "clearance"):
        own["clearance"] = _clearance(unit, bearing)
    bore, outer, width = sizes
    own |= {"bore": bore, "outer_diameter": outer, "width": width}
    inside: dict[str, Any] = {"elements": round(elements.count), "element_diameter": elements.diameter}
    if kind not in (DeepGroove, AngularContact):
        inside["element_length"] = elements.length
    static, dynamic = bearing.static_load_rating, bearing.dynamic_load_rating
    if "arrangement" in own:  # of one row: ISO 76 and ISO 281 rate i rows by i and i^0.7
        static, dynamic = static and static / 2, dynamic and dynamic / 2**0.7
    ratings: dict[str, Any] = {"static_load_rating": static, "dynamic_load_rating": dynamic}
    detailed = bearing.elements is not None and bearing.element_diameter is not None
    choices = [inside | ratings, inside] if detailed else [ratings, inside] if bearing.static_load_rating else [inside]
    known = {field.name for field in fields(kind)}
    circles = {name: value for name in _CIRCLES if name in known and (value := getattr(bearing, name)) is not None}
    for each, taken in [*((each, circles) for each in choices if circles), *((each, {}) for each in choices)]:
        try:
            made = kind(**own, **taken, **{key: value for key, value in each.items() if value is not None})
        except InputError as error:
            unit.findings.add("differs", bearing.name, "internal geometry", "not used", str(error))
            continue
        _record(unit, bearing, made, elements, angle, rated=each is ratings, detailed=detailed)
        for name, value in taken.items():
            unit.findings.add("taken", bearing.name, name.replace("_", " "), f"{1e3 * value:.6g} mm", "file")
        return made
    return None


def paired(low: RollingModel | None, high: RollingModel | None, apart: float) -> RollingModel | None:
    """Return two single bearings of one kind and size as a pair; None if they differ, or one is a pair already.

    low, high : bearings at the lower and the higher z; None for one without rolling elements.
    apart : distance of their centres (m).
    """
    if low is None or high is None or low.load_rows > 1 or (low.arrangement, high.arrangement) != ("single", "single"):
        return None
    if isinstance(low, AngularContact | Tapered) and isinstance(high, AngularContact | Tapered):
        if replace(low, thrust=1, axial_clearance=0.0) != replace(high, thrust=1, axial_clearance=0.0):
            return None
        play = low.axial_clearance + high.axial_clearance
        if low.thrust == high.thrust:
            return replace(low, arrangement="tandem", row_distance=apart, axial_clearance=play)
        kind: Arrangement = "back_to_back" if low.thrust > 0 else "face_to_face"
        return replace(low, arrangement=kind, row_distance=apart, axial_clearance=play, thrust=0)
    if isinstance(low, Cylindrical) and isinstance(high, Cylindrical):  # stiffness of ribs follows the load of each
        ribs = low.axial_stiffness + high.axial_stiffness
        low, high = replace(low, axial_stiffness=ribs), replace(high, axial_stiffness=ribs)
    return replace(low, arrangement="tandem", row_distance=apart) if low == high else None


def _class(bearing: ImportedBearing, angle: float, thrust: int) -> type[RollingModel] | None:
    """Return the kind of a bearing; None where the case has none that carries the same directions."""
    one_way = thrust != 0
    if "self_aligning_roller" in bearing.kind:
        return Spherical if not one_way and angle > _STEEPEST_GROOVE else None
    rows = bearing.rows or 1
    if bearing.kind == "angular_contact_ball_bearing" and angle > _STEEPEST_GROOVE:
        return AngularContact if (rows == 1 and one_way) or (rows == 2 and bearing.axial == "both_directions") else None
    if rows > 1:
        return None
    if "grooved_ball" in bearing.kind and "radial" in bearing.kind:
        if (bearing.contact_angle or 0.0) <= _STEEPEST_GROOVE:
            return DeepGroove
        return AngularContact if one_way else None
    if bearing.kind == "radial_tapered_roller_bearing":
        return Tapered if one_way and angle > _STEEPEST_GROOVE else None
    return Cylindrical if bearing.kind in ("radial_roller_bearing", "radial_needle_roller_bearing") else None


def _clearance(unit: GearUnit, bearing: ImportedBearing) -> float:
    """Return the clearance (m) in operation or as mounted; none where the file has it before mounting only."""
    if bearing.clearance is None:
        return 0.0
    if any(name in bearing.catalogue for name in _MOUNTED):
        return bearing.clearance
    text = f"none instead of {1e6 * bearing.clearance:.4g} µm"
    unit.findings.add("assumed", bearing.name, "clearance in operation", text, "that in the file is before mounting")
    return 0.0


def _record(
    unit: GearUnit,
    bearing: ImportedBearing,
    made: RollingModel,
    elements: Elements,
    angle: float,
    *,
    rated: bool,
    detailed: bool,
) -> None:
    """Record what was derived or assumed of the inside of a bearing."""
    inside, record = made.internal, unit.findings
    if not detailed:
        text = f"{inside.count} of {1e3 * inside.diameter:.4g} mm" + (
            f", {1e3 * inside.length:.4g} mm long" if inside.length else ""
        )
        source = "load ratings of the file by ISO 76 and ISO 281" if rated else elements.source
        record.add("assumed", bearing.name, "rolling elements", text, source)
    if inside.angle and bearing.contact_angle is None:
        record.add("assumed", bearing.name, "contact angle", f"{degrees(angle):.4g}°", "usual of its type")
    if bearing.axial_clearance and not hasattr(made, "axial_clearance"):
        text = f"{1e6 * bearing.axial_clearance:.4g} µm"
        record.add("excluded", bearing.name, "axial clearance", text, f"{made.title} has none in the case")
    if bearing.axial in ("positive", "negative") and isinstance(made, DeepGroove):
        record.add("assumed", bearing.name, "axial support", "both directions", "a deep groove bearing carries both")
