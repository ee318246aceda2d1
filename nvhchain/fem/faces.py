"""Faces of solids and shells as six-node triangles: corners counter-clockwise, then the middles of their edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import counted, require
from nvhchain.fem.solid_model import CORNERS, EDGES, FACES
from nvhchain.handoff import IntArray

_QUARTERS = ((0, 3, 5), (1, 4, 3), (2, 5, 4), (3, 4, 5))


def element_faces(elements: Sequence[tuple[str, IntArray]]) -> tuple[IntArray, IntArray]:
    """Return all faces (f, 8) of elements, and the index (f,) of the element of each, numbered through.

    elements : pairs of shape and (m, nodes) node numbers: corners, then the mid-edge nodes in the order of `EDGES`, −1
        for a missing one.

    A face has four corners, −1 for the fourth of a triangle. The middles of the edges after them follow, −1 likewise.
    """
    faces, owners = [], []
    start = 0
    for shape, members in elements:
        edges = [frozenset(edge) for edge in EDGES[shape]]
        for face in FACES[shape]:
            middles = [
                CORNERS[shape] + edges.index(frozenset((a, face[i - len(face) + 1]))) for i, a in enumerate(face)
            ]
            table = np.full((len(members), 8), -1)
            table[:, : len(face)] = members[:, list(face)]
            table[:, 4 : 4 + len(face)] = members[:, middles]
            faces.append(table)
            owners.append(np.arange(start, start + len(members)))
        start += len(members)
    return np.concatenate(faces), np.concatenate(owners)


def boundary_faces(elements: Sequence[tuple[str, IntArray]], labels: IntArray, subject: str) -> IntArray:
    """Return the outward faces (f, 8) of one element only, laid out as by `element_faces`.

    labels : labels of the nodes.
    subject : name of the structure in the message.

    Raises InputError for a face of more than two elements, which overlap.
    """
    faces, _ = element_faces(elements)
    return np.asarray(faces[boundary_rows(faces, labels, subject)])


def boundary_rows(faces: IntArray, labels: IntArray, subject: str) -> IntArray:
    """Return the rows, rising, of the faces (f, 8) that belong to one element only; raises as `boundary_faces`."""
    key = np.sort(faces[:, :4], axis=1)
    _, first, sides = np.unique(key, axis=0, return_index=True, return_counts=True)
    require(
        bool((sides <= 2).all()),
        f"{subject}: {counted(int((sides > 2).sum()), 'face')} shared by more than two elements, first at nodes "
        f"{labels[key[first[sides > 2]][:1, 1:]].ravel()}: elements overlap; remove those that are twice",
    )
    return np.sort(first[sides == 1])


def six_node_facets(faces: IntArray, count: int) -> tuple[IntArray, sp.csr_matrix]:
    """Return facets (k, 6) of faces (f, 8), laid out as by `element_faces`, and the nodes added in their middles.

    count : number of nodes so far.

    A triangle is one facet. Four corners make two facets, whose common edge has a new node in the middle if the face
    has the middles of its edges. Facets of faces that lack one have −1 for all three. The second result (q, count) maps
    values at the nodes so far to values at the new nodes, numbered from `count`.
    """
    three = faces[:, 3] < 0
    whole = (faces[:, 4:] >= 0).sum(axis=1) == np.where(three, 3, 4)
    c, m = faces[~three, :4], faces[~three, 4:]
    curved = whole[~three]
    centre = np.full(len(c), -1)
    centre[curved] = count + np.arange(int(curved.sum()))
    facets = np.concatenate(
        [
            faces[three][:, [0, 1, 2, 4, 5, 6]],
            np.column_stack([c[:, 0], c[:, 1], c[:, 2], m[:, 0], m[:, 1], centre]),
            np.column_stack([c[:, 0], c[:, 2], c[:, 3], centre, m[:, 2], m[:, 3]]),
        ]
    )
    facets[~np.concatenate([whole[three], curved, curved]), 3:] = -1
    # the serendipity face at its centre: −¼ of each corner, ½ of each mid-edge node
    rows = np.repeat(np.arange(int(curved.sum())), 8)
    weight = np.tile([-0.25] * 4 + [0.5] * 4, int(curved.sum()))
    shape = (int(curved.sum()), count)
    return facets, sp.csr_matrix((weight, (rows, np.hstack([c, m])[curved].ravel())), shape=shape)


def flat_triangles(facets: IntArray) -> IntArray:
    """Return flat triangles (t, 3) that follow the curved edges of facets (k, 6): four each, or one without middles."""
    curved = facets[:, 3] >= 0
    return np.concatenate([facets[~curved, :3], *(facets[curved][:, list(cut)] for cut in _QUARTERS)])
