"""Generated mesh of a gear as one undivided volume mesh, for other programs and for checks of the divided one."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.fidelity import GearFidelity
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.elements.gear_mesh import GearMesh, even_fidelity, gear_mesh
from nvhchain.handoff import IntArray

_SAME = 1e-6
"""Distance (normal modules) within which nodes of neighbouring parts are merged."""


def whole_mesh(body: GearBody, fidelity: GearFidelity) -> VolumeMesh:
    """Return the blank and all teeth of a gear as one mesh in Cartesian axes; the blank's nodes come first.

    The blank has the layers of the teeth; for mesh laws it has fewer.
    """
    return joined_mesh(body, gear_mesh(body, even_fidelity(body, fidelity)))[0]


def joined_mesh(body: GearBody, mesh: GearMesh) -> tuple[VolumeMesh, IntArray]:
    """Join the blank and all teeth of a divided mesh.

    mesh : its divided mesh.

    mesh : undivided mesh.
    label : (n,) its node for every node of the blank, then of the pitches of teeth 0, 1, ….
    """
    gear = body.geometry
    pitch, blank = mesh.pitch_solid, mesh.blank_solid
    points, bricks, flanks = [blank.nodes], [blank.elements], []
    for tooth in range(gear.teeth):
        c, s = np.cos(tooth * gear.pitch_angle), np.sin(tooth * gear.pitch_angle)
        first = len(blank.nodes) + tooth * len(pitch.nodes)
        bricks.append(pitch.elements + first)
        flanks.append(pitch.stacked(mesh.pitch.flanks.ravel()) + first)
        points.append(pitch.nodes @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]))
    nodes = np.vstack(points)
    same = cKDTree(nodes).query_pairs(_SAME * gear.normal_module, output_type="ndarray")
    joined = sp.coo_matrix((np.ones(len(same)), same.T), shape=(len(nodes),) * 2)
    count, label = sp.csgraph.connected_components(joined)
    place = np.empty((count, 3))
    place[label] = nodes
    whole = VolumeMesh(
        nodes=place,
        elements=label[np.vstack(bricks)].astype(np.int64),
        kind="hex20",
        bore=np.unique(label[blank.stacked(mesh.blank.bore)]).astype(np.int64),
        flanks=np.unique(label[np.concatenate(flanks)]).astype(np.int64),
        order=max(body.blank.symmetry, 1) if body.sector > 1 else gear.teeth,
    )
    return whole, label.astype(np.int64)
