"""Skin of a mixed mesh as six-node facets; a face with four corners is divided into two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.fem.faces import boundary_faces, flat_triangles, six_node_facets
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fem.structural.model import ShellBlock
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.skin.shell_sides import distinct, outward_sides


@dataclass(frozen=True, eq=False)
class Skin:
    """Boundary of a solid.

    nodes: (n + q, 3) nodes of the model, then the centres of four-cornered faces (m).
    facets: (k, 6) corners counter-clockwise seen from outside, then mid-edge nodes.
    interpolation: (n + q, n) values at `nodes` from those at the nodes of the model.
    sheets: (k,) bool, or one for all, facets of shells, without known material behind them.
    depth: (k,) or one for all, distance from the nodes to the air in front of the facets of shells (m).
    """

    nodes: FloatArray
    facets: IntArray
    interpolation: sp.csr_matrix
    sheets: IntArray | bool = False
    depth: FloatArray | float = 0.0

    @property
    def triangles(self) -> IntArray:
        """Four flat triangles (4 k, 3) per facet, which follow its curved edges."""
        return flat_triangles(self.facets)

    def restrict(self, operator: sp.csr_matrix) -> sp.csr_matrix:
        """Return an operator (…, 3 (n + q)) on displacements of `nodes` as one (…, 3 n) on those of the model."""
        return sp.csr_matrix(operator @ sp.kron(self.interpolation, sp.identity(3)))


def model_skin(model: SolidModel) -> tuple[Skin, IntArray]:
    """Return the skin of solids and shells, and its facets (k,) bool that are one of the two sides of a shell.

    Facets of shells lie at their nodes and state their depth. Closed shells have one side, the outer one. The second
    sides of open ones come last. Shells on faces of solids move with these and are excluded.
    """
    solid = solid_skin(model) if model.blocks else _no_skin(model)
    if not model.structure.shells:
        return solid, np.zeros(len(solid.facets), dtype=bool)
    flat = np.concatenate(
        [np.pad(block.nodes, ((0, 0), (0, 8 - block.nodes.shape[1])), constant_values=-1) for block in
         model.structure.shells]
    )  # fmt: skip
    if model.blocks:
        covered = {tuple(row) for row in np.sort(_outer_faces(model)[:, :4], axis=1).tolist()}
        flat = flat[[tuple(row) not in covered for row in np.sort(flat[:, :4], axis=1).tolist()]]
    sheets, shells = outward_sides(model.nodes, distinct(six_node_facets(flat, len(model.nodes))[0], []))
    middled, halves = add_middles(sheets, len(solid.nodes))
    known = sp.csr_matrix(halves @ solid.interpolation) if halves.shape[0] else halves
    interpolation = sp.csr_matrix(sp.vstack([solid.interpolation, known]))
    facets = np.concatenate([solid.facets, middled])
    is_sheet: IntArray = np.repeat([False, True], [len(solid.facets), len(sheets)])
    sides = np.concatenate([np.zeros(len(solid.facets), dtype=bool), shells])
    depth = np.concatenate([np.zeros(len(solid.facets)), _depths(model.nodes, sheets[:, :3], model.structure.shells)])
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation, is_sheet, depth), sides


_THREE_OF_FOUR = [(0, 1, 2), (1, 2, 3), (2, 3, 0), (3, 0, 1)]


def _depths(nodes: FloatArray, facets: IntArray, shells: Sequence[ShellBlock]) -> FloatArray:
    """Return the distances (k,) m from the nodes of facets to the face of the shell on the facet's side.

    nodes : (n, 3) m.
    facets : (k, 3) or more, outward sides of shells.

    Half the thickness, and the offset of the section in or against the direction of the facet. 0 for facets that are of
    no shell.
    """
    corners, half, offset = [], [], []
    for block in shells:
        for cut in _THREE_OF_FOUR if block.nodes.shape[1] == 4 else [(0, 1, 2)]:
            corners.append(block.nodes[:, list(cut)])
            half.append(block.thickness / 2)
            offset.append(block.offset)
    known, own = np.concatenate(corners), facets[:, :3]
    _, place = np.unique(np.sort(np.concatenate([known, own]), axis=1), axis=0, return_inverse=True)
    place = place.ravel()
    row = np.full(int(place.max(initial=-1)) + 1, -1)
    row[place[: len(known)]] = np.arange(len(known))
    row = row[place[len(known) :]]
    alike = np.sign((_normals(nodes, known)[row] * _normals(nodes, own)).sum(axis=1))
    depths = np.concatenate(half)[row] + np.concatenate(offset)[row] * alike
    return np.where(row < 0, 0.0, depths)


def _normals(nodes: FloatArray, triangles: IntArray) -> FloatArray:
    a, b, c = nodes[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def _no_skin(model: SolidModel) -> Skin:
    count = len(model.nodes)
    return Skin(model.nodes, np.zeros((0, 6), dtype=np.int64), sp.csr_matrix(sp.identity(count)))


def add_middles(facets: IntArray, count: int) -> tuple[IntArray, sp.csr_matrix]:
    """Return facets (k, 6) with new nodes, numbered from `count`, in the middles of straight edges, and their halves.

    The second result (q, count) maps values at the nodes so far to values at the new nodes.
    """
    facets = facets.copy()
    straight = facets[:, 3] < 0
    edges = np.sort(facets[straight][:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    ends, slot = np.unique(edges, axis=0, return_inverse=True)
    facets[straight, 3:] = count + slot.reshape(-1, 3)
    rows = np.repeat(np.arange(len(ends)), 2)
    return facets, sp.csr_matrix((np.full(len(rows), 0.5), (rows, ends.ravel())), shape=(len(ends), count))


def solid_skin(model: SolidModel) -> Skin:
    """Return the faces of a quadratic model that belong to one element only; InputError if elements overlap."""
    count = len(model.nodes)
    facets, centres = six_node_facets(_outer_faces(model), count)
    interpolation = sp.csr_matrix(sp.vstack([sp.identity(count), centres]))
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation)


def _outer_faces(model: SolidModel) -> IntArray:
    return boundary_faces([(block.shape, block.nodes) for block in model.blocks], model.labels, model.source)
