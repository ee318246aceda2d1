"""Strain at the tooth roots of a running gear, by static modes and by nodal forces.

Static modes: d = Ψ q, with Ψ the displacement under unit normal forces on the grid of the flanks of all teeth, and q
the slice forces shared out over that grid.  The strain B Ψ at the root is stored, so that a position costs a dot
product. It is found by reciprocity: one solve per component gives the displacement of the flanks under the forces Bᵀ
conjugate to a strain.  Friction is excluded, and a force near the fillet is blurred over the grid.

Nodal forces: d = K⁻¹ F, with slice forces and friction spread by shape functions over the nodes about their points.
Nothing is excluded, and every position costs a solve.

Both evaluate the strain in a finer mesh about the root (`root_submodel`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import InputError, is_whole, require
from nvhchain.fem._sparse import BLOCK, factorize
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.body_flexibility import HeldBody
from nvhchain.gear.compliance.flank_splines import LocalBasis, local_basis, point_weights
from nvhchain.gear.compliance.tooth_compliance import (
    CondensedTooth,
    condensed_tooth,
    cylindrical_stiffness,
    flank_loads,
    unknowns,
)
from nvhchain.gear.contact.contact_lines import check_coefficient
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.gear.elements.gear_mesh import GearMesh, even_fidelity, gear_mesh
from nvhchain.gear.laws.slice_loads import nodal_forces
from nvhchain.gear.laws.transmission_error import LoadedMesh
from nvhchain.gear.root_strain.places import RootPlace
from nvhchain.gear.root_strain.submodel import RootSubmodel, root_submodel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.kinds import checked

PINION, WHEEL = 0, 1


@dataclass(frozen=True, eq=False)
class RootStrainModes:
    """Strain of the static modes at places on some teeth of one gear of a pair.

    gear: PINION or WHEEL.
    teeth: teeth at which the strain is computed.
    radial_basis, axial_basis: B-splines on the grid of the flank.
    coefficients (n_tooth, z, n_place, 6, 2, n_p n_w): strain per force (1/N).  [i, d, …, f] belongs to normal forces on
        flank f of tooth teeth[i] + d.
    """

    gear: int
    teeth: tuple[int, ...]
    radial_basis: LocalBasis
    axial_basis: LocalBasis
    coefficients: FloatArray

    def strain(self, loaded: Sequence[LoadedMesh]) -> FloatArray:
        """Return the strain under the normal forces of loaded meshes; friction has no effect.

        Returns (n_case, n_tooth, n_place, 6): strain.
        """
        total = np.zeros((len(loaded), len(self.teeth), *self.coefficients.shape[2:4]))
        for case, mesh in enumerate(loaded):
            lines = mesh.lines
            index, weight = point_weights(self.radial_basis, self.axial_basis, lines.radius[self.gear], lines.axial)
            share = weight * mesh.force[:, None]
            for i, tooth in enumerate(self.teeth):
                distance = (lines.tooth[self.gear] - tooth) % self.coefficients.shape[1]
                for d in np.unique(distance):
                    on = distance == d
                    modes = self.coefficients[i, d, :, :, lines.side]
                    total[case, i] += np.einsum("psnk,nk->ps", modes[:, :, index[on]], share[on])
        return total


@checked
def root_strain_modes(
    pair: GearPair, gear: int, places: Sequence[RootPlace], teeth: Sequence[int], fidelity: GearFidelity
) -> RootStrainModes:
    """Compute the strain modes at places on some teeth of the pinion or the wheel.

    fidelity: elements about the root, at least as fine as for contact: the strain converges later.
    Returns strain per normal force.
    """
    body = _gear_body(pair, gear, teeth)
    mesh, tooth, probed = _prepared(body, places, fidelity)
    radius, axial, count = tooth.radius, tooth.axial, body.geometry.teeth
    grid = flank_loads(body.geometry, (mesh.pitch, mesh.pitch_solid), radius, axial)[probed.loaded]
    passed = probed.passed @ grid
    own = probed.own @ grid
    own += probed.submodel.forces @ flank_loads(body.geometry, probed.submodel.tooth, radius, axial)
    modes = np.empty((len(teeth), count, *own.shape))
    with HeldBody(mesh, tooth, body.material, body.sector) as held:
        for i, t in enumerate(teeth):
            moved = held.solve([{t % count: probed.shared.T}])
            for d in range(count):
                modes[i, d] = moved[held.unknowns[(t + d) % count]].T @ passed
            modes[i, 0] += own
    (radial_basis, r), (axial_basis, z) = local_basis(radius), local_basis(axial + body.offset)
    shape = (len(teeth), count, len(places), 6, 2, len(radius), len(axial))
    coefficients = np.einsum("ij,...jl,kl->...ik", r, modes.reshape(shape), z, optimize=True)
    return RootStrainModes(gear, tuple(teeth), radial_basis, axial_basis, coefficients.reshape(*shape[:5], -1))


@checked
def nodal_force_strain(
    pair: GearPair,
    gear: int,
    places: Sequence[RootPlace],
    teeth: Sequence[int],
    loaded: Sequence[LoadedMesh],
    fidelity: GearFidelity,
    *,
    friction: float = 0.0,
) -> FloatArray:
    """Compute the strain at places on some teeth under the slice forces of loaded meshes, by nodal forces.

    friction: coefficient μ with which the meshes were loaded; its forces act along the profile.
    Returns (n_case, n_tooth, n_place, 6): strain.
    """
    check_coefficient(friction)
    body = _gear_body(pair, gear, teeth)
    mesh, tooth, probed = _prepared(body, places, fidelity)
    count = body.geometry.teeth
    strain = np.zeros((len(loaded), len(teeth), 6 * len(places)))
    with HeldBody(mesh, tooth, body.material, body.sector) as held:
        for start in range(0, len(loaded), BLOCK):
            block = loaded[start : start + BLOCK]
            nodal = [nodal_forces(pair, gear, (mesh.pitch, mesh.pitch_solid), m, friction) for m in block]
            moved = held.solve(
                [{t: (probed.passed @ f[probed.loaded])[:, None] for t, f in forces.items()} for forces in nodal]
            )
            near = [nodal_forces(pair, gear, probed.submodel.tooth, m, friction) for m in block]
            for i, t in enumerate(np.asarray(teeth) % count):
                rows = (probed.shared @ moved[held.unknowns[t]]).T
                for row, coarse, fine in zip(rows, nodal, near, strict=True):
                    if t in coarse:
                        row += probed.own @ coarse[t][probed.loaded] + probed.submodel.forces @ fine[t]
                strain[start : start + BLOCK, i] = rows
    return strain.reshape(len(loaded), len(teeth), len(places), 6)


def _gear_body(pair: GearPair, gear: int, teeth: Sequence[int]) -> GearBody:
    """Return the body of the pinion or the wheel, and check the teeth."""
    require(gear in (PINION, WHEEL), f"gear = {gear}: PINION ({PINION}) or WHEEL ({WHEEL}) is needed")
    require(all(is_whole(t) for t in teeth), f"teeth = {tuple(teeth)}: whole numbers are needed")
    return (pair.pinion, pair.wheel)[gear]


@dataclass(frozen=True, eq=False)
class _ProbedTooth:
    """Response to single nodal forces on the flanks of a tooth of the body's mesh, and the tooth's submodel.

    loaded (m,): unknowns of the pitch at which the forces act.
    passed (3 n_i, m): forces passed to the shared nodes.
    own (6 n_place, m): strain with the shared nodes held (1/N).
    shared (6 n_place, 3 n_i): strain under displacements of the shared nodes (1/m).
    submodel: finer mesh about the root.
    """

    loaded: IntArray
    passed: FloatArray
    own: FloatArray
    shared: FloatArray
    submodel: RootSubmodel


def _prepared(
    body: GearBody, places: Sequence[RootPlace], fidelity: GearFidelity
) -> tuple[GearMesh, CondensedTooth, _ProbedTooth]:
    """Mesh the body, condense its tooth and prepare the response at `places`."""
    fidelity = even_fidelity(body, fidelity)
    mesh = gear_mesh(body, fidelity)
    submodel = root_submodel(body, mesh, list(places), fidelity)
    tooth = condensed_tooth(body.geometry, mesh, body.material)
    return mesh, tooth, _probed(mesh, tooth, body.material, submodel)


def _probed(mesh: GearMesh, tooth: CondensedTooth, material: Material, submodel: RootSubmodel) -> _ProbedTooth:
    """Return the response of a tooth, ε = R_o K_oo⁻¹ P + (R_i − R_o K_oo⁻¹ K_oi) u_i.

    The system is solved for R_oᵀ and P, which have few columns.
    """
    solid, flanks, operator = mesh.pitch_solid, mesh.pitch.flanks, submodel.displacement
    K = cylindrical_stiffness(solid, solid.elements, material)
    shared = unknowns(np.concatenate([tooth.left, tooth.right, tooth.bottom]))
    inner = np.setdiff1d(np.arange(K.shape[0]), shared)
    loaded = unknowns(np.unique(solid.stacked(flanks.ravel())))
    loaded_rows = np.searchsorted(inner, loaded)
    if not np.array_equal(inner[np.minimum(loaded_rows, len(inner) - 1)], loaded):
        raise InputError("the flanks reach the rim that the tooth shares: raise dedendum or transverse_refinement")
    load = np.zeros((len(inner), len(loaded)))
    load[loaded_rows, np.arange(len(loaded))] = 1.0
    with factorize(K[inner][:, inner]) as factor:
        response = factor.solve(np.hstack([load, operator[:, inner].T.toarray()]))
    K_io = K[shared][:, inner]
    answer, adjoint = response[:, : len(loaded)], response[:, len(loaded) :]
    return _ProbedTooth(
        loaded=loaded,
        passed=-(K_io @ answer),
        own=operator[:, inner] @ answer,
        shared=operator[:, shared].toarray() - (K_io @ adjoint).T,
        submodel=submodel,
    )
