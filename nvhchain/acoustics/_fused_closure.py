"""How well the fused engine's quadrature copes with a surface: needles, thin gaps and all, in one number."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nvhchain.acoustics._coupling import coupling
from nvhchain.acoustics._fused import rows_of, stripes
from nvhchain.acoustics._fused_mesh import Plane
from nvhchain.acoustics.intersections import facing_pairs, neighbours
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, Surface

_STATIC = 1e-6
"""Wavenumber times size of the surface at which its sound field is a static one."""

_SAMPLE = 64
"""Vertices, evenly taken from those of suspect triangles, that stand for all of them."""

_SECONDS = 4e-6
"""s of processor time per triangle and frequency that a gap takes, times the square of its width in edges (measured at
0.011, 0.028 and 0.1 edges, standard knobs)."""

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

    Suspect are needles, and triangles across gaps and walls narrower than the smallest pieces can do.  Costs the
    assembly of `_SAMPLE` rows of one frequency, once for a surface.
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


def _sampled(surface: Surface, fidelity: AcousticsFidelity, rules: AcousticsFidelity) -> tuple[IntArray, IntArray]:
    """Vertices of suspect triangles, and those of them that stand for all."""
    aspect = surface.longest_edges**2 / (2.0 * surface.areas)
    suspect = aspect > fidelity.needle_aspect
    narrow = unresolved_gap(rules)
    suspect[facing_pairs(surface, neighbours(surface, narrow), narrow).pairs.ravel()] = True
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
    return np.asarray(a @ values - b @ slopes - exact[rows])


def unresolved_gap(fidelity: AcousticsFidelity) -> float:
    """Gap in longest edges below which the smallest pieces of triangles are still too near to each other."""
    return fidelity.gap_ratio * 0.5**fidelity.gap_halvings


@lru_cache(maxsize=8)
def gap_cost(surface: Surface, fidelity: AcousticsFidelity) -> tuple[int, float, float, float]:
    """(triangles, least width in edges, s of processor time per frequency, s that `suspect_error` takes once) of narrow
    gaps and thin walls."""
    facing = facing_pairs(surface, neighbours(surface, _WIDE), _WIDE)
    width = np.full(len(surface.triangles), np.inf)
    for side in facing.pairs.T:
        np.minimum.at(width, side, facing.ratio)
    narrow = width < _WIDE
    seconds = np.where(narrow, _SECONDS / np.maximum(width, unresolved_gap(fidelity)) ** 2, 0.0)
    tested = np.isin(surface.triangles, _sampled(surface, fidelity, fidelity)[1]).any(axis=1)
    return int(narrow.sum()), float(width.min()), float(seconds.sum()), float(seconds[tested].sum())


def _weights(surface: Surface) -> FloatArray:
    """Area (n_v,) m² that belongs to every vertex."""
    weight = np.zeros(len(surface.vertices))
    np.add.at(weight, surface.triangles.ravel(), np.repeat(surface.areas / 3.0, 3))
    return weight


def _wavenumber(surface: Surface) -> float:
    return _STATIC / float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
