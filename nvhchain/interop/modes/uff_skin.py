"""Skin of the elements of a universal file: its shells, or the boundary of its solids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import FileFormatError, require
from nvhchain.fem.faces import boundary_faces, flat_triangles, six_node_facets
from nvhchain.fem.solid_model import CORNERS, EDGES
from nvhchain.fem.triangles import lying_on
from nvhchain.handoff import FloatArray, IntArray

_Places = tuple[int, ...]

SHELLS: dict[int, tuple[_Places, _Places]] = {
    **dict.fromkeys((41, 91), ((0, 1, 2), ())),
    **dict.fromkeys((42, 92), ((0, 2, 4), (1, 3, 5))),
    **dict.fromkeys((44, 94), ((0, 1, 2, 3), ())),
    **dict.fromkeys((45, 95), ((0, 2, 4, 6), (1, 3, 5, 7))),
}
"""Descriptors of dataset 2412: places of the corners and of the middles of the edges after them."""

SOLIDS: dict[int, tuple[str, _Places, _Places]] = {
    111: ("tet", (0, 1, 2, 3), ()),
    118: ("tet", (0, 2, 4, 9), (1, 3, 5, 6, 7, 8)),
    112: ("wedge", (0, 1, 2, 3, 4, 5), ()),
    113: ("wedge", (0, 2, 4, 9, 11, 13), (1, 3, 5, 10, 12, 14, 6, 7, 8)),
    115: ("hex", (0, 1, 2, 3, 4, 5, 6, 7), ()),
    116: ("hex", (0, 2, 4, 6, 12, 14, 16, 18), (1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11)),
}
"""Descriptors of dataset 2412: shape, places of the corners and of the middles of the edges (`EDGES`).

Parabolic elements list nodes round each layer.
"""

_COAT_DISTANCE = 0.05
"""Largest distance of a point on a triangle, over its size: a coat may follow a curve that the solids cut short."""

_WHOLE = 0.999
"""Least share of the solids' skin under shells that counts as the whole skin."""


@dataclass(frozen=True, eq=False)
class UniversalSkin:
    """Skin of a universal file.

    triangles: (k, 6), as in `ModalModel`.
    two_sided: (k,) bool, as in `ModalModel`.
    centres: (q, n) values at added nodes in the middles of four-cornered faces, from those at the n nodes of the file.
        Added nodes are numbered on from n.
    notes: choices in words.
    """

    triangles: IntArray
    two_sided: IntArray
    centres: sp.csr_matrix
    notes: tuple[str, ...]


def skin(
    elements: list[tuple[int, list[int]]], labels: IntArray, nodes: FloatArray, moves: IntArray, subject: str
) -> UniversalSkin:
    """Return the boundary of the solids and the shells beside it.

    nodes : (n, 3) m, of `labels` (n,).
    moves : (n,) bool, nodes with displacements in every mode.
    subject : table of the elements as messages call it.

    Shells that coat solids replace the covered skin, oriented outward, if more of them has displacements than of the
    solids' skin. Shells elsewhere radiate from both sides. Faces with a mid-edge node without displacements use their
    corners only.

    Raises InputError for elements without a skin, a skin without displacements, and for solids that overlap.
    """
    rows: dict[int, IntArray] = {}
    for descriptor in dict.fromkeys(kind for kind, _ in elements):
        corners, middles = _layout(descriptor)
        if corners:
            members = _members(elements, descriptor, 1 + max(*corners, *middles), subject)
            corner_rows = select_rows(labels, members[:, corners].ravel(), subject).reshape(len(members), -1)
            rows[descriptor] = np.hstack([corner_rows, _moving_rows(labels, members[:, middles], moves)])
    require(bool(rows), f"{subject} holds no shells and no solids: export the skin with the shapes")
    faces = [_face(found, len(SHELLS[kind][0])) for kind, found in rows.items() if kind in SHELLS]
    shells = np.concatenate([*faces, np.empty((0, 8), dtype=np.int64)])
    solids = {kind: _once(found) for kind, found in rows.items() if kind in SOLIDS}
    boundary, notes = np.empty((0, 8), dtype=np.int64), []
    if solids:
        copies = sum(len(rows[kind]) - len(found) for kind, found in solids.items())
        if copies:
            notes.append(f"{copies} solids on the nodes of others excluded")
        boundary = boundary_faces(
            [_append_edges(SOLIDS[kind][0], found) for kind, found in solids.items()], labels, subject
        )
        if len(shells):
            boundary, shells = _chosen(boundary, shells, nodes, moves, notes)
    outward, centres = six_node_facets(boundary, len(nodes))
    sheets, others = six_node_facets(shells, len(nodes) + centres.shape[0])
    triangles = np.concatenate([outward, sheets])
    used = np.unique(triangles[:, :3])
    still = int((~moves[used]).sum())
    require(still < len(used), f"{subject}: no node of the skin has displacements in every mode: export them there")
    if still:
        notes.append(f"{still} of {len(used)} corners of the skin have no displacements: they stand still")
    return UniversalSkin(
        triangles,
        np.repeat([False, True], [len(outward), len(sheets)]),
        sp.csr_matrix(sp.vstack([centres, others[:, : len(nodes)]])),
        tuple(notes),
    )


