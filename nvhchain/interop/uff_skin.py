"""The skin that the elements of a universal file make: its shells, or the boundary of its solids."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.errors import FileFormatError, require
from nvhchain.fem.modal_model import boundary_triangles, face_triangles
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
"""Descriptors of dataset 2412: shape, places of the corners and of the middles of the edges (`EDGES`); parabolic
elements list nodes round each layer."""

_BESIDE = 0.05
"""Of a triangle's size, up to which a point lies on it: a coat may follow a curve that the solids cut short."""

_WHOLE = 0.999
"""Of the solids' skin, covered by shells, from which on nothing of it is missing."""


def skin(
    elements: list[tuple[int, list[int]]], labels: IntArray, nodes: FloatArray, moving: set[int], what: str
) -> tuple[IntArray, bool, tuple[str, ...]]:
    """Triangles (k, 3) of the solids' boundary, or of the shells where there are no solids, whether shells, and notes.

    nodes: (n, 3) m, of `labels` (n,).  moving: labels of the nodes with displacements in every mode.  what: the table
    of the elements, for messages.  Of shells that coat solids and of the solids' own skin that one is taken which has
    displacements, the solids' if both do.
    Raises InputError for shells elsewhere beside solids, where it is not clear what radiates.
    """
    parabolic = all(members[place] in moving for descriptor, members in elements for place in _layout(descriptor)[1])
    chosen: dict[int, list[list[int]]] = {}
    for descriptor, members in elements:
        corners, middles = _layout(descriptor)
        if corners:
            chosen.setdefault(descriptor, []).append([members[i] for i in (*corners, *(middles if parabolic else ()))])
    require(bool(chosen), f"{what} holds no shells and no solids: export the skin with the shapes")
    rows = {
        descriptor: rows_of(labels, np.array(members).ravel(), what).reshape(len(members), -1)
        for descriptor, members in chosen.items()
    }
    shells = [face_triangles(_face(found, len(SHELLS[kind][0]))) for kind, found in rows.items() if kind in SHELLS]
    solids = {kind: _once(found) for kind, found in rows.items() if kind in SOLIDS}
    if not solids:
        return np.concatenate(shells), True, ()
    notes = []
    copies = sum(len(rows[kind]) - len(found) for kind, found in solids.items())
    if copies:
        notes.append(f"{copies} solids on the nodes of others left out")
    boundary = boundary_triangles([(SOLIDS[kind][0], found) for kind, found in solids.items()])
    if shells:
        coat = nodes[np.concatenate(shells)]
        off = ~_lying_on(coat.mean(axis=1), nodes[boundary])
        require(
            not off.any(),
            f"{what}: {int(off.sum())} of {len(coat)} triangles of shells are not on the skin of the solids, what "
            "radiates is not clear: export the shells alone if they are the whole skin, else the solids alone",
        )
        covered = f"shells cover {100 * _area(coat) / _area(nodes[boundary]):.3g} % of the solids' skin"
        if not moving.issuperset(labels[np.unique(boundary)].tolist()):
            notes.append(f"{covered}, which lacks displacements elsewhere: the shells are taken")
            return np.concatenate(shells), True, tuple(notes)
        if _area(coat) < _WHOLE * _area(nodes[boundary]):
            notes.append(f"{covered}: the whole of it is taken")
    return boundary, False, tuple(notes)


def _once(rows: IntArray) -> IntArray:
    """Elements (m, nodes) without copies on the same nodes."""
    return np.asarray(rows[np.sort(np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1])])


def _area(corners: FloatArray) -> float:
    sides = corners[:, 1:] - corners[:, :1]
    return 0.5 * float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum())


def _lying_on(points: FloatArray, triangles: FloatArray) -> IntArray:
    """Which points (p,) bool lie on one of the triangles (k, 3, 3)."""
    centre = triangles.mean(axis=1)
    size = np.linalg.norm(triangles - centre[:, None], axis=2).max(axis=1)
    near = cKDTree(points).query_ball_point(centre, (1 + _BESIDE) * size)
    owner = np.repeat(np.arange(len(triangles)), [len(found) for found in near])
    point = np.concatenate([np.array(found, dtype=np.int64) for found in near])
    a, b, c = triangles[owner].transpose(1, 0, 2)
    frame = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=2)
    area = np.abs(np.linalg.det(frame)) > 1e-12 * size[owner] ** 4
    point, frame, away = point[area], frame[area], (points[point] - a)[area]
    u, v, w = np.linalg.solve(frame, away[:, :, None])[:, :, 0].T
    height = np.abs(w) * np.linalg.norm(frame[:, :, 2], axis=1)
    on = (np.minimum(u, v) > -_BESIDE) & (u + v < 1 + _BESIDE) & (height < _BESIDE * size[owner][area])
    found = np.zeros(len(points), dtype=bool)
    found[point[on]] = True
    return found


def _face(rows: IntArray, corners: int) -> IntArray:
    """Shells as faces (k, 8): corners, then the middles of their edges, if there are any."""
    faces = np.full((len(rows), 8), -1)
    faces[:, :corners] = rows[:, :corners]
    faces[:, 4 : 4 + rows.shape[1] - corners] = rows[:, corners:]
    return faces


def _layout(descriptor: int) -> tuple[_Places, _Places]:
    """Places of corners and middles of an element; none where it is not one of the skin."""
    if descriptor in SHELLS:
        return SHELLS[descriptor]
    return SOLIDS[descriptor][1:] if descriptor in SOLIDS else ((), ())


def rows_of(labels: IntArray, wanted: IntArray | list[int], what: str) -> IntArray:
    """Rows of the `wanted` labels among all labels, sorted.  what: names the table in the message."""
    numbers = np.asarray(wanted, dtype=np.int64)
    rows = np.minimum(np.searchsorted(labels, numbers), len(labels) - 1)
    known = labels[rows] == numbers
    if not known.all():
        raise FileFormatError(f"{what}: node {numbers[~known][0]} is not defined")
    return np.asarray(rows)
