"""Connection of the elements of an imported mesh to one body, by common faces and by rigid sets.

Bodies with only a common edge or node turn about it without resistance, and no element reports this. Such a structure
is a mechanism and moves as no casting does.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nvhchain.errors import InputError
from nvhchain.fem.faces import element_faces
from nvhchain.fem.solid_model import SolidModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.imported.cracks import COINCIDENT

_LINE = 1e-4
"""Width of a set of nodes over its length, below which they lie on a line; files round to seven digits."""

_NAMED = 6
"""Number of nodes of a joint in the message."""


def are_collinear(points: FloatArray) -> bool:
    """Return True if points (n, 3) m lie on a line, about which the parts that they join can turn."""
    if len(points) < 3:
        return True
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] <= _LINE * spread[0])


def check_joints(model: SolidModel, edge: float) -> None:
    """Raise InputError unless all elements of a quadratic model are one body; `edge` is the mean edge (m)."""
    faces, owner = element_faces([(block.shape, block.nodes) for block in model.blocks])
    corners = faces[:, :4]
    body = _face_bodies(corners, owner, model.elements)
    bodies = int(body.max()) + 1
    if bodies == 1:
        return
    corner_of = _incidence(corners, body[owner], len(model.nodes), bodies)
    pairs = [*_face_on_face(corners, body[owner], corner_of), *_rigid_set_pairs(model, corner_of)]
    count = bodies + len(model.rigid_sets)
    part = _components(np.array(pairs, dtype=np.int64).reshape(-1, 2), count)[:bodies]
    names, part = np.unique(part, return_inverse=True)
    if len(names) == 1:
        return
    sizes = np.bincount(part[body], minlength=len(names))
    listed = ", ".join(map(str, np.sort(sizes)[::-1][:6]))
    remedy = _remedy(model, corner_of, part, edge)
    raise InputError(f"{model.source}: the mesh is in {len(names)} parts of {listed} elements: {remedy}")


def _face_bodies(corners: IntArray, owner: IntArray, elements: int) -> IntArray:
    """Return the body (m,) of every element: elements with a common face belong to one body."""
    order = np.lexsort(np.sort(corners, axis=1).T)
    key = np.sort(corners, axis=1)[order]
    same = (key[1:] == key[:-1]).all(axis=1)
    return _components(np.column_stack([owner[order[:-1]][same], owner[order[1:]][same]]), elements)


def _components(pairs: IntArray, count: int) -> IntArray:
    link = sp.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(link, directed=False)[1], dtype=np.int64)


def _incidence(corners: IntArray, body: IntArray, nodes: int, bodies: int) -> sp.csr_matrix:
    """Return a matrix (n, bodies) with one where a node is a corner of a body."""
    known = corners >= 0
    columns = np.repeat(body, known.sum(axis=1))
    found = sp.csr_matrix((np.ones(len(columns)), (corners[known], columns)), shape=(nodes, bodies))
    found.data[:] = 1.0
    return found


def _face_on_face(corners: IntArray, body: IntArray, corner_of: sp.csr_matrix) -> list[tuple[int, int]]:
    """Return pairs of bodies: one has a face with all corners in the other, which may divide it differently."""
    common = np.flatnonzero(np.diff(corner_of.indptr) > 1)
    near = np.isin(corners, common) | (corners < 0)
    corners, body = corners[near.all(axis=1)], body[near.all(axis=1)]
    known = corners >= 0
    rows = np.repeat(np.arange(len(corners)), known.sum(axis=1))
    pick = sp.csr_matrix((np.ones(len(rows)), (rows, corners[known])), shape=(len(corners), corner_of.shape[0]))
    hit = sp.coo_matrix(pick @ corner_of)
    whole = (hit.data == known.sum(axis=1)[hit.row]) & (hit.col != body[hit.row])
    return list(zip(body[hit.row[whole]].tolist(), hit.col[whole].tolist(), strict=True))


def _rigid_set_pairs(model: SolidModel, corner_of: sp.csr_matrix) -> list[tuple[int, int]]:
    """Return pairs of a body and a rigid set that holds nodes of it off a line; sets are counted after the bodies."""
    pairs = []
    for number, rigid in enumerate(model.rigid_sets, corner_of.shape[1]):
        members = sp.csc_matrix(corner_of[rigid.nodes])
        for body in np.flatnonzero(np.diff(members.indptr)):
            inside = rigid.nodes[members.indices[members.indptr[body] : members.indptr[body + 1]]]
            if not are_collinear(model.nodes[inside]):
                pairs.append((int(body), number))
    return pairs


def _remedy(model: SolidModel, corner_of: sp.csr_matrix, part: IntArray, edge: float) -> str:
    """Return the remedy, by the nodes that the parts share or that coincide."""
    gather = sp.csr_matrix((np.ones(len(part)), (np.arange(len(part)), part)))
    part_of = sp.csr_matrix(corner_of @ gather)
    shared = np.flatnonzero(np.diff(part_of.indptr) > 1)
    if len(shared):
        labels = ", ".join(map(str, np.sort(model.labels[shared])[:_NAMED]))
        more = " …" if len(shared) > _NAMED else ""
        return (
            f"they hang together by an edge or a node only, at nodes {labels}{more}, about which they turn: connect "
            "them by common faces or an RBE2, or remove the loose ones"
        )
    used = np.flatnonzero(np.diff(part_of.indptr))
    owner = part_of.indices[part_of.indptr[used]]
    close = cKDTree(model.nodes[used]).query_pairs(COINCIDENT * edge, output_type="ndarray")
    apart = int((owner[close[:, 0]] != owner[close[:, 1]]).sum())
    if apart:
        return f"{apart} pairs of corners of different parts coincide: merge them in the preprocessor"
    return "connect them by common faces or an RBE2, or remove the loose ones"
