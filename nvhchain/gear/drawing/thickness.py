"""Tooth thickness as it is measured: base tangent length over teeth, dimension over balls or pins.

Formulas are those of ISO 21771 and DIN 3960 for external gears.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import acos, atan, cos, hypot, inf, pi, sin, sqrt, tan
from typing import TYPE_CHECKING, Literal

from scipy.optimize import brentq

from nvhchain.dimensions import Length
from nvhchain.errors import is_whole, require, require_each, warn_caller
from nvhchain.gear.drawing.reference_profile import Unstated
from nvhchain.kinds import check_fields

if TYPE_CHECKING:
    from nvhchain.gear.drawing.geometry import GearGeometry

ROUNDING = 1e-6
"""Largest difference (m) of two values of one measure that counts as the rounding of a drawing."""

_EXACT = 1e-9
"""Largest difference (m) that counts as none."""

Over = Literal["balls", "pins"]

_SIZES = (
    *(1.0, 1.1, 1.25, 1.4, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0, 4.25, 4.5, 5.0, 5.25, 5.5),
    *(6.0, 6.5, 7.0, 7.5, 8.0, 9.0, 10.0, 10.5, 11.0, 12.0, 14.0, 15.0, 16.0, 18.0, 20.0, 22.0, 25.0, 28.0, 30.0),
    *(35.0, 40.0, 45.0, 50.0),
)
"""Diameters of measuring balls and pins (mm), DIN 3977."""


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
    over : {'balls', 'pins'}
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
    over: Over = "balls"
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
            (self.over in ("balls", "pins"), f"over = {self.over!r}: choose balls or pins"),
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


def base_tangent_length(gear: GearGeometry, span_teeth: int) -> float:
    """Return the base tangent length W_k over k teeth (m).

    Parameters
    ----------
    gear : GearGeometry
        Gear.
    span_teeth : int
        Number of teeth k.

    Returns
    -------
    float
        Distance of two parallel planes that touch opposite flanks, normal to them.

    Raises
    ------
    InputError
        If the planes touch outside the flanks, or beyond the face width of a helical gear.

    Notes
    -----
    W_k = m_n cos α_n ((k − 1) π + z inv α_t) + s_n cos α_n.  The planes touch at r = √(r_b² + (W_k cos β_b / 2)²), and
    W_k sin β_b apart along the axis.
    """
    require(
        is_whole(span_teeth) and 1 <= span_teeth <= gear.teeth,
        f"span_teeth = {span_teeth} is outside 1…{gear.teeth}, the teeth of the gear: correct it",
    )
    length = _span_rest(gear, span_teeth) + gear.normal_thickness * cos(gear.normal_pressure_angle)
    wrong = _span_misses(gear, length, span_teeth)
    require(not wrong, wrong)
    return length


def dimension_over_balls(gear: GearGeometry, ball_diameter: float, over: Over = "balls") -> float:
    """Return the dimension over two balls or pins in opposite tooth spaces (m).

    Parameters
    ----------
    gear : GearGeometry
        Gear.
    ball_diameter : float
        Diameter D_M (m).
    over : {'balls', 'pins'}
        Balls lie in one transverse plane.  Pins lie along the teeth and may shift along the axis.

    Returns
    -------
    float
        Diametral dimension M_dK or M_dR.

    Raises
    ------
    InputError
        If a ball touches outside the flanks, lies on the root or does not stand out of the space.

    Notes
    -----
    inv α_K = inv α_t + D_M/(z m_n cos α_n) + s_t/d − π/z and d_K = d_b/cos α_K.  M = d_K + D_M for even tooth numbers
    and for pins of helical gears, otherwise M = d_K cos(π/(2 z)) + D_M.
    """
    wrong = _ball_misses(gear, ball_diameter)
    require(not wrong, wrong)
    return _apart(gear, over) * 2 * gear.base_radius / cos(_ball_angle(gear, ball_diameter)) + ball_diameter


def usual_span(gear: GearGeometry) -> int | None:
    """Return the number of teeth whose base tangent length touches nearest to the circle d + 2 x m_n.

    Parameters
    ----------
    gear : GearGeometry
        Gear.

    Returns
    -------
    int or None
        Number k; None where no span touches the flanks within the face width.
    """
    target = _middle_circle(gear)
    found = {}
    for k in range(2, max(3, gear.teeth // 2 + 2)):
        length = _span_rest(gear, k) + gear.normal_thickness * cos(gear.normal_pressure_angle)
        if not _span_misses(gear, length, k):
            found[k] = abs(_span_radius(gear, length) - target)
    return min(found, key=found.__getitem__, default=None)


def usual_ball(gear: GearGeometry) -> float | None:
    """Return the size of ball or pin (m) after DIN 3977 that touches nearest to the circle d + 2 x m_n.

    Parameters
    ----------
    gear : GearGeometry
        Gear.

    Returns
    -------
    float or None
        Diameter D_M; None where none of these sizes fits.
    """
    target = _middle_circle(gear)
    fits = [1e-3 * size for size in _SIZES if not _ball_misses(gear, 1e-3 * size)]
    return min(fits, key=lambda size: abs(_ball_radius(gear, size) - target), default=None)


def state_thickness(gear: GearGeometry) -> Iterator[tuple[str, float]]:
    """Yield the profile shift or the thickness allowance that the measured thickness of a gear gives.

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
        If measures and stated fields contradict each other beyond the rounding of a drawing.
    """
    measured = gear.thickness
    if measured is None:
        return
    found = _measured(gear, measured)
    thickness = found[0][1]
    if len(found) == 2:
        (_, one), (_, other) = found
        _agree(gear, measured, other, f"by base tangent length {_mm(one)} and over {measured.over} {_mm(other)}", one)
    shift_stated = not isinstance(gear.profile_shift, Unstated)
    if shift_stated and not isinstance(gear.thickness_allowance, Unstated):
        own = gear.normal_thickness
        text = f"by profile_shift and thickness_allowance {_mm(own)}, as measured {_mm(thickness)}"
        _agree(gear, measured, own, text, thickness)
        return
    rise = 2 * gear.normal_module * tan(gear.normal_pressure_angle)
    if shift_stated:
        allowance = 0.5 * pi * gear.normal_module + rise * gear.profile_shift - thickness
        require(
            abs(allowance) < 0.5 * gear.normal_module,
            f"{found[0][0]} contradicts profile_shift = {gear.profile_shift:g}: thickness {_mm(thickness)} measured, "
            f"{_mm(thickness + allowance)} by profile_shift: correct or leave out one of them",
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

    Parameters
    ----------
    gear : GearGeometry
        Gear with its profile shift.

    Raises
    ------
    InputError
        If planes, balls or pins do not touch the flanks.
    """
    measured = gear.thickness
    if measured is None:
        return
    if measured.base_tangent_length is not None and measured.span_teeth is not None:
        base_tangent_length(gear, measured.span_teeth)
    if measured.ball_diameter is not None:
        dimension_over_balls(gear, measured.ball_diameter, measured.over)


