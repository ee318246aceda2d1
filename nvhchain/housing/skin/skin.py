"""Skin of a mixed quadratic mesh as six-node facets; a brick's face is divided into two by its centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.fem.faces import boundary_faces, flat_triangles, six_node_facets
from nvhchain.fem.solid_model import SolidModel
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Skin:
    """Boundary of a solid.

    Parameters
    ----------
    nodes : (n + q, 3) nodes of the model, then the centres of four-cornered faces (m).
    facets : (k, 6) corners counter-clockwise seen from outside, then mid-edge nodes.
    interpolation : (n + q, n) values at `nodes` from those at the nodes of the model.
    sheets : (k,) bool, or one for all, facets of shells, without known material behind them.
    """

    nodes: FloatArray
    facets: IntArray
    interpolation: sp.csr_matrix
    sheets: IntArray | bool = False

    @property
    def triangles(self) -> IntArray:
        """Four flat triangles (4 k, 3) per facet, which follow its curved edges."""
        return flat_triangles(self.facets)

    def restrict(self, operator: sp.csr_matrix) -> sp.csr_matrix:
        """Return an operator (…, 3 (n + q)) on displacements of `nodes` as one (…, 3 n) on those of the model."""
        return sp.csr_matrix(operator @ sp.kron(self.interpolation, sp.identity(3)))


def solid_skin(model: SolidModel) -> Skin:
    """Return the faces of a quadratic model that belong to one element only; InputError if elements overlap."""
    count = len(model.nodes)
    faces = boundary_faces([(block.shape, block.nodes) for block in model.blocks], model.labels, model.source)
    facets, centres = six_node_facets(faces, count)
    interpolation = sp.csr_matrix(sp.vstack([sp.identity(count), centres]))
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation)
