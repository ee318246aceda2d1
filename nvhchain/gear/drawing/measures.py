"""Tooth thickness by measures: base tangent length over teeth, dimension over balls or pins.

Formulas are those of ISO 21771 and DIN 3960 for external gears.
"""

from __future__ import annotations

from math import atan, cos, hypot, inf, pi, sin, sqrt, tan
from typing import TYPE_CHECKING, Literal, NamedTuple

from scipy.optimize import brentq

from nvhchain.errors import is_whole, require

if TYPE_CHECKING:
    from nvhchain.gear.drawing.geometry import GearGeometry

Gauge = Literal["balls", "pins"]

_SIZES = (
    *(1.0, 1.1, 1.25, 1.4, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0, 4.25, 4.5, 5.0, 5.25, 5.5),
    *(6.0, 6.5, 7.0, 7.5, 8.0, 9.0, 10.0, 10.5, 11.0, 12.0, 14.0, 15.0, 16.0, 18.0, 20.0, 22.0, 25.0, 28.0, 30.0),
    *(35.0, 40.0, 45.0, 50.0),
)
"""Diameters of measuring balls and pins in common sets (mm)."""


class ToothSizes(NamedTuple):
    """Measures of the tooth thickness of a gear.

    profile_shift: profile shift x (normal modules).
    normal_thickness: normal tooth thickness s_n at the reference circle (m).
    span_teeth: number of teeth k of the base tangent length; None where no span touches the flanks.
    base_tangent_length: base tangent length W_k (m).
    ball_diameter: diameter of balls and pins D_M (m); None where no usual size fits.
    dimension_over_balls, dimension_over_pins: diametral dimensions M_dK and M_dR (m).
    """

    profile_shift: float
    normal_thickness: float
    span_teeth: int | None
    base_tangent_length: float | None
    ball_diameter: float | None
    dimension_over_balls: float | None
    dimension_over_pins: float | None


def base_tangent_length(gear: GearGeometry, span_teeth: int) -> float:
    """Return the base tangent length W_k over k teeth (m).

    Returns distance of two parallel planes that touch opposite flanks, normal to them.

    W_k = m_n cos α_n ((k − 1) π + z inv α_t) + s_n cos α_n.  The planes touch at r = √(r_b² + (W_k cos β_b / 2)²), and
    W_k sin β_b apart along the axis.
    """
    require(
        is_whole(span_teeth) and 1 <= span_teeth <= gear.teeth,
        f"span_teeth = {span_teeth} is outside 1…{gear.teeth}, the teeth of the gear: correct it",
    )
    length = span_rest(gear, span_teeth) + gear.normal_thickness * cos(gear.normal_pressure_angle)
    wrong = _span_misses(gear, length, span_teeth)
    require(not wrong, wrong)
    return length


def dimension_over_balls(gear: GearGeometry, ball_diameter: float, gauge: Gauge = "balls") -> float:
    """Return the dimension over two balls or pins in opposite tooth spaces (m).

    ball_diameter: diameter D_M (m).
    gauge {'balls', 'pins'}: balls lie in one transverse plane. Pins lie along the teeth and may shift along the axis.

    inv α_K = inv α_t + D_M/(z m_n cos α_n) + s_t/d − π/z and d_K = d_b/cos α_K.  M = d_K + D_M for even tooth numbers
    and for pins of helical gears, otherwise M = d_K cos(π/(2 z)) + D_M.
    """
    wrong = _ball_misses(gear, ball_diameter)
    require(not wrong, wrong)
    return centres_apart(gear, gauge) * 2 * gear.base_radius / cos(ball_angle(gear, ball_diameter)) + ball_diameter


