"""Root of a tooth as a rack-shaped tool cuts it: trochoid, undercut, protuberance.

The rack tooth ends in an arc.  A protuberance tool is wider there: its arc stands out from the flank's line by
amount − grinding allowance, and a line at the protuberance angle leads back to the flank (ISO 6336-3).

A point of the tool cuts where its normal passes through the pitch point.  The involute ends where this curve crosses
it: at the tool's own tangent point, or above it on an undercut tooth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import acos, atan, cos, degrees, pi, radians, sin, tan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from nvhchain.dimensions import Angle, Length, Unstated
from nvhchain.errors import require, require_each
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

if TYPE_CHECKING:
    from nvhchain.gear.drawing.geometry import GearGeometry

REFERENCE_PROFILES = {"A": (1.25, 0.38), "B": (1.25, 0.30), "C": (1.25, 0.25), "D": (1.40, 0.39)}
"""Profile → dedendum h_fP and root fillet radius ρ_fP (normal modules); all have 20° and addendum 1."""

_PROFILE_ROUNDING = 5e-4
"""Largest difference (normal modules) of a stated value from the profile's that counts as rounding."""

_POINTS = 800
"""Points of the tool's tip among which the crossing with the involute is bracketed."""

_LEAST_NECK = 0.25
"""Least thickness of an undercut tooth at its neck (normal modules); thinner teeth have no practical use."""


@dataclass(frozen=True)
class Protuberance:
    """Protuberance of a tool, which leaves an undercut for the run-out of grinding.

    Parameters
    ----------
    amount : float
        Protuberance pr_P0 (m): distance of the tip arc from the line of the tool's flank.
    grinding_allowance : float
        Stock q on each flank, normal to it (m); ground off, so that amount − allowance is left below the flank.
    angle : float
        Angle of the protuberance's flank (rad), below the pressure angle.
    """

    amount: Length
    grinding_allowance: Length = 0.0
    angle: Angle = 10.0 * pi / 180

    def __post_init__(self) -> None:
        check_fields(self)
        amount, stock = self.amount, self.grinding_allowance
        require_each(
            (0 < amount <= 5e-3, f"amount = {amount:g} m is outside 0…0.005 m: give it in m"),
            (
                0 <= stock <= amount,
                f"grinding_allowance = {stock:g} m is outside 0…{amount:g} m, the amount of the protuberance: grinding "
                "would cut into the root; lower it",
            ),
            (
                radians(2) <= self.angle < radians(35),
                f"angle = {degrees(self.angle):.4g}° is outside 2…35°: usual is 10°",
            ),
        )

    @property
    def remaining(self) -> float:
        """Depth of the undercut below the finished flank (m)."""
        return self.amount - self.grinding_allowance


class _Involute(NamedTuple):
    """Involute by its base radius (m) and the half tooth angle (rad) at which it starts."""

    base: float
    start: float

    def angle(self, radius: ArrayLike) -> FloatArray:
        """Return the half tooth angle (rad) at `radius` (m); below the base circle that of its start."""
        pressure = np.arccos(np.minimum(self.base / np.asarray(radius, float), 1.0))
        return self.start - np.tan(pressure) + pressure


