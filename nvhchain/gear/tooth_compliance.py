"""One tooth and its pitch of rim, condensed onto the nodes it shares with neighbours and blank.

Unknowns are in cylindrical axes (radial, circumferential, axial) of each node, in which all teeth are alike. With o
the inner nodes and i the shared ones, a load P on the flanks gives

    u_flank = Pᵀ K_oo⁻¹ P + Gᵀ u_i,   K_i u_i = G,   K_i = K_ii − K_io K_oo⁻¹ K_oi,   G = −K_io K_oo⁻¹ P.

From the first term the same with the tooth's centre-line surface held as well is taken away: both contain the
indentation under the nodal load, which grows without limit as the mesh is refined; their difference converges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.fem._sparse import factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.gear.geometry import GearGeometry
from nvhchain.gear.mesh import GearMesh, SolidMesh
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class CondensedTooth:
    """Three unknowns per shared node; flank points ordered flank, radius, axial.

    radius: (n_p,) m.  axial: (n_w,) m.
    stiffness: (3 n_i, 3 n_i) N/m.  passed: (3 n_i, n) G, what a unit flank load puts on the shared nodes.
    own: (n, n) m/N, flank compliance with the shared nodes held, less that with the centre-line surface held.
    passed_friction, own_friction: the same for unit forces along the profile, towards the tip; `own_friction` is the
        normal displacement under them. None where not asked for.
    left, right, bottom: shared nodes of the pitch's solid mesh in their order in `stiffness`; left and right
        without those on the bottom.
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
    left, right, bottom = (solid.on(line) for line in (pitch.left[:-1], pitch.right[:-1], pitch.bottom))
    shared = unknowns(np.concatenate([left, right, bottom]))
    inner = np.setdiff1d(np.arange(3 * len(solid.nodes)), shared)
    K = cylindrical_stiffness(solid, solid.elements, material)
    loads = [flank_loads(gear, mesh)] + ([flank_loads(gear, mesh, along_profile=True)] if friction else [])
    load = np.hstack([forces[inner].toarray() for forces in loads])
    points, n = load.shape[1], loads[0].shape[1]
    K_io = K[shared][:, inner]
    with factorize(K[inner][:, inner]) as factor:
        response = factor.solve(np.hstack([load, K_io.T.toarray()]))
    free = load[:, :n].T @ response[:, :points]
    passed = -(K_io @ response[:, :points])
    stiffness = K[shared][:, shared].toarray() - K_io @ response[:, points:]

    loose = ~np.isin(inner, unknowns(solid.on(pitch.centre)))
    held_nodes = inner[loose]
    with factorize(K[held_nodes][:, held_nodes]) as factor:
        held = load[loose, :n].T @ factor.solve(load[loose])
    own, own_friction = np.split(free - held, [n], axis=1)
    return CondensedTooth(
        radius=pitch.plane.radius[pitch.flanks[0]],
        axial=solid.nodes[solid.index[:, pitch.flanks[0, 0]], 2],
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
    """The three unknowns of each node."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def cylindrical_stiffness(solid: SolidMesh, elements: IntArray, material: Material) -> sp.csr_matrix:
    """Stiffness (N/m) of `elements` in radial, circumferential and axial unknowns of each node."""
    K, _ = stiffness_and_mass(solid.nodes, elements, "hex20", material, mass=False)
    c, s = np.cos(solid.angle), np.sin(solid.angle)
    axes = np.zeros((len(c), 3, 3))
    axes[:, 0, 0], axes[:, 0, 1], axes[:, 1, 0], axes[:, 1, 1], axes[:, 2, 2] = c, -s, s, c, 1.0
    K.resize((3 * len(c), 3 * len(c)))  # nodes beyond the last element's
    n = np.arange(len(c) + 1)
    turn = sp.bsr_matrix((axes, n[:-1], n))
    return sp.csr_matrix(turn.T @ K @ turn)


def flank_loads(gear: GearGeometry, mesh: GearMesh, *, along_profile: bool = False) -> sp.csr_matrix:
    """(unknowns of the pitch, flank points) nodal forces of unit normal forces into the tooth.

    along_profile: of unit forces towards the tip instead, in the transverse plane and tangential to the flank.

    A point on a node loads that node; one in the middle of a brick's face loads the face's eight nodes by their shape
    functions, so that force and displacement stay conjugate.
    """
    pitch, solid = mesh.pitch, mesh.pitch_solid
    n_p, n_w = pitch.flanks.shape[1], len(solid.index)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n_p), np.arange(n_w), indexing="ij"))
    middle = (i % 2 == 1) & (j % 2 == 1)
    around = [(0, 0, 1.0, 0.0)] + [
        (di, dj, 0.0, 0.5 if di == 0 or dj == 0 else -0.25)
        for di in (-1, 0, 1)
        for dj in (-1, 0, 1)
        if (di, dj) != (0, 0)
    ]
    alpha = gear.pressure_angle_at(pitch.plane.radius[pitch.flanks[0]])[i]
    base = gear.base_helix_angle
    rows, columns, values = [], [], []
    for flank, side in ((0, 1.0), (1, -1.0)):
        level = solid.nodes[solid.index[:, pitch.flanks[flank, 0]], 2]
        angle = pitch.plane.angle[pitch.flanks[flank]][i] + gear.twist * level[j]
        for di, dj, alone, shared in around:
            weight = np.where(middle, shared, alone)
            at = np.flatnonzero(weight)
            node = solid.index[j[at] + dj, pitch.flanks[flank][i[at] + di]]
            # inward normal: −sin α_r outwards, ∓cos α_r along φ, ±sin β_b along z (helicoid), turned to the node's axes
            direction = alpha[at] + side * (solid.angle[node] - angle[at])
            if along_profile:
                force = np.stack([np.cos(direction), -side * np.sin(direction), np.zeros(len(at))])
            else:
                force = np.cos(base) * np.stack(
                    [-np.sin(direction), -side * np.cos(direction), np.full(len(at), side * np.tan(base))]
                )
            rows.append((3 * node + np.arange(3)[:, None]).ravel())
            columns.append(np.tile(flank * n_p * n_w + at, 3))
            values.append((weight[at] * force).ravel())
    shape = (3 * len(solid.nodes), 2 * n_p * n_w)
    return sp.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
