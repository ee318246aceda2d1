"""Points inside a mesh of 20-node bricks: which brick holds them, and what its nodes say there."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.errors import InputError
from nvhchain.fem.elements import hex20_shape
from nvhchain.gear.mesh import SolidMesh
from nvhchain.handoff import FloatArray, IntArray

_CANDIDATES = 24
"""Bricks, by distance of their centres, among which that of a point is looked for."""

_NEWTON_STEPS = 12
"""For the place in a brick; from its middle four are usual."""

_OUTSIDE = 0.1
"""How far, in half bricks, a point on a drawn surface may miss the mesh, whose faces are parabolas."""


class ElementSearch:
    """The bricks of `solid`, sorted for searching."""

    def __init__(self, solid: SolidMesh) -> None:
        self._solid = solid
        self._tree = cKDTree(solid.nodes[solid.elements].mean(axis=1))

    def find(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """(n,) brick that holds each of `points` (n, 3) m, and (n, 3) its place in it, −1 … 1.

        Raises InputError for a point outside the mesh.
        """
        points = np.asarray(points, float)
        candidates = self._tree.query(points, k=range(1, min(_CANDIDATES, self._tree.n) + 1))[1]
        best, place, element = np.full(len(points), np.inf), np.zeros((len(points), 3)), np.zeros(len(points), np.int64)
        for column in candidates.T:
            at = np.flatnonzero(best > 1.0)  # those not yet found inside a brick
            if not len(at):
                break
            xi = self._place(points[at], column[at])
            outside = np.abs(xi).max(axis=1)
            better = outside < best[at]
            kept = at[better]
            best[kept], place[kept], element[kept] = outside[better], xi[better], column[kept]
        worst = int(np.argmax(best))
        if best[worst] > 1 + _OUTSIDE:
            where = ", ".join(f"{1e3 * c:.4g}" for c in points[worst])
            raise InputError(
                f"the point ({where}) mm lies outside the tooth's mesh by {best[worst] - 1:.2g} of half an element: "
                "raise the refinement of the mesh or move the point"
            )
        return element, np.clip(place, -1.0, 1.0)

    def _place(self, points: FloatArray, element: IntArray) -> FloatArray:
        """Newton for x(ξ) = point in one brick per point."""
        corners = self._solid.nodes[self._solid.elements[element]]
        xi = np.zeros((len(points), 3))
        for _ in range(_NEWTON_STEPS):
            shape, gradient = hex20_shape(xi)
            miss = points - np.einsum("pn,pna->pa", shape, corners)
            jacobian = np.einsum("pna,pnb->pab", corners, gradient)
            xi = np.clip(xi + np.linalg.solve(jacobian, miss[..., None])[..., 0], -2.0, 2.0)
        return xi

    def interpolation(self, points: FloatArray, angle: FloatArray) -> sp.csr_matrix:
        """(3 n, unknowns of the mesh): displacement at `points` (n, 3) m, both in cylindrical axes.

        angle: (n,) rad, of the axes at the points.
        """
        element, xi = self.find(points)
        shape, nodes = hex20_shape(xi)[0], self._solid.elements[element]
        turn = self._solid.angle[nodes] - angle[:, None]
        c, s, zero, one = np.cos(turn), np.sin(turn), np.zeros(turn.shape), np.ones(turn.shape)
        axes = np.stack([np.stack(row, axis=-1) for row in ((c, -s, zero), (s, c, zero), (zero, zero, one))], axis=-2)
        value = shape[..., None, None] * axes  # (n, 20, to, from)
        rows = np.broadcast_to(3 * np.arange(len(points))[:, None, None, None] + np.arange(3)[:, None], value.shape)
        columns = np.broadcast_to(3 * nodes[..., None, None] + np.arange(3), value.shape)
        size = (3 * len(points), 3 * len(self._solid.nodes))
        return sp.csr_matrix((value.ravel(), (rows.ravel(), columns.ravel())), shape=size)
