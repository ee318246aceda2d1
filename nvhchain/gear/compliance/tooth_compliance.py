"""Condensation of one tooth and its pitch of rim onto the nodes shared with neighbours and blank.

Unknowns are in cylindrical axes (radial, circumferential, axial) of each node, in which all teeth are alike.  With
inner nodes o and shared nodes i, a load P on the flanks gives

    u_flank = Pᵀ K_oo⁻¹ P + Gᵀ u_i,   K_i u_i = G,   K_i = K_ii − K_io K_oo⁻¹ K_oi,   G = −K_io K_oo⁻¹ P.

From the first term the same term with the tooth's centre-line surface held is subtracted.  Both contain the indentation
under the nodal load, which grows without limit as the mesh is refined.  Their difference converges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.fem._sparse import factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.gear.compliance.flank_forces import flank_grid, flank_loads
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.elements.gear_mesh import GearMesh, SolidMesh
from nvhchain.handoff import FloatArray, IntArray


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
        flank_loads(gear, (pitch, solid), radius, axial, profile_force=along)
        for along in ((False, True) if friction else (False,))
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
