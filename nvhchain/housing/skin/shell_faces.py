"""Outer faces of shells: half the thickness in front of the middle surface, where the air begins."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.skin.skin import Skin

_SOFT = 1e-2
"""Share of the mean stiffness that holds a node where no facet asks for a motion, such as along a smooth wall."""

_FARTHEST = 1.75
"""Largest motion of a node over the largest depth: a corner of three walls at right angles moves by √3."""

_ON_PLANE = 1e-3
"""Distance from the mounting plane over the depth, below which a node stays on it."""


def at_outer_faces(
    skin: Skin, exposed: IntArray, floor: tuple[FloatArray, FloatArray] | None
) -> tuple[Skin, FloatArray]:
    """Return the exposed facets at the faces of their shells, and triangles (t, 3, 3) m from their rims to the nodes.

    exposed : (k,) bool, facets in contact with the air.
    floor : point and normal of the mounting plane, on which nodes stay.

    The corners of facets side by side go where all of them, moved by their depths, meet; those of the other side of a
    shell are others. The motion is still that of the nodes.
    """
    facets, depth = skin.facets[exposed], np.broadcast_to(skin.depth, len(exposed))[exposed]
    fan = _fans(facets)
    owner = np.zeros(fan.max() + 1, dtype=np.int64)
    owner[fan] = facets[:, :3]
    places = skin.nodes[owner] + _displaced(skin.nodes[owner], fan, depth, floor)
    ends = np.roll(fan, -1, axis=1)
    middles = (places[fan] + places[ends]) / 2
    rows = np.concatenate([owner, facets[:, 3:].ravel()])
    numbers = len(owner) + np.arange(3 * len(facets)).reshape(-1, 3)
    outer = Skin(np.vstack([places, middles.reshape(-1, 3)]), np.hstack([fan, numbers]), skin.interpolation[rows])
    # edges of one facet are rims: strips join them to the shell's nodes
    both = np.sort(np.stack([fan, ends], axis=2).reshape(-1, 2), axis=1)
    _, which, count = np.unique(both, axis=0, return_inverse=True, return_counts=True)
    a, b = np.stack([fan, ends], axis=2).reshape(-1, 2)[count[which.ravel()] == 1].T
    inner, moved = (skin.nodes[owner[a]], skin.nodes[owner[b]]), (places[a], places[b])
    strips = [np.stack([inner[0], inner[1], moved[1]], axis=1), np.stack([inner[0], moved[1], moved[0]], axis=1)]
    return outer, np.concatenate(strips)


def _fans(facets: IntArray) -> IntArray:
    """Return numbers (k, 3) of the corners of facets; corners at one node are one where facets lie side by side.

    Facets lie side by side at an edge that they run along in opposite directions, unless all corners are the same.
    """
    corners = facets[:, :3]
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    slot = np.arange(len(start))
    following = slot + np.where(slot % 3 == 2, -2, 1)
    size = int(corners.max()) + 1
    key, back = start * size + end, end * size + start
    order = np.argsort(key, kind="stable")
    low, high = (np.searchsorted(key[order], back, side=side) for side in ("left", "right"))
    count = high - low
    one = np.repeat(slot, count)
    other = order[np.repeat(low, count) + np.arange(len(one)) - np.repeat(np.cumsum(count) - count, count)]
    same = (np.sort(corners, axis=1)[one // 3] == np.sort(corners, axis=1)[other // 3]).all(axis=1)
    one, other = one[~same], other[~same]
    first, second = np.concatenate([one, following[one]]), np.concatenate([following[other], other])
    link = sp.coo_matrix((np.ones(len(first)), (first, second)), shape=(len(start), len(start)))
    return np.asarray(connected_components(link, directed=False)[1]).reshape(-1, 3)


def _displaced(
    nodes: FloatArray, facets: IntArray, depth: FloatArray, floor: tuple[FloatArray, FloatArray] | None
) -> FloatArray:
    """Return the displacements (n, 3) m of corners that move every facet by its depth along its normal."""
    a, b, c = nodes[facets[:, :3]].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(area, np.finfo(float).tiny)[:, None]
    matrix, right = np.zeros((len(nodes), 3, 3)), np.zeros((len(nodes), 3))
    for corner in facets[:, :3].T:
        np.add.at(matrix, corner, area[:, None, None] * normal[:, :, None] * normal[:, None, :])
        np.add.at(right, corner, (area * depth)[:, None] * normal)
    used = np.unique(facets[:, :3])
    stiff = matrix[used] + _SOFT / 3 * np.trace(matrix[used], axis1=1, axis2=2)[:, None, None] * np.eye(3)
    moved = np.zeros_like(nodes)
    moved[used] = (1 + _SOFT / 3) * np.linalg.solve(stiff, right[used][:, :, None])[:, :, 0]
    farthest = _FARTHEST * np.abs(depth).max()
    moved *= np.minimum(1.0, farthest / np.maximum(np.linalg.norm(moved, axis=1), farthest))[:, None]
    if floor is not None:
        point, up = floor
        standing = np.abs((nodes - point) @ up) < _ON_PLANE * farthest
        moved[standing] -= (moved[standing] @ up)[:, None] * up
    return moved
