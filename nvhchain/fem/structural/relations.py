"""Motions that follow others: rigid sets, weighted means, ties and held freedoms, as a map from the unknowns.

A weighted mean (RBE3, distributing coupling) moves as the rigid body closest to its nodes. Its motion q minimises
Σ w_i |u_i − S_i q|² with the rigid motion S_i of node i, thus q = (Σ Sᵀ w S)⁻¹ Σ Sᵀ w u. It adds no stiffness: a force
on the mean is shared among the nodes. Weights of rotations are scaled with the squared mean distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import InputError, require
from nvhchain.fem.structural.model import Average, Relation
from nvhchain.handoff import FloatArray, IntArray

_DEPENDENT = 1e-9
"""Least size of a pivot over the largest, for nodes that determine all motions of their mean."""

_MOST = 3000
"""Largest number of nodes of a mean: all of them couple with one another, 9 · 10⁶ numbers per thousand nodes."""

_CHAIN = 20
"""Largest number of relations that follow one another."""


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Nodes that follow a reference point (m) with or without their rotations; `held` are its fixed motions (6,)."""

    name: str
    nodes: IntArray
    reference: FloatArray
    rotations: bool
    held: IntArray


@dataclass
class _Rows:
    """Rows of dependent unknowns under construction."""

    unknowns: int
    row: list[IntArray] = field(default_factory=list)
    column: list[IntArray] = field(default_factory=list)
    value: list[FloatArray] = field(default_factory=list)
    owner: dict[int, str] = field(default_factory=dict)

    def add(self, name: str, rows: IntArray, table: sp.coo_matrix) -> None:
        """Let unknowns `rows` follow others by `table` (rows, unknowns)."""
        for row in rows.tolist():
            if row in self.owner:
                raise InputError(
                    f"node freedom {1 + row % 6} follows both {self.owner[row]} and {name}: keep one of them"
                )
            self.owner[row] = name
        self.row.append(rows[table.row])
        self.column.append(table.col)
        self.value.append(table.data)


def rigid_motion(arm: FloatArray) -> FloatArray:
    """Return the motions (k, 6, 6) of nodes at `arm` (k, 3) m from a point that moves by three shifts and turns."""
    motion = np.broadcast_to(np.eye(6), (len(arm), 6, 6)).copy()
    x, y, z = arm.T
    motion[:, 0, 4], motion[:, 0, 5] = z, -y
    motion[:, 1, 3], motion[:, 1, 5] = -z, x
    motion[:, 2, 3], motion[:, 2, 4] = y, -x
    return motion


def average_map(one: Average, nodes: FloatArray) -> FloatArray:
    """Return the six motions of a mean per motions (6, 6 k) of its nodes; `nodes` (n, 3) m.

    Raises InputError if the nodes do not determine them, for example on a line.
    """
    require(
        len(one.nodes) <= _MOST,
        f"mean {one.name} has {len(one.nodes)} nodes, {_MOST} are admitted: take every second or third of them",
    )
    arm = nodes[one.nodes] - nodes[one.node]
    motion = rigid_motion(arm)
    weights = one.weights.copy()
    reach = float(np.sqrt((arm**2).sum(axis=1).mean()))
    weights[:, 3:] *= max(reach, np.finfo(float).tiny) ** 2
    weighted = motion * weights[:, :, None]
    normal = np.einsum("kia,kib->ab", weighted, motion)
    scale = np.sqrt(normal.diagonal())
    scaled = normal / np.maximum(np.outer(scale, scale), np.finfo(float).tiny)
    value, vector = np.linalg.eigh(scaled)
    require(
        bool((scale > 0).all()) and value[0] > _DEPENDENT * value[-1],
        f"mean {one.name}: its {len(one.nodes)} nodes lie on a line or in a point and do not determine its rotation: "
        "give three nodes that are not on a line",
    )
    inverse = (vector / value) @ vector.T / np.outer(scale, scale)
    return np.asarray(np.einsum("ab,kib->aki", inverse, weighted).reshape(6, -1))


