"""Roller bearings: cylindrical, tapered and spherical."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin, tan

from nvhchain.bearings.catalogue import RollingBearing, angle_of, describe_no_play
from nvhchain.bearings.internal import Internal, roller_geometry
from nvhchain.bearings.rows import RollerRow, crowned_profile, logarithmic_profile
from nvhchain.dimensions import Angle, Length
from nvhchain.errors import require
from nvhchain.handoff import FloatArray

SPHERICAL_OSCULATION = 0.98
"""Profile radius of a spherical roller over that of its raceways; assumed, catalogues do not state it."""


@dataclass(frozen=True)
class Cylindrical(RollingBearing):
    """Cylindrical roller bearing.

    Parameters
    ----------
    bore, outer_diameter, width, dynamic_load_rating, static_load_rating, elements, element_diameter : optional
        As in `RollingBearing`.
    pitch_diameter, arrangement, row_distance, misalignment : optional
        As in `RollingBearing`.
    element_length : float, optional
        Effective length of the rollers (m).
    clearance : float
        Radial internal clearance in operation (m), a diameter; negative for preload.
    axial_stiffness : float
        Axial stiffness of the ribs (N/m); 0 for a floating bearing (N, NU).
    thrust : int
        Direction of the axial force of the shaft that the ribs carry: +1 along +z, −1 along −z (NJ); 0 for both (NUP).
    """

    element_length: Length | None = None
    clearance: Length = 0.0
    axial_stiffness: float = 0.0
    thrust: int = 0

    title = "cylindrical roller bearing"

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.thrust in (-1, 0, 1),
            f"{self.title}: thrust = {self.thrust} must be 1, −1, or 0 for ribs that carry both ways",
        )
        require(
            self.thrust == 0 or self.axial_stiffness > 0.0,
            f"{self.title}: thrust = {self.thrust} without axial_stiffness: give that of the ribs (N/m), or leave out "
            "thrust for a bearing that floats",
        )

    @cached_property
    def internal(self) -> Internal:
        """Internal geometry of a row."""
        return roller_geometry(self._given(0.0), share=0.53, fill=0.83, b_m=1.1)

    @cached_property
    def rows(self) -> tuple[RollerRow, ...]:
        """Rows of rollers."""
        internal = self.internal
        profile = logarithmic_profile(internal.diameter, internal.length)
        return tuple(
            RollerRow(
                internal.count, internal.length, 0.5 * internal.pitch_diameter, 0.0, 0.5 * self.clearance, profile, z
            )
            for z in self.places
        )

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the force of the shaft on the seat (5,) (N, N m) and its stiffness (5, 5).

        Parameters
        ----------
        u : (5,) array
            Displacement of the inner ring against the outer one: x, y, z (m) and tilts about x and y (rad).

        Returns
        -------
        force : (5,) array
            Force and moment at the centre of the bearing.
        stiffness : (5, 5) array
            Derivative of the force, symmetric.
        """
        force, stiffness = super().evaluate(u)
        if self.thrust * u[2] >= 0.0:
            force[2] += self.axial_stiffness * u[2]
            stiffness[2, 2] += self.axial_stiffness
        return force, stiffness

    @property
    def derived(self) -> tuple[str, ...]:
        """Statements about all values that were derived or assumed."""
        return (
            *self.internal.derived,
            "logarithmic profile of ISO/TS 16281",
            *describe_no_play(self.clearance, "clearance"),
        )


