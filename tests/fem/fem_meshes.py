"""Small structured meshes for the tests."""

import numpy as np

from nvhchain.fem.elements import HEX20_EDGES, HEX_CORNERS, TET10_EDGES

TETRAHEDRA_OF_BRICK = ((0, 1, 3, 7), (0, 1, 7, 4), (1, 2, 3, 7), (1, 2, 7, 6), (1, 5, 7, 4), (1, 5, 6, 7))


def brick(counts, lengths, distort=0.0):
    """hex20 nodes and elements of a box; `distort` moves inner corner nodes by parts of the cell size."""
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


def tetrahedra(counts, lengths, distort=0.0):
    """tet10 nodes and elements: six tetrahedra for each brick."""
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


def rigid_motions(nodes):
    """Three translations and three small rotations about the origin, (3 n, 6)."""
    motion = np.zeros((len(nodes), 3, 6))
    for axis in range(3):
        motion[:, axis, axis] = 1.0
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    return motion.reshape(-1, 6)
