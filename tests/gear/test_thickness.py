"""Base tangent length, balls, pins and backlash against contact found numerically, and published values."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from nvhchain.errors import InputError
from nvhchain.gear import (
    MeasuredThickness,
    base_tangent_length,
    dimension_over_balls,
    nominal_centre_distance,
    normal_backlash,
    set_backlash,
    sizes,
)
from tests.gear import plain_gear
from tests.gear.plain_gear import MODULE

gear = partial(plain_gear.gear, face_width=40e-3)


def flank(g, sign, tooth, radius, z):
    """Points of a flank (…, 3) in m; sign +1 faces +φ."""
    angle = sign * g.half_tooth_angle(radius) + tooth * g.pitch_angle + g.twist * z
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z + 0 * angle], axis=-1)


@pytest.mark.parametrize(("teeth", "helix", "shift"), [(25, 0.0, 0.2), (40, 15.0, -0.3), (33, -20.0, 0.5)])
def test_base_tangent_length_is_the_distance_of_planes_on_the_flanks(teeth, helix, shift):
    g = gear(teeth, helix, profile_shift=shift, face_width=80e-3)
    k = sizes(g).span_teeth
    radius, z = np.meshgrid(np.linspace(g.form_radius, g.tip_circle_radius, 1201), np.linspace(-20e-3, 20e-3, 1201))
    # plane normal to the axis of the tooth gap or tooth amid the span, tilted by the base helix angle
    tilt = g.base_helix_angle
    normal = np.array([0.0, np.cos(tilt), -np.sin(tilt)])
    reach = (k - 1) / 2
    far = [flank(g, sign, sign * reach, radius, z) @ normal for sign in (1, -1)]
    # the flank's highest point over the plane's direction; along a generator the height is constant
    length = far[0].max() - far[1].min()
    assert base_tangent_length(g, k) == pytest.approx(length, abs=2e-9)


@pytest.mark.parametrize(("teeth", "helix"), [(24, 0.0), (25, 0.0), (31, 18.0)])
def test_balls_touch_both_flanks_of_opposite_spaces(teeth, helix):
    g = gear(teeth, helix, profile_shift=0.1)
    ball = sizes(g).ball_diameter

    def gap(centre):
        """Distance of a ball's surface from the flank beside its space (m)."""
        at = centre * np.array([np.cos(np.pi / teeth), np.sin(np.pi / teeth), 0.0])

        def nearest(radius):
            away = minimize_scalar(
                lambda z: np.linalg.norm(flank(g, 1, 0, radius, z) - at),
                bounds=(-6e-3, 6e-3),
                method="bounded",
                options={"xatol": 1e-10},
            )
            return away.fun

        found = minimize_scalar(
            nearest, bounds=(g.form_radius, g.tip_circle_radius), method="bounded", options={"xatol": 1e-10}
        )
        return found.fun - 0.5 * ball

    centre = brentq(gap, g.pitch_radius - MODULE, g.pitch_radius + 2 * MODULE, xtol=1e-11)
    across = 1.0 if teeth % 2 == 0 else np.cos(np.pi / (2 * teeth))
    assert dimension_over_balls(g, ball) == pytest.approx(2 * centre * across + ball, abs=2e-8)
    pins = dimension_over_balls(g, ball, "pins")
    assert pins == pytest.approx(2 * centre * (1.0 if helix else across) + ball, abs=2e-8)


@pytest.mark.parametrize(("teeth", "helix", "shift"), [(17, 0.0, 0.0), (18, 12.0, 0.35), (61, -25.0, -0.4)])
def test_profile_shift_returns_from_every_measure(teeth, helix, shift):
    g = gear(teeth, helix, profile_shift=shift)
    found = sizes(g)
    measures = [{"base_tangent_length": found.base_tangent_length, "span_teeth": found.span_teeth}]
    measures += [
        {
            "dimension_over_balls": getattr(found, f"dimension_over_{gauge}"),
            "ball_diameter": found.ball_diameter,
            "gauge": gauge,
        }
        for gauge in ("balls", "pins")
    ]
    for measure in measures:
        assert gear(teeth, helix, thickness=MeasuredThickness(**measure)).profile_shift == pytest.approx(
            shift, abs=1e-10
        )
        thin = gear(teeth, helix, profile_shift=shift + 0.02, thickness=MeasuredThickness(**measure))
        assert thin.thickness_allowance == pytest.approx(0.04 * MODULE * np.tan(np.radians(20)), abs=1e-13)


def test_limit_deviations_count_by_their_mean():
    g = gear(profile_shift=0.2)
    k, length = sizes(g).span_teeth, sizes(g).base_tangent_length
    thin = gear(profile_shift=0.2, thickness=MeasuredThickness(length, k, deviations=(-30e-6, -50e-6)))
    assert thin.thickness_allowance == pytest.approx(40e-6 / np.cos(np.radians(20)), rel=1e-9)


