"""Boxes of linear elements as foreign models: held at one end, a rigid seat at the other."""

import numpy as np

from nvhchain.conventions import STEEL
from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel

SPLITS = {
    "hex8": [[0, 1, 2, 3, 4, 5, 6, 7]],
    "wedge6": [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]],
    "tet4": [[0, 1, 3, 7], [0, 1, 7, 4], [1, 2, 3, 7], [1, 2, 7, 6], [1, 5, 7, 4], [1, 5, 6, 7]],
}


def grid(counts, lengths):
    """Nodes (n, 3) m and bricks (m, 8) of a box from the origin."""
    axes = [np.linspace(0.0, length, n + 1) for n, length in zip(counts, lengths, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape([n + 1 for n in counts])
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    i, j, k = (a.ravel() for a in np.indices(counts))
    return nodes, np.stack([number[i + a, j + b, k + c] for a, b, c in corner], axis=1)


def turned(nodes, tetrahedra):
    """Tetrahedra with positive volume."""
    inside_out = np.linalg.det(nodes[tetrahedra[:, 1:]] - nodes[tetrahedra[:, :1]]) < 0
    tetrahedra[inside_out] = tetrahedra[inside_out][:, [0, 2, 1, 3]]
    return tetrahedra


def box(kind, counts=(3, 2, 1), lengths=(0.2, 0.06, 0.05), material=STEEL, held=True):
    """Box of `kind`; the end at x = 0 is held by a rigid set, the seat `S` moves the other end."""
    nodes, bricks = grid(counts, lengths)
    elements = bricks[:, SPLITS[kind]].reshape(-1, len(SPLITS[kind][0]))
    if kind == "tet4":
        elements = turned(nodes, elements)
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
