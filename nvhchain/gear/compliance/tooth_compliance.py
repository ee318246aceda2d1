"""Condensation of one tooth and its pitch of rim onto the nodes shared with neighbours and blank.

Unknowns are in cylindrical axes (radial, circumferential, axial) of each node, in which all teeth are alike.  With
inner nodes o and shared nodes i, a load P on the flanks gives

    u_flank = Pᵀ K_oo⁻¹ P + Gᵀ u_i,   K_i u_i = G,   K_i = K_ii − K_io K_oo⁻¹ K_oi,   G = −K_io K_oo⁻¹ P.

From the first term the same term with the tooth's centre-line surface held is subtracted.  Both contain the indentation
under the nodal load, which grows without limit as the mesh is refined.  Their difference converges.

Point forces on the flanks are spread over their nodes by shape functions.

A tooth may have thinner layers than the blank.  Its shared nodes follow those of the blank, u_i = N u_b, which gives
Nᵀ K_i N and Nᵀ G.  A turn by half a revolution about the middle of the tooth maps each flank onto the other.  One flank
is therefore loaded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.fem._sparse import BLOCK, Factor, factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fem.elements import hex20_shape
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.elements.finer_tooth import FinerTooth, following_matrix
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
    left, right, bottom: shared nodes of the solid mesh of the pitch on the blank, in their order in `stiffness`; left
        and right exclude those on the bottom.
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
    gear: GearGeometry, mesh: GearMesh, material: Material, *, friction: bool = False, finer: FinerTooth | None = None
) -> CondensedTooth:
    """Condense one pitch of `mesh`; with `friction`, under forces along the profile too.

    finer: the same pitch in thinner layers, whose shared nodes follow those of `mesh`.
    """
    pitch, finer = mesh.pitch, finer or FinerTooth(mesh.pitch_solid, 1)
    solid, lines = finer.solid, (pitch.left[:-1], pitch.right[:-1], pitch.bottom)
    shared = unknowns(np.concatenate([solid.stacked(line) for line in lines]))
    left, right, bottom = (mesh.pitch_solid.stacked(line) for line in lines)
    inner = np.setdiff1d(np.arange(3 * len(solid.nodes)), shared)
    K = cylindrical_stiffness(solid, solid.elements, material)
    K_io, K_ii = K[shared][:, inner], K[shared][:, shared]
    if finer.parts > 1:
        follow = following_matrix(pitch, mesh.pitch_solid, finer, lines)[
            :, unknowns(np.concatenate([left, right, bottom]))
        ]
        K_io, K_ii = sp.csr_matrix(follow.T @ K_io), follow.T @ K_ii @ follow
    radius, axial = flank_grid((pitch, solid))
    loads = [
        flank_loads(gear, (pitch, solid), radius, axial, profile_force=profile_force)[inner]
        for profile_force in ((False, True) if friction else (False,))
    ]
    n = loads[0].shape[1]
    half = sp.csc_matrix(sp.hstack([load[:, : n // 2] for load in loads]))  # of the first flank
    answers = sp.csr_matrix(sp.vstack([loads[0].T, K_io]))
    with factorize(K[inner][:, inner]) as factor:
        loaded = _answers(factor, answers, half)
        stiffness = K_ii.toarray() - _answers(factor, K_io, sp.csc_matrix(K_io.T))
    loose = ~np.isin(inner, unknowns(solid.stacked(pitch.centre)))
    held_nodes = inner[loose]
    with factorize(K[held_nodes][:, held_nodes]) as factor:
        loaded[:n] -= _answers(factor, sp.csr_matrix(loads[0][loose].T), half[loose])
    turned = _turned(mesh.pitch_solid, lines)
    sign = np.tile([1.0, -1.0, -1.0], len(turned) // 3)[:, None, None]

    def both(part: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the rows of the flanks and of the shared nodes, under loads on both flanks."""
        places = len(radius), len(axial)
        own, passed = part[:n].reshape(2, *places, *places), -part[n:].reshape(-1, *places)
        other = own[::-1, :, ::-1, :, ::-1].reshape(n, -1), (sign * passed)[turned, :, ::-1].reshape(len(passed), -1)
        return np.hstack([part[:n], other[0]]), np.hstack([-part[n:], other[1]])

    own, passed = both(loaded[:, : n // 2])
    own_friction, passed_friction = both(loaded[:, n // 2 :]) if friction else (None, None)
    return CondensedTooth(
        radius=radius,
        axial=axial,
        stiffness=0.5 * (stiffness + stiffness.T),
        passed=passed,
        own=0.5 * (own + own.T),
        left=left,
        right=right,
        bottom=bottom,
        passed_friction=passed_friction,
        own_friction=own_friction,
    )


def _answers(factor: Factor, answers: sp.csr_matrix, loads: sp.csc_matrix) -> FloatArray:
    """Return `answers` · K⁻¹ · `loads`, a few loads at a time."""
    blocks = (slice(start, start + BLOCK) for start in range(0, loads.shape[1], BLOCK))
    return np.hstack([answers @ factor.solve(loads[:, block].toarray()) for block in blocks])


def _turned(solid: SolidMesh, lines: tuple[IntArray, IntArray, IntArray]) -> IntArray:
    """Return the shared unknown that each one replaces when the tooth turns by half a revolution about its middle.

    Turned around, circumferential and axial components change their sign.
    """
    left, right, bottom = lines
    nodes = np.concatenate([solid.stacked(line) for line in lines])
    place = np.full(len(solid.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    there = np.full(solid.index.shape, -1)
    there[:, np.concatenate(lines)] = solid.index[::-1, np.concatenate([right, left, bottom[::-1]])]
    moved = np.full(len(solid.nodes), -1)
    moved[solid.index[solid.index >= 0]] = there[solid.index >= 0]
    return unknowns(place[moved[nodes]])


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