def test_backlash_gives_shift_or_allowance():
    pinion, wheel = gear(20, 10.0, profile_shift=0.2), gear(45, -10.0)
    distance = nominal_centre_distance(pinion, gear(45, -10.0, profile_shift=-0.1)) + 2e-5
    one, other = set_backlash(pinion, wheel, distance, normal=80e-6)
    assert one.thickness_allowance == 0.0
    assert other.profile_shift < -0.1
    assert normal_backlash(one, other, distance) == pytest.approx(80e-6, abs=1e-12)
    thin = set_backlash(pinion, gear(45, -10.0, profile_shift=-0.1), distance, circumferential=80e-6)
    assert thin[0].thickness_allowance == thin[1].thickness_allowance > 0
    cosine = (one.base_radius + other.base_radius) / distance * np.cos(one.base_helix_angle)
    assert normal_backlash(*thin, distance) == pytest.approx(80e-6 * cosine, abs=1e-12)
    with pytest.raises(InputError, match=r"backlash 0.1 mm stated, 0.0\d+ mm by the tooth thicknesses"):
        set_backlash(*thin, distance, normal=1e-4)


@pytest.mark.parametrize(
    ("measure", "changes", "message"),
    [
        ({"base_tangent_length": 23.2e-3}, {}, "base_tangent_length and span_teeth go together"),
        ({"base_tangent_length": 23.2, "span_teeth": 0}, {}, "base_tangent_length = 23.2 m .*|span_teeth = 0"),
        ({"base_tangent_length": 23.2e-3, "span_teeth": 4}, {}, "gives profile_shift = -4.312, outside −2…2"),
        (
            {"base_tangent_length": 32.6e-3, "span_teeth": 4},
            {"profile_shift": 0.3, "thickness_allowance": 0.0},
            r"by profile_shift and thickness_allowance 5.367\d* mm, as measured .* differ by .* µm in the measure",
        ),
        ({"dimension_over_balls": 60e-3, "ball_diameter": 5.25e-3}, {}, "centres lie within the base circle"),
        (
            {"dimension_over_balls": 83.3e-3, "ball_diameter": 2.5e-3},
            {"profile_shift": 0.0, "thickness_allowance": 0.0},
            "ball_diameter = 2.5 mm: falls through the space",
        ),
        (
            {
                "dimension_over_balls": 83.3e-3,
                "ball_diameter": 5.25e-3,
                "base_tangent_length": 32.6e-3,
                "span_teeth": 4,
            },
            {},
            r"by base tangent length .* mm and over balls .* mm: they differ",
        ),
    ],
)
def test_measures_that_fit_no_gear_are_refused_with_their_values(measure, changes, message):
    with pytest.raises(InputError, match=message):
        gear(**changes, thickness=MeasuredThickness(**measure))


def test_a_rounded_measure_beside_a_rounded_shift_passes_and_is_reported():
    g = gear(25, profile_shift=0.2, thickness_allowance=0.0)
    length = round(base_tangent_length(g, 4), 6)
    with pytest.warns(UserWarning, match="passes as the rounding of a drawing"):
        both = gear(25, profile_shift=0.2, thickness_allowance=0.0, thickness=MeasuredThickness(length, 4))
    assert (both.profile_shift, both.thickness_allowance) == (0.2, 0.0)


def test_spans_and_balls_that_miss_the_flank_name_a_better_one():
    with pytest.raises(InputError, match=r"span_teeth = 6: the planes touch at radius .* outside the flank .* fewer"):
        base_tangent_length(gear(25), 6)
    with pytest.raises(InputError, match="apart along the axis, beyond face_width = 10 mm: span fewer teeth, or"):
        base_tangent_length(gear(60, 25.0, face_width=10e-3), 9)
    with pytest.raises(InputError, match=r"ball_diameter = 3 mm: touches below the base circle.* take a larger"):
        dimension_over_balls(gear(25), 3e-3)


def test_published_examples():
    # SDP/SI, Elements of metric gear technology, tables 10-1 and 10-3: tooth thickness 17.8918 and 8.5819 mm
    spur = gear(12, normal_module=10e-3, profile_shift=0.3)
    helical = gear(16, 25.0, normal_module=5e-3, profile_shift=0.2)
    assert sizes(spur).normal_thickness == pytest.approx(17.8918e-3, abs=5e-8)
    assert sizes(helical).normal_thickness == pytest.approx(8.5819e-3, abs=5e-8)
    # machinecalcs.com, span measurement calculator: m 2, z 20, k 3
    assert base_tangent_length(gear(20, normal_module=2e-3), 3) == pytest.approx(15.321e-3, abs=5e-7)
    # AGMA and GearCutter over pins, as quoted in a public report on a calculator of such sizes: 127 teeth, P_nd 12,
    # 10.5°, s_n 0.1309 inch, pins of 0.144 inch: 10.967749 inch; to its last digit and that of the thickness
    inch = 25.4e-3
    fine = gear(127, 10.5, normal_module=inch / 12)
    fine = replace(fine, thickness_allowance=sizes(fine).normal_thickness - 0.1309 * inch)
    found = dimension_over_balls(fine, 0.144 * inch, "pins") / inch
    assert found == pytest.approx(10.967749, abs=2e-6)
