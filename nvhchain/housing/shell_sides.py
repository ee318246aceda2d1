"""Triangles numbered anyhow, turned outward where they close a body; open shells are looked at from both sides."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from nvhchain.handoff import FloatArray, IntArray


def outward_sides(nodes: FloatArray, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles (s, 3) that look outward and which of them (s,) bool are sides of an open shell.

    nodes: (n, 3) m.  triangles: (k, 3) in any order of their corners.  A patch is what hangs together by edges of two
    triangles; if all its edges are such and it can be turned alike it is a body with the volume positive.
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
    alike = np.where(turn[:, None], triangles[:, [0, 2, 1]], triangles)
    torn = np.bincount(patch[one], same ^ turn[one] ^ turn[other], minlength=patches) > 0
    torn |= np.bincount(patch, (count[edge] != 2).reshape(-1, 3).any(axis=1), minlength=patches) > 0
    volume = np.bincount(patch, np.linalg.det(nodes[alike] - nodes.mean(axis=0)), minlength=patches)
    outward = np.where((volume < 0)[patch][:, None], alike[:, [0, 2, 1]], alike)
    shell = torn[patch]
    both = np.concatenate([outward, outward[shell][:, [0, 2, 1]]])
    return both, np.concatenate([shell, np.ones(int(shell.sum()), dtype=bool)])


def _turns(one: IntArray, other: IntArray, same: IntArray, link: sp.csr_matrix, patch: IntArray) -> IntArray:
    """Which triangles (k,) bool must be turned to run as the first of their patch does, along a tree of neighbours."""
    differs = sp.csr_matrix((np.r_[same, same] + 1.0, (np.r_[one, other], np.r_[other, one])), shape=link.shape)
    turn = np.zeros(link.shape[0], dtype=bool)
    for first in np.unique(patch, return_index=True)[1]:
        reached, parent = breadth_first_order(link, first, directed=False)
        step = np.asarray(differs[reached[1:], parent[reached[1:]]]).ravel() == 2.0
        for child, ancestor, turned in zip(reached[1:].tolist(), parent[reached[1:]].tolist(), step, strict=True):
            turn[child] = turn[ancestor] ^ turned
    return turn
