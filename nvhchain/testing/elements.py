"""Structured meshes of solid elements: bricks, tetrahedra, and a held box with a rigid seat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nvhchain.conventions import STEEL, Material
from nvhchain.fem.elements import HEX20_EDGES, HEX_CORNERS, TET10_EDGES
from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel
from nvhchain.handoff import FloatArray, IntArray

TETRAHEDRA_OF_BRICK = ((0, 1, 3, 7), (0, 1, 7, 4), (1, 2, 3, 7), (1, 2, 7, 6), (1, 5, 7, 4), (1, 5, 6, 7))
SPLITS = {
    "hex8": ((0, 1, 2, 3, 4, 5, 6, 7),),
    "wedge6": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
    "tet4": TETRAHEDRA_OF_BRICK,
}
"""Corners of the elements that a brick is split into."""


def brick(counts: Sequence[int], lengths: Sequence[float], distort: float = 0.0) -> tuple[FloatArray, IntArray]:
    """Mesh a box from the origin with quadratic bricks.

    counts, lengths : (3,) elements along every axis, and edges of the box, m.
    """
    grid = [np.linspace(0.0, length, 2 * n + 1) for n, length in zip(counts, lengths, strict=True)]
    corners, edges = HEX_CORNERS, np.array(HEX20_EDGES)
    local = np.vstack([corners, (corners[edges[:, 0]] + corners[edges[:, 1]]) / 2]).astype(int) + 1
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    index = 2 * cells + local
    shape = [2 * n + 1 for n in counts]
    flat = np.ravel_multi_index(tuple(np.moveaxis(index, -1, 0)), shape)
    used, elements = np.unique(flat, return_inverse=True)
    where = np.stack(np.unravel_index(used, shape), axis=-1)
    nodes = np.column_stack([grid[a][where[:, a]] for a in range(3)])
    elements = elements.reshape(flat.shape)
    if distort:
        inner = np.all((nodes > 1e-9) & (nodes < np.array(lengths) - 1e-9), axis=1)
        corner = np.all(where % 2 == 0, axis=1) & inner
        cell = np.array(lengths) / np.array(counts)
        nodes[corner] += np.random.default_rng(1).uniform(-distort, distort, (corner.sum(), 3)) * cell
        nodes[elements[:, 8:]] = (nodes[elements[:, edges[:, 0]]] + nodes[elements[:, edges[:, 1]]]) / 2
    return nodes, elements


def tetrahedra(counts: Sequence[int], lengths: Sequence[float], distort: float = 0.0) -> tuple[FloatArray, IntArray]:
    """Mesh a box with tet10, six for each `brick`: nodes (n, 3) m and elements (m, 10)."""
    nodes, bricks = brick(counts, lengths, distort)
    corners = bricks[:, :8][:, TETRAHEDRA_OF_BRICK].reshape(-1, 4)
    jacobian = np.linalg.det(nodes[corners[:, 1:]] - nodes[corners[:, :1]])
    corners[jacobian < 0] = corners[jacobian < 0][:, [1, 0, 2, 3]]
    used, corners = np.unique(corners, return_inverse=True)
    corners, nodes = corners.reshape(-1, 4), nodes[used]
    pairs = np.sort(corners[:, np.array(TET10_EDGES)], axis=-1)
    edge, slot = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    middle = len(nodes) + slot.reshape(len(corners), 6)
    return np.vstack([nodes, nodes[edge].mean(axis=1)]), np.hstack([corners, middle])


def rigid_motions(nodes: FloatArray) -> FloatArray:
    """Compute three translations and three small rotations about the origin of nodes (n, 3): (3 n, 6)."""
    motion = np.zeros((len(nodes), 3, 6))
    for axis in range(3):
        motion[:, axis, axis] = 1.0
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    return motion.reshape(-1, 6)


def grid(counts: Sequence[int], lengths: Sequence[float]) -> tuple[FloatArray, IntArray]:
    """Mesh a box from the origin with linear bricks: nodes (n, 3) m and elements (m, 8)."""
    axes = [np.linspace(0.0, length, n + 1) for n, length in zip(counts, lengths, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape([n + 1 for n in counts])
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    i, j, k = (a.ravel() for a in np.indices(counts))
    return nodes, np.stack([number[i + a, j + b, k + c] for a, b, c in corner], axis=1)


def positive(nodes: FloatArray, elements: IntArray) -> IntArray:
    """Order the corners of tetrahedra (m, 4), in place, so that all volumes are positive."""
    inverted = np.linalg.det(nodes[elements[:, 1:]] - nodes[elements[:, :1]]) < 0
    elements[inverted] = elements[inverted][:, [0, 2, 1, 3]]
    return elements


def held_box(
    kind: str,
    counts: Sequence[int] = (3, 2, 1),
    lengths: Sequence[float] = (0.2, 0.06, 0.05),
    material: Material = STEEL,
    held: bool = True,
) -> SolidModel:
    """Build a box as another program would export it: one end held, a rigid seat at the other.

    counts, lengths : (3,) bricks along every axis, each split into elements, and edges of the box, m.
    """
    nodes, bricks = grid(counts, lengths)
    elements = bricks[:, SPLITS[kind]].reshape(-1, len(SPLITS[kind][0]))
    if kind == "tet4":
        elements = positive(nodes, elements)
    count = len(nodes)
    ends = [np.flatnonzero(nodes[:, 0] < 1e-9), np.flatnonzero(nodes[:, 0] > lengths[0] - 1e-9)]
    sets = [
        RigidSet("FOOT", nodes[ends[0]].mean(axis=0), ends[0], count + 1, np.full(6, held)),
        RigidSet("S", nodes[ends[1]].mean(axis=0), ends[1], count + 2),
    ]
    return SolidModel(
        nodes=nodes,
        labels=np.arange(1, count + 1),
        blocks=(ElementBlock(kind, elements, material, np.arange(1, len(elements) + 1), "BOX"),),
        rigid_sets=tuple(sets if held else sets[1:]),
        held=np.zeros((count, 3), dtype=bool),
        groups={"TOP": np.flatnonzero(nodes[:, 2] > lengths[2] - 1e-9)},
        source=f"box of {kind}",
    )
