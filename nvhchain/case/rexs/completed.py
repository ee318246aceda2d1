"""Gears of an imported unit as the chain draws them: what the file leaves open is completed by stated rules."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import acos, cos, degrees, dist, pi, sin, tan
from typing import Any

import numpy as np

from nvhchain.case.rexs.arranged import Arrangement
from nvhchain.case.rexs.backlash import set_backlashes
from nvhchain.case.rexs.flanks import micro_geometry
from nvhchain.case.rexs.measured import ball_allowance, measured_thickness, tool_fields
from nvhchain.errors import InputError
from nvhchain.gear import GearGeometry, GearPair
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.geometry import USUAL_RACK_TIP_RADIUS, involute
from nvhchain.gear.drawing.pair import offset_bodies
from nvhchain.interop.rexs import GearUnit, ImportedGear, ImportedStage

AGREEMENT = 1e-4
"""Largest relative difference of a result in the file and that of the drawn gears."""

_SPREAD = 0.5
"""Largest difference (modules) of centre distance and a_v = (d₁ + d₂)/2 + Σx m_n of gears that can mesh."""

_NEARLY = 1e-3
"""Largest relative difference of module or helix angle of two gears in mesh that counts as rounding."""


@dataclass(frozen=True)
class Comparison:
    """Result in the file beside that of the drawn gears."""

    stage: str
    quantity: str
    unit: str
    stated: float
    found: float

    @property
    def agrees(self) -> bool:
        """True within 1e-4 of the value."""
        return abs(self.found - self.stated) <= AGREEMENT * max(abs(self.stated), 1e-9)


def shared_data(unit: GearUnit) -> GearUnit:
    """Return the unit with one module, pressure angle and helix angle for gears in mesh, and their profile shifts."""
    gears = {gear.name: gear for gear in unit.gears}
    for stage in unit.stages:
        pinion, wheel = gears[stage.pinion], gears[stage.wheel]
        for quantity in ("module", "pressure_angle", "helix_angle"):
            one, other = getattr(pinion, quantity), getattr(wheel, quantity)
            target = -one if quantity == "helix_angle" else one
            difference = abs(other - target) / max(abs(target), 0.05 if quantity == "helix_angle" else abs(target))
            shown = [f"{degrees(v):.6g}°" if "angle" in quantity else f"{1e3 * v:.6g} mm" for v in (one, other)]
            if difference > _NEARLY:
                need = "of the same size and opposite hands" if quantity == "helix_angle" else "the same"
                unit.findings.refuse(
                    f"{stage.name}: {quantity.replace('_', ' ')} {shown[0]} of {pinion.name} and {shown[1]} of "
                    f"{wheel.name} do not mesh: make them {need}"
                )
            elif difference > 1e-9:
                text = f"{shown[0]} and {shown[1]}"
                unit.findings.add("differs", stage.name, quantity, text, f"rounding; that of {pinion.name} taken")
            gears[wheel.name] = wheel = replace(wheel, **{quantity: target})
        for gear in _shifted(unit, stage, pinion, wheel):
            gears[gear.name] = gear
    return replace(unit, gears=tuple(gears.values()))


def _measured_shift(unit: GearUnit, gear: ImportedGear) -> ImportedGear:
    """Return a gear without profile shift with that of its measured thickness, where the file has one."""
    if gear.profile_shift is not None or gear.thickness is not None or gear.allowance is not None:
        return gear
    found = measured_thickness(unit, gear)
    if found is None:
        return gear
    shift = found[1].profile_shift
    unit.findings.add("assumed", gear.name, "profile shift x", f"{shift:.6g}", "measured tooth thickness, no allowance")
    if gear.ball_deviation is not None:  # of a nominal dimension
        return replace(gear, profile_shift=shift)
    return replace(gear, profile_shift=shift, thickness=found[1].normal_thickness)


def _shifted(unit: GearUnit, stage: ImportedStage, pinion: ImportedGear, wheel: ImportedGear) -> list[ImportedGear]:
    """Return both gears with profile shifts, from the centre distance where the file has none."""
    pinion, wheel = (_measured_shift(unit, gear) for gear in (pinion, wheel))
    open_ = [gear for gear in (pinion, wheel) if gear.profile_shift is None]
    if not open_:
        return [pinion, wheel]
    total, source = stage.shift_sum, "sum of the profile shifts in the file"
    if total is None and (distance := stage.centre_distance or _apart(unit, pinion, wheel)) is not None:
        total, source = shift_sum(pinion, wheel, distance), "centre distance, without backlash"
    if total is None:
        total, source = 0.0, "none given"
    known = sum(gear.profile_shift or 0.0 for gear in (pinion, wheel))
    each = (total - known) / len(open_)
    for gear in open_:
        unit.findings.add("assumed", gear.name, "profile shift x", f"{each:.6g}", source)
    return [replace(gear, profile_shift=each) if gear in open_ else gear for gear in (pinion, wheel)]


def _apart(unit: GearUnit, pinion: ImportedGear, wheel: ImportedGear) -> float | None:
    """Return the distance (m) of the shafts of two gears; None where the file does not place both."""
    axes = {shaft.name: shaft.axis for shaft in unit.shafts}
    one, other = axes[pinion.shaft], axes[wheel.shaft]
    return dist(one, other) or None if one is not None and other is not None else None


def shift_sum(pinion: ImportedGear, wheel: ImportedGear, distance: float) -> float | None:
    """Return the sum (modules) of the profile shifts at which gears run without backlash at a centre distance (m).

    ISO 21771: inv α_wt = inv α_t + 2 tan α_n Σx/(z₁ + z₂). None where base circles are farther apart.
    """
    transverse = np.arctan(tan(pinion.pressure_angle) / cos(pinion.helix_angle))
    teeth = pinion.teeth + wheel.teeth
    cosine = 0.5 * teeth * pinion.module / cos(pinion.helix_angle) * cos(transverse) / distance
    if not 0.0 < cosine < 1.0:
        return None
    rise = float(involute(acos(cosine)) - involute(transverse))
    return rise * teeth / (2 * tan(pinion.pressure_angle))


def nominal_distances(unit: GearUnit) -> dict[str, float]:
    """Return the centre distance (m) of every stage without backlash by its profile shifts."""
    gears = {gear.name: gear for gear in unit.gears}
    found = {}
    for stage in unit.stages:
        pinion, wheel = gears[stage.pinion], gears[stage.wheel]
        total = (pinion.profile_shift or 0.0) + (wheel.profile_shift or 0.0)
        reference = 0.5 * (pinion.teeth + wheel.teeth) * pinion.module / cos(pinion.helix_angle)
        low, high = reference * 0.9, reference * 1.2
        for _ in range(60):
            middle = 0.5 * (low + high)
            value = shift_sum(pinion, wheel, middle)
            low, high = (middle, high) if value is None or value < total else (low, middle)
        found[stage.name] = 0.5 * (low + high)
    return found


def complete_gears(
    unit: GearUnit, arrangement: Arrangement, bores: dict[str, float]
) -> tuple[dict[str, GearGeometry], list[Comparison]]:
    """Return the geometry of every gear, and the results of the file beside those of the drawn gears.

    bores : bore radius (m) of every gear.
    """
    gears = {gear.name: gear for gear in unit.gears}
    fields = {name: _fields(unit, gear, arrangement, bores[name]) for name, gear in gears.items()}
    for stage in unit.stages:
        _set_tips(unit, stage, gears, fields, arrangement.distances[stage.name])
    if unit.findings.mistakes:
        return {}, []
    drawn: dict[str, GearGeometry] = {}
    for name in gears:
        try:
            shape = drawn[name] = GearGeometry(**fields[name])
            if shape.undercut > 0:
                text = f"form diameter {2e3 * shape.form_radius:.6g} mm"
                unit.findings.add("taken", name, "undercut", text, "drawn with the trochoid of the tool")
        except InputError as error:
            unit.findings.refuse(f"gear {name}: {error}")
    stages = [stage for stage in unit.stages if stage.pinion in drawn and stage.wheel in drawn]
    open_ = [name for name in drawn if not fields[name].keys() & {"thickness", "thickness_allowance"}]
    set_backlashes(unit, stages, drawn, arrangement.distances, open_)
    for name, gear in gears.items():
        if name in drawn:
            try:
                drawn[name] = replace(drawn[name], micro=micro_geometry(unit, gear, drawn[name]))
            except InputError as error:
                unit.findings.refuse(f"gear {name}: {error}")
    comparisons = [line for stage in stages for line in _compared(unit, stage, drawn, arrangement)]
    return drawn, comparisons


def _fields(unit: GearUnit, gear: ImportedGear, arrangement: Arrangement, bore: float) -> dict[str, Any]:
    """Return the fields of a geometry, with assumptions for the basic profile."""
    record, x = unit.findings, gear.profile_shift or 0.0
    pitch = 0.5 * gear.teeth * gear.module / cos(gear.helix_angle)
    dedendum, source = gear.dedendum, "tool"
    if gear.root_radius is not None:
        dedendum, source = (pitch - gear.root_radius) / gear.module + x, "root diameter"
    if dedendum is None:
        dedendum = 1.25
        record.add(
            "assumed", gear.name, "dedendum", "1.25 modules", "ISO 53 profile A; neither tool nor root diameter given"
        )
    else:
        record.add("taken", gear.name, "dedendum", f"{dedendum:.5g} modules", source)
    fields: dict[str, Any] = {
        "teeth": gear.teeth,
        "normal_module": gear.module,
        "normal_pressure_angle": gear.pressure_angle,
        "helix_angle": gear.helix_angle,
        "face_width": arrangement.widths[gear.name],
        "bore_radius": bore,
        "profile_shift": x,
        "dedendum": dedendum,
        **tool_fields(unit, gear),
    }
    if gear.addendum is not None:
        fields["addendum"] = gear.addendum
    if gear.tip_radius is not None:
        fields["tip_radius"] = gear.tip_radius
    limit = pi / 4 - dedendum * tan(gear.pressure_angle)
    largest = limit * cos(gear.pressure_angle) / (1 - sin(gear.pressure_angle))
    if gear.rack_tip_radius is not None and gear.rack_tip_radius <= largest:
        fields["rack_tip_radius"] = gear.rack_tip_radius
    elif gear.rack_tip_radius is not None:
        text = f"{max(largest, 0.0):.4g} modules instead of {gear.rack_tip_radius:.4g}"
        record.add("assumed", gear.name, "tip radius of the tool", text, "largest that fits the drawn profile")
    else:
        text = f"{min(USUAL_RACK_TIP_RADIUS, largest):.4g} modules"
        record.add("assumed", gear.name, "tip radius of the tool", text, "ISO 53 profile A, or the largest that fits")
    if gear.thickness is not None:
        nominal = gear.module * (pi / 2 + 2 * x * tan(gear.pressure_angle))
        fields["thickness_allowance"] = nominal - gear.thickness
    elif gear.allowance is not None:
        fields["thickness_allowance"] = gear.allowance
    elif gear.ball_deviation is not None and (allowance := ball_allowance(unit, gear, x)) is not None:
        fields["thickness_allowance"] = allowance
    elif (found := measured_thickness(unit, gear)) is not None:
        fields["thickness"] = found[0]
    return fields


def _set_tips(
    unit: GearUnit,
    stage: ImportedStage,
    gears: dict[str, ImportedGear],
    fields: dict[str, dict[str, Any]],
    distance: float,
) -> None:
    """Shorten tips that the file leaves open so that the tip clearance is kept (DIN 3960: k = (a − a_v)/m_n)."""
    pair = [gears[stage.pinion], gears[stage.wheel]]
    reference = 0.5 * sum(gear.teeth for gear in pair) * pair[0].module / cos(pair[0].helix_angle)
    spread = (distance - reference) / pair[0].module - sum(gear.profile_shift or 0.0 for gear in pair)
    if abs(spread) > _SPREAD:
        unit.findings.refuse(
            f"{stage.name}: centre distance {1e3 * distance:.6g} mm is {abs(spread):.2g} modules from the "
            f"{1e3 * (distance - spread * pair[0].module):.6g} mm of teeth, module, helix and profile shifts (limit "
            f"{_SPREAD:g}): correct one of them"
        )
        return
    for gear in pair:
        own = fields[gear.name]
        if "tip_radius" in own or "addendum" in own:
            continue
        own["addendum"] = 1.0 + min(spread, 0.0)
        text = f"{own['addendum']:.5g} modules"
        unit.findings.add(
            "assumed",
            gear.name,
            "addendum",
            text,
            "ISO 53 profile, shortened to keep the tip clearance; no tip diameter given",
        )


def _compared(
    unit: GearUnit, stage: ImportedStage, drawn: dict[str, GearGeometry], arrangement: Arrangement
) -> list[Comparison]:
    """Return the results of a stage beside those of the file; differences beyond 1e-4 go into the record."""
    distance = arrangement.distances[stage.name]
    try:
        planes = arrangement.planes[stage.pinion], arrangement.planes[stage.wheel]
        bodies = offset_bodies(GearBody(drawn[stage.pinion]), GearBody(drawn[stage.wheel]), planes)
        pair = GearPair(*bodies, distance)
    except InputError as error:
        unit.findings.refuse(f"{stage.name}: {error}")
        return []
    found = {
        "contact_ratio": ("transverse contact ratio", "", pair.transverse_contact_ratio, 1.0),
        "overlap_ratio": ("overlap ratio", "", pair.overlap_ratio, 1.0),
        "total_contact_ratio": ("total contact ratio", "", pair.total_contact_ratio, 1.0),
        "working_pressure_angle": (
            "transverse working pressure angle",
            "°",
            degrees(pair.working_pressure_angle),
            180 / pi,
        ),
        "common_face_width": ("common face width", "mm", 1e3 * pair.face_width, 1e3),
    }
    lines = []
    if stage.centre_distance is not None:
        lines.append(Comparison(stage.name, "centre distance", "mm", 1e3 * stage.centre_distance, 1e3 * distance))
    for key, stated in stage.stated.items():
        quantity, unit_, value, factor = found[key]
        lines.append(Comparison(stage.name, quantity, unit_, factor * stated, value))
    for line in lines:
        if not line.agrees:
            text = f"file {line.stated:.7g}, drawn {line.found:.7g} {line.unit}".rstrip()
            unit.findings.add("differs", stage.name, line.quantity, text, "drawn gears taken")
    return lines
