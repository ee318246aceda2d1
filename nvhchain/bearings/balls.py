"""Ball bearings: deep groove and angular contact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

from nvhchain.bearings.catalogue import RollingBearing, describe_no_play
from nvhchain.bearings.hertz import Groove, ball_stiffness
from nvhchain.bearings.internal import Internal, ball_geometry
from nvhchain.bearings.rows import BallRow
from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, require

INNER_OSCULATION, OUTER_OSCULATION = 0.52, 0.53
"""Groove radii over ball diameter to which the load ratings of ISO 76 and ISO 281 apply."""


def _grooves(bearing: DeepGroove | AngularContact) -> tuple[Groove, Groove]:
    """Return the contacts of a ball with inner and outer raceway."""
    internal = bearing.internal
    gamma = internal.diameter * cos(internal.angle) / internal.pitch_diameter
    inner = bearing.inner_groove_radius or INNER_OSCULATION * internal.diameter
    outer = bearing.outer_groove_radius or OUTER_OSCULATION * internal.diameter
    for name, radius in (("inner", inner), ("outer", outer)):
        require(
            0.501 * internal.diameter <= radius <= internal.diameter,
            f"{bearing.title}: {name}_groove_radius = {1e3 * radius:.4g} mm is outside 0.501…1 times the ball diameter "
            f"{1e3 * internal.diameter:.4g} mm: correct it",
        )
    return Groove(internal.diameter, inner, gamma), Groove(internal.diameter, outer, -gamma)


def _derived(bearing: DeepGroove | AngularContact, clearance: float, kind: str) -> tuple[str, ...]:
    """Return the statements about values that were not given."""
    made = list(bearing.internal.derived)
    if bearing.inner_groove_radius is None or bearing.outer_groove_radius is None:
        made.append(f"groove radii {INNER_OSCULATION:g} and {OUTER_OSCULATION:g} of the ball diameter")
    return (*made, *describe_no_play(clearance, kind))


@dataclass(frozen=True)
class DeepGroove(RollingBearing):
    """Deep groove ball bearing.

    Parameters
    ----------
    bore, outer_diameter, width, dynamic_load_rating, static_load_rating, elements, element_diameter : optional
        As in `RollingBearing`.
    pitch_diameter, arrangement, row_distance, misalignment : optional
        As in `RollingBearing`.
    clearance : float
        Radial internal clearance in operation (m), a diameter; negative for preload.
    inner_groove_radius, outer_groove_radius : float, optional
        Radii of the grooves (m); by default 0.52 and 0.53 of the ball diameter.
    floating : bool
        True where the bearing carries no axial force, since a ring slides in its seat.
    """

    clearance: Length = 0.0
    inner_groove_radius: Length | None = None
    outer_groove_radius: Length | None = None
    floating: bool = False

    title = "deep groove ball bearing"

    @cached_property
    def internal(self) -> Internal:
        """Internal geometry of a row."""
        return ball_geometry(self._given(0.0))

    @cached_property
    def rows(self) -> tuple[BallRow, ...]:
        """Rows of balls."""
        inner, outer = _grooves(self)
        internal = self.internal
        distance = inner.groove_radius + outer.groove_radius - internal.diameter
        require(
            abs(self.clearance) < distance,
            f"{self.title}: clearance = {1e6 * self.clearance:.4g} µm is beyond {1e6 * distance:.4g} µm, the distance "
            "of its groove centres: correct it",
        )
        return tuple(
            BallRow(
                internal.count, ball_stiffness(inner, outer), 0.5 * internal.pitch_diameter, distance, 0.0,
                distance - 0.5 * self.clearance, z,
            )
            for z in self.places
        )  # fmt: skip

    @property
    def derived(self) -> tuple[str, ...]:
        """Statements about all values that were derived or assumed."""
        return _derived(self, self.clearance, "clearance")


@dataclass(frozen=True)
class AngularContact(RollingBearing):
    """Angular contact ball bearing, single or a pair.

    Parameters
    ----------
    bore, outer_diameter, width, dynamic_load_rating, static_load_rating, elements, element_diameter : optional
        As in `RollingBearing`.
    pitch_diameter, arrangement, row_distance, misalignment : optional
        As in `RollingBearing`.
    contact_angle : float
        Nominal contact angle (rad); required.
    thrust : int
        Direction of the axial force of the shaft that a single bearing or a tandem carries: +1 along +z, −1 along −z.
    axial_clearance : float
        Axial play in operation (m) of one bearing, or of both of a pair together; negative for preload.
    inner_groove_radius, outer_groove_radius : float, optional
        Radii of the grooves (m); by default 0.52 and 0.53 of the ball diameter.
    """

    contact_angle: Angle | None = None
    thrust: int = 0
    axial_clearance: Length = 0.0
    inner_groove_radius: Length | None = None
    outer_groove_radius: Length | None = None

    title = "angular contact ball bearing"

    @cached_property
    def internal(self) -> Internal:
        """Internal geometry of a row."""
        angle = self.contact_angle
        if angle is None:
            raise InputError(f"{self.title}: contact_angle is missing: give that of the catalogue, such as 40°")
        require(
            angle > 0.05, f"{self.title}: contact_angle = {angle:.4g} rad is below 0.05 rad: take a deep_groove bearing"
        )
        return ball_geometry(self._given(angle))

    @cached_property
    def rows(self) -> tuple[BallRow, ...]:
        """Rows of balls."""
        inner, outer = _grooves(self)
        internal = self.internal
        distance = inner.groove_radius + outer.groove_radius - internal.diameter
        opened = self.axial_clearance / len(self.places)
        return tuple(
            BallRow(
                internal.count, ball_stiffness(inner, outer), 0.5 * internal.pitch_diameter, distance,
                way * (distance * sin(internal.angle) - opened), distance * cos(internal.angle), z,
            )
            for z, way in zip(self.places, self._directions(self.thrust), strict=True)
        )  # fmt: skip

    @property
    def derived(self) -> tuple[str, ...]:
        """Statements about all values that were derived or assumed."""
        return _derived(self, self.axial_clearance, "axial clearance")
