"""Rigid node sets: bearing seats that follow a reference point, and bolt bores that are fixed.

A node i of a rigid set moves as u_i = u_ref + θ × (x_i − x_ref), linearised (multipoint constraint, RBE2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray, IntArray

RigidSet = tuple[IntArray, FloatArray | None]


def rigid_map(nodes: FloatArray, sets: Sequence[RigidSet]) -> sp.csr_matrix:
    """Return the map T of rigid node sets, with u = T u_reduced and K_reduced = Tᵀ K T.

    nodes (n, 3): nodes (m).
    sets sequence of (array, array or None): node numbers and reference point (3,) (m) of each set; None for fixed
    nodes.
    Returns (3 n, n_reduced) sparse matrix: map T. u_reduced holds the free nodes in node order. Then each reference
    point has three translations (m) and three rotations (rad) about x, y, z, in the order of `sets`. Fixed sets have
    none.
    """
    nodes = np.asarray(nodes, dtype=float)
    owner = np.full(len(nodes), -1)
    for number, (members, _) in enumerate(sets):
        members = np.asarray(members, dtype=np.int64)
        require(members.size > 0, f"rigid set {number} has no nodes")
        require(members.min() >= 0 and members.max() < len(nodes), f"rigid set {number} refers to unknown nodes")
        if (owner[members] >= 0).any():
            node = int(members[np.argmax(owner[members] >= 0)])
            raise InputError(f"node {node} belongs to rigid sets {owner[node]} and {number}: only one may hold it")
        owner[members] = number
    free = np.flatnonzero(owner < 0)
    offset = 3 * len(free)
    free_dofs = (3 * free[:, None] + np.arange(3)).ravel()
    rows, columns, values = [free_dofs], [np.arange(offset)], [np.ones(offset)]
    for members, reference in sets:
        if reference is None:
            continue
        members = np.unique(np.asarray(members, dtype=np.int64))
        arm = nodes[members] - np.asarray(reference, dtype=float)
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            # translation along the axis, and θ × r: −θ_axis r_v in component u, θ_axis r_u in component v
            for component, column, value in (
                (axis, axis, np.ones(len(members))),
                (u, 3 + axis, -arm[:, v]),
                (v, 3 + axis, arm[:, u]),
            ):
                rows.append(3 * members + component)
                columns.append(np.full(len(members), offset + column))
                values.append(value)
        offset += 6
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.coo_matrix(entries, shape=(3 * len(nodes), offset)).tocsr()
