"""Rigid sets of an imported model, or nodes of modal results, that carry the bearings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from nvhchain.errors import InputError, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.skin.surface_nets import BoolArray

SEAT_TOLERANCE = 1e-4
"""Largest distance (m) between a rigid set's reference point and a bearing."""

_FEWEST = 6
"""Least number of nodes in the wall of a rigid seat, and of modes that show it."""

_RIGID = 3e-5
"""Largest distance of a wall from rigid motion over the largest displacement of a mode: files have five digits."""

_RESTING = 1e-9
"""Largest displacement of a node at rest over the largest of all."""

_SEVERAL = 50
"""Largest number of nodes that tell the rotation of a seat."""


def bearing_seats(
    model: SolidModel, positions: Mapping[str, Sequence[float]], names: Mapping[str, str] | None = None
) -> tuple[RigidSet, ...]:
    """Return the rigid set of every bearing, renamed to the bearing.

    Parameters
    ----------
    model : SolidModel
        Imported model.
    positions : mapping of str to sequence of float
        Bearing → centre of its seat (m).
    names : mapping of str to str, optional
        Bearing → name of a rigid set (RBE2 or coupling), number of its reference node, or name of a node group. A node
        group is made rigid about the position. By default a bearing has the set whose reference point is at its
        position.

    Returns
    -------
    tuple of RigidSet
        Seats in the order of `positions`.

    Raises
    ------
    InputError
        For a bearing without a seat.
    """
    names = names or {}
    _check_names(names, positions)
    return tuple(
        _seat(model, bearing, np.array(centre, dtype=float), names.get(bearing))
        for bearing, centre in positions.items()
    )


def seat_rows(
    model: ModalModel, positions: Mapping[str, Sequence[float]], labels: Mapping[str, int] | None = None
) -> IntArray:
    """Return the rows of the nodes that move as the seats of the bearings.

    positions: bearing → centre of its seat (m).
    labels: bearing → node of the file; by default the node at the position.
    Returns (n_bearing,) of int: rows of `model.nodes`.
    """
    labels = labels or {}
    require(len(positions) > 0, "no bearing seats are given: at least one is needed")
    _check_names(labels, positions)
    rows = np.array(
        [_node(model, name, np.array(centre, float), labels.get(name)) for name, centre in positions.items()]
    )
    for name, row in zip(positions, rows, strict=True):
        require(
            bool(model.shapes[:, row].any()),
            f"bearing {name}: node {model.labels[row]} of {model.source} moves in no mode: export displacements "
            "at it, or name a node of the seat that has them",
        )
    return rows


def seat_walls(model: ModalModel, seats: IntArray, skin: IntArray) -> list[IntArray]:
    """Return the nodes of the skin that move with each rigid seat, such as the wall of its bore.

    seats: (n_bearing,) rows of the nodes that move as the seats.
    skin: (n,) rows of nodes of the skin.
    Returns rows of at least `_FEWEST` nodes for every rigid seat; a seat whose surroundings bend has none.

    u_i = u_seat + θ × (x_i − x_seat) in every mode. Nodes that keep their distance from the seat tell θ.
    """
    largest = np.abs(model.shapes).max(axis=(1, 2))
    bending = (model.frequency > 0) & (largest > 0)
    shapes = model.shapes[bending] / largest[bending][:, None, None]
    others = np.setdiff1d(skin, seats)
    found = []
    for seat in seats if bending.sum() >= _FEWEST else ():
        arm, moved = model.nodes[others] - model.nodes[seat], shapes[:, others] - shapes[:, [seat]]
        length = np.linalg.norm(arm, axis=1)
        stretched = np.abs(np.einsum("mni,ni->mn", moved, arm)).max(axis=0)
        kept = np.flatnonzero(stretched < _RIGID * length)
        kept = kept[np.argsort(length[kept])][:_SEVERAL]
        turning = np.cross(np.eye(3), arm[:, None]).transpose(0, 2, 1)  # (n, 3, 3): turning @ θ = θ × arm
        right = moved[:, kept].reshape(len(moved), -1).T
        angles = np.linalg.lstsq(turning[kept].reshape(-1, 3), right)[0]
        apart = np.abs(moved - np.einsum("nij,jm->mni", turning, angles)).max(axis=(0, 2))
        if (apart < _RIGID).sum() >= _FEWEST:
            found.append(others[apart < _RIGID])
    return found