class ToothRoot:
    """Root curve of one tooth from the end of the involute to the root circle.

    gear : gear, whose rack has been checked.
    """

    def __init__(self, gear: GearGeometry) -> None:
        alpha, rho = gear.normal_pressure_angle, gear.rack_tip_radius_in_use
        self._gear, self._rho = gear, rho
        self._module, self._slant = gear.normal_module, np.cos(gear.helix_angle)
        self._out = gear.protuberance.remaining / gear.normal_module if gear.protuberance else 0.0
        corner = gear.rack_half_width - gear.dedendum * np.tan(alpha) - rho * (1 - np.sin(alpha)) / np.cos(alpha)
        self._corner = corner + self._out / np.cos(alpha) if self._out else corner
        self._last, self._second = self._protruding(alpha)

    def _protruding(self, alpha: float) -> tuple[float, _Involute | None]:
        """Return the normal's angle (rad) where the arc ends, and the involute that the line beyond it cuts."""
        tool = self._gear.protuberance
        if tool is None or not self._out:
            return alpha, None
        require(
            tool.angle < alpha,
            f"protuberance angle = {degrees(tool.angle):.4g}° must be below the pressure angle {degrees(alpha):.4g}°",
        )
        if self._out <= self._rho * (1 - cos(alpha - tool.angle)):
            # the arc dips below the flank's line before it reaches the angle
            return alpha - acos(1 - self._out / self._rho), None
        gear, angle = self._gear, tool.angle
        up = gear.dedendum - gear.profile_shift - self._rho * (1 - sin(angle))  # from the arc's end to the pitch line
        half_space = self._module * (self._corner + self._rho * cos(angle) + up * tan(angle)) / self._slant
        transverse = atan(tan(angle) / self._slant)
        base = gear.pitch_radius * cos(transverse)
        return angle, _Involute(base, pi / gear.teeth - half_space / gear.pitch_radius + tan(transverse) - transverse)

    @cached_property
    def _arc_start(self) -> float:
        """Angle (rad) on the arc from its end at the flank to where it cuts the end of an involute."""
        gear = self._gear
        if not self._out and gear.undercut <= 0:
            return 0.0
        end, second = self._line_end, self._second
        if second and end > second.base and float(second.angle(end)) <= float(gear.half_tooth_angle(end)):
            return 0.0  # the line cuts the flank, and the arc goes on from its end
        place = np.linspace(0.0, pi / 2 - self._last, _POINTS)
        for base in {gear.base_radius, *([self._second.base] if self._second else [])}:
            below = np.flatnonzero(self._arc(place)[0] < base)
            if len(below) and below[0] > 0:
                ends = place[below[0] - 1], place[below[0]]
                base_place = brentq(lambda u, base=base: float(self._arc(u)[0]) - base, *ends, xtol=1e-15)
                place = np.insert(place, below[0], base_place)
        deeper = np.flatnonzero(self._clearance(place) < -1e-12)
        if not len(deeper) or deeper[0] == 0:
            return 0.0
        ends = place[deeper[0] - 1], place[deeper[0]]
        if float(self._clearance(ends[0])) <= 0.0:  # by rounding
            return float(ends[0])
        return float(brentq(lambda u: float(self._clearance(u)), *ends, xtol=1e-15))

    def _clearance(self, place: ArrayLike) -> FloatArray:
        """Return the angle (rad) by which the arc's curve lies outside both involutes; negative where it cuts in."""
        radius, angle = self._arc(place)
        involute, second = self._gear.half_tooth_angle(radius), self._second
        if second is None:
            return angle - involute
        return angle - np.where(radius >= self._line_end, np.minimum(involute, second.angle(radius)), involute)

    @cached_property
    def _line_end(self) -> float:
        """Radius (m) below which the protuberance's line cuts nothing: where the arc begins, or its base circle."""
        gear, second = self._gear, self._second
        if second is None:
            return 0.0
        depth = gear.normal_module * (gear.dedendum - gear.profile_shift - self._rho * (1 - sin(self._last)))
        undercut = depth > gear.pitch_radius * (1 - (second.base / gear.pitch_radius) ** 2)
        return second.base if undercut else float(self._arc(0.0)[0])

    @cached_property
    def _line(self) -> tuple[float, float] | None:
        """Radii (m) between which the line of the protuberance ends the flank; None without such a part."""
        gear, second = self._gear, self._second
        if second is None:
            return None
        low, high = max(float(self._arc(self._arc_start)[0]), self._line_end), gear.tip_circle_radius

        def deeper(radius: float) -> float:
            return float(gear.half_tooth_angle(radius) - second.angle(radius))

        if deeper(low) <= 1e-12:
            return None
        require(
            low < high and deeper(high) < 0,
            f"protuberance amount = {1e3 * gear.protuberance.amount:g} mm at {degrees(gear.protuberance.angle):.4g}° "  # type: ignore[union-attr]
            f"cuts the flank up to the tip circle of radius {1e3 * high:.6g} mm: lower the amount or the angle",
        )
        return low, float(brentq(deeper, low, high, xtol=1e-15))

    def _arc(self, place: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle (rad) that places on the arc cut, rad from its end at the flank."""
        turn = self._last + np.asarray(place, float)
        return self._cut(self._corner + self._rho * np.cos(turn), self._rho * (1 - np.sin(turn)), turn)

    def fillet(self, fraction: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle (rad) of the curve, from 0 at the end of the involute to 1 on the root circle."""
        share, line = np.asarray(fraction, float), self._line
        first = self._last + self._arc_start
        if line is None or self._second is None:
            turn = first + share * (pi / 2 - first)
            return self._cut(self._corner + self._rho * np.cos(turn), self._rho * (1 - np.sin(turn)), turn)
        knee = self._knee
        low, high = line
        line_radius = high + np.minimum(share / knee, 1.0) * (low - high)
        turn = first + np.maximum((share - knee) / (1 - knee), 0.0) * (pi / 2 - first)
        arc = self._cut(self._corner + self._rho * np.cos(turn), self._rho * (1 - np.sin(turn)), turn)
        upper = share < knee
        return np.where(upper, line_radius, arc[0]), np.where(upper, self._second.angle(line_radius), arc[1])

    @cached_property
    def _knee(self) -> float:
        """Fraction of the curve's length above the arc's part."""
        radius, angle = self._arc(np.linspace(self._arc_start, pi / 2 - self._last, 200))
        arc = float(np.hypot(np.diff(radius), radius[1:] * np.diff(angle)).sum())
        low, high = self._line or (0.0, 0.0)
        return (high - low) / (high - low + arc)

    def _cut(self, offset: FloatArray, up: FloatArray, turn: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle (rad) that a point of the rack cuts.

        offset: from the middle of the rack tooth (normal modules).  up: from its tip (normal modules).  turn: angle of
        its normal (rad).  The normal section is stretched by 1/cos β in the transverse one.
        """
        gear, module, slant = self._gear, self._module, self._slant
        x = module * offset / slant
        height = module * (gear.profile_shift - gear.dedendum + up)
        # normal (cos turn, −sin turn) in the normal section; its first component shrinks with cos β in the transverse
        shift = -height * slant * np.cos(turn) / np.sin(turn) - x
        x, y = x + shift, gear.pitch_radius + height
        space_angle = np.arctan2(x, y) - shift / gear.pitch_radius
        return np.hypot(x, y), np.pi / gear.teeth - space_angle

    def check_neck(self) -> None:
        """Refuse (InputError) teeth that an undercut leaves too thin."""
        radius, angle = self.fillet(np.linspace(0.0, 1.0, 200))
        thickness = 2 * radius * np.sin(angle)
        neck, least = int(thickness.argmin()), _LEAST_NECK * self._module
        require(
            thickness[neck] >= least,
            f"{self._gear.teeth} teeth with profile_shift = {self._gear.profile_shift:.6g}: undercut leaves "
            f"{1e3 * thickness[neck]:.4g} mm of tooth at radius {1e3 * radius[neck]:.5g} mm, of {1e3 * least:.4g} mm "
            f"at least: raise profile_shift by about {max(self._gear.undercut, 0.1):.2g}",
        )


def state_profile(gear: GearGeometry) -> Iterator[tuple[str, float]]:
    """Yield name and value of the fields that the reference profile gives; InputError for contradictions."""
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
                abs(stated - value) <= _PROFILE_ROUNDING,
                f"{field} = {stated:g} contradicts reference_profile = {name!r}, of {value:g} normal modules: leave "
                "one of them out",
            )