def usual_span(gear: GearGeometry) -> int | None:
    """Return the number of teeth whose span touches nearest to the circle d + 2 x m_n; None if none can be measured."""
    target = _middle_circle(gear)
    found = {}
    for k in range(2, max(3, gear.teeth // 2 + 2)):
        length = span_rest(gear, k) + gear.normal_thickness * cos(gear.normal_pressure_angle)
        if not _span_misses(gear, length, k):
            found[k] = abs(_span_radius(gear, length) - target)
    return min(found, key=found.__getitem__, default=None)


def usual_ball(gear: GearGeometry) -> float | None:
    """Return the common size of ball or pin (m) that touches nearest to the circle d + 2 x m_n; None if none fits."""
    target = _middle_circle(gear)
    fits = [1e-3 * size for size in _SIZES if not _ball_misses(gear, 1e-3 * size)]
    return min(fits, key=lambda size: abs(_ball_radius(gear, size) - target), default=None)


def sizes(gear: GearGeometry) -> ToothSizes:
    """Return the measures of the tooth thickness by which a gear is compared with its drawing.

    Parameters
    ----------
    gear : GearGeometry
        Gear; its own numbers of teeth and ball are used where its `thickness` states them.

    Returns
    -------
    ToothSizes
        Measures.
    """
    stated = gear.thickness
    span = (stated.span_teeth if stated else None) or usual_span(gear)
    ball = (stated.ball_diameter if stated else None) or usual_ball(gear)
    return ToothSizes(
        profile_shift=float(gear.profile_shift),
        normal_thickness=gear.normal_thickness,
        span_teeth=span,
        base_tangent_length=None if span is None else base_tangent_length(gear, span),
        ball_diameter=ball,
        dimension_over_balls=None if ball is None else dimension_over_balls(gear, ball),
        dimension_over_pins=None if ball is None else dimension_over_balls(gear, ball, "pins"),
    )


def _middle_circle(gear: GearGeometry) -> float:
    """Return the radius (m) of the circle d + 2 x m_n, or that of the nearest place on the flank."""
    wanted = gear.pitch_radius + gear.profile_shift * gear.normal_module
    return min(max(wanted, gear.form_radius), gear.tip_form_radius)


def span_rest(gear: GearGeometry, k: int) -> float:
    """Return W_k less that of the tooth thickness (m)."""
    pitches = (k - 1) * pi + gear.teeth * inv(gear.transverse_pressure_angle)
    return gear.normal_module * cos(gear.normal_pressure_angle) * pitches


def _span_radius(gear: GearGeometry, length: float) -> float:
    """Return the radius (m) at which the planes touch."""
    return hypot(gear.base_radius, 0.5 * length * cos(gear.base_helix_angle))


def _span_misses(gear: GearGeometry, length: float, k: int) -> str:
    """Return the reason for which a span cannot be measured; empty if it can."""
    radius, low, high = _span_radius(gear, length), gear.form_radius, gear.tip_form_radius
    axial_span = length * abs(sin(gear.base_helix_angle))
    if not low <= radius <= high:
        other = "more" if radius < low else "fewer"
        return (
            f"span_teeth = {k}: the planes touch at radius {mm_text(radius)}, outside the flank of {1e3 * low:.6g}…"
            f"{1e3 * high:.6g} mm: span {other} teeth"
        )
    if axial_span >= gear.face_width:
        return (
            f"span_teeth = {k}: the planes touch {mm_text(axial_span)} apart along the axis, beyond face_width = "
            f"{mm_text(gear.face_width)}: span fewer teeth, or measure over balls"
        )
    return ""


def centres_apart(gear: GearGeometry, gauge: Gauge) -> float:
    """Return the distance of two ball centres in opposite spaces, relative to the circle of the centres."""
    even = gear.teeth % 2 == 0 or (gauge == "pins" and gear.helix_angle != 0)
    return 1.0 if even else cos(pi / (2 * gear.teeth))


def ball_angle(gear: GearGeometry, ball: float) -> float:
    """Return the pressure angle α_K (rad) of the centre of a ball; 0 if the space is too wide for it."""
    rise = ball / (gear.teeth * gear.normal_module * cos(gear.normal_pressure_angle))
    thickness = gear.normal_thickness / cos(gear.helix_angle) / (2 * gear.pitch_radius)
    target = inv(gear.transverse_pressure_angle) + rise + thickness - pi / gear.teeth
    if not 0 < target < 50:
        return 0.0
    # u = tan α avoids the pole: u − arctan u = target
    low, high = 0.0, target + 0.5 * pi
    return atan(float(brentq(lambda u: u - atan(u) - target, low, high, xtol=1e-16, rtol=1e-15, maxiter=200)))


def _ball_radius(gear: GearGeometry, ball: float) -> float:
    """Return the radius (m) at which a ball touches the flanks; −∞ where it falls below the base circle."""
    rolled = gear.base_radius * tan(ball_angle(gear, ball)) - 0.5 * ball * cos(gear.base_helix_angle)
    return sqrt(gear.base_radius**2 + rolled**2) if rolled >= 0 else -inf


def _ball_misses(gear: GearGeometry, ball: float) -> str:
    """Return the reason for which a ball cannot be used; empty if it can."""
    touch, low, high = _ball_radius(gear, ball), gear.form_radius, gear.tip_form_radius
    centre = gear.base_radius / cos(ball_angle(gear, ball))
    name = f"ball_diameter = {mm_text(ball)}"
    if not low <= touch <= high:
        other = "larger" if touch < low else "smaller"
        where = f"at radius {mm_text(touch)}" if touch > 0 else "below the base circle"
        return f"{name}: touches {where}, outside the flank of {1e3 * low:.6g}…{1e3 * high:.6g} mm: take a {other} one"
    if centre - 0.5 * ball <= gear.root_radius:
        return f"{name}: reaches the root circle of radius {mm_text(gear.root_radius)}: take a smaller one"
    if centre + 0.5 * ball <= gear.tip_circle_radius:
        return f"{name}: stays below the tip circle of radius {mm_text(gear.tip_circle_radius)}: take a larger one"
    return ""


def mm_text(length: float) -> str:
    """Return a length (m) in words."""
    return f"{1e3 * length:.8g} mm"


def inv(angle: float) -> float:
    """Return inv α = tan α − α."""
    return tan(angle) - angle
