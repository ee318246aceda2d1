"""Axes and planes of an imported unit: shafts at their centre distances, gears on their common width."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin

from nvhchain.interop.rexs import GearUnit, ImportedStage

_AGREE = 5e-6
"""Largest difference (m) of centre distance and places that counts as none."""


@dataclass(frozen=True)
class Arrangement:
    """Places of shafts and gears.

    Parameters
    ----------
    axes : dict
        Axis x, y (m) of every shaft.
    shifts : dict
        Length (m) to be added to z on every shaft.
    planes : dict
        Mid-plane (m) of every gear in mesh.
    widths : dict
        Face width (m) of every gear about its mid-plane.
    distances : dict
        Centre distance (m) of every stage.
    """

    axes: dict[str, tuple[float, float]]
    shifts: dict[str, float]
    planes: dict[str, float]
    widths: dict[str, float]
    distances: dict[str, float]


def arranged(unit: GearUnit, nominal: dict[str, float]) -> Arrangement:
    """Return the places of shafts and gears.

    Parameters
    ----------
    unit : GearUnit
        Unit.
    nominal : dict
        Centre distance (m) by the profile shifts of every stage, where neither file nor places state one.

    Returns
    -------
    Arrangement
        Places; assumptions go into the record of the unit.
    """
    shafts = {shaft.name: shaft for shaft in unit.shafts}
    gears = {gear.name: gear for gear in unit.gears}
    axes = {unit.input_shaft: shafts[unit.input_shaft].axis or (0.0, 0.0)}
    shifts, distances = {unit.input_shaft: 0.0}, {}
    waiting = list(unit.stages)
    while waiting:
        stage = next(s for s in waiting if {gears[s.pinion].shaft, gears[s.wheel].shaft} & set(axes))
        waiting.remove(stage)
        near, far = gears[stage.pinion], gears[stage.wheel]
        back = near.shaft not in axes
        if back:
            near, far = far, near
        distance, axis = _axis(
            unit, stage, axes[near.shaft], (shafts[near.shaft].axis, shafts[far.shaft].axis), back, nominal
        )
        distances[stage.name] = distance
        axes.setdefault(far.shaft, axis)
        if far.shaft not in shifts:
            placed = shafts[far.shaft].axis is not None or near.z is None or far.z is None
            shifts[far.shaft] = 0.0 if placed else near.z + shifts[near.shaft] - far.z  # type: ignore[operator]
    planes, widths = _common(unit, shifts)
    return Arrangement(axes, shifts, planes, widths, distances)


def _axis(
    unit: GearUnit,
    stage: ImportedStage,
    start: tuple[float, float],
    given: tuple[tuple[float, float] | None, tuple[float, float] | None],
    back: bool,
    nominal: dict[str, float],
) -> tuple[float, tuple[float, float]]:
    """Return the centre distance (m) and the axis of a stage's second shaft."""
    record, (one, other) = unit.findings, given
    apart = hypot(other[0] - one[0], other[1] - one[1]) if one is not None and other is not None else None
    distance = stage.centre_distance
    if distance is None:
        distance = apart if apart else nominal[stage.name]
        source = "distance of the shafts" if apart else "profile shifts, without backlash"
        record.add("taken" if apart else "assumed", stage.name, "centre distance", f"{1e3 * distance:.6g} mm", source)
    elif apart and abs(apart - distance) > _AGREE:
        text = f"{1e3 * distance:.6g} mm stated, shafts {1e3 * apart:.6g} mm apart"
        record.add("differs", stage.name, "centre distance", text, "the stated one taken, the shaft moved")
    if apart and one is not None and other is not None:
        if abs(apart - distance) <= _AGREE and hypot(one[0] - start[0], one[1] - start[1]) <= _AGREE:
            return distance, other
        along = (other[0] - one[0]) / apart, (other[1] - one[1]) / apart
    elif stage.angle is not None:
        sign = -1.0 if back else 1.0
        along = sign * sin(stage.angle), sign * cos(stage.angle)
        record.add(
            "taken", stage.name, "direction of the axes", f"{stage.angle:.4g} rad", "rotating_angle_around_neg_u_axis"
        )
    else:
        along = 1.0, 0.0
        record.add("assumed", stage.name, "direction of the axes", "side by side", "no place of the shafts in the file")
    return distance, (start[0] + distance * along[0], start[1] + distance * along[1])


def _common(unit: GearUnit, shifts: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Return mid-plane and face width (m) of every gear, about the middle of the width common to those in mesh."""
    gears = {gear.name: gear for gear in unit.gears}
    group = {name: name for name in gears}
    for stage in unit.stages:
        one, other = group[stage.pinion], group[stage.wheel]
        group = {name: one if of == other else of for name, of in group.items()}
    planes: dict[str, float] = {}
    widths: dict[str, float] = {}
    for of in dict.fromkeys(group.values()):
        members = [gears[name] for name in gears if group[name] == of]
        known = [gear.z + shifts[gear.shaft] for gear in members if gear.z is not None]
        usual = known[0] if known else 0.0
        if len(known) < len(members):
            unit.findings.add("assumed", members[0].name, "mid-plane", f"z = {1e3 * usual:.5g} mm", "that of its mate")
        ends = {}
        for gear in members:
            z = usual if gear.z is None else gear.z + shifts[gear.shaft]
            ends[gear.name] = z - 0.5 * gear.face_width, z + 0.5 * gear.face_width
        low, high = max(low for low, _ in ends.values()), min(high for _, high in ends.values())
        if high - low < 1e-4:
            unit.findings.refuse(
                f"gears {', '.join(ends)} do not meet: their faces share {1e3 * max(high - low, 0.0):.3g} mm along the "
                "axis: correct u_coordinate_on_shaft"
            )
            high = low + 1e-3
        middle = 0.5 * (low + high)
        for name, (start, end) in ends.items():
            planes[name] = middle
            widths[name] = 2.0 * min(middle - start, end - middle)
            if abs(0.5 * (start + end) - middle) > 1e-6:
                unit.findings.add(
                    "assumed",
                    name,
                    "face",
                    f"{1e3 * widths[name]:.5g} mm about z = {1e3 * middle:.5g} mm, of {1e3 * (end - start):.5g} mm",
                    "contact on the width common to the gears in mesh; the rest of the face has no mass here",
                )
    for stage in unit.stages:
        stated = stage.stated.get("common_face_width")
        narrow = min((stage.pinion, stage.wheel), key=lambda name: widths[name])
        if stated is not None and 0.5 * widths[narrow] <= stated < widths[narrow] - 1e-6:
            text = f"{1e3 * stated:.5g} of {1e3 * widths[narrow]:.5g} mm"
            unit.findings.add("taken", narrow, "face", text, "common_face_width; the ends are chamfered")
            widths[narrow] = stated
    return planes, widths