def _members(elements: list[tuple[int, list[int]]], descriptor: int, least: int, subject: str) -> IntArray:
    """Return labels (m, nodes) of the nodes of all elements of one descriptor, which have `least` nodes."""
    found = [members for kind, members in elements if kind == descriptor]
    for members in found:
        if len(members) != least:
            raise FileFormatError(f"{subject}: an element of type {descriptor} has {len(members)} nodes, not {least}")
    return np.array(found, dtype=np.int64)


def _append_edges(shape: str, rows: IntArray) -> tuple[str, IntArray]:
    """Return solids with all places of mid-edge nodes, −1 for missing ones."""
    none = np.full((len(rows), CORNERS[shape] + len(EDGES[shape]) - rows.shape[1]), -1)
    return shape, np.hstack([rows, none])


def _chosen(
    boundary: IntArray, shells: IntArray, nodes: FloatArray, moves: IntArray, notes: list[str]
) -> tuple[IntArray, IntArray]:
    """Return faces of the skin, outward, and the shells that are not on it."""
    skin = _flat(boundary, nodes)
    covering, below = lying_on(_middles(shells, nodes), skin, _COAT_DISTANCE).T
    coat = np.zeros(len(shells), dtype=bool)
    coat[covering] = True
    if coat.any():
        whole = _area(skin)
        share = _area(_flat(shells[coat], nodes)) / whole
        covered = f"shells cover {100 * share:.3g} % of the solids' skin"
        own, theirs = (_area(_flat(faces[_moving(faces, moves)], nodes)) / whole for faces in (boundary, shells[coat]))
        moved = f"{covered}; {100 * own:.3g} % of it have displacements of their own, {100 * theirs:.3g} % the shells'"
        if own < _WHOLE and _WHOLE * theirs > own:
            notes.append(f"{moved}: the shells are taken there")
            bare = np.ones(len(boundary), dtype=bool)
            bare[lying_on(_middles(boundary, nodes), _flat(shells[coat], nodes), _COAT_DISTANCE)[:, 0]] = False
            boundary = np.concatenate([boundary[bare], _outward(shells, covering, skin[below], nodes)[coat]])
        elif own < _WHOLE:
            notes.append(f"{moved}: the solids' skin is taken")
        elif share < _WHOLE:
            notes.append(f"{covered}: the whole of it is taken")
    if not coat.all():
        notes.append(f"{int((~coat).sum())} shells that are not on the skin of the solids radiate from both sides")
    return boundary, shells[~coat]


