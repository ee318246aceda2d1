"""What is special about contact near the tip of a tooth: half a strip of contact, and a wedge instead of a half-space.

Strip. Beyond the end of the path the flanks enclose an angle φ at the edge; x along the flank from the edge, the gap
is φ x + x²/(2ρ). The edge stays, so the strip is 0 ≤ x ≤ b, its pressure vanishing at b and singular at the edge. For
half-planes (singular integral with one open end; K. L. Johnson, Contact Mechanics, 1985, ch. 2 and 5)

    p = (E*/2) √((b − x)/x) (φ + (x + b/2)/ρ),    q = (πE*/4)(φ b + ¾ b²/ρ),

and the approach is that of a full strip with the half width L replaced by (b/2) e^(−w/2), w = φb/(φb + ¾b²/ρ). All of
this lies in one fact: another bit of load acts like a flat punch on the strip of the moment, so that with half width c

    dδ/dq = ... − a ln c − a/2,    a = 2/(πE*),    c = L (Hertz) or b/2 (at an edge).

Contact at the distance d inside the edge is whole as long as L ≤ d, and afterwards the same strip with φ = −d/ρ: at
L = d both have b = 2d, and the law and its slope go on.

Wedge. A tip is a wedge of W = 90° + α_tip. Far from a load near its apex the stress is Flamant's for a wedge
(S. Timoshenko, J. N. Goodier, Theory of Elasticity, art. 38), along its axis cos θ/(r (W/2 + ½ sin W)), across it
sin θ/(r (W/2 − ½ sin W)); a force normal to a face has the parts sin W/2 and cos W/2 of these, and what gives way
along it has κ times the half-space's logarithm of the distance:

    κ = (π/2)[sin²(W/2)/(W/2 + ½ sin W) + cos²(W/2)/(W/2 − ½ sin W)],    κ(180°) = 1.

The displacement at x from the apex under a load at s knows of the wedge beyond the farther of both, and the wedge ends
inside the tooth: with d = max(x, s) the bracket has ½(κ − 1) ln(1 + (m h/d)²) more. Of a flat punch on a strip at the
edge the mean of ln d over both places is that of 2c e^(7ζ(3)/π² − 2 ln 2) = 1.173 c; inside it grows to that from that
of the middle.

Held section. What is taken off the flank's compliance (`FlankCompliance`) is not a half-space seen from the depth h but
a tooth held on its centre line. Away from its ends that is a layer of thickness h bonded to something rigid, whose
surface gives way under a line load by 2(1−ν²)q/(πE) [ln(h/r) + C] (Fourier integral of `held_excess`); in the bracket
of Weber and Banaschek C = −1/(2(1−ν)). What goes back in must be what was taken out: the difference belongs to flanks
freed of a held tooth, not to the formula.

All three against finite elements of plane sections: docs/measured/gear/tip_edge.md (an edge in contact: within 2 %).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from nvhchain.handoff import FloatArray

FADE = 0.13
"""m: finite elements of held sections of teeth (20 to 82) give 0.12 to 0.14 (benchmarks/gear/tip_edge.py)."""

_BEYOND_STRIP = 0.1728
"""2 e^(7ζ(3)/π² − 2 ln 2) − 1: where two points under a flat punch at an edge have the farther of them, less c."""

_LAYER_END = 60.0
"""Wave number times thickness beyond which a layer is a half-space, to rounding."""


@dataclass(frozen=True, eq=False)
class TipEdges:
    """Where the tip edges of both gears are, seen from every slice.

    distance: (2, n) m, along the flank from the contact to the tip edge of pinion and wheel; 0 where that edge touches.
    angle: (n,) φ, rad, between the flanks at the edge, in the normal plane; −d/ρ where the contact lies inside.
    wedge: (2,) W, rad, 90° + α_tip, of the tips of pinion and wheel.
    """

    distance: FloatArray
    angle: FloatArray
    wedge: FloatArray


def strip_half_width(
    load: FloatArray, curvature_radius: FloatArray, angle: FloatArray, compliance: float
) -> FloatArray:
    """Half width c, m, of the strip under `load`, N/m: Hertz's, or half of b where an edge ends it.

    curvature_radius: ρ, m.  angle: φ, rad, at the nearest edge.  compliance: a, 1/Pa, of both flanks.
    """
    whole = np.sqrt(2 * compliance * load * curvature_radius)
    ended = curvature_radius / 3 * (np.sqrt(angle**2 + 6 * compliance * load / curvature_radius) - angle)
    return np.where(whole <= -angle * curvature_radius, whole, ended)


def load_of_half_width(
    half_width: FloatArray, curvature_radius: FloatArray, angle: FloatArray, compliance: float
) -> FloatArray:
    """q, N/m, at which the strip has half width c, m; the inverse of `strip_half_width`."""
    whole = half_width**2 / curvature_radius
    ended = 2 * half_width * angle + 3 * half_width**2 / curvature_radius
    return np.where(half_width <= -angle * curvature_radius, whole, ended) / (2 * compliance)


def wedge_factor(angle: float) -> float:
    """κ of a wedge of `angle` W, rad, loaded near its apex normal to a face; 1 for a half-space."""
    half, bend = 0.5 * angle, 0.5 * np.sin(angle)
    return float(0.5 * np.pi * (np.sin(half) ** 2 / (half + bend) + np.cos(half) ** 2 / (half - bend)))


def wedge_excess(distance: FloatArray, half_width: FloatArray, depth: FloatArray, angle: float) -> FloatArray:
    """What a tip adds to the bracket of the local deflection's slope.

    distance: m, from the tip to the middle of the contact; less than c where the strip ends at it.
    half_width: c, m.  depth: h, m.  angle: W, rad.
    """
    farther = np.maximum(distance, half_width) + _BEYOND_STRIP * half_width
    return 0.5 * (wedge_factor(angle) - 1) * np.log1p((FADE * depth / farther) ** 2)


@cache
def held_excess(poisson: float) -> float:
    """What a layer held at the depth h adds to the Weber–Banaschek bracket: 0.188 for ν = 0.3.

    u = 2(1−ν²)q/(πE) ∫ M(k) cos(k x/h)/k dk, M = (2K sinh 2k − 4k)/(2K cosh 2k + 4k² + 1 + K²), K = 3 − 4ν.
    """
    from scipy.integrate import quad

    kappa = 3 - 4 * poisson

    def layer(k: float) -> float:
        return float((2 * kappa * np.sinh(2 * k) - 4 * k) / (2 * kappa * np.cosh(2 * k) + 4 * k**2 + 1 + kappa**2))

    below = quad(lambda k: layer(k) / k, 0.0, 1.0)[0]
    above = quad(lambda k: (layer(k) - 1) / k, 1.0, _LAYER_END)[0]
    return below + above - np.euler_gamma + 0.5 / (1 - poisson)
