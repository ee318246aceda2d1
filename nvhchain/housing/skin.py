"""The skin of a mixed quadratic mesh as six-node facets; a brick's face becomes two by way of its centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import require
from nvhchain.fem.modal_model import face_triangles
from nvhchain.fem.solid_model import CORNERS, EDGES, FACES, SolidModel
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Skin:
    """Boundary of a solid.

    nodes: (n + q, 3) m, the nodes of the model, then the centres of four-cornered faces.  facets: (k, 6), corners
    counter-clockwise seen from outside, then mid-edge nodes.  interpolation: (n + q, n), values at `nodes` from those
    at the nodes of the model.
    """

    nodes: FloatArray
    facets: IntArray
    interpolation: sp.csr_matrix

    @property
    def triangles(self) -> IntArray:
        """Four flat triangles (4 k, 3) for every facet, which follow its curved edges."""
        none = np.full((len(self.facets), 1), -1)
        return face_triangles(np.hstack([self.facets[:, :3], none, self.facets[:, 3:], none]))

    def on_nodes(self, operator: sp.csr_matrix) -> sp.csr_matrix:
        """An operator (…, 3 (n + q)) on displacements of `nodes` as one (…, 3 n) on those of the model."""
        return sp.csr_matrix(operator @ sp.kron(self.interpolation, sp.identity(3)))


def solid_skin(model: SolidModel) -> Skin:
    """Faces that belong to one element only, of a model of quadratic elements; InputError where elements overlap."""
    count = len(model.nodes)
    corners, middles, _ = element_faces(model)
    key = np.sort(np.where(corners < 0, count, corners), axis=1)
    _, first, sides = np.unique(key, axis=0, return_index=True, return_counts=True)
    require(
        bool((sides <= 2).all()),
        f"{model.source}: {int((sides > 2).sum())} faces belong to more than two elements, first at nodes "
        f"{model.labels[key[first[sides > 2]][:1, :3]].ravel()}: elements overlap; remove those that are twice",
    )
    outer = np.sort(first[sides == 1])
    corners, middles = corners[outer], middles[outer]
    three = corners[:, 3] < 0
    triangles = np.hstack([corners[three, :3], middles[three, :3]])
    c, m = corners[~three], middles[~three]
    centre = count + np.arange(len(c))
    one = np.column_stack([c[:, 0], c[:, 1], c[:, 2], m[:, 0], m[:, 1], centre])
    other = np.column_stack([c[:, 0], c[:, 2], c[:, 3], centre, m[:, 2], m[:, 3]])
    # the serendipity face at its centre: −¼ of each corner, ½ of each mid-edge node
    rows = np.repeat(np.arange(len(c)), 8)
    weight = np.tile([-0.25] * 4 + [0.5] * 4, len(c))
    centres = sp.csr_matrix((weight, (rows, np.hstack([c, m]).ravel())), shape=(len(c), count))
    interpolation = sp.csr_matrix(sp.vstack([sp.identity(count), centres]))
    facets = np.concatenate([triangles, one, other])
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation)


def element_faces(model: SolidModel) -> tuple[IntArray, IntArray, IntArray]:
    """Of all faces of all elements corners and mid-edge nodes (f, 4), the fourth −1 on triangles, and element (f,).

    Elements count through the blocks; all are quadratic.
    """
    corners: list[IntArray] = []
    middles: list[IntArray] = []
    owners: list[IntArray] = []
    start = 0
    for block in model.blocks:
        edges = [frozenset(edge) for edge in EDGES[block.shape]]
        for face in FACES[block.shape]:
            around = [edges.index(frozenset((a, face[(i + 1) % len(face)]))) for i, a in enumerate(face)]
            for found, columns in ((corners, list(face)), (middles, [CORNERS[block.shape] + e for e in around])):
                table = np.full((len(block.nodes), 4), -1)
                table[:, : len(columns)] = block.nodes[:, columns]
                found.append(table)
            owners.append(np.arange(start, start + len(block.nodes)))
        start += len(block.nodes)
    return np.concatenate(corners), np.concatenate(middles), np.concatenate(owners)
