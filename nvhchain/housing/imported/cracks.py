"""Openings in an imported mesh of one body: coincident nodes, and faces divided differently on both sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nvhchain.fem.faces import boundary_rows, element_faces, flat_triangles, six_node_facets
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fem.triangles import lying_on
from nvhchain.handoff import FloatArray, IntArray

COINCIDENT = 1e-4
"""Largest distance of two nodes at the same place, over the mean edge; files round to seven digits of the extent."""

_SKIN_TOLERANCE = 1e-3
"""Largest distance between the middle of a flat facet and a facet that it lies on, over the latter's size."""

_CURVED = 1.25
"""Largest distance between two facets on one arc, over the sum of their chords' distances from the arc."""

_FACING, _SMOOTH = np.radians(8.0), np.radians(35.0)
"""Largest angles between flat facets that face one another, and between neighbours on a round face (else an edge)."""

_WALL = 1.5
"""Largest depth of an element over the distance of the facet behind it that makes it a wall between both."""


def cracks(model: SolidModel, edge: float) -> list[str]:
    """Return warnings of coincident nodes that no rigid set joins; `edge` is the mean edge (m)."""
    pairs = _coincident(model.nodes, edge)
    for rigid in model.rigid_sets:
        pairs = pairs[~np.isin(pairs, rigid.nodes).all(axis=1)]
    if not len(pairs):
        return []
    one, other = pairs[np.lexsort(pairs.T[::-1])[0]]
    place = ", ".join(f"{1e3 * x:.4g}" for x in model.nodes[one])
    return [
        f"{len(pairs)} pairs of nodes coincide, first {model.labels[one]} and {model.labels[other]} at ({place}) mm: "
        "the mesh is open there as by a crack; merge them in the preprocessor, unless it is to be open"
    ]


