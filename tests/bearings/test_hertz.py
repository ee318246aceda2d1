"""Contacts of balls and rollers: closed forms, Harris's table, and the factor of ISO 76 that follows from them."""

from math import pi

import numpy as np
import pytest

from nvhchain.bearings.hertz import LINE_STIFFNESS, POISSON, YOUNG, Groove, ball_stiffness, ellipse
from nvhchain.bearings.ratings import ball_static_rating, roller_static_rating
from nvhchain.errors import InputError

# Harris, Rolling Bearing Analysis, table of dimensionless contact parameters: F(ρ), a*, b*, δ*
HARRIS = [
    (0.1075, 1.0760, 0.9318, 0.9974),
    (0.3204, 1.2623, 0.8114, 0.9761),
    (0.4795, 1.4556, 0.7278, 0.9429),
    (0.5916, 1.6440, 0.6687, 0.9077),
    (0.83495, 2.494, 0.5186, 0.7602),
    (0.90999, 3.233, 0.4499, 0.6636),
    (0.95738, 4.395, 0.3830, 0.5551),
    (0.983797, 6.448, 0.3150, 0.4352),
    (0.9989156, 17.974, 0.18822, 0.2106),
]


@pytest.mark.parametrize("row", HARRIS)
def test_the_constants_are_those_of_harris(row):
    made = ellipse(row[0])
    assert np.allclose([made.major, made.minor, made.deflection], row[1:], rtol=5e-4)  # its digits


def test_two_spheres_touch_in_a_circle_with_hertz_closed_form():
    circle = ellipse(0.0)
    assert (circle.major, circle.minor, circle.deflection) == (1.0, 1.0, 1.0)
    # continuous towards the circle
    assert abs(ellipse(1e-7).deflection - 1.0) < 1e-12
    # sphere of radius R on an alike sphere: Q = (4/3) E* √(R/2) δ^(3/2), E* = E/(2 (1 − ν²))
    radius, load = 5e-3, 100.0
    modulus = YOUNG / (1.0 - POISSON**2)
    closed = (load / (4.0 / 3.0 * 0.5 * modulus * np.sqrt(radius / 2.0))) ** (2.0 / 3.0)
    curvature = 4.0 / radius
    ours = 0.5 * circle.deflection * (3.0 * load / (modulus * curvature)) ** (2.0 / 3.0) * curvature
    assert abs(ours / closed - 1.0) < 1e-12


def test_a_groove_almost_as_round_as_its_ball_is_refused():
    with pytest.raises(InputError, match="difference of curvatures"):
        ellipse(1.0)


def test_the_ball_constant_is_that_of_iso_16281():
    # 1.48 E/(1 − ν²) (K_i (Σρ_i/(χ_i² E_i))^(1/3) + K_o (…)^(1/3))^(−3/2), with the standard's rounded 1.48
    from scipy.special import ellipe, ellipk

    inner, outer = Groove(12e-3, 6.24e-3, 0.2), Groove(12e-3, 6.36e-3, -0.2)
    total = 0.0
    for groove in (inner, outer):
        m = 1.0 - groove.ellipse.ratio**-2
        total += ellipk(m) * (1e-3 * groove.curvature / (groove.ellipse.ratio**2 * ellipe(m))) ** (1.0 / 3.0)
    standard = 1.48 * 1e-6 * YOUNG / (1.0 - POISSON**2) * total**-1.5  # N/mm^1.5
    assert abs(ball_stiffness(inner, outer) / 1e3**1.5 / standard - 1.0) < 1.5e-3


def pressure(groove, load):
    """Largest pressure, Pa, of the ellipse under a load, N."""
    scale = (3.0 * load * (1.0 - POISSON**2) / (YOUNG * groove.curvature)) ** (1.0 / 3.0)
    return 1.5 * load / (pi * groove.ellipse.major * groove.ellipse.minor * scale**2)


@pytest.mark.parametrize("gamma", [0.05, 0.1, 0.2, 0.3])
def test_the_static_rating_of_iso_76_is_4200_mpa_at_the_worse_raceway(gamma):
    ball = 10e-3
    inner, outer = Groove(ball, 0.52 * ball, gamma), Groove(ball, 0.53 * ball, -gamma)
    # the standard's steel has 207 GPa
    load = (4.2e9 / max(pressure(inner, 1.0), pressure(outer, 1.0))) ** 3 * (YOUNG / 207e9) ** 2
    assert abs(9 * load / 5.0 / ball_static_rating(1, 9, ball, ball / gamma, 0.0) - 1.0) < 6e-3


def test_the_static_rating_of_rollers_is_4000_mpa_at_the_inner_raceway():
    count, diameter, length, pitch = 14, 10e-3, 9.6e-3, 65e-3
    load = 5.0 * roller_static_rating(1, count, diameter, length, pitch, 0.0) / count
    curvature = 2.0 / (diameter * (1.0 - diameter / pitch))
    pressure = np.sqrt(load * curvature * YOUNG / (1.0 - POISSON**2) / (2.0 * np.pi * length))
    assert abs(pressure / 4.0e9 - 1.0) < 0.02


def test_the_line_contact_keeps_its_number_in_newtons_and_millimetres():
    # 10 mm long, 10 µm: 35948 · 10^(8/9) · 0.01^(10/9) N
    wanted = 35948.0 * 10.0 ** (8.0 / 9.0) * 0.01 ** (10.0 / 9.0)
    assert abs(LINE_STIFFNESS * 1e-2 ** (8.0 / 9.0) * 1e-5 ** (10.0 / 9.0) / wanted - 1.0) < 1e-12
