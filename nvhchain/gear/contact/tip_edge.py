"""Contact near the tip of a tooth: half a contact strip, and a wedge instead of a half-space.

Strip.  Beyond the end of the path the flanks enclose an angle φ at the edge.  With x along the flank from the edge the
gap is φ x + x²/(2ρ).  The edge does not move, so the strip is 0 ≤ x ≤ b.  Its pressure vanishes at b and is singular at
the edge.  For half-planes (singular integral with one open end; K. L. Johnson, Contact Mechanics, 1985, ch. 2 and 5)

    p = (E*/2) √((b − x)/x) (φ + (x + b/2)/ρ),    q = (πE*/4)(φ b + ¾ b²/ρ),

and the approach is that of a full strip with the half width L replaced by (b/2) e^(−w/2), w = φb/(φb + ¾b²/ρ).  All of
this follows from one fact: an increment of load acts like a flat punch on the current strip, so that with half width c

    dδ/dq = ... − a ln c − a/2,    a = 2/(πE*),    c = L (Hertz) or b/2 (at an edge).

Contact at the distance d inside the edge is complete as long as L ≤ d.  Beyond that it is the same strip with φ = −d/ρ.
At L = d both have b = 2d, and the law and its slope are continuous.

Wedge.  A tip is a wedge of W = 90° + α_tip.  Far from a load near its apex the stress is Flamant's for a wedge (S.
Timoshenko, J. N. Goodier, Theory of Elasticity, art. 38): along its axis cos θ/(r (W/2 + ½ sin W)), across it sin θ/(r
(W/2 − ½ sin W)).  A force normal to a face has the parts sin W/2 and cos W/2 of these.  The displacement along the
force has κ times the half-space's logarithm of the distance:

    κ = (π/2)[sin²(W/2)/(W/2 + ½ sin W) + cos²(W/2)/(W/2 − ½ sin W)],    κ(180°) = 1.

The displacement at x from the apex under a load at s follows the wedge beyond the farther of both.  The wedge ends
inside the tooth.  With d = max(x, s) the bracket gains ½(κ − 1) ln(1 + (m h/d)²).  For a flat punch on a strip at the
edge the mean of ln d over both places is that of 2c e^(7ζ(3)/π² − 2 ln 2) = 1.173 c.  Inside the flank it grows to that
from the logarithm of the middle's distance.

Held section.  The part subtracted from the flank's compliance (`FlankCompliance`) is not a half-space seen from the
depth h but a tooth held on its centre line.  Away from its ends that is a layer of thickness h bonded to a rigid base.
Its surface deflects under a line load by 2(1−ν²)q/(πE) [ln(h/r) + C] (Fourier integral of `held_excess`).  In the
bracket of Weber and Banaschek C = −1/(2(1−ν)).  The part added must equal the part subtracted.  The difference
therefore belongs to flanks less a held tooth, not to the formula.

docs/measured/gear/tip_edge.md compares all three with finite elements of plane sections; an edge in contact agrees
within 2 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from nvhchain.handoff import FloatArray

FADE = 0.13
"""Factor m in the fading of the wedge. Finite elements of held sections of teeth (20 to 82) give 0.12 to 0.14
(benchmarks/gear/tip_edge.py)."""

_EDGE_DISTANCE = 0.1728
"""2 e^(7ζ(3)/π² − 2 ln 2) − 1: equivalent distance of the farther of two points under a flat punch at an edge, over c,
less 1."""

_LAYER_END = 60.0
"""Wave number times thickness beyond which a layer equals a half-space, to rounding."""


@dataclass(frozen=True, eq=False)
class TipEdges:
    """Positions of the tip edges of both gears relative to every slice.

    distance (2, n): distance along the flank from the contact to the tip edge of pinion and wheel (m); 0 where that
        edge touches.
    angle (n,): angle φ between the flanks at the edge in the normal plane (rad); −d/ρ where the contact lies inside.
    wedge (2,): wedge angles W = 90° + α_tip of the tips of pinion and wheel (rad).
    """

    distance: FloatArray
    angle: FloatArray
    wedge: FloatArray


def strip_half_width(
    load: FloatArray, curvature_radius: FloatArray, angle: FloatArray, compliance: float
) -> FloatArray:
    """Return the half width c (m) of the strip under `load` (N/m): Hertz's, or half of b where an edge ends it.

    curvature_radius: ρ, m.  angle: φ, rad, at the nearest edge.  compliance: a, 1/Pa, of both flanks.
    """
    whole = np.sqrt(2 * compliance * load * curvature_radius)
    ended = curvature_radius / 3 * (np.sqrt(angle**2 + 6 * compliance * load / curvature_radius) - angle)
    return np.where(whole <= -angle * curvature_radius, whole, ended)


def load_of_half_width(
    half_width: FloatArray, curvature_radius: FloatArray, angle: FloatArray, compliance: float
) -> FloatArray:
    """Return the load q (N/m) at which the strip has half width c (m); the inverse of `strip_half_width`."""
    whole = half_width**2 / curvature_radius
    ended = 2 * half_width * angle + 3 * half_width**2 / curvature_radius
    return np.where(half_width <= -angle * curvature_radius, whole, ended) / (2 * compliance)


def wedge_factor(angle: float) -> float:
    """Return κ of a wedge of `angle` W (rad) loaded near its apex normal to a face; 1 for a half-space."""
    half, bend = 0.5 * angle, 0.5 * np.sin(angle)
    return float(0.5 * np.pi * (np.sin(half) ** 2 / (half + bend) + np.cos(half) ** 2 / (half - bend)))


def wedge_excess(distance: FloatArray, half_width: FloatArray, depth: FloatArray, angle: float) -> FloatArray:
    """Return the addition of a tip to the bracket in the slope of the local deflection.

    distance: m, from the tip to the middle of the contact; less than c where the strip ends at it. half_width: c, m.
    depth: h, m.  angle: W, rad.
    """
    farther = np.maximum(distance, half_width) + _EDGE_DISTANCE * half_width
    return 0.5 * (wedge_factor(angle) - 1) * np.log1p((FADE * depth / farther) ** 2)


@cache
def held_excess(poisson: float) -> float:
    """Return the addition of a layer held at the depth h to the Weber–Banaschek bracket: 0.188 for ν = 0.3.

    u = 2(1−ν²)q/(πE) ∫ M(k) cos(k x/h)/k dk, M = (2K sinh 2k − 4k)/(2K cosh 2k + 4k² + 1 + K²), K = 3 − 4ν.
    """
    from scipy.integrate import quad

    kappa = 3 - 4 * poisson

    def layer(k: float) -> float:
        return float((2 * kappa * np.sinh(2 * k) - 4 * k) / (2 * kappa * np.cosh(2 * k) + 4 * k**2 + 1 + kappa**2))

    below = quad(lambda k: layer(k) / k, 0.0, 1.0)[0]
    above = quad(lambda k: (layer(k) - 1) / k, 1.0, _LAYER_END)[0]
    return below + above - np.euler_gamma + 0.5 / (1 - poisson)
