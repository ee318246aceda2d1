"""Submodel: a finer mesh about the root of one tooth, driven at its outer faces by the body's mesh.

The stress at a fillet needs elements of a fifth of its radius; the deflection of a flank does not.  The submodel is the
same pitch, meshed finer and shallower.  The faces shared with neighbours and blank follow the coarser pitch by shape
functions; its field is smooth there (Saint-Venant).  The forces on the flanks are applied to both meshes.  The strain
at the places is then linear in both,

    ε = Y_oᵀ P + (R_b − Y_oᵀ K_ob) N u,   K_oo Y_o = R_oᵀ,

with P the nodal forces on the finer pitch, u the displacement of the coarser one, o the free unknowns of the finer
pitch, and b its driven ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from nvhchain.fem._sparse import factorize
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.tooth_compliance import cylindrical_stiffness, unknowns
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.elements.gear_mesh import GearMesh, SolidMesh, tooth_mesh
from nvhchain.gear.elements.pitch_mesh import PitchMesh
from nvhchain.gear.elements.point_location import interpolation
from nvhchain.gear.root_strain.places import RootPlace, strain_operator
from nvhchain.handoff import FloatArray


@dataclass(frozen=True, eq=False)
class RootSubmodel:
    """Strain at places on one tooth, six rows per place.

    tooth: finer pitch.
    forces (6 n_place, unknowns of the finer pitch): strain per nodal force (1/N).
    displacement (6 n_place, unknowns of the coarser pitch): strain per displacement (1/m).
    """

    tooth: tuple[PitchMesh, SolidMesh]
    forces: FloatArray
    displacement: sp.csr_matrix


def root_submodel(body: GearBody, mesh: GearMesh, places: list[RootPlace], fidelity: GearFidelity) -> RootSubmodel:
    """Mesh the pitch of `mesh` again with `fidelity.root_refinement`; places off the root are an InputError."""
    k = fidelity.root_refinement
    profile = max(fidelity.profile_elements, k)
    fine = replace(fidelity, transverse_refinement=k, profile_elements=profile)
    pitch, solid = tooth_mesh(body, fine)
    operator = strain_operator(body.geometry, solid, places)
    moved_nodes = np.unique(np.concatenate([solid.stacked(line) for line in (pitch.left, pitch.right, pitch.bottom)]))
    moved = unknowns(moved_nodes)
    inner = np.setdiff1d(np.arange(3 * len(solid.nodes)), moved)
    K = cylindrical_stiffness(solid, solid.elements, body.material)
    with factorize(K[inner][:, inner]) as factor:
        adjoint = factor.solve(operator[:, inner].T.toarray())
    forces = np.zeros((operator.shape[0], K.shape[0]))
    forces[:, inner] = adjoint.T
    boundary = sp.csr_matrix(operator[:, moved].toarray() - (K[moved][:, inner] @ adjoint).T)
    follow = interpolation(mesh.pitch_solid, solid.nodes[moved_nodes], solid.angle[moved_nodes])
    return RootSubmodel((pitch, solid), forces, sp.csr_matrix(boundary @ follow))