def _measured(gear: GearGeometry, measured: MeasuredThickness) -> list[tuple[str, float]]:
    """Return the name and the normal tooth thickness (m) of every measure."""
    found = []
    if measured.base_tangent_length is not None and measured.span_teeth is not None:
        length = measured.base_tangent_length + measured.mean_deviation
        name = f"base_tangent_length = {_mm(measured.base_tangent_length)} over {measured.span_teeth} teeth"
        found.append((name, (length - _span_rest(gear, measured.span_teeth)) / cos(gear.normal_pressure_angle)))
    if measured.dimension_over_balls is not None and measured.ball_diameter is not None:
        ball, dimension = measured.ball_diameter, measured.dimension_over_balls + measured.mean_deviation
        name = f"dimension_over_balls = {_mm(measured.dimension_over_balls)} over {measured.over} of {_mm(ball)}"
        centres = (dimension - ball) / _apart(gear, measured.over)
        require(
            centres > 2 * gear.base_radius,
            f"{name}: their centres lie within the base circle of diameter {_mm(2 * gear.base_radius)}: correct it, or "
            "the ball",
        )
        angle = acos(2 * gear.base_radius / centres)
        rise = ball / (gear.teeth * gear.normal_module * cos(gear.normal_pressure_angle))
        half = _inv(angle) - _inv(gear.transverse_pressure_angle) - rise + pi / gear.teeth
        found.append((name, 2 * gear.pitch_radius * half * cos(gear.helix_angle)))
    return found


def _agree(gear: GearGeometry, measured: MeasuredThickness, one: float, text: str, other: float) -> None:
    """Refuse thicknesses (m) whose measures differ by more than a rounding; a rounding is reported."""
    angle = gear.normal_pressure_angle
    slope = cos(angle)
    if measured.base_tangent_length is None and measured.ball_diameter is not None:
        slope = cos(angle) / sin(_ball_angle(gear, measured.ball_diameter))
    apart = abs(one - other) * slope
    require(
        apart <= ROUNDING,
        f"tooth thickness {text}: they differ by {1e6 * apart:.4g} µm in the measure, of {1e6 * ROUNDING:g} µm at "
        "most: correct or leave out one of them",
    )
    if apart > _EXACT:
        warn_caller(f"tooth thickness {text} (passes as the rounding of a drawing)", kind="rounding of a drawing")


def _mm(length: float) -> str:
    return f"{1e3 * length:.8g} mm"


def _inv(angle: float) -> float:
    return tan(angle) - angle


def _middle_circle(gear: GearGeometry) -> float:
    """Return the radius (m) of the circle d + 2 x m_n, or that of the nearest place on the flank."""
    wanted = gear.pitch_radius + gear.profile_shift * gear.normal_module
    return min(max(wanted, gear.form_radius), gear.tip_form_radius)


