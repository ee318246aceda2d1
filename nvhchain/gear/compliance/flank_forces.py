"""Nodal forces of point forces on the flanks of a meshed tooth, spread by shape functions."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from nvhchain.fem.elements import hex20_shape
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.elements.gear_mesh import SolidMesh
from nvhchain.gear.elements.pitch_mesh import PitchMesh
from nvhchain.handoff import FloatArray, IntArray

_FACE = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)])
"""Nodes of a brick's face on the flank, counted along the profile and in levels from its first corner."""

_TOP = [4, 5, 6, 7, 12, 13, 14, 15]
"""Positions of the same nodes in the brick's order, for the face ζ = 1."""


def point_forces(
    gear: GearGeometry,
    tooth: tuple[PitchMesh, SolidMesh],
    flank: IntArray,
    radius: FloatArray,
    axial: FloatArray,
    *,
    profile_force: bool = False,
) -> sp.csr_matrix:
    """Return the nodal forces of a unit normal force into the tooth at each of n points.

    flank (n,) int array: flanks: 0 faces +φ, 1 faces −φ.
    radius, axial (n,): points (m); points beyond the flank are moved to its nearest edge.
    profile_force: apply unit forces towards the tip instead, in the transverse plane and tangential to the flank.
    Returns (unknowns of the pitch, n) sparse matrix: nodal forces.

    The shape functions of the eight nodes of the brick's face spread each force.  Force and displacement therefore stay
    conjugate.
    """
    pitch, solid = tooth
    rows, levels = flank_grid(tooth)
    (row, xi), (level, eta) = _cell(rows, radius), _cell(levels, axial)
    weight = hex20_shape(np.column_stack([xi, eta, np.ones(len(xi))]))[0][:, _TOP]
    node = solid.index[level[:, None] + _FACE[:, 1], pitch.flanks[flank[:, None], row[:, None] + _FACE[:, 0]]]
    side = 1.0 - 2.0 * flank
    angle = side * gear.half_tooth_angle(radius) + gear.twist * axial
    # inward normal: −sin α_r outwards, ∓cos α_r along φ, ±sin β_b along z (helicoid), in the node's axes
    direction = gear.pressure_angle_at(radius)[:, None] + side[:, None] * (solid.angle[node] - angle[:, None])
    sense = np.broadcast_to(side[:, None], direction.shape)
    if profile_force:
        force = np.stack([np.cos(direction), -sense * np.sin(direction), np.zeros(direction.shape)], axis=-1)
    else:
        tilt = gear.base_helix_angle
        force = np.cos(tilt) * np.stack([-np.sin(direction), -sense * np.cos(direction), sense * np.tan(tilt)], axis=-1)
    column = np.broadcast_to(np.arange(len(radius))[:, None, None], force.shape)
    unknown = 3 * node[..., None] + np.arange(3)
    shape = (3 * len(solid.nodes), len(radius))
    forces = sp.csr_matrix(((weight[..., None] * force).ravel(), (unknown.ravel(), column.ravel())), shape=shape)
    forces.eliminate_zeros()
    return forces


def flank_loads(
    gear: GearGeometry,
    tooth: tuple[PitchMesh, SolidMesh],
    radius: FloatArray,
    axial: FloatArray,
    *,
    profile_force: bool = False,
) -> sp.csr_matrix:
    """Return the nodal forces of unit forces at a grid of points on both flanks.

    radius (n_p,): radii (m).
    axial (n_w,): axial positions (m).
    Returns (unknowns of the pitch, 2 n_p n_w) sparse matrix: nodal forces; points are ordered flank, radius, axial.
    """
    flank = np.repeat(np.arange(2), len(radius) * len(axial))
    r, z = np.tile(np.repeat(radius, len(axial)), 2), np.tile(axial, 2 * len(radius))
    return point_forces(gear, tooth, flank, r, z, profile_force=profile_force)


def flank_grid(tooth: tuple[PitchMesh, SolidMesh]) -> tuple[FloatArray, FloatArray]:
    """Return the radii (n_p,) and axial positions (n_w,) of the nodes of a flank (m), the middles of faces included.

    The middle of a face has no node.
    """
    pitch, solid = tooth
    return pitch.plane.radius[pitch.flanks[0]], solid.nodes[solid.index[:, pitch.flanks[0, 0]], 2]


def _cell(grid: FloatArray, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the first grid point of the element that holds each of `points`, and the place −1 … 1 in it."""
    ends = grid[::2]
    cell = np.searchsorted(ends[1:-1], points, side="right")
    place = (2 * points - ends[cell] - ends[cell + 1]) / (ends[cell + 1] - ends[cell])
    return 2 * cell, np.clip(np.round(place, 12), -1.0, 1.0)  # rounding must not miss a node
