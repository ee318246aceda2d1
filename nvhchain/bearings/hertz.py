"""Hertzian contact of a ball with a groove, and the line contact of a roller."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from nvhchain.errors import require

YOUNG = 210e9
"""Young's modulus of bearing steel (Pa), as in ISO/TS 16281."""
POISSON = 0.3
"""Poisson's ratio of bearing steel, as in ISO/TS 16281."""

LINE_STIFFNESS = 35948.0 * 1e3 ** (10.0 / 9.0 + 8.0 / 9.0)
"""Constant c of a steel roller between two raceways, Q = c L^(8/9) δ^(10/9) (N, m).

ISO/TS 16281 has 35948 for N and mm.
"""

LINE_EXPONENT = 10.0 / 9.0
"""Exponent of the load over deflection of a line contact."""


@dataclass(frozen=True)
class Ellipse:
    """Dimensionless constants of an elliptic contact.

    ratio: ratio κ = a/b ≥ 1 of the semi-axes.
    major, minor: constants a* and b* of the semi-axes.
    deflection: constant δ* of the approach.

    With the sum of curvatures Σρ and the equivalent modulus E′ = E/(1 − ν²) of two alike bodies:
    a = a* (3Q/(E′ Σρ))^(1/3), b = b* (3Q/(E′ Σρ))^(1/3) and δ = δ* (3Q/(E′ Σρ))^(2/3) Σρ/2.
    """

    ratio: float
    major: float
    minor: float
    deflection: float


def ellipse(difference: float) -> Ellipse:
    """Return the constants of a contact by Hertz's elliptic integrals.

    difference: relative difference F(ρ) of the curvatures, 0 (circle) … below 1 (line).

    κ solves F = ((κ² + 1) E − 2K)/((κ² − 1) E) with the complete integrals K and E of the parameter 1 − 1/κ².
    a* = (2κ²E/π)^(1/3), b* = a*/κ, δ* = (2K/π) (π/(2κ²E))^(1/3). Source: T. A. Harris and M. N. Kotzalas,
    Essential Concepts of Bearing Technology, 5th ed., ch. 6; ISO/TS 16281, 4.2.
    """
    require(
        0.0 <= difference <= 1.0 - 1e-9,
        f"difference of curvatures = {difference:.10g} is outside 0…1: correct the groove radii of the bearing",
    )
    if difference < 1e-8:
        return Ellipse(1.0, 1.0, 1.0, 1.0)

    def excess(log_ratio: float) -> float:
        small = 10.0 ** (-2.0 * log_ratio)  # 1/κ²
        return float(1.0 - 2.0 * small / (1.0 - small) * (ellipkm1(small) / ellipe(1.0 - small) - 1.0) - difference)

    ratio = 10.0 ** brentq(excess, 1e-9, 8.0, xtol=1e-14, rtol=1e-14)
    first, second = float(ellipkm1(ratio**-2)), float(ellipe(1.0 - ratio**-2))
    major = (2.0 * ratio**2 * second / pi) ** (1.0 / 3.0)
    return Ellipse(ratio, major, major / ratio, 2.0 * first / (pi * major))


@dataclass(frozen=True)
class Groove:
    """Contact of a ball with one raceway.

    ball_diameter: diameter of the ball (m).
    groove_radius: radius of the groove's cross-section (m), above that of the ball.
    gamma: D_w cos α/D_pw; negative for the outer raceway, which curves around the ball.
    """

    ball_diameter: float
    groove_radius: float
    gamma: float

    @property
    def curvature(self) -> float:
        """Sum of curvatures Σρ (1/m)."""
        rolling = self.gamma / (1.0 - self.gamma)
        return 2.0 / self.ball_diameter * (2.0 + rolling - 0.5 * self.ball_diameter / self.groove_radius)

    @property
    def ellipse(self) -> Ellipse:
        """Constants of the contact."""
        rolling, osculation = self.gamma / (1.0 - self.gamma), 0.5 * self.ball_diameter / self.groove_radius
        return ellipse(abs(rolling + osculation) / (2.0 + rolling - osculation))

    @property
    def compliance(self) -> float:
        """Approach per load^(2/3) (m/N^(2/3))."""
        modulus = YOUNG / (1.0 - POISSON**2)
        return 0.5 * self.ellipse.deflection * (3.0 / modulus) ** (2.0 / 3.0) * self.curvature ** (1.0 / 3.0)


def ball_stiffness(inner: Groove, outer: Groove) -> float:
    """Return K (N/m^(3/2)) of a ball between two raceways, Q = K δ^(3/2).

    Returns load per deflection to the power of 3/2.
    """
    return (inner.compliance + outer.compliance) ** -1.5
