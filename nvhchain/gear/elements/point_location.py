"""Point location in a mesh of quadratic solids: the element that contains a point, and interpolation there."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.errors import InputError
from nvhchain.fem.elements import hex20_shape, tet10_shape
from nvhchain.gear.elements.gear_mesh import SolidMesh
from nvhchain.handoff import FloatArray, IntArray

_CANDIDATES = 24
"""Number of elements, nearest by their centres, that are tried for a point."""

_NEWTON_STEPS = 12
"""Newton steps for the place in an element; four usually suffice from its middle."""

_FACE_TOLERANCE = 1e-9
"""Rounding (half elements) by which a point on a face may lie outside and still be accepted at once."""

_SURFACE_TOLERANCE = 0.1
"""Distance (half elements) by which a point on a drawn surface may miss the mesh, whose faces are parabolas."""


class ElementSearch:
    """Elements arranged for the search of points.

    nodes : (n, 3) positions (m).
    elements : node numbers.
    kind : {'hex20', 'tet10'} kind of element.
    """

    def __init__(self, nodes: FloatArray, elements: IntArray, kind: str = "hex20") -> None:
        self._nodes, self._elements, self._brick = nodes, elements, kind == "hex20"
        self._functions = hex20_shape if self._brick else tet10_shape
        self._tree = cKDTree(nodes[elements].mean(axis=1))

    def shape(self, place: FloatArray) -> FloatArray:
        """Return the shape functions (p, k) at places (p, 3) in the reference element."""
        return self._functions(place)[0]

    def find(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the element (n,) that contains each of `points` (n, 3) in m, and its place (n, 3) in that element.

        InputError if a point lies outside the mesh.
        """
        points = np.asarray(points, float)
        candidates = self._tree.query(points, k=range(1, min(_CANDIDATES, self._tree.n) + 1))[1]
        best, place, element = np.full(len(points), np.inf), np.zeros((len(points), 3)), np.zeros(len(points), np.int64)
        for column in candidates.T:
            unlocated = np.flatnonzero(best > _FACE_TOLERANCE)  # points not yet located
            if not len(unlocated):
                break
            xi = self._place(points[unlocated], column[unlocated])
            outside = self._excess(xi)
            better = outside < best[unlocated]
            kept = unlocated[better]
            best[kept], place[kept], element[kept] = outside[better], xi[better], column[kept]
        worst = int(np.argmax(best))
        if best[worst] > _SURFACE_TOLERANCE:
            where = ", ".join(f"{1e3 * c:.4g}" for c in points[worst])
            raise InputError(
                f"the point ({where}) mm lies outside the mesh by {best[worst]:.2g} of half an element: "
                "raise the refinement of the mesh or move the point"
            )
        if self._brick:
            return element, np.clip(place, -1.0, 1.0)
        share = np.clip(np.column_stack([1 - place.sum(axis=1), place]), 0.0, None)
        return element, share[:, 1:] / share.sum(axis=1, keepdims=True)

    def _excess(self, place: FloatArray) -> FloatArray:
        """Return the distance (half elements) by which places lie outside; negative inside."""
        if self._brick:
            return np.asarray(np.abs(place).max(axis=1) - 1.0)
        return np.asarray(2 * np.maximum(-place.min(axis=1), place.sum(axis=1) - 1.0))

    def _place(self, points: FloatArray, element: IntArray) -> FloatArray:
        """Solve x(ξ) = point by Newton's method, in one element per point."""
        corners = self._nodes[self._elements[element]]
        xi = np.full((len(points), 3), 0.0 if self._brick else 0.25)
        for _ in range(_NEWTON_STEPS):
            shape, gradient = self._functions(xi)
            miss = points - np.einsum("pn,pna->pa", shape, corners)
            jacobian = np.einsum("pna,pnb->pab", corners, gradient)
            xi = np.clip(xi + np.linalg.solve(jacobian, miss[..., None])[..., 0], -2.0, 2.0)
        return xi


def interpolation(solid: SolidMesh, points: FloatArray, angle: FloatArray) -> sp.csr_matrix:
    """Return the matrix (3 n, unknowns of the mesh) to displacements at `points` (n, 3) in m.

    Both are in cylindrical axes.  angle: (n,) rad, of the axes at the points.
    """
    search = ElementSearch(solid.nodes, solid.elements)
    element, xi = search.find(points)
    nodes = solid.elements[element]
    row = np.repeat(np.arange(len(points)), nodes.shape[1])
    turn = (solid.angle[nodes] - angle[:, None]).ravel()
    return weighted_displacement((row, nodes.ravel()), search.shape(xi).ravel(), turn, (len(points), len(solid.nodes)))


def weighted_displacement(
    places: tuple[IntArray, IntArray], weight: FloatArray, turn: FloatArray, shape: tuple[int, int]
) -> sp.csr_matrix:
    """Return the matrix to sums of displacements, in the cylindrical axes of points, from those of nodes.

    places: point (m,) and node (m,) of each part of a sum.
    weight (m,): weight of the part.
    turn (m,): angle of the node less that of the point (rad).
    shape: number of points and of nodes.
    """
    point, node = places
    c, s, zero, one = np.cos(turn), np.sin(turn), np.zeros(turn.shape), np.ones(turn.shape)
    axes = np.stack([np.stack(row, axis=-1) for row in ((c, -s, zero), (s, c, zero), (zero, zero, one))], axis=-2)
    value = weight[:, None, None] * axes  # (m, to, from)
    rows = np.broadcast_to(3 * point[:, None, None] + np.arange(3)[:, None], value.shape)
    columns = np.broadcast_to(3 * node[:, None, None] + np.arange(3), value.shape)
    size = (3 * shape[0], 3 * shape[1])
    return sp.csr_matrix((value.ravel(), (rows.ravel(), columns.ravel())), shape=size)
