"""Quadrature error of the fused engine on a given surface, including needles and thin gaps, as a single number."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.fused.close_pairs import NEAREST
from nvhchain.acoustics.fused.engine import assemble_rows
from nvhchain.acoustics.fused.mesh import prepare, quadrature_rules
from nvhchain.acoustics.fused.splitting import cut
from nvhchain.acoustics.surfaces.burton_miller import coupling, half_diagonal
from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.acoustics.surfaces.intersections import facing_pairs, joined_pairs, neighbours
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, Surface

FAIR_ORDER = 3
"""Smallest `singular_order` that integrates even triangles well. The closure errors of a sphere, a box and a slab are
3e-5 to 7e-4 at this order. They are 5e-4 to 6e-3 at order 2 and 5e-2 to 8e-2 at order 1."""

_STATIC = 1e-6
"""Wavenumber times size of the surface at which its sound field is static."""

_SAMPLE = 64
"""Vertices, evenly taken from those of suspect triangles, that represent all of them."""

_SECONDS = 2.8e-5
"""Processor time (s) per triangle at a gap and frequency solved alone, times area over the squared width of the gap."""

_POINT_SECONDS = 6.5e-9
"""Processor time (s) per point of the rules of needles at a frequency solved alone."""

JOINT_SHARE = 0.5
"""Share of that time for each of four frequencies solved together: 0.3 across gaps, 0.4 to 0.8 for needles."""

_WIDE = 0.1
"""Gap (edges) that costs no more than other neighbours."""


@lru_cache(maxsize=8)
def suspect_error(
    surface: Surface, fidelity: AcousticsFidelity, rules: AcousticsFidelity | None = None
) -> float | None:
    """Return the area RMS error of the static matrices at suspect triangles, for the worst of four pressures.

    rules : fidelity of the engine that assembles the rows; `fidelity` defines needles.
    Returns error, 0 if the integrals are exact; None without suspects.

    The pressures are one constant and three linear in a coordinate, one at half the diagonal from the middle.
    Harmonic functions u inside the body satisfy A u − B ∂u/∂n = u + α ∂u/∂n, tested with the hats. Linear functions are
    represented exactly on the triangles and take part in all four operators. A constant takes part in the double layer
    alone. The remaining error is quadrature of near and touching triangles.

    Other triangles count as exact. Suspects are needles, and triangles across gaps and walls narrower than the smallest
    pieces resolve. Triangles that meet at a sharp edge or tip, or in a narrow notch, are suspects as well. Below
    `FAIR_ORDER`, all triangles are suspects. The cost is the assembly of `_SAMPLE` rows of one frequency, once for a
    surface.
    """
    rules = rules or fidelity
    rows, some = _sampled(surface, fidelity, rules)
    if len(rows) == 0:
        return None
    weight = _weights(surface)
    missed = _missed(surface, some, *assemble_rows(surface, _wavenumber(surface), rules, some))
    mean_square = float((np.abs(missed) ** 2 / weight[some, None]).sum(axis=0).max() / weight[some].sum())
    return float(np.sqrt(mean_square * weight[rows].sum() / surface.areas.sum()))


@lru_cache(maxsize=8)
def _sampled(surface: Surface, fidelity: AcousticsFidelity, rules: AcousticsFidelity) -> tuple[IntArray, IntArray]:
    """Return the vertices of suspect triangles, and the sample of them that represents all."""
    suspect = _needles(surface, fidelity) | (rules.singular_order < FAIR_ORDER)
    narrow = unresolved_gap(rules)
    for pairs in (neighbours(surface, narrow), joined_pairs(surface)[0]):
        suspect[facing_pairs(surface, pairs, narrow).pairs.ravel()] = True
    rows = np.unique(surface.triangles[suspect])
    return rows, rows[np.unique(np.linspace(0, len(rows) - 1, _SAMPLE).astype(int))] if len(rows) else rows


def _missed(surface: Surface, rows: IntArray | slice, a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Return the errors (n_row, 4) of rows of A and B for a constant and for x, y, z over half the diagonal."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    half = 0.5 * float(np.linalg.norm(high - low))
    place = (surface.vertices - 0.5 * (low + high)) / half
    values = np.concatenate([np.ones((len(place), 1)), place], axis=1)
    slopes = np.concatenate([np.zeros((len(surface.areas), 1)), surface.normals / half], axis=1)
    exact = np.zeros((len(place), 4), dtype=complex)
    corner_values = values[surface.triangles]
    alpha = coupling(surface, _wavenumber(surface))
    for corner in range(3):
        mass = (corner_values.sum(axis=1) + corner_values[:, corner]) / 12.0 + alpha * slopes / 3.0
        np.add.at(exact, surface.triangles[:, corner], surface.areas[:, None] * mass)
    missed = a @ values - b @ slopes - exact[rows]
    # the error of the hypersingular equation counts in its own measure
    missed[:, 1:] *= half_diagonal(surface) / abs(alpha)
    return np.asarray(missed)


def unresolved_gap(fidelity: AcousticsFidelity) -> float:
    """Return the gap, in longest edges, below which the smallest pieces of triangles are too near to each other."""
    return fidelity.gap_ratio * 0.5**fidelity.gap_halvings


@lru_cache(maxsize=8)
def gap_cost(surface: Surface, fidelity: AcousticsFidelity) -> tuple[int, float, int, float, float]:
    """Return (triangles at gaps, narrowest gap in edges, needles, seconds of both, seconds of `suspect_error`).

    Triangles at gaps are those at narrow gaps and thin walls. Seconds are processor time: at a frequency solved alone
    for gaps and needles, and once for `suspect_error`.
    """
    facing = facing_pairs(surface, neighbours(surface, _WIDE), _WIDE)
    width = np.full(len(surface.triangles), np.inf)
    for side in facing.pairs.T:
        np.minimum.at(width, side, facing.ratio)
    gap = np.maximum(width, unresolved_gap(fidelity)) * surface.longest_edges
    seconds = _SECONDS * surface.areas / gap**2 + _needle_seconds(surface, fidelity)
    tested = np.isin(surface.triangles, _sampled(surface, fidelity, fidelity)[1]).any(axis=1)
    needles = int(_needles(surface, fidelity).sum())
    return int((width < _WIDE).sum()), float(width.min()), needles, float(seconds.sum()), float(seconds[tested].sum())


def _needles(surface: Surface, fidelity: AcousticsFidelity) -> NDArray[np.bool_]:
    """Return a mask of triangles (n_face,) that are needles."""
    return np.asarray(surface.longest_edges**2 > fidelity.needle_aspect * 2.0 * surface.areas)


def _needle_seconds(surface: Surface, fidelity: AcousticsFidelity) -> FloatArray:
    """Return the additional processor time (n_face,) s of needles, at a frequency solved alone.

    Touching needles count with their rules. Needles side by side are cut and count with the pieces of a sample.
    """
    needles = _needles(surface, fidelity)
    if not needles.any():
        return np.zeros(len(surface.triangles))
    mesh = prepare(surface, fidelity, None)
    rules = quadrature_rules(fidelity.quadrature_order, mesh.slenderest, fidelity)
    points = np.add.reduceat(rules.width, rules.start[:-1])
    pairs = mesh.trials[0]
    test, trial = np.repeat(np.arange(len(mesh.order)), np.diff(pairs.close_start)), pairs.close_trial
    taken = np.where(pairs.close_rule >= rules.plain, points[pairs.close_rule], 0.0)
    slender = needles[mesh.order]
    needle_pairs = np.flatnonzero((pairs.close_rule == NEAREST) & (slender[test] | slender[trial]))
    if len(needle_pairs):
        some = needle_pairs[np.unique(np.linspace(0, len(needle_pairs) - 1, _SAMPLE).astype(int))]
        pieces, share = np.empty((256, 2, 3, 3)), np.empty(256)
        corners, least = mesh.vertices[mesh.triangles], mesh.least_scale * mesh.sizes
        cuts = [
            cut(pieces, share, corners[[t, s]], mesh.gap, least[t], least[s])[2]
            for t, s in zip(test[some], trial[some], strict=True)
        ]
        taken[needle_pairs] = (np.mean(cuts) - 1.0) * points[NEAREST]
    return np.asarray(_POINT_SECONDS * np.bincount(mesh.order[test], taken, len(slender)))


def _weights(surface: Surface) -> FloatArray:
    """Return the area (n_v,) m² that belongs to every vertex."""
    weight = np.zeros(len(surface.vertices))
    np.add.at(weight, surface.triangles.ravel(), np.repeat(surface.areas / 3.0, 3))
    return weight


def _wavenumber(surface: Surface) -> float:
    return _STATIC / diameter(surface.vertices)
