"""Stiffness and mass of shells, beams, springs and masses, with six unknowns per node: 6·node + component."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from nvhchain.fem.structural.beams import beam_matrices
from nvhchain.fem.structural.model import Structure
from nvhchain.fem.structural.shells import shell_matrices
from nvhchain.handoff import FloatArray, IntArray

_GROUND = -1


def structure_matrices(nodes: FloatArray, structure: Structure) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return stiffness and mass of all items.

    nodes (n, 3): nodes (m).
    Returns K, M (6 n, 6 n) sparse matrix: stiffness (N/m, N, N m) and mass (kg, kg m, kg m²).
    """
    count = len(nodes)
    groups = [*(block.nodes for block in structure.shells), *(block.nodes for block in structure.beams)]
    if structure.springs is not None:
        groups.append(structure.springs.nodes)
    if structure.masses is not None:
        groups.append(structure.masses.nodes[:, None])
    if not groups:
        empty = sp.csr_matrix((6 * count, 6 * count))
        return empty, empty.copy()
    pairs = np.unique(np.concatenate([_keys(members, count) for members in groups]))
    pairs = pairs[pairs >= 0]
    stiffness, mass = np.zeros((len(pairs), 36)), np.zeros((len(pairs), 36))
    for members, K, M in _element_matrices(nodes, structure):
        key = _keys(members, count)
        known = key >= 0
        slot = np.searchsorted(pairs, key[known])
        for total, own in ((stiffness, K), (mass, M)):
            if own is not None:
                _add(total, slot, _node_blocks(own)[known])
    start = np.searchsorted(pairs, np.arange(count + 1) * count)
    size = (6 * count, 6 * count)
    K_all, M_all = (
        sp.bsr_matrix((values.reshape(-1, 6, 6), pairs % count, start), shape=size).tocsr()
        for values in (stiffness, mass)
    )
    for matrix in (K_all, M_all):
        matrix.eliminate_zeros()
    return K_all, M_all


def _element_matrices(
    nodes: FloatArray, structure: Structure
) -> Iterator[tuple[IntArray, FloatArray | None, FloatArray | None]]:
    for shells in structure.shells:
        yield from shell_matrices(nodes, shells)
    for beams in structure.beams:
        yield beams.nodes, *beam_matrices(nodes, beams)
    if structure.springs is not None:
        yield structure.springs.nodes, structure.springs.stiffness, None
    if structure.masses is not None:
        yield structure.masses.nodes[:, None], None, structure.masses.matrix


def _keys(members: IntArray, count: int) -> IntArray:
    """Return a number (m · k²,) for every pair of nodes of elements (m, k); −1 with the ground."""
    key = members[:, :, None] * count + members[:, None, :]
    grounded = members == _GROUND
    key[grounded[:, :, None] | grounded[:, None, :]] = -1
    return np.asarray(key.ravel())


def _node_blocks(matrices: FloatArray) -> FloatArray:
    """Return 6 × 6 blocks (m · k², 36) of element matrices (m, 6 k, 6 k)."""
    m, size, _ = matrices.shape
    k = size // 6
    return matrices.reshape(m, k, 6, k, 6).transpose(0, 1, 3, 2, 4).reshape(-1, 36)


def _add(total: FloatArray, slot: IntArray, blocks: FloatArray) -> None:
    """Add blocks (b, 36) to the rows `slot` (b,) of the sums."""
    gather = sp.csr_matrix((np.ones(len(slot)), (slot, np.arange(len(slot)))), shape=(len(total), len(slot)))
    total += gather @ blocks
