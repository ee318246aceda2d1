"""Ties: nodes follow the nearest place on a surface of element faces, by the shape functions of the face."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.errors import require
from nvhchain.fem.structural.model import Relation, Tie
from nvhchain.fem.triangles import squared_distance
from nvhchain.handoff import FloatArray, IntArray

_TOLERANCE = 0.05
"""Default distance of tied nodes from the surface over the mean edge of its faces."""

_NEAR = 24
"""Number of triangles with the nearest centroids among which the nearest one is sought."""

_STEPS, _STILL = 10, 1e-12
"""Largest number of Newton steps for the place within a face, and the change that ends them."""


def tied_relations(
    nodes: FloatArray, tie: Tie, turning: IntArray, notes: list[str]
) -> tuple[tuple[Relation, ...], FloatArray]:
    """Return relations of the tied nodes, and nodes (n, 3) m with these moved onto the surface if the tie adjusts.

    turning : nodes with rotations, which are tied, too, where all nodes of the face have them.

    Raises InputError if no node lies within the tolerance.
    """
    faces = tie.faces
    slaves = np.setdiff1d(tie.nodes, faces)
    if not len(slaves):
        return (), nodes
    four = np.flatnonzero(faces[:, 3] >= 0)
    triangles = np.concatenate([faces[:, :3], faces[four][:, [0, 2, 3]]])
    owner = np.concatenate([np.arange(len(faces)), four])
    corners = nodes[triangles]
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    tolerance = _TOLERANCE * edge if tie.tolerance is None else tie.tolerance
    points = nodes[slaves]
    near = cKDTree(corners.mean(axis=1)).query(points, k=min(_NEAR, len(corners)))[1].reshape(len(points), -1)
    distance = np.sqrt(squared_distance(points[:, None], corners[near]))
    close = distance.min(axis=1) <= tolerance
    require(
        bool(close.any()),
        f"tie {tie.name} ties nothing: the nearest of its {len(slaves)} nodes is {1e3 * distance.min():.3g} mm from "
        f"the surface, {1e3 * tolerance:.3g} mm are admitted: state a larger tolerance",
    )
    if not close.all():
        notes.append(
            f"tie {tie.name}: {int((~close).sum())} nodes farther than {1e3 * tolerance:.3g} mm from the surface are "
            "not tied"
        )
    best = owner[near[np.arange(len(points)), distance.argmin(axis=1)]]
    relations, moved = [], nodes.copy()
    for i in np.flatnonzero(close).tolist():
        node, face = int(slaves[i]), faces[best[i]]
        members, share = _shares(points[i], face, nodes)
        if tie.adjust:
            moved[node] = share @ nodes[members]
        turns = tie.rotations and bool(np.isin([node, *members.tolist()], turning).all())
        for component in range(6 if turns else 3):
            relations.append(
                Relation(f"tie {tie.name}", node, component, members, np.full(len(members), component), share)
            )
    return tuple(relations), moved


def _shares(point: FloatArray, face: IntArray, nodes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the nodes of a face (8,) and their shares of the motion of its place nearest to a point."""
    count = 3 if face[3] < 0 else 4
    corners, place = nodes[face[:count]], np.zeros(2) if count == 4 else np.full(2, 1 / 3)
    for _ in range(_STEPS):
        shape, slope = _linear(place, count)
        step = np.linalg.lstsq(corners.T @ slope, point - shape @ corners, rcond=None)[0]
        place = place + step
        if np.abs(step).max() < _STILL:
            break
    if count == 4:
        place = place.clip(-1.0, 1.0)
    else:
        place = place.clip(0.0, 1.0)
        place = place / max(1.0, place.sum())
    middles = face[4 : 4 + count]
    if (middles < 0).any():
        return face[:count], _linear(place, count)[0]
    return np.concatenate([face[:count], middles]), _quadratic(place, count)


def _linear(place: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return shape functions (count,) and gradients (count, 2) of a face with straight edges."""
    r, s = place
    if count == 3:
        return np.array([1 - r - s, r, s]), np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    x, y = 1 + r * corners[:, 0], 1 + s * corners[:, 1]
    return x * y / 4, np.column_stack([corners[:, 0] * y, corners[:, 1] * x]) / 4


def _quadratic(place: FloatArray, count: int) -> FloatArray:
    """Return shape functions of a face with six or eight nodes, corners first, then the middles of its edges."""
    linear, _ = _linear(place, count)
    if count == 3:
        return np.concatenate([linear * (2 * linear - 1), 4 * linear * np.roll(linear, -1)])
    r, s = place
    middles = 0.5 * np.array(
        [(1 - r * r) * (1 - s), (1 + r) * (1 - s * s), (1 - r * r) * (1 + s), (1 - r) * (1 - s * s)]
    )
    return np.concatenate([linear - 0.5 * (middles + np.roll(middles, 1)), middles])
