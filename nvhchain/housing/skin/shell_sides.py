"""Triangles numbered anyhow, turned outward where they close a body; open shells are looked at from both sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from nvhchain.handoff import FloatArray, IntArray

_NO_AREA = 1e-12
"""Of the square of the longest edge."""

_TURNED = [0, 2, 1, 5, 4, 3]
"""Corners of a triangle the other way round, then the middles of its edges."""


def distinct(triangles: IntArray, notes: list[str]) -> IntArray:
    """Triangles on three corners, each once whichever way it is numbered; what is left out is noted.

    triangles: (k, 3) corners, or (k, 6) with the middles of their edges, here and below.
    """
    corners = np.sort(triangles[:, :3], axis=1)
    collapsed = (np.diff(corners, axis=1) == 0).any(axis=1)
    if collapsed.any():
        notes.append(f"{int(collapsed.sum())} triangles of the skin that repeat a corner left out")
    _, first = np.unique(corners[~collapsed], axis=0, return_index=True)
    copies = len(triangles) - int(collapsed.sum()) - len(first)
    if copies:
        notes.append(f"{copies} triangles of the skin on the corners of others left out")
    return triangles[~collapsed][np.sort(first)]


def has_area(nodes: FloatArray, triangles: IntArray, notes: list[str]) -> IntArray:
    """Which triangles (k,) bool are more than a line; the others are noted."""
    sides = nodes[triangles[:, [1, 2, 0]]] - nodes[triangles[:, :3]]
    twice = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    found = twice > _NO_AREA * (sides**2).sum(axis=2).max(axis=1)
    if not found.all():
        notes.append(f"{int((~found).sum())} triangles of the skin without area left out")
    return np.asarray(found)


def outward_sides(nodes: FloatArray, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles that look outward and which of them (s,) bool are sides of an open shell.

    nodes: (n, 3) m.  triangles: `distinct`, in any order of their corners.  A patch is what hangs together by
    edges of two triangles; if all its edges are such and it can be turned alike it is a body with the volume positive.
    """
    turn, patch, torn = _alike(triangles)
    volume = np.bincount(patch, _volumes(nodes, triangles, turn))
    outward = _turned(triangles, turn ^ (volume < 0)[patch])
    shell = torn[patch]
    both = np.concatenate([outward, _turned(outward[shell], np.ones(int(shell.sum()), dtype=bool))])
    return both, np.concatenate([shell, np.ones(int(shell.sum()), dtype=bool)])


def outward_skin(nodes: FloatArray, triangles: IntArray, notes: list[str]) -> IntArray:
    """Triangles, `distinct`, of the skin of solids that look out of them; how many were turned is noted.

    nodes: (n, 3) m.  A closed patch has a positive volume.  One within the bounds of another may be the wall of a
    cavity: it looks where most of its area does, as do open patches.
    """
    turn, patch, torn = _alike(triangles)
    corners = nodes[triangles[:, :3]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    most = np.bincount(patch, area * np.where(turn, 1.0, -1.0)) > 0
    low, high = np.full((len(torn), 3), np.inf), np.full((len(torn), 3), -np.inf)
    np.minimum.at(low, patch, corners.min(axis=1))
    np.maximum.at(high, patch, corners.max(axis=1))
    inward = np.where(torn, most, np.bincount(patch, _volumes(nodes, triangles, turn)) < 0)
    for i in np.flatnonzero(~torn):
        around = ~torn & (low <= low[i]).all(axis=1) & (high >= high[i]).all(axis=1)
        around[i] = False
        if around.any():
            inward[i] = most[i]
    turn ^= inward[patch]
    if turn.any():
        notes.append(f"{int(turn.sum())} triangles of the skin that looked inward turned over")
    return _turned(triangles, turn)


def _turned(triangles: IntArray, turn: IntArray) -> IntArray:
    return np.where(turn[:, None], triangles[:, _TURNED[: triangles.shape[1]]], triangles)


def _volumes(nodes: FloatArray, triangles: IntArray, turn: IntArray) -> FloatArray:
    """Six times the volumes (k,) between the triangles, once turned, and the middle of the nodes."""
    return np.asarray(np.linalg.det(nodes[_turned(triangles, turn)[:, :3]] - nodes.mean(axis=0)))


def _alike(triangles: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Which triangles (k,) bool to turn so that all of a patch run alike, their patches (k,), which of these are torn.

    Torn are those with an edge of one triangle or of three and more, and those that cannot be turned alike.
    """
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, edge, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.ravel()
    order = np.argsort(edge, kind="stable")
    shared = order[count[edge[order]] == 2].reshape(-1, 2)
    one, other = shared.T // 3
    same = (edges[shared[:, 0]] == edges[shared[:, 1]]).all(axis=1)  # along the edge in the same direction
    size = (len(triangles), len(triangles))
    link = sp.csr_matrix((np.ones(2 * len(one)), (np.r_[one, other], np.r_[other, one])), shape=size)
    patches, patch = connected_components(link, directed=False)
    turn = _turns(one, other, same, link, patch)
    torn = np.bincount(patch[one], same ^ turn[one] ^ turn[other], minlength=patches) > 0
    torn |= np.bincount(patch, (count[edge] != 2).reshape(-1, 3).any(axis=1), minlength=patches) > 0
    return turn, patch, np.asarray(torn)


def _turns(one: IntArray, other: IntArray, same: IntArray, link: sp.csr_matrix, patch: IntArray) -> IntArray:
    """Which triangles (k,) bool must be turned to run as the first of their patch does, along a tree of neighbours."""
    differs = sp.csr_matrix((np.r_[same, same] + 1.0, (np.r_[one, other], np.r_[other, one])), shape=link.shape)
    turn = np.zeros(link.shape[0], dtype=bool)
    _, starts, sizes = np.unique(patch, return_index=True, return_counts=True)
    for first in starts[sizes > 1]:
        reached, parent = breadth_first_order(link, first, directed=False)
        step = np.asarray(differs[reached[1:], parent[reached[1:]]]).ravel() == 2.0
        for child, ancestor, turned in zip(reached[1:].tolist(), parent[reached[1:]].tolist(), step, strict=True):
            turn[child] = turn[ancestor] ^ turned
    return turn
