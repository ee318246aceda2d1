"""Outer faces of shells: half the thickness in front of the middle surface, where the air begins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nvhchain.fem.structural.model import ShellBlock
from nvhchain.handoff import FloatArray, IntArray

_SOFT = 1e-2
"""Share of the mean stiffness that holds a node where no facet asks for a motion, such as along a smooth wall."""

_FARTHEST = 1.75
"""Largest motion of a node over the largest depth: a corner of three walls at right angles moves by √3."""

_ON_PLANE = 1e-3
"""Distance from the mounting plane over the depth, below which a node stays on it."""

_THREE_OF_FOUR = [(0, 1, 2), (1, 2, 3), (2, 3, 0), (3, 0, 1)]


def face_depths(nodes: FloatArray, facets: IntArray, shells: Sequence[ShellBlock]) -> FloatArray:
    """Return the distances (k,) m from the nodes of facets to the face of the shell on the facet's side.

    nodes : (n, 3) m.
    facets : (k, 3) or more, outward sides of shells.

    Half the thickness, and the offset of the section in or against the direction of the facet. 0 for facets that are of
    no shell.
    """
    known: dict[tuple[int, ...], tuple[float, float, FloatArray]] = {}
    for block in shells:
        cuts = _THREE_OF_FOUR if block.nodes.shape[1] == 4 else [(0, 1, 2)]
        for cut in cuts:
            corners = block.nodes[:, list(cut)]
            a, b, c = nodes[corners].transpose(1, 0, 2)
            normal = np.cross(b - a, c - a)
            keys = map(tuple, np.sort(corners, axis=1).tolist())
            known |= dict(zip(keys, zip(block.thickness / 2, block.offset, normal, strict=True), strict=True))
    depths = np.zeros(len(facets))
    a, b, c = nodes[facets[:, :3]].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    for row, key in enumerate(map(tuple, np.sort(facets[:, :3], axis=1).tolist())):
        if key in known:
            half, offset, normal = known[key]
            depths[row] = half + offset * np.sign(normal @ normals[row])
    return depths


def outer_nodes(
    nodes: FloatArray, facets: IntArray, depth: FloatArray, floor: tuple[FloatArray, FloatArray] | None
) -> FloatArray:
    """Return nodes (n, 3) m of which those of `facets` lie at the faces of the shells.

    facets : (k, 6) facets in contact with the air, with the middles of their edges.
    depth : (k,) distance from the nodes to the air (m).
    floor : point and normal of the mounting plane, on which nodes stay.

    A node goes where all facets around it, moved by their depths, meet. Between opposite sides of one shell it stays.
    Its motion is still that of the middle surface.
    """
    moved = _displaced(nodes, facets, depth, floor)
    corners, middles = facets[:, :3], facets[:, 3:]
    halfway = (moved[corners] + moved[np.roll(corners, -1, axis=1)]) / 2
    moved[middles.ravel()] = halfway.reshape(-1, 3)
    return nodes + moved


def _displaced(
    nodes: FloatArray, facets: IntArray, depth: FloatArray, floor: tuple[FloatArray, FloatArray] | None
) -> FloatArray:
    """Return the displacements (n, 3) m of corners that move every facet by its depth along its normal."""
    a, b, c = nodes[facets[:, :3]].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(area, np.finfo(float).tiny)[:, None]
    matrix, right = np.zeros((len(nodes), 3, 3)), np.zeros((len(nodes), 3))
    for corner in facets[:, :3].T:
        np.add.at(matrix, corner, area[:, None, None] * normal[:, :, None] * normal[:, None, :])
        np.add.at(right, corner, (area * depth)[:, None] * normal)
    used = np.unique(facets[:, :3])
    stiff = matrix[used] + _SOFT / 3 * np.trace(matrix[used], axis1=1, axis2=2)[:, None, None] * np.eye(3)
    moved = np.zeros_like(nodes)
    moved[used] = (1 + _SOFT / 3) * np.linalg.solve(stiff, right[used][:, :, None])[:, :, 0]
    farthest = _FARTHEST * np.abs(depth).max()
    moved *= np.minimum(1.0, farthest / np.maximum(np.linalg.norm(moved, axis=1), farthest))[:, None]
    if floor is not None:
        point, up = floor
        standing = np.abs((nodes - point) @ up) < _ON_PLANE * farthest
        moved[standing] -= (moved[standing] @ up)[:, None] * up
    return moved
