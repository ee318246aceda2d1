"""Shape of an imported housing for pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nvhchain.fem.faces import boundary_faces, flat_triangles, six_node_facets
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import CORNERS, EDGES, SolidModel
from nvhchain.handoff import IntArray
from nvhchain.housing.imported.seats import bearing_seats, seat_rows
from nvhchain.housing.skin.shape import HousingShape


def model_shape(
    model: SolidModel, positions: Mapping[str, Sequence[float]], names: Mapping[str, str] | None = None
) -> HousingShape:
    """Return the surface of imported elements with bearing seats and held nodes.

    Returns surface; held nodes and every held rigid set are supports.
    """
    elements = []
    for block in model.blocks:
        missing = CORNERS[block.shape] + len(EDGES[block.shape]) - block.nodes.shape[1]
        elements.append((block.shape, np.pad(block.nodes, ((0, 0), (0, missing)), constant_values=-1)))
    shells = [np.pad(b.nodes, ((0, 0), (0, 8 - b.nodes.shape[1])), constant_values=-1) for b in model.structure.shells]
    solids = [boundary_faces(elements, model.labels, model.source)] if elements else []
    facets, centres = six_node_facets(np.concatenate([*solids, *shells]), len(model.nodes))
    held = np.flatnonzero(model.held.any(axis=1))
    supports = [rigid.nodes for rigid in model.rigid_sets if rigid.held.any()]
    return HousingShape(
        np.vstack([model.nodes, centres @ model.nodes]),
        flat_triangles(facets),
        {seat.name: _carried(model, seat.nodes) for seat in bearing_seats(model, positions, names)},
        tuple([*supports, held] if len(held) else supports),
    )


def _carried(model: SolidModel, nodes: IntArray) -> IntArray:
    """Return the nodes of a seat; those of its mean (RBE3, distributing coupling) in place of the reference node."""
    means = [mean.nodes for mean in model.structure.averages if len(nodes) == 1 and mean.node == nodes[0]]
    return means[0] if means else nodes


def modes_shape(
    modes: ModalModel, positions: Mapping[str, Sequence[float]], labels: Mapping[str, int] | None = None
) -> HousingShape:
    """Return the skin of imported modes with the node of every bearing seat.

    positions: position (3,) of every bearing, m.
    labels: node labels of bearings that are named in the file.
    """
    rows = seat_rows(modes, positions, labels)
    seats: dict[str, IntArray] = {name: rows[[i]] for i, name in enumerate(positions)}
    return HousingShape(modes.nodes, flat_triangles(modes.triangles), seats)