def open_joints(model: SolidModel, edge: float) -> list[str]:
    """Return warnings where the skin of a quadratic model lies on facing skin and no rigid set holds it.

    Meshes that divide a common face differently, or hang their nodes on it, are joined by their common nodes alone.
    Faces that differ only by coincident nodes are excluded, as `cracks` reports them. `edge` is the mean edge (m).
    """
    faces, owner = element_faces([(block.shape, block.nodes) for block in model.blocks])
    outside = boundary_rows(faces, model.labels, model.source)
    told = _same(faces[outside, :4], _coincident(model.nodes, edge), len(model.nodes))
    nodes, triangles, face = _triangles(model.nodes, faces[outside])
    rigid = np.ones(len(model.nodes) + 1, dtype=bool)  # index −1, without a fourth corner, is the last
    rigid[:-1] = np.isin(np.arange(len(model.nodes)), np.concatenate([[], *(one.nodes for one in model.rigid_sets)]))
    corners = nodes[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    loose = np.asarray(~rigid[faces[outside, :4]].all(axis=1))
    free = np.flatnonzero(loose[face] & (twice > 0))
    triangles, corners, face, twice = triangles[free], corners[free], face[free], twice[free]
    normal, centre = cross[free] / twice[:, None], corners.mean(axis=1)
    bend, sag = _curvature(triangles, corners, normal)
    size = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    one, other = lying_on(centre, corners, np.maximum(_SKIN_TOLERANCE, 2 * _CURVED * sag / size)).T
    # chords of one arc lie apart by the sum of their distances from the arc
    round_ = np.where(np.minimum(sag[one], sag[other]) > 0, _CURVED * (sag[one] + sag[other]), 0.0)
    above = np.einsum("ka,ka->k", centre[one] - centre[other], normal[other])
    angle = np.arccos(-np.einsum("ka,ka->k", normal[one], normal[other]).clip(-1, 1))
    touching = np.flatnonzero(
        (angle < _FACING + (bend[one] + bend[other]) / 2)
        & (np.abs(above) < np.maximum(_SKIN_TOLERANCE * size[other], round_))
    )
    flat = np.abs(above[touching]) < _SKIN_TOLERANCE * size[other[touching]]
    element, facing = (owner[outside[face[side[touching]]]] for side in (one, other))
    facets = one[touching]
    # a wall is at least as thick as the element behind its skin; facets that meet at an edge of the body diverge
    wall = _depth(model.nodes, faces, owner, element, centre[facets], normal[facets]) < -_WALL * above[touching]
    wall[_joined(faces[:, :4], owner, element, facing)] = True
    # in a round joint the coarser facets' middles may be further from the finer facets than these are from the arc
    found = np.unique(np.concatenate([facets[flat | ~wall], other[touching][~flat & ~wall]]))
    found = found[~told[face[found]]]
    if not len(found):
        return []
    place = ", ".join(f"{1e3 * x:.4g}" for x in centre[found[0]])
    return [
        f"{1e4 * twice[found].sum() / 2:.3g} cm² of the skin lie on skin that faces it, first at ({place}) mm: parts "
        "that divide a common face differently are joined by their common nodes alone; divide it alike, unless it is "
        "to be open"
    ]


def _triangles(nodes: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Return nodes with added face centres, flat triangles (k, 3) of faces (f, 8), and the face (k,) of each triangle.

    Each half of a curved face has four triangles.
    """
    facets, centres = six_node_facets(faces, len(nodes))
    nodes = np.vstack([nodes, centres @ nodes])
    four = np.flatnonzero(faces[:, 3] >= 0)
    face = np.concatenate([np.flatnonzero(faces[:, 3] < 0), four, four])
    ends = nodes[facets[:, :3]]
    bulge = np.linalg.norm(nodes[facets[:, 3:]] - (ends + np.roll(ends, -1, axis=1)) / 2, axis=2).max(axis=1)
    straight = bulge < _SKIN_TOLERANCE * np.linalg.norm(ends - np.roll(ends, -1, axis=1), axis=2).max(axis=1)
    facets[straight, 3:] = -1
    curved = np.flatnonzero(~straight)
    return nodes, flat_triangles(facets), face[np.concatenate([np.flatnonzero(straight), *[curved] * 4])]


def _coincident(nodes: FloatArray, edge: float) -> IntArray:
    """Return pairs (q, 2) of nodes at the same place."""
    return np.asarray(cKDTree(nodes).query_pairs(COINCIDENT * edge, output_type="ndarray"))


def _same(corners: IntArray, pairs: IntArray, count: int) -> IntArray:
    """Return faces (f,) bool with the corners (f, 4) of another, once `pairs` (q, 2) of `count` nodes are merged."""
    link = sp.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    merged = np.append(connected_components(link, directed=False)[1], -1)[corners]
    _, which, sides = np.unique(np.sort(merged, axis=1), axis=0, return_inverse=True, return_counts=True)
    return np.asarray(sides[which.ravel()] > 1)


def _curvature(facets: IntArray, corners: FloatArray, normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest angle (k,) rad from a facet to a neighbour, and the distance (m) of the arc from the facet.

    facets : (k, 3) nodes. Neighbours at more than `_SMOOTH` lie beyond an edge of the body.
    """
    ends = facets[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, edge, sides = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.ravel()
    order = np.argsort(edge, kind="stable")
    pair = order[sides[edge[order]] == 2].reshape(-1, 2)
    angle = np.arccos(np.einsum("ka,ka->k", *(normal[side] for side in (pair // 3).T)).clip(-1, 1))
    angle[angle > _SMOOTH] = 0.0
    edge_angle = np.zeros(3 * len(facets))
    edge_angle[pair] = angle[:, None]
    turned = edge_angle.reshape(-1, 3)
    length = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return turned.max(axis=1), (turned * area[:, None] / length).sum(axis=1) / 8


def _joined(corners: IntArray, owners: IntArray, first: IntArray, second: IntArray) -> IntArray:
    """Return indices of the pairs of elements that have a corner in common.

    corners : (f, 4) of all faces, with their elements `owners` (f,).
    """
    known = corners >= 0
    rows = np.repeat(owners, known.sum(axis=1))
    incidence = sp.csr_matrix((np.ones(len(rows)), (rows, corners[known])))
    common: IntArray = np.asarray(incidence[first].multiply(incidence[second]).sum(axis=1), dtype=np.int64).ravel()
    return np.flatnonzero(common)


def _depth(
    nodes: FloatArray, faces: IntArray, owners: IntArray, element: IntArray, place: FloatArray, normal: FloatArray
) -> FloatArray:
    """Return the depth (q,) m from places (q, 3) on the skin of elements (q,) along the inward normal to their ends.

    faces : (f, 8) of all elements, with their elements `owners` (f,).
    normal : (q, 3) outward normals.
    """
    order = np.argsort(owners, kind="stable")
    first, last = (np.searchsorted(owners[order], element, side=side) for side in ("left", "right"))
    count = last - first
    row = np.repeat(np.arange(len(element)), count)
    which = order[np.arange(len(row)) + np.repeat(first - np.cumsum(count) + count, count)]
    corners = nodes[np.where(faces[which, :4] >= 0, faces[which, :4], faces[which, :1])]  # triangles repeat a corner
    face_normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    speed = -np.einsum("ka,ka->k", face_normal, normal[row])
    ahead = speed > 1e-9 * np.linalg.norm(face_normal, axis=1)
    away = np.einsum("ka,ka->k", corners[:, :3].mean(axis=1) - place[row], face_normal)
    found = np.full(len(element), np.inf)
    np.minimum.at(found, row[ahead], away[ahead] / speed[ahead])
    return found
