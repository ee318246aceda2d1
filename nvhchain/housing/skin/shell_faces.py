"""Outer faces of shells: half the thickness in front of the middle surface, where the air begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.skin.regions import CAVITY, EXTERIOR, WALL, Regions, mark, reached, samples
from nvhchain.housing.skin.skin import Skin

_SOFT = 1e-2
"""Share of the mean stiffness that holds a corner where no facet asks for a motion, such as along a smooth wall."""

_FARTHEST = 1.75
"""Largest motion of a corner over the largest depth beside it: that of three walls at right angles moves by √3."""

_PLANE_TOLERANCE = 1e-3
"""Distance from the mounting plane over the depth, below which a corner stays on it."""

_ONE_PLACE = 1e-6
"""Largest angle (rad) between two walls at one place around an edge."""


def move_to_outer_faces(skin: Skin, exposed: IntArray, floor: tuple[FloatArray, FloatArray] | None) -> Skin:
    """Return the exposed facets, those of shells at the faces of these.

    exposed : (k,) bool, facets in contact with the air.
    floor : point and outward normal of the mounting plane, on which nodes stay.

    The corners of facets around the same air go where all of them, moved by their depths, meet. The other side of a
    shell has corners of its own. The motion is still that of the nodes.
    """
    facets, depth = skin.facets[exposed], np.broadcast_to(skin.depth, len(exposed))[exposed]
    fan = _fans(skin.nodes, facets)
    owner = np.zeros(fan.max() + 1, dtype=np.int64)
    owner[fan] = facets[:, :3]
    moved = _displaced(skin.nodes[owner], fan, depth, floor)
    middles = skin.nodes[facets[:, 3:]] + (moved[fan] + moved[np.roll(fan, -1, axis=1)]) / 2
    rows = np.concatenate([owner, facets[:, 3:].ravel()])
    numbers = len(owner) + np.arange(3 * len(facets)).reshape(-1, 3)
    places = np.concatenate([skin.nodes[owner] + moved, middles.reshape(-1, 3)])
    sheets = np.broadcast_to(skin.sheets, len(exposed))[exposed]
    return Skin(places, np.hstack([fan, numbers]), skin.interpolation[rows], sheets)


def thickened(space: Regions, inner: FloatArray, outer: FloatArray) -> tuple[Regions, IntArray]:
    """Return the regions with the walls between facets filled, and the facets (k,) bool that these enclose.

    inner, outer : (k, 3, 3) m, corners of the exposed facets at the nodes and at the faces of their shells.
    """
    apart = np.linalg.norm(outer - inner, axis=2).max(axis=1)
    pad = int(np.ceil(apart.max() / space.size)) + 1
    below = 0 if space.has_floor else pad
    label = np.pad(space.label, ((pad, pad), (pad, pad), (below, pad)), constant_values=EXTERIOR)
    made = replace(space, label=label, origin=space.origin - space.size * np.array([pad, pad, below]))
    wall, moved = np.zeros(label.shape, dtype=bool), apart > 0
    triangles = np.arange(3 * int(moved.sum())).reshape(-1, 3)
    for share in np.linspace(0.0, 1.0, int(np.ceil(2 * apart.max() / space.size)) + 2):
        layer = ((1 - share) * inner + share * outer)[moved].reshape(-1, 3) @ space.axes
        for points, _ in samples(layer, triangles, space.size / 2):
            mark(wall, points.reshape(-1, 3), made.origin, space.size)
    label[wall & (label == EXTERIOR)] = WALL
    closed = (label == EXTERIOR) & ~reached(label == EXTERIOR, space.has_floor)
    label[closed] = CAVITY
    a, b, c = outer.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    reach = 1.05 * space.size * np.abs(normal @ space.axes).sum(axis=1, keepdims=True)
    return made, closed[tuple(made.index(outer.mean(axis=1) + reach * normal).T)]


def _fans(nodes: FloatArray, facets: IntArray) -> IntArray:
    """Return numbers (k, 3) of the corners of facets; corners at one node are one where facets bound the same air.

    Such facets follow each other around an edge, on their front sides. One that is alone at an edge bounds the same air
    as its back does, which still has corners of its own.
    """
    corners = facets[:, :3]
    start, end, third = (np.roll(corners, -i, axis=1).ravel() for i in range(3))
    slot = np.arange(len(start))
    following = slot + np.where(slot % 3 == 2, -2, 1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    edge = np.unique(low * (int(corners.max()) + 1) + high, return_inverse=True)[1].ravel()
    angle = _angles(nodes, low, high, third, edge)
    order = np.argsort(edge, kind="stable")
    backward = order[(start > end)[order]]
    first, last = (np.searchsorted(edge[backward], edge, side=side) for side in ("left", "right"))
    forward = np.flatnonzero(start < end)
    count = (last - first)[forward]
    one = np.repeat(forward, count)
    other = backward[np.repeat(first[forward] - np.cumsum(count) + count, count) + np.arange(len(one))]
    turn = (angle[other] - angle[one]) % (2 * np.pi)
    turn[(turn < _ONE_PLACE) | (turn > 2 * np.pi - _ONE_PLACE)] = 2 * np.pi
    least = np.full(len(start), 2 * np.pi)
    np.minimum.at(least, one, turn)
    adjacent = (turn <= least[one] + _ONE_PLACE) & (turn < 2 * np.pi)
    one, other = one[adjacent], other[adjacent]
    pairs = np.concatenate([one, following[one]]), np.concatenate([following[other], other])
    link = sp.coo_matrix((np.ones(len(pairs[0])), pairs), shape=(len(start), len(start)))
    return np.asarray(connected_components(link, directed=False)[1]).reshape(-1, 3)


def _angles(nodes: FloatArray, low: IntArray, high: IntArray, third: IntArray, edge: IntArray) -> FloatArray:
    """Return the angles (3 k,) of walls about their edges, from the first wall of each, right-handed from low to high.

    The front of a facet that runs from low to high lies at larger angles than the facet, that of others at smaller.
    """
    direction = nodes[high] - nodes[low]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), np.finfo(float).tiny)
    altitude = nodes[third] - nodes[low]
    altitude -= (altitude * direction).sum(axis=1, keepdims=True) * direction
    first = np.unique(edge, return_index=True)[1][edge]
    x = altitude[first] / np.maximum(np.linalg.norm(altitude[first], axis=1, keepdims=True), np.finfo(float).tiny)
    y = np.cross(direction, x)
    return np.asarray(np.arctan2((altitude * y).sum(axis=1), (altitude * x).sum(axis=1)))


def _displaced(
    nodes: FloatArray, facets: IntArray, depth: FloatArray, floor: tuple[FloatArray, FloatArray] | None
) -> FloatArray:
    """Return the displacements (n, 3) m of corners that move every facet by its depth along its normal."""
    a, b, c = nodes[facets].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(area, np.finfo(float).tiny)[:, None]
    corner, count = facets.ravel(), np.arange(facets.size + 1)
    summed = sp.csr_matrix((np.repeat(area, 3), corner, count), shape=(facets.size, len(nodes))).T
    outer = (normal[:, :, None] * normal[:, None, :]).reshape(-1, 9)
    matrix = (summed @ np.repeat(outer, 3, axis=0)).reshape(-1, 3, 3)
    right = summed @ np.repeat(depth[:, None] * normal, 3, axis=0)
    matrix += _SOFT / 3 * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    moved = (1 + _SOFT / 3) * np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    farthest = np.zeros(len(nodes))
    np.maximum.at(farthest, corner, np.repeat(_FARTHEST * np.abs(depth), 3))
    length = np.linalg.norm(moved, axis=1)
    moved *= np.where(length > farthest, farthest / np.maximum(length, np.finfo(float).tiny), 1.0)[:, None]
    if floor is not None:
        point, outward = floor
        height = -(nodes - point) @ outward
        rise = -moved @ outward
        stays = np.abs(height) < _PLANE_TOLERANCE * farthest
        wanted = np.where(stays, 0.0, np.maximum(rise, np.minimum(0.0, -height)))
        moved += (rise - wanted)[:, None] * outward
    return moved
