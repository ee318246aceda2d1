"""Condensation of a refined tooth: response of pressure cells to each other, and forces passed to the coarse model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from benchmarks.gear.reference.tooth_mesh import RefinedPitch
from nvhchain.conventions import Material
from nvhchain.fem._sparse import factorize
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, cylindrical_stiffness, unknowns
from nvhchain.gear.elements.gear_mesh import GearMesh, SolidMesh
from nvhchain.handoff import FloatArray, IntArray

_FACE = np.array([[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]], dtype=float)
"""Nodes of a brick's face, row by row."""


def face_shape(axial: FloatArray, radial: FloatArray) -> FloatArray:
    """Return the serendipity shape functions (n, 8) of a face at local −1 … 1, in the order of `_FACE`."""
    value = np.empty((len(axial), 8))
    for node, (a, b) in enumerate(_FACE):
        u, v = 1 + a * axial, 1 + b * radial
        if a and b:
            value[:, node] = u * v * (a * axial + b * radial - 1) / 4
        else:
            value[:, node] = ((1 - axial**2) * v if a == 0 else (1 - radial**2) * u) / 2
    return value


_MEAN = np.array([-1.0, 4.0, -1.0, 4.0, 4.0, -1.0, 4.0, -1.0]) / 12
"""Means of the nodes' shape functions over the face."""


def cells(surface: IntArray) -> IntArray:
    """Return the nodes (n, 8) of the cells of even pressure on a swept surface, layer by layer.

    There is one cell per face of a brick.  Two, as many as the displacement has nodes along the face, would oscillate
    under an edge (inf-sup condition).

    surface: (levels, points) nodes on layer faces and middles, at row ends and middles.
    """
    layer, row = (a.ravel() for a in np.indices((surface.shape[0] // 2, surface.shape[1] // 2)))
    place = _FACE.astype(int) + 1
    return surface[2 * layer[:, None] + place[:, 1], 2 * row[:, None] + place[:, 0]]


def cell_loads(solid: SolidMesh, nodes: IntArray, direction: FloatArray) -> sp.csc_matrix:
    """Return the nodal forces (unknowns, n) of a unit force on each cell of `nodes` (n, 8), in each node's own axes.

    direction: (n, 8, 3), of the force.
    """
    rows = 3 * nodes[:, :, None] + np.arange(3)
    columns = np.broadcast_to(np.arange(len(nodes))[:, None, None], rows.shape)
    values = (_MEAN[:, None] * direction).ravel()
    return sp.csc_matrix((values, (rows.ravel(), columns.ravel())), shape=(3 * len(solid.nodes), len(nodes)))


@dataclass(frozen=True, eq=False)
class RefinedTooth:
    """Condensed refined tooth.

    Parameters
    ----------
    own : (n, n) array
        Mean displacement of cells under unit forces on cells, the shared nodes held (m/N).
    passed : (3 n_i, n) array
        Forces that the unit forces put on the shared nodes of the coarse pitch.
    """

    own: FloatArray
    passed: FloatArray


def refined_tooth(
    pitch: RefinedPitch, load: sp.csc_matrix, coarse: GearMesh, tooth: CondensedTooth, material: Material, *, half: bool
) -> RefinedTooth:
    """Condense the refined `pitch` under `load` (unknowns, n); its shared nodes follow the coarse pitch.

    half: the pitch is that of z ≥ 0 of a gear symmetric about mid-width.  Half of each unit force then acts on this
    half, and its mirror image on the other.
    """
    solid = pitch.solid
    tie, held = _tie(pitch, coarse, tooth)
    fixed = unknowns(held)
    if half:
        fixed = np.append(fixed, 3 * np.flatnonzero(solid.nodes[:, 2] == 0.0) + 2)
    inner = np.setdiff1d(np.arange(3 * len(solid.nodes)), fixed)
    K = cylindrical_stiffness(solid, solid.elements, material)
    forces = load[inner].toarray()
    with factorize(K[inner][:, inner]) as factor:
        response = factor.solve(forces)
    own = forces.T @ response
    passed = tie.T @ -(K[unknowns(held)][:, inner] @ response)
    if half:
        own, passed = 0.5 * own, 0.5 * (passed + _mirrored(passed, coarse, tooth))
    return RefinedTooth(0.5 * (own + own.T), passed)


def _tie(pitch: RefinedPitch, coarse: GearMesh, tooth: CondensedTooth) -> tuple[sp.csr_matrix, IntArray]:
    """Return the matrix (3 n_held, 3 n_i) from the coarse pitch to the refined pitch's outer nodes, and these nodes."""
    shared = np.concatenate([tooth.left, tooth.right, tooth.bottom])
    place = np.full(len(coarse.pitch_solid.nodes), -1)
    place[shared] = np.arange(len(shared))
    sides = (
        (pitch.left, coarse.pitch.left[::-1], "radius"),
        (pitch.right, coarse.pitch.right[::-1], "radius"),
        (pitch.bottom[1:-1], coarse.pitch.bottom, "angle"),
    )
    height = coarse.pitch_solid.nodes[coarse.pitch_solid.index[::2, coarse.pitch.bottom[0]], 2]
    rows, columns, values, held = [], [], [], []
    for fine, line, what in sides:
        index = pitch.solid.index[:, fine]
        nodes = index[index >= 0]
        held.append(nodes)
        x, y, z = pitch.solid.nodes[nodes].T
        if what == "radius":
            at, grid = np.hypot(x, y), coarse.pitch.plane.radius[line]
        else:
            at = np.broadcast_to(pitch.bottom_angle[1:-1], index.shape)[index >= 0]
            grid = coarse.pitch.plane.angle[line]
        element, along = _local(at, grid[::2])
        layer, up = _local(z, height)
        around = _FACE.astype(int) + 1
        on = coarse.pitch_solid.index[2 * layer[:, None] + around[:, 1], line[2 * element[:, None] + around[:, 0]]]
        start = sum(len(h) for h in held[:-1])
        rows.append(np.repeat(start + np.arange(len(nodes)), 8))
        columns.append(place[on].ravel())
        values.append(face_shape(along, up).ravel())
    outer = np.concatenate(held)
    weights = sp.csr_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(len(outer), len(shared))
    )
    return sp.csr_matrix(sp.kron(weights, sp.eye(3))), outer


def _local(points: FloatArray, grid: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the element of a rising `grid` that contains each point, and the place −1 … 1 in it."""
    element = np.clip(np.searchsorted(grid, points) - 1, 0, len(grid) - 2)
    start, end = grid[element], grid[element + 1]
    return element, np.clip(2 * (points - start) / (end - start) - 1, -1.0, 1.0)


def _mirrored(forces: FloatArray, coarse: GearMesh, tooth: CondensedTooth) -> FloatArray:
    """Return the forces on the shared nodes of the other half of the width."""
    solid, new = coarse.pitch_solid, np.full(len(coarse.pitch_solid.nodes), -1)
    shared = np.concatenate([tooth.left, tooth.right, tooth.bottom])
    flipped = solid.index[::-1]
    new[solid.index[solid.index >= 0]] = flipped[solid.index >= 0]
    place = np.full(len(new), -1)
    place[shared] = np.arange(len(shared))
    other = forces.reshape(len(shared), 3, -1)[place[new[shared]]] * np.array([1.0, 1.0, -1.0])[:, None]
    return other.reshape(forces.shape)
