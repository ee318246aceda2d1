"""Tooth thickness as a drawing states it: profile shift and allowance from measures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import acos, cos, pi, sin, tan
from typing import TYPE_CHECKING

from nvhchain.dimensions import Length, Unstated
from nvhchain.errors import is_whole, require, require_each, warn_caller
from nvhchain.gear.drawing.measures import (
    Gauge,
    ball_angle,
    base_tangent_length,
    centres_apart,
    dimension_over_balls,
    inv,
    mm_text,
    span_rest,
)
from nvhchain.kinds import check_fields

if TYPE_CHECKING:
    from nvhchain.gear.drawing.geometry import GearGeometry

ROUNDING = 1e-6
"""Largest difference (m) of two values of one measure that counts as the rounding of a drawing."""

_EXACT = 1e-9
"""Largest difference (m) that counts as none."""


@dataclass(frozen=True)
class MeasuredThickness:
    """Tooth thickness as a drawing states it, by one measure or by both.

    Parameters
    ----------
    base_tangent_length : float, optional
        Base tangent length W_k over `span_teeth` (m).
    span_teeth : int, optional
        Number of teeth k spanned by it.
    dimension_over_balls : float, optional
        Diametral dimension M_d over two balls or pins of `ball_diameter` (m).
    ball_diameter : float, optional
        Diameter D_M of balls or pins (m).
    gauge : {'balls', 'pins'}
        Balls, or pins along the teeth; they differ for helical gears of odd tooth numbers.
    deviations : tuple of 2 float
        Limit deviations of the measure (m), mostly negative; their mean counts.

    Raises
    ------
    InputError
        If neither measure is complete or a value is out of range.
    """

    base_tangent_length: Length | None = None
    span_teeth: int | None = None
    dimension_over_balls: Length | None = None
    ball_diameter: Length | None = None
    gauge: Gauge = "balls"
    deviations: tuple[Length, Length] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_fields(self)
        span, balls = self.base_tangent_length, self.dimension_over_balls
        positive = [
            (value is None or 0 < value < 20, f"{name} = {value} m must lie between 0 and 20 m: give it in m")
            for name, value in (
                ("base_tangent_length", span),
                ("dimension_over_balls", balls),
                ("ball_diameter", self.ball_diameter),
            )
        ]
        require_each(
            (span is not None or balls is not None, "thickness: give base_tangent_length or dimension_over_balls"),
            ((span is None) is (self.span_teeth is None), "base_tangent_length and span_teeth go together: give both"),
            (
                (balls is None) is (self.ball_diameter is None),
                "dimension_over_balls and ball_diameter go together: give both",
            ),
            (
                self.span_teeth is None or (is_whole(self.span_teeth) and self.span_teeth >= 1),
                f"span_teeth = {self.span_teeth}: a whole number from 1 upwards is needed",
            ),
            (self.gauge in ("balls", "pins"), f"gauge = {self.gauge!r}: choose balls or pins"),
            (
                max(map(abs, self.deviations)) <= 1e-3,
                f"deviations = {self.deviations} m are beyond ±0.001 m: give them in m",
            ),
            (
                span is None or balls is None or self.deviations == (0.0, 0.0),
                f"deviations = {self.deviations} m of two measures: give one measure with its deviations",
            ),
            *positive,
        )

    @property
    def mean_deviation(self) -> float:
        """Mean of the limit deviations (m)."""
        return 0.5 * sum(self.deviations)


def state_thickness(gear: GearGeometry) -> Iterator[tuple[str, float]]:
    """Yield name and value of profile shift or thickness allowance as the measured thickness of a gear gives them.

    InputError if measures and stated fields contradict each other beyond the rounding of a drawing.
    """
    measured = gear.thickness
    if measured is None:
        return
    found = _measured(gear, measured)
    thickness = found[0][1]
    if len(found) == 2:
        (_, one), (_, other) = found
        _agree(
            gear,
            measured,
            other,
            f"by base tangent length {mm_text(one)} and over {measured.gauge} {mm_text(other)}",
            one,
        )
    shift_stated = not isinstance(gear.profile_shift, Unstated)
    if shift_stated and not isinstance(gear.thickness_allowance, Unstated):
        own = gear.normal_thickness
        text = f"by profile_shift and thickness_allowance {mm_text(own)}, as measured {mm_text(thickness)}"
        _agree(gear, measured, own, text, thickness)
        return
    rise = 2 * gear.normal_module * tan(gear.normal_pressure_angle)
    if shift_stated:
        allowance = 0.5 * pi * gear.normal_module + rise * gear.profile_shift - thickness
        require(
            abs(allowance) < 0.5 * gear.normal_module,
            f"{found[0][0]} contradicts profile_shift = {gear.profile_shift:g}: thickness {mm_text(thickness)} "
            f"measured, {mm_text(thickness + allowance)} by profile_shift: correct or leave out one of them",
        )
        yield "thickness_allowance", allowance
        return
    shift = (thickness + gear.thickness_allowance - 0.5 * pi * gear.normal_module) / rise
    require(
        abs(shift) <= 2,
        f"{found[0][0]} gives profile_shift = {shift:.4g}, outside −2…2: correct it, its number of teeth or ball, the "
        "module or the pressure angle",
    )
    yield "profile_shift", shift
    yield "thickness_allowance", float(gear.thickness_allowance)


def check_measured(gear: GearGeometry) -> None:
    """Refuse a measured thickness that cannot be measured on the gear.

    gear : gear with its profile shift.

    InputError if planes, balls or pins do not touch the flanks.
    """
    measured = gear.thickness
    if measured is None:
        return
    if measured.base_tangent_length is not None and measured.span_teeth is not None:
        base_tangent_length(gear, measured.span_teeth)
    if measured.ball_diameter is not None:
        dimension_over_balls(gear, measured.ball_diameter, measured.gauge)


def _measured(gear: GearGeometry, measured: MeasuredThickness) -> list[tuple[str, float]]:
    """Return the name and the normal tooth thickness (m) of every measure."""
    found = []
    if measured.base_tangent_length is not None and measured.span_teeth is not None:
        length = measured.base_tangent_length + measured.mean_deviation
        name = f"base_tangent_length = {mm_text(measured.base_tangent_length)} over {measured.span_teeth} teeth"
        found.append((name, (length - span_rest(gear, measured.span_teeth)) / cos(gear.normal_pressure_angle)))
    if measured.dimension_over_balls is not None and measured.ball_diameter is not None:
        ball, dimension = measured.ball_diameter, measured.dimension_over_balls + measured.mean_deviation
        name = (
            f"dimension_over_balls = {mm_text(measured.dimension_over_balls)} over {measured.gauge} of {mm_text(ball)}"
        )
        centres = (dimension - ball) / centres_apart(gear, measured.gauge)
        require(
            centres > 2 * gear.base_radius,
            f"{name}: their centres lie within the base circle of diameter {mm_text(2 * gear.base_radius)}: correct "
            "it, or the ball",
        )
        angle = acos(2 * gear.base_radius / centres)
        rise = ball / (gear.teeth * gear.normal_module * cos(gear.normal_pressure_angle))
        half = inv(angle) - inv(gear.transverse_pressure_angle) - rise + pi / gear.teeth
        found.append((name, 2 * gear.pitch_radius * half * cos(gear.helix_angle)))
    return found


def _agree(gear: GearGeometry, measured: MeasuredThickness, one: float, text: str, other: float) -> None:
    """Refuse thicknesses (m) whose measures differ by more than a rounding; a rounding is reported."""
    angle = gear.normal_pressure_angle
    slope = cos(angle)
    if measured.base_tangent_length is None and measured.ball_diameter is not None:
        centre = ball_angle(gear, measured.ball_diameter)
        require(
            centre > 0,
            f"ball_diameter = {mm_text(measured.ball_diameter)}: falls through the space that profile_shift and "
            "thickness_allowance leave: take a larger one, or correct them",
        )
        slope = cos(angle) / sin(centre)
    apart = abs(one - other) * slope
    require(
        apart <= ROUNDING,
        f"tooth thickness {text}: they differ by {1e6 * apart:.4g} µm in the measure, of {1e6 * ROUNDING:g} µm at "
        "most: correct or leave out one of them",
    )
    if apart > _EXACT:
        warn_caller(f"tooth thickness {text} (passes as the rounding of a drawing)", kind="tooth thickness")