@dataclass(frozen=True)
class Tapered(RollingBearing):
    """Tapered roller bearing, single or a pair.

    Parameters
    ----------
    bore, outer_diameter, width, dynamic_load_rating, static_load_rating, elements, element_diameter : optional
        As in `RollingBearing`.
    pitch_diameter, arrangement, row_distance, misalignment : optional
        As in `RollingBearing`.
    element_length : float, optional
        Effective length of the rollers (m).
    contact_angle : float, optional
        Contact angle of the outer raceway (rad).
    load_ratio : float, optional
        Factor e of the catalogue, from which the contact angle follows.
    thrust : int
        Direction of the axial force of the shaft that a single bearing or a tandem carries: +1 along +z, −1 along −z.
    axial_clearance : float
        Axial play in operation (m) of one bearing, or of both of a pair together; negative for preload.
    """

    element_length: Length | None = None
    contact_angle: Angle | None = None
    load_ratio: float | None = None
    thrust: int = 0
    axial_clearance: Length = 0.0

    title = "tapered roller bearing"

    @cached_property
    def internal(self) -> Internal:
        """Internal geometry of a row."""
        angle = angle_of(self.title, self.contact_angle, self.load_ratio)[0]
        require(angle > 0.05, f"{self.title}: contact_angle = {angle:.4g} rad is below 0.05 rad: correct it")
        return roller_geometry(self._given(angle), share=0.5, fill=0.9, b_m=1.1)

    @cached_property
    def rows(self) -> tuple[RollerRow, ...]:
        """Rows of rollers."""
        internal = self.internal
        profile, opened = (
            logarithmic_profile(internal.diameter, internal.length),
            self.axial_clearance / len(self.places),
        )
        return tuple(
            RollerRow(
                internal.count,
                internal.length,
                0.5 * internal.pitch_diameter,
                way * internal.angle,
                opened * sin(internal.angle),
                profile,
                z,
            )
            for z, way in zip(self.places, self._directions(self.thrust), strict=True)
        )

    @property
    def derived(self) -> tuple[str, ...]:
        """Statements about all values that were derived or assumed."""
        angle = angle_of(self.title, self.contact_angle, self.load_ratio)[1]
        profile = "logarithmic profile of ISO/TS 16281"
        return (*angle, *self.internal.derived, profile, *describe_no_play(self.axial_clearance, "axial clearance"))


@dataclass(frozen=True)
class Spherical(RollingBearing):
    """Spherical roller bearing with two rows; tilts are free.

    Parameters
    ----------
    bore, outer_diameter, width : optional
        As in `RollingBearing`.
    dynamic_load_rating, static_load_rating : float, optional
        Load ratings C and C_0 (N) of both rows together.
    elements, element_diameter, pitch_diameter : optional
        As in `RollingBearing`.
    arrangement : str
        `single`: both rows belong to one bearing.
    row_distance : float, optional
        Not used: the rows lie where their normals meet on the axis.
    misalignment : (float, float)
        Without effect: the bearing aligns itself.
    element_length : float, optional
        Effective length of the rollers (m).
    contact_angle : float, optional
        Contact angle (rad).
    load_ratio : float, optional
        Factor e of the catalogue, from which the contact angle follows.
    clearance : float
        Radial internal clearance in operation (m), a diameter; negative for preload.
    floating : bool
        True where the bearing carries no axial force, since a ring slides in its seat.
    """

    element_length: Length | None = None
    contact_angle: Angle | None = None
    load_ratio: float | None = None
    clearance: Length = 0.0
    floating: bool = False

    title = "spherical roller bearing"
    load_rows = 2

    @cached_property
    def internal(self) -> Internal:
        """Internal geometry of a row."""
        angle = angle_of(self.title, self.contact_angle, self.load_ratio)[0]
        return roller_geometry(self._given(angle), share=0.53, fill=0.9, b_m=1.15)

    @cached_property
    def rows(self) -> tuple[RollerRow, ...]:
        """Rows of rollers."""
        require(
            self.arrangement == "single",
            f"{self.title}: arrangement = {self.arrangement!r}: it has two rows of its own; leave it out",
        )
        internal = self.internal
        radius = 0.5 * internal.pitch_diameter
        sphere = radius / cos(internal.angle) + 0.5 * internal.diameter
        profile = crowned_profile((1.0 / SPHERICAL_OSCULATION - 1.0) / sphere, internal.length)
        gap, place = 0.5 * self.clearance * cos(internal.angle), radius * tan(internal.angle)
        return tuple(
            RollerRow(
                internal.count, internal.length, radius, way * internal.angle, gap, profile, way * place, aligning=True
            )
            for way in (-1, 1)
        )

    @property
    def derived(self) -> tuple[str, ...]:
        """Statements about all values that were derived or assumed."""
        angle = angle_of(self.title, self.contact_angle, self.load_ratio)[1]
        crown = f"rollers of {SPHERICAL_OSCULATION:g} of the raceways' profile radius"
        return (*angle, *self.internal.derived, crown, *describe_no_play(self.clearance, "clearance"))
