"""Quadrature over one triangle and over pairs of triangles that coincide, touch or are close.

Three barycentric coordinates define a point of a triangle; they are also the values of the three hats. The weights of
every rule sum to one. An integral is area (or area × area′) times the weighted sum.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from nvhchain.fem.quadrature import HIGHEST_DEGREE, triangle_rule
from nvhchain.handoff import ComplexArray, FloatArray, IntArray


class PairRule(NamedTuple):
    """Points and weights over triangle × triangle.

    first, second : (3, n) barycentric coordinates of the point on either triangle.
    weight : (n,) weights.
    """

    first: FloatArray
    second: FloatArray
    weight: FloatArray


@cache
def oscillation_error(degree: int, phase: float) -> float:
    """Return the RMS error of a triangle rule for the mean of a plane wave, over all directions.

    degree : degree of the rule.
    phase : wavenumber times edge of the equilateral triangle, rad.

    The effect of quadrature of well separated triangles on surface pressure is 0.4 to ten times this, as measured.
    """
    angle = np.arange(12) * (2.0 * np.pi / 36.0)
    height = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]]) @ np.array([np.cos(angle), np.sin(angle)])

    def mean(order: int) -> ComplexArray:
        points, weight = triangle_rule(order)
        return np.asarray(weight @ np.exp(1j * phase * (points.T @ height)))

    return float(np.sqrt(np.mean(np.abs(mean(degree) - mean(HIGHEST_DEGREE)) ** 2)))


def quadrature_order(least: int, phase: float, tolerance: float) -> int:
    """Return the lowest triangle order from `least` up whose `oscillation_error` is tolerable, else the highest."""
    orders = range(least, HIGHEST_DEGREE)
    return next((order for order in orders if oscillation_error(order, phase) <= tolerance), HIGHEST_DEGREE)


@cache
def product_rule(degree: int) -> PairRule:
    """Return triangle rule × triangle rule, for pairs that do not touch."""
    points, weight = triangle_rule(degree)
    n = len(weight)
    return PairRule(
        np.ascontiguousarray(np.repeat(points, n, axis=1)), np.tile(points, (1, n)), np.outer(weight, weight).ravel()
    )


@cache
def touching_rule(shared: int, order: int) -> PairRule:
    """Return a rule for two triangles that share `shared` (1, 2 or 3) vertices, listed first and in the same order.

    In its coordinates, the Jacobian cancels the 1/r singularity. Each of the four directions has `order` Gauss points.
    Source: S. Sauter, C. Schwab, Boundary Element Methods (Springer 2011), section 5.2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    xi, e1, e2, e3 = np.array(list(product(nodes, repeat=4))).T
    gauss = np.prod(np.array(list(product(weights, repeat=4))), axis=1)
    one = np.ones_like(xi)
    # Each region: first point, second point (before scaling by xi) and Jacobian, in the reference triangle
    # 0 ≤ x₂ ≤ x₁ ≤ 1 with vertices (0, 0), (1, 0), (1, 1).
    if shared == 3:
        jacobian = xi**3 * e1**2 * e2
        pairs = [
            ((one, 1 - e1 + e1 * e2), (1 - e1 * e2 * e3, 1 - e1)),
            ((one, e1 * (1 - e2 + e2 * e3)), (1 - e1 * e2, e1 * (1 - e2))),
            ((1 - e1 * e2 * e3, e1 * (1 - e2 * e3)), (one, e1 * (1 - e2))),
        ]
        regions = [(a, b, jacobian) for a, b in pairs] + [(b, a, jacobian) for a, b in pairs]
    elif shared == 2:
        corner = (1 - e1 * e2 * e3, e1 * e2 * (1 - e3))
        jacobian = xi**3 * e1**2 * e2
        regions = [
            ((one, e1 * e3), (1 - e1 * e2, e1 * (1 - e2)), xi**3 * e1**2),
            ((one, e1), corner, jacobian),
            ((1 - e1 * e2, e1 * (1 - e2)), (one, e1 * e2 * e3), jacobian),
            (corner, (one, e1), jacobian),
            ((1 - e1 * e2 * e3, e1 * (1 - e2 * e3)), (one, e1 * e2), jacobian),
        ]
    elif shared == 1:
        jacobian = xi**3 * e2
        regions = [((one, e1), (e2, e2 * e3), jacobian), ((e2, e2 * e3), (one, e1), jacobian)]
    else:
        raise ValueError(f"triangles share {shared} vertices, but a touching rule needs 1, 2 or 3")

    def barycentric(side: int) -> FloatArray:
        x1 = np.concatenate([xi * region[side][0] for region in regions])
        x2 = np.concatenate([xi * region[side][1] for region in regions])
        return np.stack([1.0 - x1, x1 - x2, x2])

    # The reference triangles have area ½ each.
    weight = np.concatenate([4.0 * gauss * region[2] for region in regions])
    return PairRule(barycentric(0), barycentric(1), weight)


def split_rules(rules: list[PairRule], size: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Cut rules into chunks of at most `size` points for the compiled loops.

    chunks : (n_chunk, 7, size) coordinates of both points, and weight.
    start : (n_rule + 1,) first chunk of every rule.
    width : (n_chunk,) points of every chunk.
    """
    parts, start = [], [0]
    for rule in rules:
        rows = np.vstack(rule)
        parts += [rows[:, i : i + size] for i in range(0, rows.shape[1], size)]
        start.append(len(parts))
    chunks = np.zeros((len(parts), 7, size))
    for chunk, part in zip(chunks, parts, strict=True):
        chunk[:, : part.shape[1]] = part
    return chunks, np.array(start), np.array([part.shape[1] for part in parts])
