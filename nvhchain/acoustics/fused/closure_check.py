"""How well the fused engine's quadrature copes with a surface: needles, thin gaps and all, in one number."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.fused.close_pairs import NEAREST
from nvhchain.acoustics.fused.engine import rows_of, stripes
from nvhchain.acoustics.fused.mesh import Plane, prepare, rules_of
from nvhchain.acoustics.fused.splitting import cut
from nvhchain.acoustics.surfaces.burton_miller import coupling, half_diagonal
from nvhchain.acoustics.surfaces.intersections import facing_pairs, joined_pairs, neighbours
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, Surface

FAIR_ORDER = 3
"""Least `singular_order` that even triangles, which all touch others, are integrated well with: the closure errors of a
sphere, a box and a slab are 3e-5 to 7e-4 there, 5e-4 to 6e-3 with 2 and 5e-2 to 8e-2 with 1."""

_STATIC = 1e-6
"""Wavenumber times size of the surface at which its sound field is a static one."""

_SAMPLE = 64
"""Vertices, evenly taken from those of suspect triangles, that stand for all of them."""

_SECONDS = 2.8e-5
"""s of processor time per triangle that a gap takes at a frequency solved alone, times the triangle's area over the
square of its width."""

_POINT_SECONDS = 6.5e-9
"""s of processor time per point of the rules of needles at a frequency solved alone."""

TOGETHER = 0.5
"""Share of that for each of four frequencies solved together: 0.3 across gaps, 0.4 to 0.8 of needles."""

_WIDE = 0.1
"""Gap in edges that costs no more than other neighbours."""


def closure_error(surface: Surface, fidelity: AcousticsFidelity, plane: Plane | None = None) -> float:
    """RMS over the area of what the static matrices miss of pressures that are constant or linear in a coordinate, one
    at half the diagonal from the middle, the worst of the four; 0 if integrals are exact.

    Harmonic functions u inside the body satisfy A u − B ∂u/∂n = u + α ∂u/∂n, tested with the hats; linear ones are
    represented exactly on the triangles and take part in all four operators, a constant in the double layer alone.
    What is left is quadrature error of near and touching triangles: about 1e-5 on a smooth mesh, 1e-4 on a box at
    `standard`, 4e-3 and 3e-2 on needles ten and thirty times as long as high.  Over a plane the constant alone counts.
    Costs the assembly of one frequency, in stripes: a run takes `suspect_error`, which tests hold against this, as
    they do the quadrature.  Raises ResourceError as `stripes` does.
    """
    weight, functions = _weights(surface), 4 if plane is None else 1
    square = np.zeros(functions)
    for rows, a, b in stripes(surface, [_wavenumber(surface)], fidelity, plane):
        missed = _missed(surface, rows, a[0], b[0])[:, :functions]
        square += (np.abs(missed) ** 2 / weight[rows, None]).sum(axis=0)
    return float(np.sqrt(square.max() / surface.areas.sum()))


@lru_cache(maxsize=8)
def suspect_error(
    surface: Surface, fidelity: AcousticsFidelity, rules: AcousticsFidelity | None = None
) -> float | None:
    """`closure_error` from the vertices of suspect triangles alone, the others taken as exact; None without suspects.

    Suspect are needles, triangles across gaps and walls narrower than the smallest pieces can do, and those that meet
    at a sharp edge or tip, or in a narrow notch; below `FAIR_ORDER` all are.  Costs the assembly of `_SAMPLE` rows of
    one frequency, once for a surface.
    rules: those of another engine, with which the rows are assembled; `fidelity` says what a needle is.
    """
    rules = rules or fidelity
    rows, some = _sampled(surface, fidelity, rules)
    if len(rows) == 0:
        return None
    weight = _weights(surface)
    missed = _missed(surface, some, *rows_of(surface, _wavenumber(surface), rules, some))
    mean_square = float((np.abs(missed) ** 2 / weight[some, None]).sum(axis=0).max() / weight[some].sum())
    return float(np.sqrt(mean_square * weight[rows].sum() / surface.areas.sum()))


@lru_cache(maxsize=8)
def _sampled(surface: Surface, fidelity: AcousticsFidelity, rules: AcousticsFidelity) -> tuple[IntArray, IntArray]:
    """Vertices of suspect triangles, and those of them that stand for all."""
    suspect = _needles(surface, fidelity) | (rules.singular_order < FAIR_ORDER)
    narrow = unresolved_gap(rules)
    for pairs in (neighbours(surface, narrow), joined_pairs(surface)[0]):
        suspect[facing_pairs(surface, pairs, narrow).pairs.ravel()] = True
    rows = np.unique(surface.triangles[suspect])
    return rows, rows[np.unique(np.linspace(0, len(rows) - 1, _SAMPLE).astype(int))] if len(rows) else rows


def _missed(surface: Surface, rows: IntArray | slice, a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """What rows of A and B miss of a constant and of x, y, z over half the diagonal: (n_row, 4)."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    half = 0.5 * float(np.linalg.norm(high - low))
    place = (surface.vertices - 0.5 * (low + high)) / half
    values = np.concatenate([np.ones((len(place), 1)), place], axis=1)
    slopes = np.concatenate([np.zeros((len(surface.areas), 1)), surface.normals / half], axis=1)
    exact = np.zeros((len(place), 4), dtype=complex)
    on_faces = values[surface.triangles]
    alpha = coupling(surface, _wavenumber(surface))
    for corner in range(3):
        mass = (on_faces.sum(axis=1) + on_faces[:, corner]) / 12.0 + alpha * slopes / 3.0
        np.add.at(exact, surface.triangles[:, corner], surface.areas[:, None] * mass)
    missed = a @ values - b @ slopes - exact[rows]
    # what the hypersingular equation misses counts in its own measure
    missed[:, 1:] *= half_diagonal(surface) / abs(alpha)
    return np.asarray(missed)


