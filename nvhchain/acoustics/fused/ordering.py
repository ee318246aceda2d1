"""Order of triangles, rows and columns in the fused engine, and ownership of rows."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.fused.points import TILE
from nvhchain.handoff import FloatArray, IntArray

BLOCK = 64
"""Test triangles assembled together; their rows are written once per tile and must fit into the cache until then."""


@dataclass(frozen=True)
class Block:
    """Test triangles assembled together and the rows they may write.

    triangles : (n_test,) triangles in sorted numbering.
    rows : (n_row,) vertices.
    lines : (n_test, 3) indices into `rows`, or n_row + corner.
    """

    triangles: IntArray
    rows: IntArray
    lines: IntArray


@dataclass(frozen=True)
class Part:
    """Rows that one thread assembles; no other part writes them, so that parts need no lock and add in fixed order.

    rows : (n_row,) vertices.
    triangles : (n_test,) all triangles that touch them, in sorted numbering.
    blocks : the same triangles in portions.
    """

    rows: IntArray
    triangles: IntArray
    blocks: tuple[Block, ...]


def sorted_tiles(centroids: FloatArray) -> tuple[IntArray, IntArray]:
    """Return (order, first of every tile): triangles halved along their longest extent until at most TILE remain."""
    leaves: list[IntArray] = []
    stack = [np.arange(len(centroids))]
    while stack:
        group = stack.pop()
        if len(group) <= TILE:
            leaves.append(group)
            continue
        axis = int(np.argmax(np.ptp(centroids[group], axis=0)))
        group = group[np.argsort(centroids[group, axis], kind="stable")]
        half = -(-len(group) // (2 * TILE)) * TILE  # all tiles but one are full
        stack += [group[half:], group[:half]]
    return np.concatenate(leaves), np.cumsum([0] + [len(leaf) for leaf in leaves])


def distribute_rows(triangles: IntArray, tiles: IntArray, n_vertex: int, n_part: int) -> tuple[Part, ...]:
    """Distribute the rows to at most `n_part` non-empty parts; border triangles belong to both sides."""
    n_part = min(n_part, len(tiles) - 1)
    limits = tiles[np.linspace(0, len(tiles) - 1, n_part + 1).astype(int)]
    owner = np.full(n_vertex, n_part)
    np.minimum.at(
        owner, triangles.ravel(), np.repeat(np.searchsorted(limits, np.arange(len(triangles)), "right") - 1, 3)
    )
    return tuple(make_part(triangles, owner == part) for part in np.unique(owner[owner < n_part]))


def make_part(triangles: IntArray, owned: NDArray[np.bool_]) -> Part:
    """Return the part that assembles the rows of the vertices that are `owned`, (n_v,)."""
    mine = np.flatnonzero(owned[triangles].any(axis=1))
    blocks = []
    for test in np.array_split(mine, -(-len(mine) // BLOCK)):
        own = owned[triangles[test]]
        rows = np.unique(triangles[test][own])
        lines = np.where(own, np.searchsorted(rows, triangles[test]), len(rows) + np.arange(3))
        blocks.append(Block(test, rows, lines))
    return Part(np.flatnonzero(owned), mine, tuple(blocks))


RESTORE_COLUMNS = "void(int64[::1], int64[::1], int64[::1], cplx[:,:,::1], cplx[:,:,::1])"
"""Signature of `restore_columns`."""


def restore_columns(
    rows,  # rows of A and B to restore
    vertex_rank,  # (n_v,) column of A that holds every vertex
    face_rank,  # (n_face,) column of B that holds every face
    a,  # (n_k, n_row, n_v) changed in place
    b,  # (n_k, n_row, n_face) changed in place
):
    """Move the columns from the order of the sorted triangles to the caller's numbering."""
    line = np.empty(len(face_rank), a.dtype)
    n_vertex, n_face = len(vertex_rank), len(face_rank)
    for ik in range(a.shape[0]):
        for row in rows:
            for j in range(n_vertex):
                line[j] = a[ik, row, j]
            for j in range(n_vertex):
                a[ik, row, j] = line[vertex_rank[j]]
            for j in range(n_face):
                line[j] = b[ik, row, j]
            for j in range(n_face):
                b[ik, row, j] = line[face_rank[j]]