def resting_nodes(model: ModalModel) -> BoolArray:
    """Return a mask (n,) of the nodes that move in no mode."""
    largest = np.abs(model.shapes).max(axis=(0, 2))
    return np.asarray(largest <= _RESTING * largest.max())


def held_holes(model: ModalModel, facets: IntArray) -> list[IntArray]:
    """Return the nodes of every hole, such as that of a bolt, whose wall moves in no mode.

    facets: (k, 6) nodes of the skin's facets, outward; middles of edges may lie beyond the model's nodes.
    """
    held = facets[resting_nodes(model)[facets[:, :3]].all(axis=1)]
    edges = held[:, [0, 1, 2]].ravel(), held[:, [1, 2, 0]].ravel()
    graph = sp.coo_matrix((np.ones(len(edges[0])), edges), shape=(len(model.nodes),) * 2)
    patches = connected_components(graph, directed=False)[1][held[:, 0]]
    holes = []
    for number in np.unique(patches):
        patch = held[patches == number]
        a, b, c = model.nodes[patch[:, :3]].transpose(1, 0, 2)
        normal, extent = np.cross(b - a, c - a), np.ptp(a, axis=0)
        inward = np.einsum("ka,ka->k", normal, a.min(axis=0) + extent / 2 - a)
        if (inward > 0.1 * extent.max() * np.linalg.norm(normal, axis=1)).all():
            nodes = np.unique(patch)
            holes.append(nodes[nodes < len(model.nodes)])
    return holes


def _check_names(names: Iterable[str], positions: Mapping[str, Sequence[float]]) -> None:
    unknown = sorted(set(names) - set(positions))
    require(
        not unknown, f"seats are named for {', '.join(unknown)}, which are no bearings: known {', '.join(positions)}"
    )


def _node(model: ModalModel, bearing: str, position: FloatArray, label: int | None) -> int:
    if label is not None:
        found = np.flatnonzero(model.labels == label)
        require(len(found) == 1, f"bearing {bearing}: {model.source} has no node {label}")
        return int(found[0])
    distance = np.linalg.norm(model.nodes - position, axis=1)
    nearest = int(distance.argmin())
    require(
        float(distance[nearest]) <= SEAT_TOLERANCE,
        f"bearing {bearing}: the nearest node of {model.source}, {model.labels[nearest]}, is "
        f"{1e3 * distance[nearest]:.3g} mm from its seat, {1e3 * SEAT_TOLERANCE:g} mm are admitted: name the node",
    )
    return nearest


def _carriers(model: SolidModel) -> tuple[RigidSet, ...]:
    """Return rigid sets, and for every mean (RBE3, distributing coupling) one of its reference node alone."""
    means = tuple(
        RigidSet(mean.name, model.nodes[mean.node].copy(), np.array([mean.node]), int(model.labels[mean.node]))
        for mean in model.structure.averages
        if mean.components.all()
    )
    return (*model.rigid_sets, *means)


def _seat(model: SolidModel, bearing: str, position: FloatArray, name: str | None) -> RigidSet:
    carriers = _carriers(model)
    known = ", ".join(f"{r.name} at {np.round(1e3 * r.reference, 3).tolist()} mm" for r in carriers) or "none"
    if name is None:
        distance = [float(np.linalg.norm(rigid.reference - position)) for rigid in carriers]
        nearest = min(distance, default=np.inf)
        require(
            nearest <= SEAT_TOLERANCE,
            f"bearing {bearing} at {np.round(1e3 * position, 3).tolist()} mm has no rigid set of {model.source} within "
            f"{1e3 * SEAT_TOLERANCE:g} mm; there are: {known}",
        )
        return replace(carriers[distance.index(nearest)], name=bearing)
    for rigid in carriers:
        if name in (rigid.name, str(rigid.label)):
            return replace(rigid, name=bearing)
    if name in model.groups:
        return RigidSet(bearing, position, np.unique(model.groups[name]))
    raise InputError(
        f"bearing {bearing}: {model.source} has no rigid set or node group {name!r}; rigid sets: {known}; "
        f"groups: {', '.join(model.groups) or 'none'}"
    )