def _outward(shells: IntArray, which: IntArray, base: FloatArray, nodes: FloatArray) -> IntArray:
    """Return shells (f, 8), `which` (q,) of them oriented like the triangles `base` (q, 3, 3) on which they lie."""
    corners = nodes[np.where(shells[:, :4] >= 0, shells[:, :4], shells[:, :1])]
    own = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal = np.cross(base[:, 1] - base[:, 0], base[:, 2] - base[:, 0])
    alignment = np.bincount(which, np.einsum("qa,qa->q", own[which], normal), minlength=len(shells))
    four = shells[:, 3:4] >= 0
    turned = shells[:, [0, 3, 2, 1, 7, 6, 5, 4]]
    turned = np.where(four, turned, shells[:, [0, 2, 1, 3, 6, 5, 4, 7]])
    return np.where(alignment[:, None] < 0, turned, shells)


def _moving(faces: IntArray, moves: IntArray) -> IntArray:
    """Return the faces (f,) bool that have displacements at all their corners."""
    corners = np.where(faces[:, :4] >= 0, faces[:, :4], faces[:, :1])
    return np.asarray(moves[corners].all(axis=1))


def _flat(faces: IntArray, nodes: FloatArray) -> FloatArray:
    """Return corners (t, 3, 3) of flat triangles that follow the faces."""
    facets, centres = six_node_facets(faces, len(nodes))
    return np.asarray(np.vstack([nodes, centres @ nodes])[flat_triangles(facets)])


def _middles(faces: IntArray, nodes: FloatArray) -> FloatArray:
    """Return middles (f, 3) of faces, on the curved face if it has mid-edge nodes."""
    there = faces >= 0
    place = np.where(there[:, :, None], nodes[faces], 0.0)
    corners, edges = place[:, :4].sum(axis=1), place[:, 4:].sum(axis=1)
    count = there[:, :4].sum(axis=1)[:, None]
    curved = (4 * edges - corners) / np.where(count == 3, 9, 8) - np.where(count == 3, 0.0, corners / 8)
    return np.where(there[:, 4:].sum(axis=1)[:, None] == count, curved, corners / count)


def _once(rows: IntArray) -> IntArray:
    """Return elements (m, nodes) without copies on the same nodes."""
    return np.asarray(rows[np.sort(np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1])])


def _area(corners: FloatArray) -> float:
    sides = corners[:, 1:] - corners[:, :1]
    return 0.5 * float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum())


def _face(rows: IntArray, corners: int) -> IntArray:
    """Return shells as faces (k, 8): corners, then mid-edge nodes, if any."""
    faces = np.full((len(rows), 8), -1)
    faces[:, :corners] = rows[:, :corners]
    faces[:, 4 : 4 + rows.shape[1] - corners] = rows[:, corners:]
    return faces


def _layout(descriptor: int) -> tuple[_Places, _Places]:
    """Return places of corners and middles of an element; none if it has no skin."""
    if descriptor in SHELLS:
        return SHELLS[descriptor]
    return SOLIDS[descriptor][1:] if descriptor in SOLIDS else ((), ())


def _moving_rows(labels: IntArray, wanted: IntArray, moves: IntArray) -> IntArray:
    """Return rows of the `wanted` labels, any shape, −1 for those without displacements."""
    rows = np.minimum(np.searchsorted(labels, wanted), len(labels) - 1)
    return np.where((labels[rows] == wanted) & moves[rows], rows, -1)


def select_rows(labels: IntArray, wanted: IntArray | list[int], subject: str) -> IntArray:
    """Return rows of the `wanted` labels among all labels, sorted; `subject` names the table in messages."""
    numbers = np.asarray(wanted, dtype=np.int64)
    rows = np.minimum(np.searchsorted(labels, numbers), len(labels) - 1)
    known = labels[rows] == numbers
    if not known.all():
        raise FileFormatError(f"{subject}: node {numbers[~known][0]} is not defined")
    return np.asarray(rows)
