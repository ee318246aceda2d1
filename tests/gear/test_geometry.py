"""Involute, trochoid and tooth depth against independent constructions; drawings that cannot be made."""

import dataclasses
from functools import partial

import numpy as np
import pytest

from nvhchain.errors import InputError
from tests.gear import plain_gear

gear = partial(plain_gear.gear, helix=12.0)


def test_centre_distances_of_the_two_gearbox_stages():
    for teeth, module, distance in (((20, 50), 2.7e-3, 95.958e-3), ((30, 82), 2.68e-3, 152.395e-3)):
        radii = [gear(z, helix=10.0, normal_module=module).pitch_radius for z in teeth]
        assert sum(radii) == pytest.approx(distance, abs=0.5e-6)


def test_span_over_four_teeth_is_the_textbook_base_tangent_length():
    # W_k = m cos α [(k − ½) π + z inv α] + 2 x m sin α, spur gear (DIN 3960)
    alpha, m, z, x, k = np.radians(20.0), 3e-3, 25, 0.2, 4
    spur = gear(z, helix=0.0, profile_shift=x)
    base_thickness = 2 * spur.base_radius * float(spur.half_tooth_angle(spur.base_radius))
    span = (k - 1) * 2 * np.pi * spur.base_radius / z + base_thickness
    involute = np.tan(alpha) - alpha
    expected = m * np.cos(alpha) * ((k - 0.5) * np.pi + z * involute) + 2 * x * m * np.sin(alpha)
    assert span == pytest.approx(expected, rel=1e-12)


def test_thickness_allowance_thins_the_normal_tooth_at_the_reference_circle():
    thick, thin = gear(), gear(thickness_allowance=50e-6)
    r = thick.pitch_radius
    loss = 2 * r * (thick.half_tooth_angle(r) - thin.half_tooth_angle(r)) * np.cos(thick.helix_angle)
    assert float(loss) == pytest.approx(50e-6, rel=1e-9)


def profile(g, points=2000):
    """Radius and angle from the tooth's centre line, root to tip."""
    fillet = g.fillet(np.linspace(1.0, 0.0, points))
    flank = np.linspace(g.form_radius, g.tip_circle_radius, points)
    return np.append(fillet[0], flank), np.append(fillet[1], g.half_tooth_angle(flank))


@pytest.mark.parametrize("changes", [{}, {"teeth": 60, "profile_shift": -0.3}, {"rack_tip_radius": 0.2}])
def test_fillet_leaves_the_flank_smoothly_and_ends_on_the_root_circle(changes):
    g = gear(**changes)
    radius, angle = g.fillet(np.array([0.0, 1e-5, 1.0]))
    step = 1e-5 * g.normal_module
    assert angle[0] == pytest.approx(float(g.half_tooth_angle(radius[0])), rel=1e-12)
    fillet_slope = (angle[1] - angle[0]) / (radius[1] - radius[0])
    flank_slope = float(g.half_tooth_angle(radius[0] + step) - angle[0]) / step
    assert fillet_slope == pytest.approx(flank_slope, rel=2e-3)
    assert radius[2] == pytest.approx(g.root_radius, rel=1e-12)


