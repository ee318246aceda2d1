"""Orientation of triangles: outward where they close a body; open shells get both sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from nvhchain.handoff import FloatArray, IntArray

_NO_AREA = 1e-12
"""Least area of a triangle over the square of its longest edge."""

_TURNED = [0, 2, 1, 5, 4, 3]
"""Corners of a triangle in reverse order, then the middles of its edges."""


def distinct(triangles: IntArray, notes: list[str]) -> IntArray:
    """Return triangles on three corners, each once in whatever order it is numbered; note the excluded ones.

    triangles : (k, 3) corners, or (k, 6) with the middles of their edges, here and below.
    """
    corners = np.sort(triangles[:, :3], axis=1)
    collapsed = (np.diff(corners, axis=1) == 0).any(axis=1)
    if collapsed.any():
        notes.append(f"{int(collapsed.sum())} triangles of the skin that repeat a corner excluded")
    _, first = np.unique(corners[~collapsed], axis=0, return_index=True)
    copies = len(triangles) - int(collapsed.sum()) - len(first)
    if copies:
        notes.append(f"{copies} triangles of the skin on the corners of others excluded")
    return triangles[~collapsed][np.sort(first)]


def has_area(nodes: FloatArray, triangles: IntArray, notes: list[str]) -> IntArray:
    """Return the triangles (k,) bool that are more than a line; note the others."""
    sides = nodes[triangles[:, [1, 2, 0]]] - nodes[triangles[:, :3]]
    twice = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    found = twice > _NO_AREA * (sides**2).sum(axis=2).max(axis=1)
    if not found.all():
        notes.append(f"{int((~found).sum())} triangles of the skin without area excluded")
    return np.asarray(found)


def outward_sides(nodes: FloatArray, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return triangles that look outward, and those (s,) bool that are sides of an open shell.

    nodes : (n, 3) nodes (m).
    triangles : `distinct`, with corners in any order.

    A patch consists of triangles connected by edges of two triangles. It is a body of positive volume if all its edges
    are such edges and its triangles can be oriented consistently.
    """
    turn, patch, torn = _alike(triangles)
    volume = np.bincount(patch, _volumes(nodes, triangles, turn))
    outward = _turned(triangles, turn ^ (volume < 0)[patch])
    shell = torn[patch]
    both = np.concatenate([outward, _turned(outward[shell], np.ones(int(shell.sum()), dtype=bool))])
    return both, np.concatenate([shell, np.ones(int(shell.sum()), dtype=bool)])


def outward_skin(nodes: FloatArray, triangles: IntArray, notes: list[str]) -> IntArray:
    """Return the triangles (`distinct`) of the skin of solids, oriented outward; note the number of reversed ones.

    nodes : (n, 3) nodes (m).

    A closed patch has a positive volume. A patch within the bounds of another may be the wall of a cavity: it keeps the
    orientation of most of its area, as do open patches.
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
        enclosing = ~torn & (low <= low[i]).all(axis=1) & (high >= high[i]).all(axis=1)
        enclosing[i] = False
        if enclosing.any():
            inward[i] = most[i]
    turn ^= inward[patch]
    if turn.any():
        notes.append(f"{int(turn.sum())} triangles of the skin that looked inward turned over")
    return _turned(triangles, turn)


def _turned(triangles: IntArray, turn: IntArray) -> IntArray:
    return np.where(turn[:, None], triangles[:, _TURNED[: triangles.shape[1]]], triangles)


def _volumes(nodes: FloatArray, triangles: IntArray, turn: IntArray) -> FloatArray:
    """Return six times the volumes (k,) between the triangles, once turned, and the middle of the nodes."""
    return np.asarray(np.linalg.det(nodes[_turned(triangles, turn)[:, :3]] - nodes.mean(axis=0)))


def _alike(triangles: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return triangles (k,) bool to turn for a consistent patch, their patches (k,), and the torn patches.

    Torn patches have an edge of one triangle or of three and more, or cannot be oriented consistently.
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


def _turns(triangle: IntArray, neighbour: IntArray, same: IntArray, link: sp.csr_matrix, patch: IntArray) -> IntArray:
    """Return triangles (k,) bool to turn to the orientation of the first of their patch, along a tree of neighbours."""
    differs = sp.csr_matrix(
        (np.r_[same, same] + 1.0, (np.r_[triangle, neighbour], np.r_[neighbour, triangle])), shape=link.shape
    )
    turn = np.zeros(link.shape[0], dtype=bool)
    _, starts, sizes = np.unique(patch, return_index=True, return_counts=True)
    for first in starts[sizes > 1]:
        reached, parent = breadth_first_order(link, first, directed=False)
        step = np.asarray(differs[reached[1:], parent[reached[1:]]]).ravel() == 2.0
        for child, ancestor, turned in zip(reached[1:].tolist(), parent[reached[1:]].tolist(), step, strict=True):
            turn[child] = turn[ancestor] ^ turned
    return turn
