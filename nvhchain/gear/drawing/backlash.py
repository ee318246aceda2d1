"""Backlash of two gears, and tooth thickness from a stated backlash."""

from __future__ import annotations

from dataclasses import replace
from math import acos, cos, pi, tan

from nvhchain.dimensions import Unstated
from nvhchain.errors import require, warn_caller
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.drawing.thickness import ROUNDING
from nvhchain.kinds import checked


@checked
def normal_backlash(pinion: GearGeometry, wheel: GearGeometry, centre_distance: float) -> float:
    """Return the normal backlash j_bn of two gears (m), negative where the flanks jam.

    centre_distance: centre distance (m).
    Returns backlash along the line of action.

    j_bn = j_wt cos α_wt cos β_b, with the circumferential backlash j_wt = p_wt − s_wt1 − s_wt2 (ISO 21771).
    """
    working = working_angle(pinion, wheel, centre_distance)
    radii = [gear.base_radius / cos(working) for gear in (pinion, wheel)]
    thickness = sum(2 * r * float(g.half_tooth_angle(r)) for g, r in zip((pinion, wheel), radii, strict=True))
    pitch = 2 * pi * radii[1] / wheel.teeth
    return (pitch - thickness) * cos(working) * cos(pinion.base_helix_angle)


def working_angle(pinion: GearGeometry, wheel: GearGeometry, centre_distance: float) -> float:
    """Return the transverse working pressure angle α_wt (rad); 0 below the sum of the base radii."""
    return acos(min((pinion.base_radius + wheel.base_radius) / centre_distance, 1.0))


@checked
def set_backlash(
    pinion: GearGeometry,
    wheel: GearGeometry,
    centre_distance: float,
    *,
    normal: float | None = None,
    circumferential: float | None = None,
) -> tuple[GearGeometry, GearGeometry]:
    """Return the gears with the tooth thickness that a stated backlash of the pair gives.

    Parameters
    ----------
    pinion, wheel, centre_distance
        As in `normal_backlash`.
    normal, circumferential : float, optional
        Backlash j_bn along the line of action, or j_wt on the working pitch circles in the transverse section (m).

    Returns
    -------
    tuple of 2 GearGeometry
        Pinion and wheel.

    Raises
    ------
    InputError
        If not exactly one backlash is given, or the gears state another one beyond the rounding of a drawing.

    Notes
    -----
    A gear is open if it states neither thickness_allowance nor thickness.  Open gears without profile_shift get it from
    the backlash, in equal parts where both are.  Otherwise open gears keep their shifts and share the allowance.
    """
    require(
        (normal is None) is not (circumferential is None),
        f"backlash: normal = {normal} and circumferential = {circumferential}: give one of them",
    )
    wanted = normal
    if circumferential is not None:
        cosine = cos(working_angle(pinion, wheel, centre_distance))
        wanted = circumferential * cosine * cos(pinion.base_helix_angle)
    assert wanted is not None
    require(
        0 <= wanted <= 0.5 * pinion.normal_module,
        f"backlash = {1e3 * wanted:g} mm is outside 0…{500 * pinion.normal_module:g} mm (half a module): give it in m",
    )
    gears, found = [pinion, wheel], normal_backlash(pinion, wheel, centre_distance)
    open_ = [gear for gear in gears if gear.thickness is None and isinstance(gear.thickness_allowance, Unstated)]
    text = f"backlash {1e3 * wanted:.7g} mm stated, {1e3 * found:.7g} mm by the tooth thicknesses (along the normal)"
    if not open_:
        require(
            abs(found - wanted) <= ROUNDING,
            f"{text}: they differ by {1e6 * abs(found - wanted):.4g} µm, of 1 µm at most: correct the backlash, or "
            "leave out thickness_allowance or thickness of a gear",
        )
        if abs(found - wanted) > 1e-9:
            warn_caller(f"{text} (passes as the rounding of a drawing)", kind="backlash")
        return pinion, wheel
    shifted = [gear for gear in open_ if isinstance(gear.profile_shift, Unstated)]
    angle = pinion.normal_pressure_angle
    each = (wanted - found) / cos(angle) / len(shifted or open_)
    for number, gear in enumerate(gears):
        if any(gear is item for item in shifted):
            shift = gear.profile_shift - each / (2 * gear.normal_module * tan(angle))
            gears[number] = replace(gear, profile_shift=shift, thickness_allowance=float(gear.thickness_allowance))
        elif not shifted and any(gear is item for item in open_):
            gears[number] = replace(gear, thickness_allowance=each)
    return gears[0], gears[1]