@pytest.mark.parametrize("helix", [0.0, 12.0, -25.0])
def test_rolling_rack_touches_the_profile_everywhere_and_never_cuts_it(helix):
    """Brute force: the rack's tooth rolled past the blank, its outline never inside the material."""
    g = gear(helix=helix, thickness_allowance=30e-6)
    alpha, rho, m = g.normal_pressure_angle, g.rack_tip_radius_in_use, g.normal_module
    half = np.pi / 4 + 0.5 * g.thickness_allowance / m
    turn = np.linspace(alpha, np.pi / 2, 400)
    corner = half - g.dedendum * np.tan(alpha) - rho * (1 - np.sin(alpha)) / np.cos(alpha)
    x = np.append(corner + rho * np.cos(turn), half + np.linspace(-0.5, 1.0, 600) * np.tan(alpha))
    y = np.append(-g.dedendum + rho * (1 - np.sin(turn)), np.linspace(-0.5, 1.0, 600))
    x, y = x * m / np.cos(g.helix_angle), y * m
    radius, angle = profile(g)
    order = np.argsort(radius)
    closest = np.full(len(radius), np.inf)
    for shift in np.linspace(-4 * m, 4 * m, 1501):
        r = np.hypot(x + shift, g.pitch_radius + y)
        from_space = np.arctan2(x + shift, g.pitch_radius + y) - shift / g.pitch_radius
        inside = (r > g.root_radius) & (r < g.tip_circle_radius)
        gap = np.pi / g.teeth - from_space[inside] - np.interp(r[inside], radius[order], angle[order])
        near = np.searchsorted(radius[order], r[inside])
        np.minimum.at(closest, near, gap * r[inside])
    closest = closest[np.isfinite(closest)]
    assert closest.min() > -0.1e-6
    assert np.percentile(closest, 90) < 3e-6


@pytest.mark.parametrize("helix", [0.0, 12.0, -30.0])
def test_depth_ends_on_the_centre_line_surface(helix):
    g = gear(helix=helix)
    radius = np.linspace(g.form_radius, g.tip_circle_radius, 7)
    alpha, psi, tilt = g.pressure_angle_at(radius), g.half_tooth_angle(radius), g.base_helix_angle
    depth = g.depth_to_centre_line(radius)
    # flank that faces +φ in the plane z = 0; its inward normal is −sin α r, −cos α φ, +tan β_b z, times cos β_b
    x = radius - depth * np.cos(tilt) * np.sin(alpha)
    y = -depth * np.cos(tilt) * np.cos(alpha)
    end = psi + np.arctan2(y, x) - g.twist * depth * np.sin(tilt)
    np.testing.assert_allclose(end, 0.0, atol=1e-13)
    assert (depth > 0).all()


def test_roll_angle_is_the_length_along_the_line_of_action_over_the_base_radius():
    g = gear()
    radius = np.linspace(g.form_radius, g.tip_circle_radius, 5)
    np.testing.assert_allclose(g.base_radius * np.hypot(1, g.roll_angle_at(radius)), radius, rtol=1e-14)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"teeth": 3}, "teeth = 3"),
        ({"teeth": "50"}, "teeth = .50.: a whole number"),
        ({"normal_module": -3e-3}, "normal_module = -0.003"),
        ({"face_width": 20.0}, "face_width = 20.0 is outside"),
        ({"bore_radius": 33e-3}, "bore_radius = 0.033 m leaves less than one module"),
        ({"normal_pressure_angle": 20.0}, "normal_pressure_angle = 1146"),
        ({"helix_angle": np.radians(60.0)}, "helix_angle = 60"),
        ({"teeth": -60}, "teeth = -60: internal gears .ring gears. are not modelled"),
        ({"teeth": 9, "profile_shift": -1.0, "bore_radius": 1e-3}, "undercut leaves .* mm of tooth .* at least"),
        ({"profile_shift": 1.6, "teeth": 12}, "pointed at 0.0250939 m, below tip_radius = 0.0262"),
        ({"tip_radius": 36e-3}, "tip_radius = 0.036 m does not lie above the usable flank"),
        ({"rack_tip_radius": 0.6}, "rack_tip_radius = 0.6 does not fit the rack tooth: at most 0.4719"),
        ({"dedendum": 2.4}, "dedendum = 2.4 makes the rack tooth pointed: at most 2.158 normal"),
        ({"thickness_allowance": 0.05}, "thickness_allowance = 0.05 m exceeds"),
    ],
)
def test_impossible_drawing_is_refused_with_its_number(changes, message):
    with pytest.raises(InputError, match=message):
        gear(**changes)


def test_geometry_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        gear().teeth = 4
