"""Tooth in thinner layers than the blank below it: its outer faces follow the nodes that the blank has there.

Forces on a flank are local; those that the tooth passes on are smooth (Saint-Venant). Each layer of the blank is cut
into equal ones. Every face of the blank's layers then holds whole faces of the tooth's, whose shape functions contain
those of the larger one. The field is continuous, but for the curvature of a helix within a layer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.elements.gear_mesh import GearMesh, SolidMesh, swept_tooth
from nvhchain.gear.elements.pitch_mesh import PitchMesh
from nvhchain.gear.elements.point_location import weighted_displacement
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class FinerTooth:
    """Tooth and its pitch of rim in layers of their own.

    solid : solid mesh; its transverse mesh is that of the coarser pitch.
    parts : layers in each layer of the coarser pitch.
    """

    solid: SolidMesh
    parts: int


def finer_tooth(body: GearBody, mesh: GearMesh, layers: int) -> FinerTooth:
    """Cut every layer of the pitch of `mesh` into equal ones, at least `layers` in all."""
    count = mesh.pitch_solid.layers
    parts = max(1, -(-layers // count))
    return FinerTooth(mesh.pitch_solid if parts == 1 else swept_tooth(body, mesh.pitch, parts * count), parts)


def following_matrix(
    pitch: PitchMesh, coarse: SolidMesh, finer: FinerTooth, lines: tuple[IntArray, ...]
) -> sp.csr_matrix:
    """Return the matrix from displacements of the coarser pitch to those of finer nodes on its outer faces.

    lines: transverse nodes; the solid nodes above and below each line follow each other.
    Returns (3 n, unknowns of the coarser pitch) sparse matrix, in the cylindrical axes of the nodes.
    """
    solid, plane, parts = finer.solid, pitch.plane, finer.parts
    nodes = np.concatenate([solid.stacked(line) for line in lines])
    level, flat = (place[np.argsort(solid.index[solid.index >= 0])][nodes] for place in np.nonzero(solid.index >= 0))
    layer = np.minimum(level // (2 * parts), coarse.layers - 1)
    low, eta = 2 * layer, level / parts - 2 * layer - 1.0
    entries: list[tuple[IntArray, IntArray, FloatArray]] = []

    def enter(rows: IntArray, plane_nodes: IntArray, above: int, weight: FloatArray) -> None:
        used = weight != 0.0
        entries.append((rows[used], coarse.index[low[rows] + above, plane_nodes][used], weight[used]))

    column, face = np.flatnonzero(flat < plane.corners), np.flatnonzero(flat >= plane.corners)
    for above, weight in enumerate((0.5 * eta * (eta - 1.0), 1.0 - eta**2, 0.5 * eta * (eta + 1.0))):
        enter(column, flat[column], above, weight[column])
    # middles of a face of eight nodes
    bulge = 0.5 * (1.0 - eta[face] ** 2)
    for above, weight in ((0, 0.5 * (1.0 - eta[face])), (2, 0.5 * (1.0 + eta[face]))):
        enter(face, flat[face], above, weight)
    for end in plane.edges[flat[face] - plane.corners].T:
        for above, weight in ((0, -0.5 * bulge), (1, bulge), (2, -0.5 * bulge)):
            enter(face, end, above, weight)
    row, node, weight = (np.concatenate(arrays) for arrays in zip(*entries, strict=True))
    turn = coarse.angle[node] - solid.angle[nodes[row]]
    return weighted_displacement((row, node), weight, turn, (len(nodes), len(coarse.nodes)))
