"""Local deflection law of slices: flanks after Weber and Banaschek and Hertz, tip edges, and the form that is solved.

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
from numpy.typing import ArrayLike

from nvhchain.conventions import Material
from nvhchain.handoff import FloatArray, IntArray


def half_space_compliance(material: Material) -> float:
    """Return 2 (1 − ν²)/(π E) (1/Pa), the contribution of one flank to the local deflection per unit q."""
    return 2.0 * (1.0 - material.poisson**2) / (np.pi * material.young)


def contact_half_width(
    load: ArrayLike, curvature_radius: ArrayLike, materials: tuple[Material, Material]
) -> FloatArray:
    """Return the Hertzian half width L = √{(4/π)[(1−ν₁²)/E₁ + (1−ν₂²)/E₂] q ρ} (m).

    load: load per length of contact line q (N/m).
    curvature_radius: radius of relative curvature ρ = ρ₁ρ₂/(ρ₁+ρ₂) in the normal plane (m).
    """
    a = sum(half_space_compliance(m) for m in materials)
    return np.sqrt(2.0 * a * np.asarray(load, float) * np.asarray(curvature_radius, float))


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


PIECES = 24
"""Pieces of a law between a millionth of its limit and the limit."""

_SPAN = 1e6


@dataclass(frozen=True, eq=False)
class LocalLaw:
    """Piecewise law δ_loc = D + q (A − H ln q) per slice, q in N/m; δ and dδ/dq are continuous.

    limit (n,): load at which the half width reaches half the smaller depth (N/m); the formula is meaningless beyond it.
    ratio: ratio of the loads at successive ends of pieces.
    level (n, k + 1): A (1/Pa).
    half_slope (n, k + 1): H (1/Pa).
    offset (n, k + 1): D (m).
    energy (n, k + 1): E (J/m²), in ∫ δ dq = E + D q + q² (A/2 − H (½ ln q − ¼)).

    The pieces end at `limit` divided by `ratio`^(k − 1), ..., `ratio`, 1.  Between the ends dδ/dq is linear in ln q, as
    it is for Hertz's strip throughout. The last piece is the tangent from `limit` on (H = 0).  It keeps the law rising;
    the formula itself falls from L ≈ h on.
    """

    limit: FloatArray
    ratio: float
    level: FloatArray
    half_slope: FloatArray
    offset: FloatArray
    energy: FloatArray

    def deflection(self, load: FloatArray) -> FloatArray:
        """Return δ_loc (n,) in m under `load` q (n,) in N/m."""
        count = self.level.shape[1] - 1
        with np.errstate(divide="ignore"):
            steps = np.log(load / self.limit) / np.log(self.ratio)
        piece = np.clip(np.floor(steps) + count, 0, count).astype(int)
        index = np.arange(len(load)), piece
        log = np.log(np.maximum(load, 1e-300))
        return np.asarray(self.offset[index] + load * (self.level[index] - self.half_slope[index] * log))

    def select(self, slices: IntArray) -> LocalLaw:
        """Return the law of some slices (n,)."""
        parts = (values[slices] for values in (self.limit, self.level, self.half_slope, self.offset, self.energy))
        limit, *rest = (np.ascontiguousarray(part) for part in parts)
        return LocalLaw(limit, self.ratio, *rest)


def local_law(
    curvature_radius: FloatArray,
    depths: tuple[FloatArray, FloatArray],
    materials: tuple[Material, Material],
    *,
    edges: TipEdges | None = None,
    held: tuple[bool, bool] = (False, False),
) -> LocalLaw:
    """Return the approach of tooth centre lines by flattening as a piecewise law, with the corrections of tip edges.

    curvature_radius (n,): radius of relative curvature ρ (m).
    depths tuple of 2 (n,) array: depths of both gears (m).
    edges: tip edges near the slices; None for flanks without an end.
    held: gears from whose compliance that of a tooth held on its centre line was subtracted (`held_excess`).

    Without edge and held tooth δ_loc = Σ_i 2q(1−ν_i²)/(πE_i) [ln(2h_i/L) − ν_i/(2(1−ν_i))].  It holds while L is well
    below h_i.

    Source: C. Weber, K. Banaschek, Schriftenreihe Antriebstechnik 11 (1953).
    """
    parts = [half_space_compliance(m) for m in materials]
    a = sum(parts)
    n = len(curvature_radius)
    angle = np.full(n, -np.inf) if edges is None else edges.angle
    widest = 0.5 * np.minimum(*depths)
    limit = load_of_half_width(widest, curvature_radius, angle, a)
    ratio = _SPAN ** (1 / (PIECES - 1))
    load = limit[:, None] * ratio ** np.arange(1 - PIECES, 1)
    width = strip_half_width(load, curvature_radius[:, None], angle[:, None], a)
    slope = -a * (np.log(width) + 0.5)
    for gear, (part, h, m) in enumerate(zip(parts, depths, materials, strict=True)):
        bracket = np.log(2.0 * h) - m.poisson / (2.0 * (1.0 - m.poisson))
        if held[gear]:
            bracket = bracket + held_excess(m.poisson)
        slope = slope + part * bracket[:, None]
        if edges is not None:
            slope = slope + part * wedge_excess(edges.distance[gear][:, None], width, h[:, None], edges.wedge[gear])
    return _pieces(limit, ratio, load, slope)


def _pieces(limit: FloatArray, ratio: float, load: FloatArray, slope: FloatArray) -> LocalLaw:
    """Return the law whose slope dδ/dq (n, k) in 1/Pa at `load` (n, k) in N/m is interpolated linearly in ln q."""
    log = np.log(load)
    half_slope = np.zeros((len(limit), PIECES + 1))
    half_slope[:, 1:-1] = -np.diff(slope, axis=1) / np.diff(log, axis=1)
    half_slope[:, 0] = half_slope[:, 1]
    level = np.empty_like(half_slope)
    level[:, 1:] = slope + half_slope[:, 1:] * (log + 1)
    level[:, 0] = level[:, 1]
    # δ and its integral are continuous where pieces meet
    offset, energy = np.zeros_like(level), np.zeros_like(level)
    fallen, less = -np.diff(level, axis=1), -np.diff(half_slope, axis=1)
    step = load * (fallen - less * log)
    offset[:, 1:] = np.cumsum(step, axis=1)
    energy[:, 1:] = np.cumsum(load**2 * (0.5 * fallen - less * (0.5 * log - 0.25)) - load * step, axis=1)
    return LocalLaw(limit, ratio, level, half_slope, offset, energy)
