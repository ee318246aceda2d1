"""Quadratic quadrilaterals in the transverse plane, in polar coordinates about the shaft."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nvhchain.handoff import FloatArray, IntArray

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PlaneMesh:
    """Mesh of 8-node quadrilaterals: corner nodes first, then one node on every edge.

    radius, angle : (n,) positions (m, rad).
    corners : number of corner nodes.
    quads : (m, 8) nodes, counter-clockwise: corners, then the nodes between corners 01, 12, 23, 30.
    edges : (n − corners, 2) corner nodes of each edge, the smaller first, in order.
    """

    radius: FloatArray
    angle: FloatArray
    corners: int
    quads: IntArray
    edges: IntArray

    def edge_nodes(self, first: IntArray, second: IntArray) -> IntArray:
        """Return the nodes on the edges that join corners `first` and `second`."""
        key = self.edges[:, 0] * self.corners + self.edges[:, 1]
        wanted = np.minimum(first, second) * self.corners + np.maximum(first, second)
        return self.corners + np.searchsorted(key, wanted)

    def chain(self, corners: IntArray) -> IntArray:
        """Return the nodes along a line of `corners`, edge nodes included."""
        corners = np.asarray(corners)
        line = np.empty(2 * len(corners) - 1, dtype=np.int64)
        line[::2], line[1::2] = corners, self.edge_nodes(corners[:-1], corners[1:])
        return line


@dataclass(frozen=True, eq=False)
class Curve:
    """Line of corner nodes whose edge nodes lie on a curve.

    corners : (n,) corner nodes.
    radius, angle : (n − 1,) positions of the edge nodes (m, rad).
    """

    corners: IntArray
    radius: FloatArray
    angle: FloatArray


def quadratic_mesh(radius: FloatArray, angle: FloatArray, quads: IntArray, curves: tuple[Curve, ...]) -> PlaneMesh:
    """Add edge nodes to quadrilaterals: on the given curves, else half-way in radius and in angle (the short way).

    radius, angle: (n,) of the corner nodes, all in use.  quads: (m, 4) counter-clockwise.
    """
    n = len(radius)
    ends = np.sort(quads[:, [0, 1, 1, 2, 2, 3, 3, 0]].reshape(-1, 2), axis=1)
    key, where = np.unique(ends[:, 0] * n + ends[:, 1], return_inverse=True)
    edges = np.column_stack([key // n, key % n])
    turn = np.remainder(angle[edges[:, 1]] - angle[edges[:, 0]] + np.pi, 2 * np.pi) - np.pi
    edge_radius, edge_angle = radius[edges].mean(axis=1), angle[edges[:, 0]] + 0.5 * turn
    for curve in curves:
        a, b = curve.corners[:-1], curve.corners[1:]
        at = np.searchsorted(key, np.minimum(a, b) * n + np.maximum(a, b))
        edge_radius[at], edge_angle[at] = curve.radius, curve.angle
    return PlaneMesh(
        radius=np.concatenate([radius, edge_radius]),
        angle=np.concatenate([angle, edge_angle]),
        corners=n,
        quads=np.hstack([quads, n + where.reshape(-1, 4)]),
        edges=edges,
    )


def grid_quads(nodes: IntArray) -> IntArray:
    """Return the quadrilaterals (m, 4) of a grid of corner nodes.

    Rows run from inside outwards, columns counter-clockwise.
    """
    inner, outer = nodes[:-1], nodes[1:]
    return np.stack([inner[:, :-1], outer[:, :-1], outer[:, 1:], inner[:, 1:]], axis=-1).reshape(-1, 4)
