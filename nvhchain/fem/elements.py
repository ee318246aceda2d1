"""Quadratic reference elements: shape functions and quadrature of 10-node tetrahedron, 20-node brick, 15-node wedge.

Node order is that of VTK: corners first, then mid-edge nodes.

- tet10: corners 0…3; edges 01, 12, 02, 03, 13, 23.
- hex20: corners 0…3 below and 4…7 above, counter-clockwise; edges 01 12 23 30, 45 56 67 74, 04 15 26 37.
- wedge15: triangle (r, s) times height t in −1 … 1; corners 0…2 at t = −1 and 3…5 at t = +1; edges 01 12 20, 34 45 53,
  03 14 25. Shape functions as in Zienkiewicz & Taylor, The Finite Element Method, vol. 1, ch. 8.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from nvhchain.errors import InputError
from nvhchain.fem.quadrature import tetrahedron_rule, triangle_rule
from nvhchain.handoff import FloatArray

TET10_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
HEX20_EDGES = (
    (0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7),
)  # fmt: skip
HEX_CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    dtype=float,
)


@dataclass(frozen=True, eq=False)
class ReferenceElement:
    """Values at quadrature points; the mass needs a finer rule than the stiffness.

    gradient : (q, n, 3) ∂N/∂ξ.
    weight : (q,) weights.
    mass_shape, mass_gradient, mass_weight : (p, n), (p, n, 3) and (p,), the same with N for the mass.
    """

    nodes: int
    gradient: FloatArray
    weight: FloatArray
    mass_shape: FloatArray
    mass_gradient: FloatArray
    mass_weight: FloatArray


@cache
def reference_element(kind: str) -> ReferenceElement:
    """Return the tabulated element of `kind` `tet10`, `wedge15` or `hex20`."""
    if kind == "tet10":
        # straight-sided: strain energy is of degree 2, kinetic energy of degree 4. The 4-point rule is the usual
        # choice for curved elements as well; of the rules of degree 4 that with 14 points has no negative weights.
        return _tabulate(tet10_shape, _tetrahedron_rule(2), _tetrahedron_rule(4))
    if kind == "hex20":
        rule = _brick_rule(3)
        return _tabulate(hex20_shape, rule, rule)
    if kind == "wedge15":
        rule = wedge_rule(4, 3)
        return _tabulate(wedge15_shape, rule, rule)
    raise InputError(f"element kind {kind!r} is not known: use wedge15, tet10 or hex20")


_Rule = tuple[FloatArray, FloatArray]


def _tabulate(shape: Callable[[FloatArray], _Rule], rule: _Rule, mass_rule: _Rule) -> ReferenceElement:
    _, gradient = shape(rule[0])
    mass_shape, mass_gradient = shape(mass_rule[0])
    return ReferenceElement(mass_shape.shape[1], gradient, rule[1], mass_shape, mass_gradient, mass_rule[1])


def tet10_shape(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (q, 10) and gradients (q, 10, 3) at `points` (q, 3) of the unit tetrahedron."""
    points = np.asarray(points, dtype=float)
    L = np.column_stack([1 - points.sum(axis=1), points])
    dL = np.vstack([-np.ones(3), np.eye(3)])
    i, j = np.array(TET10_EDGES).T
    value = np.hstack([L * (2 * L - 1), 4 * L[:, i] * L[:, j]])
    corner = (4 * L - 1)[:, :, None] * dL
    edge = 4 * (L[:, i, None] * dL[j] + L[:, j, None] * dL[i])
    return value, np.concatenate([corner, edge], axis=1)


