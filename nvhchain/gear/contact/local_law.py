"""Local deflection law of slices, in the form that the contact problem solves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.conventions import Material
from nvhchain.gear.contact.flattening import half_space_compliance
from nvhchain.gear.contact.tip_edge import TipEdges, held_excess, load_of_half_width, strip_half_width, wedge_excess
from nvhchain.handoff import FloatArray, IntArray

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
        at = np.arange(len(load)), piece
        log = np.log(np.maximum(load, 1e-300))
        return np.asarray(self.offset[at] + load * (self.level[at] - self.half_slope[at] * log))

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
    """Return `local_deflection` of slices as a piecewise law, with the corrections of `tip_edge`.

    curvature_radius (n,): radius of relative curvature ρ (m).
    depths tuple of 2 (n,) array: depths of both gears (m).
    edges: tip edges near the slices; None for flanks without an end.
    held: gears from whose compliance that of a tooth held on its centre line was subtracted (`held_excess`).
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
