"""Axes and planes of an imported unit: shafts at their centre distances, gears on their mid-planes."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin

from nvhchain.gear.drawing.pair import LEAST_SHARE, common_face
from nvhchain.interop.rexs import GearUnit, ImportedStage

_AGREE = 5e-6
"""Largest difference (m) of centre distance and places that counts as none."""


@dataclass(frozen=True)
class Arrangement:
    """Places of shafts and gears.

    axes : axis x, y (m) of every shaft.
    shifts : length (m) to be added to z on every shaft.
    planes : mid-plane (m) of every gear in mesh.
    widths : face width (m) of every gear about its mid-plane.
    distances : centre distance (m) of every stage.
    """

    axes: dict[str, tuple[float, float]]
    shifts: dict[str, float]
    planes: dict[str, float]
    widths: dict[str, float]
    distances: dict[str, float]


def arranged(unit: GearUnit, nominal: dict[str, float]) -> Arrangement:
    """Return the places of shafts and gears.

    nominal : centre distance (m) by the profile shifts of every stage, where neither file nor places state one.
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
    for _ in unit.bearings:  # shafts without gears lie on the axis of those that they carry
        for bearing in unit.bearings:
            ends = bearing.shaft, bearing.outer_shaft
            if bearing.outer_shaft and len(set(ends) & set(axes)) == 1:
                held, free = ends if ends[0] in axes else ends[::-1]
                axes[free], shifts[free] = shafts[free].axis or axes[held], shifts[held]
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
        direction = (other[0] - one[0]) / apart, (other[1] - one[1]) / apart
    elif stage.angle is not None:
        sign = -1.0 if back else 1.0
        direction = sign * sin(stage.angle), sign * cos(stage.angle)
        record.add(
            "taken", stage.name, "direction of the axes", f"{stage.angle:.4g} rad", "rotating_angle_around_neg_u_axis"
        )
    else:
        direction = 1.0, 0.0
        record.add("assumed", stage.name, "direction of the axes", "side by side", "no place of the shafts in the file")
    return distance, (start[0] + distance * direction[0], start[1] + distance * direction[1])


def _common(unit: GearUnit, shifts: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Return mid-plane and face width (m) of every gear; gears without a place take the mid-plane of their mate."""
    gears = {gear.name: gear for gear in unit.gears}
    planes = {gear.name: gear.z + shifts[gear.shaft] for gear in unit.gears if gear.z is not None}
    waiting = [stage for stage in unit.stages if not {stage.pinion, stage.wheel} <= set(planes)]
    while waiting:
        stage = next((s for s in waiting if {s.pinion, s.wheel} & set(planes)), waiting[0])
        waiting.remove(stage)
        usual = planes.get(stage.pinion, planes.get(stage.wheel, 0.0))
        for name in {stage.pinion: None, stage.wheel: None}:
            if name not in planes:
                planes[name] = usual
                unit.findings.add("assumed", name, "mid-plane", f"z = {1e3 * usual:.5g} mm", "that of its mate")
    widths = {gear.name: gear.face_width for gear in unit.gears}
    for stage in unit.stages:
        pair = stage.pinion, stage.wheel
        low, high = common_face([planes[name] for name in pair], [widths[name] for name in pair])
        narrow = min(pair, key=lambda name: widths[name])
        if high - low < LEAST_SHARE * widths[narrow]:
            unit.findings.refuse(
                f"gears {', '.join(pair)} do not meet: their faces share {1e3 * max(high - low, 0.0):.3g} mm along the "
                "axis: correct u_coordinate_on_shaft"
            )
            continue
        if high - low < widths[narrow] - 1e-6:
            text = f"{1e3 * (high - low):.5g} of {1e3 * widths[narrow]:.5g} mm"
            unit.findings.add("taken", stage.name, "common face", text, "the mid-planes differ")
            continue
        stated = stage.stated.get("common_face_width")
        if stated is not None and 0.5 * widths[narrow] <= stated < widths[narrow] - 1e-6:
            text = f"{1e3 * stated:.5g} of {1e3 * widths[narrow]:.5g} mm"
            unit.findings.add("taken", narrow, "face", text, "common_face_width; the ends are chamfered")
            widths[narrow] = stated
    return {gear: planes[gear] for gear in gears if gear in planes}, widths