def hex20_shape(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return serendipity shape functions (q, 20) and gradients (q, 20, 3) at `points` (q, 3) of the cube −1 … 1."""
    points = np.asarray(points, dtype=float)
    value = np.empty((len(points), 20))
    gradient = np.empty((len(points), 20, 3))
    for node, c in enumerate(HEX_CORNERS):
        factor, reach = 1 + points * c, points @ c - 2
        value[:, node] = factor.prod(axis=1) * reach / 8
        for a in range(3):
            others = factor[:, (a + 1) % 3] * factor[:, (a + 2) % 3]
            gradient[:, node, a] = c[a] * others * (reach + factor[:, a]) / 8
    for node, (i, j) in enumerate(HEX20_EDGES, start=8):
        c = (HEX_CORNERS[i] + HEX_CORNERS[j]) / 2
        axis = int(np.flatnonzero(c == 0)[0])
        u, v = (axis + 1) % 3, (axis + 2) % 3
        bubble = 1 - points[:, axis] ** 2
        fu, fv = 1 + points[:, u] * c[u], 1 + points[:, v] * c[v]
        value[:, node] = bubble * fu * fv / 4
        gradient[:, node, axis] = -2 * points[:, axis] * fu * fv / 4
        gradient[:, node, u] = bubble * c[u] * fv / 4
        gradient[:, node, v] = bubble * fu * c[v] / 4
    return value, gradient


def _tetrahedron_rule(degree: int) -> _Rule:
    """Return points (q, 3) and weights (q,) of the unit tetrahedron, exact to `degree`."""
    points, weights = tetrahedron_rule(degree)
    return np.ascontiguousarray(points[1:].T), weights / 6.0


def _brick_rule(order: int) -> _Rule:
    """Return Gauss points (order³, 3) and weights of the cube −1 … 1."""
    x, w = np.polynomial.legendre.leggauss(order)
    grid = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
    return grid, weight


def wedge15_shape(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (q, 15) and gradients (q, 15, 3).

    points : (q, 3) r, s of the unit triangle, t in −1 … 1.

    Nodes: corners 0…2 at t = −1, 3…5 at t = +1; edges 01 12 20, 34 45 53, 03 14 25.
    """
    points = np.asarray(points, dtype=float)
    L = np.column_stack([1 - points[:, 0] - points[:, 1], points[:, 0], points[:, 1]])
    dL = np.array([[-1.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    t = points[:, 2]
    dt = np.array([0.0, 0.0, 1.0])
    value = np.empty((len(points), 15))
    gradient = np.empty((len(points), 15, 3))
    for node in range(6):
        i, sign = node % 3, -1.0 if node < 3 else 1.0
        above = 1 + sign * t
        value[:, node] = L[:, i] / 2 * ((2 * L[:, i] - 1) * above - (1 - t**2))
        gradient[:, node] = (
            0.5 * ((4 * L[:, i] - 1) * above - (1 - t**2))[:, None] * dL[i]
            + 0.5 * (L[:, i] * ((2 * L[:, i] - 1) * sign + 2 * t))[:, None] * dt
        )
    for edge in range(3):
        i, j = edge, (edge + 1) % 3
        for node, sign in ((6 + edge, -1.0), (9 + edge, 1.0)):
            above = 1 + sign * t
            value[:, node] = 2 * L[:, i] * L[:, j] * above
            gradient[:, node] = (
                2 * above[:, None] * (L[:, i, None] * dL[j] + L[:, j, None] * dL[i])
                + 2 * (L[:, i] * L[:, j] * sign)[:, None] * dt
            )
        value[:, 12 + edge] = L[:, edge] * (1 - t**2)
        gradient[:, 12 + edge] = (1 - t**2)[:, None] * dL[edge] - 2 * (L[:, edge] * t)[:, None] * dt
    return value, gradient


def wedge_rule(degree: int, order: int) -> tuple[FloatArray, FloatArray]:
    """Return points (q, 3) and weights (q,): a triangle rule exact to `degree` times `order` Gauss points along t."""
    plane, area = triangle_rule(degree)
    t, length = np.polynomial.legendre.leggauss(order)
    points = np.column_stack([np.repeat(plane[1:].T, order, axis=0), np.tile(t, len(area))])
    return points, (0.5 * area[:, None] * length).ravel()