def unresolved_gap(fidelity: AcousticsFidelity) -> float:
    """Gap in longest edges below which the smallest pieces of triangles are still too near to each other."""
    return fidelity.gap_ratio * 0.5**fidelity.gap_halvings


@lru_cache(maxsize=8)
def gap_cost(surface: Surface, fidelity: AcousticsFidelity) -> tuple[int, float, int, float, float]:
    """(triangles at narrow gaps and thin walls, least width in edges, needles, s of processor time that both take at a
    frequency solved alone, s that `suspect_error` takes once)."""
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
    """Whether triangles (n_face,) are needles."""
    return np.asarray(surface.longest_edges**2 > fidelity.needle_aspect * 2.0 * surface.areas)


def _needle_seconds(surface: Surface, fidelity: AcousticsFidelity) -> FloatArray:
    """Processor time (n_face,) s, at a frequency solved alone, of the pairs that take more points for needles: those
    that touch, by their rules, and those side by side, which are cut, by what some of them are cut into."""
    needles = _needles(surface, fidelity)
    if not needles.any():
        return np.zeros(len(surface.triangles))
    mesh = prepare(surface, fidelity, None)
    rules = rules_of(fidelity.quadrature_order, mesh.slenderest, fidelity)
    points = np.add.reduceat(rules.width, rules.start[:-1])
    pairs = mesh.trials[0]
    test, trial = np.repeat(np.arange(len(mesh.order)), np.diff(pairs.close_start)), pairs.close_trial
    taken = np.where(pairs.close_rule >= rules.plain, points[pairs.close_rule], 0.0)
    slender = needles[mesh.order]
    beside = np.flatnonzero((pairs.close_rule == NEAREST) & (slender[test] | slender[trial]))
    if len(beside):
        some = beside[np.unique(np.linspace(0, len(beside) - 1, _SAMPLE).astype(int))]
        pieces, share = np.empty((256, 2, 3, 3)), np.empty(256)
        corners, least = mesh.vertices[mesh.triangles], mesh.least_scale * mesh.sizes
        cuts = [
            cut(pieces, share, corners[[t, s]], mesh.gap, least[t], least[s])[2]
            for t, s in zip(test[some], trial[some], strict=True)
        ]
        taken[beside] = (np.mean(cuts) - 1.0) * points[NEAREST]
    return np.asarray(_POINT_SECONDS * np.bincount(mesh.order[test], taken, len(slender)))


def _weights(surface: Surface) -> FloatArray:
    """Area (n_v,) m² that belongs to every vertex."""
    weight = np.zeros(len(surface.vertices))
    np.add.at(weight, surface.triangles.ravel(), np.repeat(surface.areas / 3.0, 3))
    return weight


def _wavenumber(surface: Surface) -> float:
    return _STATIC / float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
