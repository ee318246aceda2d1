"""Ball bearings by a second method: energy of two Hertz contacts per ball, minimised over the place of the ball."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, minimize

from nvhchain.bearings import AngularContact, DeepGroove

BALLS = {"elements": 9, "element_diameter": 9.5e-3, "pitch_diameter": 46e-3}


def contact(ball, groove, along):
    """K (N/m^1.5) of a ball in a groove, from Hertz's integrals over the confocal ellipsoids; 1/m, steel."""
    flexibility = 2.0 * (1.0 - 0.3**2) / (np.pi * 210e9)

    def integral(ratio, power):
        """∫ dξ (1 + ξ)^-power / √((1 + ξ)(ratio² + ξ) ξ), ξ = tan²t: the long semi-axis is 1, the short one `ratio`."""

        def value(t):
            x = np.tan(t) ** 2
            at = {"": 1.0, "a": 1.0 / (1.0 + x), "b": 1.0 / (ratio**2 + x)}[power]
            return 2.0 * at * np.sqrt((1.0 + x) / (ratio**2 + x))

        return quad(value, 0.0, np.pi / 2, limit=200)[0]

    flat, steep = sorted((0.5 * (2.0 / ball - 1.0 / groove), 0.5 * (2.0 / ball + along)))
    ratio = brentq(lambda r: integral(r, "a") / integral(r, "b") - flat / steep, 1e-3, 1.0)
    a = (0.75 * flexibility * integral(ratio, "a") / flat) ** (1.0 / 3.0)  # under 1 N
    return (0.75 * flexibility * integral(ratio, "") / a) ** -1.5


def turned(tilt):
    """Rotation (3, 3) about a vector in the plane x, y (rad), exact."""
    size = np.linalg.norm(tilt)
    x, y = tilt / size if size else (1.0, 0.0)
    skew = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(size) * skew + (1.0 - np.cos(size)) * skew @ skew


class Bearing:
    """Rings with circular grooves, balls free in their radial planes."""

    def __init__(self, angle, radial_gap, inner, outer):
        d, self.pitch, self.count = BALLS["element_diameter"], BALLS["pitch_diameter"], BALLS["elements"]
        roll = d * np.cos(angle) / self.pitch
        self.play = inner - d / 2, outer - d / 2
        self.k = [
            contact(d, groove, side * 2.0 / d * roll / (1.0 - side * roll))
            for groove, side in ((inner, 1), (outer, -1))
        ]
        long = sum(self.play)
        # groove centres of the inner ring lie outside, towards −z for a shaft that is pushed to +z
        self.inner = np.array([self.pitch / 2 + self.play[0] * np.cos(angle), self.play[0] * np.sin(angle)])
        self.outer = self.inner - np.array([long * np.cos(angle) - radial_gap, long * np.sin(angle)])

    def ball(self, u, psi):
        """Energy (J) and load at the inner ring (N) of a ball."""
        turn = turned(u[3:])
        normal, centre = turn[:, 2], np.array(u[:3]) + self.inner[1] * turn[:, 2]
        away = np.array([np.cos(psi), np.sin(psi), 0.0])

        def pressed(place):
            at = place[0] * away + np.array([0.0, 0.0, place[1]]) - centre
            high = at @ normal
            inner = np.hypot(self.inner[0] - np.linalg.norm(at - high * normal), high)
            outer = np.hypot(*(place - self.outer))
            return np.maximum([inner - self.play[0], outer - self.play[1]], 0.0)

        def energy(step):
            return 0.4 * float(self.k @ pressed(start + 1e-5 * step) ** 2.5)

        # from the line between the groove centres
        middle = np.array([self.inner[0] + away @ u[:3], self.inner[1] + u[2] + (self.pitch / 2) * (turn @ away)[2]])
        line = self.outer - middle
        start = middle + line * self.play[0] / sum(self.play)
        found = minimize(energy, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-17})
        return found.fun, self.k[0] * pressed(start + 1e-5 * found.x)[0] ** 1.5

    def energy(self, u):
        return sum(self.ball(u, 2 * np.pi * i / self.count)[0] for i in range(self.count))


@pytest.mark.parametrize(
    ("bearing", "second", "u"),
    [
        (
            AngularContact(**BALLS, contact_angle=0.5, thrust=1),
            lambda d: Bearing(0.5, 0.0, 0.52 * d, 0.53 * d),
            [8e-6, -3e-6, 3e-5, 2e-4, 3e-4],
        ),
        (
            DeepGroove(**BALLS, clearance=10e-6),
            lambda d: Bearing(0.0, 5e-6, 0.52 * d, 0.53 * d),
            [2e-5, 5e-6, 4e-5, 0.0, 1e-3],
        ),
    ],
)
def test_loads_and_stiffness_of_balls_follow_from_energy(bearing, second, u):
    u, model = np.array(u), second(BALLS["element_diameter"])
    loads = [model.ball(u, 2 * np.pi * i / model.count)[1] for i in range(model.count)]
    given = bearing.element_loads(u)[0][0]
    assert np.abs(loads - given).max() < 0.003 * given.max()
    force, stiffness = bearing.evaluate(u)
    step = np.array([4e-7] * 3 + [2e-5] * 2)
    centre = model.energy(u)
    for k in range(5):
        push = np.eye(5)[k] * step[k]
        up, down = model.energy(u + push), model.energy(u - push)
        scale = np.abs(force[:3]).max() * (1.0 if k < 3 else BALLS["pitch_diameter"] / 2)
        assert abs((up - down) / (2 * step[k]) - force[k]) < 0.01 * scale
        assert abs((up + down - 2 * centre) / step[k] ** 2 / stiffness[k, k] - 1.0) < 0.005