def _span_rest(gear: GearGeometry, k: int) -> float:
    """Return W_k less that of the tooth thickness (m)."""
    pitches = (k - 1) * pi + gear.teeth * _inv(gear.transverse_pressure_angle)
    return gear.normal_module * cos(gear.normal_pressure_angle) * pitches


def _span_radius(gear: GearGeometry, length: float) -> float:
    """Return the radius (m) at which the planes touch."""
    return hypot(gear.base_radius, 0.5 * length * cos(gear.base_helix_angle))


def _span_misses(gear: GearGeometry, length: float, k: int) -> str:
    """Return the reason for which a span cannot be measured; empty if it can."""
    radius, low, high = _span_radius(gear, length), gear.form_radius, gear.tip_form_radius
    across = length * abs(sin(gear.base_helix_angle))
    if not low <= radius <= high:
        other = "more" if radius < low else "fewer"
        return (
            f"span_teeth = {k}: the planes touch at radius {_mm(radius)}, outside the flank of {1e3 * low:.6g}…"
            f"{1e3 * high:.6g} mm: span {other} teeth"
        )
    if across >= gear.face_width:
        return (
            f"span_teeth = {k}: the planes touch {_mm(across)} apart along the axis, beyond face_width = "
            f"{_mm(gear.face_width)}: span fewer teeth, or measure over balls"
        )
    return ""


def _apart(gear: GearGeometry, over: Over) -> float:
    """Return the distance of two ball centres in opposite spaces, relative to the circle of the centres."""
    even = gear.teeth % 2 == 0 or (over == "pins" and gear.helix_angle != 0)
    return 1.0 if even else cos(pi / (2 * gear.teeth))


def _ball_angle(gear: GearGeometry, ball: float) -> float:
    """Return the pressure angle α_K (rad) of the centre of a ball; 0 if the space is too wide for it."""
    rise = ball / (gear.teeth * gear.normal_module * cos(gear.normal_pressure_angle))
    thickness = gear.normal_thickness / cos(gear.helix_angle) / (2 * gear.pitch_radius)
    target = _inv(gear.transverse_pressure_angle) + rise + thickness - pi / gear.teeth
    if not 0 < target < 50:
        return 0.0
    # u = tan α avoids the pole: u − arctan u = target
    low, high = 0.0, target + 0.5 * pi
    return atan(float(brentq(lambda u: u - atan(u) - target, low, high, xtol=1e-16, rtol=1e-15, maxiter=200)))


def _ball_radius(gear: GearGeometry, ball: float) -> float:
    """Return the radius (m) at which a ball touches the flanks; −∞ where it falls below the base circle."""
    rolled = gear.base_radius * tan(_ball_angle(gear, ball)) - 0.5 * ball * cos(gear.base_helix_angle)
    return sqrt(gear.base_radius**2 + rolled**2) if rolled >= 0 else -inf


def _ball_misses(gear: GearGeometry, ball: float) -> str:
    """Return the reason for which a ball cannot be used; empty if it can."""
    touch, low, high = _ball_radius(gear, ball), gear.form_radius, gear.tip_form_radius
    centre = gear.base_radius / cos(_ball_angle(gear, ball))
    name = f"ball_diameter = {_mm(ball)}"
    if not low <= touch <= high:
        other = "larger" if touch < low else "smaller"
        where = f"at radius {_mm(touch)}" if touch > 0 else "below the base circle"
        return f"{name}: touches {where}, outside the flank of {1e3 * low:.6g}…{1e3 * high:.6g} mm: take a {other} one"
    if centre - 0.5 * ball <= gear.root_radius:
        return f"{name}: reaches the root circle of radius {_mm(gear.root_radius)}: take a smaller one"
    if centre + 0.5 * ball <= gear.tip_circle_radius:
        return f"{name}: stays below the tip circle of radius {_mm(gear.tip_circle_radius)}: take a larger one"
    return ""


def sizes(gear: GearGeometry) -> dict[str, float | int | None]:
    """Return what a drawing of a gear states of its tooth thickness.

    Parameters
    ----------
    gear : GearGeometry
        Gear.

    Returns
    -------
    dict
        `profile_shift`, `normal_thickness` (m), `span_teeth`, `base_tangent_length` (m), `ball_diameter` (m),
        `dimension_over_balls`, `dimension_over_pins` (m); None where it cannot be measured.

    Raises
    ------
    InputError
        If the stated number of teeth or ball does not fit.
    """
    stated = gear.thickness or MeasuredThickness(1.0, 1)
    span = stated.span_teeth if gear.thickness and stated.span_teeth else usual_span(gear)
    ball = stated.ball_diameter or usual_ball(gear)
    return {
        "profile_shift": float(gear.profile_shift),
        "normal_thickness": gear.normal_thickness,
        "span_teeth": span,
        "base_tangent_length": None if span is None else base_tangent_length(gear, span),
        "ball_diameter": ball,
        "dimension_over_balls": None if ball is None else dimension_over_balls(gear, ball),
        "dimension_over_pins": None if ball is None else dimension_over_balls(gear, ball, "pins"),
    }
