"""15-node serendipity wedge: triangle (r, s) times height t in −1 … 1.

The corners below come first, then those above, then the mid-edge nodes. Shape functions as in Zienkiewicz & Taylor, The
Finite Element Method, vol. 1, ch. 8 (triangular prisms).
"""

from __future__ import annotations

import numpy as np

from nvhchain.fem.quadrature import triangle_rule
from nvhchain.handoff import FloatArray


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