def freedom_map(
    nodes: FloatArray,
    bodies: Sequence[RigidBody],
    averages: Sequence[Average],
    relations: Sequence[Relation],
    held: IntArray,
) -> sp.csr_matrix:
    """Return the map T from independent, free unknowns to the motions of all nodes.

    nodes (n, 3): nodes (m).
    held (n, 6) bool array: fixed motions of the nodes.
    Returns (6 n, r) sparse matrix: map. Unknowns of the nodes come first, in their order; six of every body's
    reference point follow.
    """
    count = len(nodes)
    size = 6 * (count + len(bodies))
    rows = _Rows(size)
    fixed = np.concatenate([held.ravel(), *(body.held for body in bodies)]).astype(bool)
    for number, body in enumerate(bodies):
        _follow_body(rows, body, nodes, 6 * (count + number))
    for relation in relations:
        follower = np.array([6 * relation.node + relation.component])
        columns = 6 * relation.nodes + relation.components
        rows.add(relation.name, follower, _table(np.zeros_like(columns), columns, relation.coefficients, (1, size)))
    for average in averages:
        _follow_average(rows, average, nodes, fixed)
    dependent = np.zeros(size, dtype=bool)
    dependent[list(rows.owner)] = True
    both = np.flatnonzero(dependent & fixed)
    require(
        not both.size,
        f"node freedom {1 + int(both[:1].sum()) % 6} is held and follows {rows.owner.get(int(both[:1].sum()))}: "
        "hold what it follows instead",
    )
    own = np.flatnonzero(~dependent)
    select = sp.csr_matrix((np.ones(len(own)), (own, own)), shape=(size, size))
    if rows.row:
        row, source, value = np.concatenate(rows.row), np.concatenate(rows.column), np.concatenate(rows.value)
        follow = sp.csr_matrix(_table(row, source, value, (size, size)))
        whole = _resolved(select, follow)
    else:
        whole = select
    free = np.flatnonzero(~dependent & ~fixed)
    return sp.csr_matrix(whole[: 6 * count, free])


def _table(rows: IntArray, columns: IntArray, values: FloatArray, shape: tuple[int, int]) -> sp.coo_matrix:
    return sp.coo_matrix((values, (rows, columns)), shape=shape)


def _resolved(select: sp.csr_matrix, follow: sp.csr_matrix) -> sp.csr_matrix:
    """Return (I − follow)⁻¹ select: motions that follow others that follow in turn."""
    whole = term = select
    for _ in range(_CHAIN):
        term = sp.csr_matrix(follow @ term)
        term.eliminate_zeros()
        if term.nnz == 0:
            return sp.csr_matrix(whole)
        whole = whole + term
    raise InputError(f"rigid sets, means or ties follow one another in a circle, or by more than {_CHAIN} links")


def _follow_body(rows: _Rows, body: RigidBody, nodes: FloatArray, first: int) -> None:
    motion = rigid_motion(nodes[body.nodes] - body.reference)
    components = 6 if body.rotations else 3
    index, row, column = np.nonzero(motion[:, :components])
    own = (6 * body.nodes[:, None] + np.arange(components)).ravel()
    table = _table(index * components + row, first + column, motion[index, row, column], (len(own), rows.unknowns))
    rows.add(f"rigid set {body.name}", own, table)


def _follow_average(rows: _Rows, one: Average, nodes: FloatArray, fixed: IntArray) -> None:
    """Let the mean follow its nodes; or six motions of these follow the mean, where it follows another or is held."""
    name = f"mean {one.name}"
    gather = average_map(one, nodes)[one.components]
    own = 6 * one.node + np.flatnonzero(one.components)
    members = (6 * one.nodes[:, None] + np.arange(6)).ravel()
    bound = np.array([row in rows.owner or bool(fixed[row]) for row in own.tolist()])
    if not bound.any():
        index, column = np.nonzero(gather)
        rows.add(name, own, _table(index, members[column], gather[index, column], (len(own), rows.unknowns)))
        return
    free = np.array([row not in rows.owner and not fixed[row] for row in members.tolist()])
    pivot = np.zeros(0, dtype=np.int64)
    if free.any():
        candidates = np.flatnonzero(free)
        _, upper, order = scipy.linalg.qr(gather[:, candidates], mode="economic", pivoting=True)
        size = np.abs(upper.diagonal())
        if len(size) >= len(own) and size[len(own) - 1] > _DEPENDENT * size[0]:
            pivot = candidates[order[: len(own)]]
    require(
        len(pivot) == len(own),
        f"{name}: its nodes are held or follow rigid sets, and it follows another item: leave it out",
    )
    rest = np.setdiff1d(np.flatnonzero(np.abs(gather).any(axis=0)), pivot)
    inverse = np.linalg.inv(gather[:, pivot])
    table = np.hstack([inverse, -inverse @ gather[:, rest]])
    columns = np.concatenate([own, members[rest]])
    index, column = np.nonzero(table)
    rows.add(name, members[pivot], _table(index, columns[column], table[index, column], (len(pivot), rows.unknowns)))
