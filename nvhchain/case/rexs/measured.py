"""Measured tooth thickness, chamfer and tool of imported gears as the chain draws them."""

from __future__ import annotations

from typing import Any

from nvhchain.errors import InputError, require
from nvhchain.gear import GearGeometry, MeasuredThickness, Protuberance
from nvhchain.gear.drawing.measures import dimension_over_balls
from nvhchain.interop.rexs import GearUnit, ImportedGear

_SMALL_BORE = 1e-4
"""Bore radius (m) of a gear of which only the teeth are wanted."""


def measured_thickness(unit: GearUnit, gear: ImportedGear) -> tuple[MeasuredThickness, GearGeometry] | None:
    """Return the measured tooth thickness of a gear, and a gear with its profile shift; None without one that fits."""
    if gear.span is None and gear.ball_size is None:
        return None
    length, teeth = gear.span or (None, None)
    size, ball, gauge = gear.ball_size or (None, None, "balls")
    shown = [f"{1e3 * length:.7g} mm over {teeth} teeth"] if length else []
    shown += [f"{1e3 * size:.7g} mm over {gauge} of {1e3 * (ball or 0.0):.4g} mm"] if size else []
    given: dict[str, Any] = {} if gear.profile_shift is None else {"profile_shift": gear.profile_shift}
    try:
        measured = MeasuredThickness(length, teeth, size, ball, gauge)  # type: ignore[arg-type]
        drawn = _plain(gear, thickness=measured, **given)
    except InputError as error:
        unit.findings.add("differs", gear.name, "tooth thickness", " and ".join(shown), f"not used: {error}")
        return None
    unit.findings.add("taken", gear.name, "tooth thickness", " and ".join(shown), "measure in the file")
    return measured, drawn


def ball_allowance(unit: GearUnit, gear: ImportedGear, shift: float) -> float | None:
    """Return the reduction of the normal tooth thickness (m) by the mean deviation of the dimension over balls.

    shift : profile shift (normal modules).
    """
    deviation = gear.ball_deviation or 0.0
    try:
        require(gear.ball is not None, "the diameter of the ball is missing")
        ball = gear.ball or 0.0
        nominal = _plain(gear, profile_shift=shift)
        measured = MeasuredThickness(None, None, dimension_over_balls(nominal, ball) + deviation, ball)
        allowance = _plain(gear, profile_shift=shift, thickness=measured).thickness_allowance
    except InputError as error:
        unit.findings.add("excluded", gear.name, "deviation over balls", f"{1e6 * deviation:.4g} µm", str(error))
        return None
    source = f"mean deviation over balls of {1e3 * ball:.4g} mm"
    unit.findings.add("taken", gear.name, "thickness allowance", f"{1e6 * allowance:.4g} µm", source)
    return allowance


def _plain(gear: ImportedGear, **fields: Any) -> GearGeometry:
    """Return the teeth of a gear without what does not bear on their thickness."""
    return GearGeometry(
        teeth=gear.teeth,
        normal_module=gear.module,
        normal_pressure_angle=gear.pressure_angle,
        helix_angle=gear.helix_angle,
        face_width=gear.face_width,
        bore_radius=_SMALL_BORE,
        **fields,
    )


def tool_fields(unit: GearUnit, gear: ImportedGear) -> dict[str, Any]:
    """Return the fields of a geometry for the chamfer of a gear and the protuberance of its tool."""
    fields: dict[str, Any] = {"tip_chamfer": gear.tip_chamfer} if gear.tip_chamfer else {}
    if gear.protuberance is None:
        return fields
    amount, stock, angle = gear.protuberance
    if angle is None or angle >= gear.pressure_angle:
        angle = 0.5 * gear.pressure_angle
        unit.findings.add(
            "assumed", gear.name, "angle of the protuberance", "half the pressure angle", "none that fits"
        )
    try:
        return fields | {"protuberance": Protuberance(amount, stock, angle)}
    except InputError as error:
        unit.findings.add("excluded", gear.name, "protuberance", f"{1e3 * amount:.4g} mm", str(error))
        return fields
