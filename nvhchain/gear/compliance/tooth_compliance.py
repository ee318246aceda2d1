"""Condensation of one tooth and its pitch of rim onto the nodes shared with neighbours and blank.

Unknowns are in cylindrical axes (radial, circumferential, axial) of each node, in which all teeth are alike.  With
inner nodes o and shared nodes i, a load P on the flanks gives

    u_flank = Pᵀ K_oo⁻¹ P + Gᵀ u_i,   K_i u_i = G,   K_i = K_ii − K_io K_oo⁻¹ K_oi,   G = −K_io K_oo⁻¹ P.

From the first term the same term with the tooth's centre-line surface held is subtracted.  Both contain the indentation
under the nodal load, which grows without limit as the mesh is refined.  Their difference converges.

Point forces on the flanks are spread over their nodes by shape functions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.fem._sparse import factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fem.elements import hex20_shape
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.elements.gear_mesh import GearMesh, SolidMesh
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


@dataclass(frozen=True, eq=False)
class CondensedTooth:
    """One condensed tooth: three unknowns per shared node, flank points ordered flank, radius, axial.

    radius (n_p,): radii of the flank points (m).
    axial (n_w,): axial positions of the flank points (m).
    stiffness (3 n_i, 3 n_i): stiffness of the shared nodes (N/m).
    passed (3 n_i, n): G, the forces that a unit flank load puts on the shared nodes.
    own (n, n): flank compliance with the shared nodes held, less that with the centre-line surface held (m/N).
    left, right, bottom: shared nodes of the pitch's solid mesh, in their order in `stiffness`; left and right exclude
        those on the bottom.
    passed_friction, own_friction: the same for unit forces along the profile, towards the tip; `own_friction` is the
        normal displacement under them.
    """

    radius: FloatArray
    axial: FloatArray
    stiffness: FloatArray
    passed: FloatArray
    own: FloatArray
    left: IntArray
    right: IntArray
    bottom: IntArray
    passed_friction: FloatArray | None = None
    own_friction: FloatArray | None = None


def condensed_tooth(
    gear: GearGeometry, mesh: GearMesh, material: Material, *, friction: bool = False
) -> CondensedTooth:
    """Condense one pitch of `mesh`; with `friction`, under forces along the profile too."""
    pitch, solid = mesh.pitch, mesh.pitch_solid
    left, right, bottom = (solid.stacked(line) for line in (pitch.left[:-1], pitch.right[:-1], pitch.bottom))
    shared = unknowns(np.concatenate([left, right, bottom]))
    inner = np.setdiff1d(np.arange(3 * len(solid.nodes)), shared)
    K = cylindrical_stiffness(solid, solid.elements, material)
    radius, axial = flank_grid((pitch, solid))
    loads = [
        flank_loads(gear, (pitch, solid), radius, axial, profile_force=profile_force)
        for profile_force in ((False, True) if friction else (False,))
    ]
    load = np.hstack([forces[inner].toarray() for forces in loads])
    points, n = load.shape[1], loads[0].shape[1]
    K_io = K[shared][:, inner]
    with factorize(K[inner][:, inner]) as factor:
        response = factor.solve(np.hstack([load, K_io.T.toarray()]))
    free = load[:, :n].T @ response[:, :points]
    passed = -(K_io @ response[:, :points])
    stiffness = K[shared][:, shared].toarray() - K_io @ response[:, points:]

    loose = ~np.isin(inner, unknowns(solid.stacked(pitch.centre)))
    held_nodes = inner[loose]
    with factorize(K[held_nodes][:, held_nodes]) as factor:
        held = load[loose, :n].T @ factor.solve(load[loose])
    own, own_friction = np.split(free - held, [n], axis=1)
    return CondensedTooth(
        radius=radius,
        axial=axial,
        stiffness=0.5 * (stiffness + stiffness.T),
        passed=passed[:, :n],
        own=0.5 * (own + own.T),
        left=left,
        right=right,
        bottom=bottom,
        passed_friction=passed[:, n:] if friction else None,
        own_friction=own_friction if friction else None,
    )


def unknowns(nodes: IntArray) -> IntArray:
    """Return the three unknowns of each node."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def cylindrical_stiffness(solid: SolidMesh, elements: IntArray, material: Material) -> sp.csr_matrix:
    """Return the stiffness (N/m) of `elements` in radial, circumferential and axial unknowns of each node."""
    K, _ = stiffness_and_mass(solid.nodes, elements, "hex20", material, mass=False)
    c, s = np.cos(solid.angle), np.sin(solid.angle)
    axes = np.zeros((len(c), 3, 3))
    axes[:, 0, 0], axes[:, 0, 1], axes[:, 1, 0], axes[:, 1, 1], axes[:, 2, 2] = c, -s, s, c, 1.0
    K.resize((3 * len(c), 3 * len(c)))  # adds nodes beyond those of the last element
    n = np.arange(len(c) + 1)
    turn = sp.bsr_matrix((axes, n[:-1], n))
    return sp.csr_matrix(turn.T @ K @ turn)
