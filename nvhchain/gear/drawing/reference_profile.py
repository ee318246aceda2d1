"""Basic rack tooth profiles of ISO 53:1998, by name."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees
from typing import TYPE_CHECKING

from nvhchain.errors import require

if TYPE_CHECKING:
    from nvhchain.gear.drawing.geometry import GearGeometry

REFERENCE_PROFILES = {"A": (1.25, 0.38), "B": (1.25, 0.30), "C": (1.25, 0.25), "D": (1.40, 0.39)}
"""Profile → dedendum h_fP and root fillet radius ρ_fP (normal modules); all have 20° and addendum 1."""

_ROUNDING = 5e-4
"""Largest difference (normal modules) of a stated value from the profile's that counts as rounding."""


class Unstated(float):
    """Default of a field that other fields of a drawing may give; a number like any other."""

    __slots__ = ()


def state_profile(gear: GearGeometry) -> Iterator[tuple[str, float]]:
    """Yield the fields that the reference profile of a gear gives.

    Parameters
    ----------
    gear : GearGeometry
        Gear.

    Yields
    ------
    tuple
        Name and value of a field.

    Raises
    ------
    InputError
        If a stated value contradicts the profile.
    """
    name = gear.reference_profile
    if name is None:
        return
    require(
        name in REFERENCE_PROFILES,
        f"reference_profile = {name!r}: choose one of {', '.join(map(repr, REFERENCE_PROFILES))} of ISO 53",
    )
    angle = degrees(gear.normal_pressure_angle)
    require(
        abs(angle - 20) < 1e-4,
        f"normal_pressure_angle = {angle:.6g}° contradicts reference_profile = {name!r}, of 20°: leave the profile out "
        "and give dedendum and rack_tip_radius",
    )
    for field, value in zip(("dedendum", "rack_tip_radius"), REFERENCE_PROFILES[name], strict=True):
        stated = getattr(gear, field)
        if stated is None or isinstance(stated, Unstated):
            yield field, value
        else:
            require(
                abs(stated - value) <= _ROUNDING,
                f"{field} = {stated:g} contradicts reference_profile = {name!r}, of {value:g} normal modules: leave "
                "one of them out",
            )
