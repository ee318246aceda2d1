"""Displacement and stress of one gear of a pair under the slice forces of a loaded mesh, bore held.

d = K⁻¹ F, with slice forces and friction spread by shape functions over the nodes about their points.  The blank with
its condensed teeth is solved first.  The inside of every tooth follows from its shared nodes,

    u_o = K_oo⁻¹ (P − K_oi u_i).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nvhchain.errors import require
from nvhchain.fem._sparse import factorize
from nvhchain.fem.stress import nodal_stress, von_mises_of_stress
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.body_flexibility import HeldBody
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, condensed_tooth, cylindrical_stiffness, unknowns
from nvhchain.gear.contact.contact_lines import check_coefficient, wheel_angle
from nvhchain.gear.contact.local_law import local_law
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.pair import DRIVE, GearPair
from nvhchain.gear.elements.gear_mesh import GearMesh, SolidMesh, even_fidelity, gear_mesh
from nvhchain.gear.elements.whole_mesh import joined_mesh
from nvhchain.gear.laws.slice_loads import slice_loads
from nvhchain.gear.laws.transmission_error import LoadedMesh
from nvhchain.handoff import FloatArray, GearField
from nvhchain.kinds import checked

_NAMES = ("pinion", "wheel")


@checked
def gear_field(
    pair: GearPair, gear: int, loaded: LoadedMesh, fidelity: GearFidelity, *, friction: float = 0.0
) -> GearField:
    """Compute displacement and stress of the pinion or the wheel under the slice forces of a loaded mesh.

    Parameters
    ----------
    pair : GearPair
        Gear pair.
    gear : int
        PINION or WHEEL.
    loaded : LoadedMesh
        Loaded mesh.
    fidelity : GearFidelity
        Elements; `transverse_refinement` refines the tooth roots.
    friction : float
        Coefficient μ with which the mesh was loaded; its forces act along the profile.

    Returns
    -------
    GearField
        Displacement of the finite elements, von Mises stress, forces, and local deflection of every slice.

    Raises
    ------
    InputError
        If the gear has an imported mesh, or the coefficient is out of range.
    ResourceError
        If memory is short.

    Notes
    -----
    Stress is recovered as in `nvhchain.fem.stress.nodal_stress`.  That at the roots converges with
    `transverse_refinement`; `nodal_force_strain` reads it in a finer submodel.
    """
    require(gear in (0, 1), f"gear = {gear}: PINION (0) or WHEEL (1) is needed")
    check_coefficient(friction)
    body, lines = (pair.pinion, pair.wheel)[gear], loaded.lines
    require(len(lines.axial) > 0, "the loaded mesh has no contact lines: choose an angle at which the flanks touch")
    mesh = gear_mesh(body, even_fidelity(body, fidelity))
    loads = slice_loads(pair, gear, (mesh.pitch, mesh.pitch_solid), loaded, friction)
    number = lines.tooth[gear] % body.geometry.teeth
    tooth_forces = {int(t): np.asarray(loads[:, number == t].sum(axis=1)).ravel() for t in np.unique(number)}
    whole, label = joined_mesh(body, mesh)
    displacement = np.empty((len(whole.nodes), 3))
    displacement[label] = _displacement(body, mesh, tooth_forces)
    stress = nodal_stress(whole.nodes, whole.elements, whole.kind, body.material, displacement)
    point, force = _points(mesh.pitch_solid, loads.toarray(), number * body.geometry.pitch_angle)
    held = fidelity.bodies == "elements"
    law = local_law(
        lines.curvature,
        (lines.depth[0], lines.depth[1]),
        (pair.pinion.material, pair.wheel.material),
        edges=lines.edges,
        held=(held, held),
    )
    passed = pair.sense * int(lines.tooth[1][0]) - (0 if lines.flank == DRIVE else 1)
    angle = wheel_angle(pair, float(lines.position[0]), float(lines.axial[0]), passed, lines.flank)
    return GearField(
        nodes=whole.nodes,
        elements=whole.elements,
        displacement=displacement,
        von_mises=von_mises_of_stress(stress),
        gear=_NAMES[gear],
        angle=angle,
        teeth=body.geometry.teeth,
        module=body.geometry.normal_module,
        twist=body.geometry.twist,
        mate_direction=-pair.tooth_angles(angle)[gear],
        slice_tooth=number,
        slice_point=point,
        slice_force=force,
        local_deflection=law.deflection(loaded.force / lines.length),
        friction=friction,
    )


def _displacement(body: GearBody, mesh: GearMesh, forces: Mapping[int, FloatArray]) -> FloatArray:
    """Return the displacement (n, 3) in m of the nodes of the blank, then of the pitches of all teeth, Cartesian.

    forces: tooth → nodal forces (unknowns of the pitch,) in N.
    """
    solid, teeth = mesh.pitch_solid, body.geometry.teeth
    tooth = condensed_tooth(body.geometry, mesh, body.material)
    shared = unknowns(np.concatenate([tooth.left, tooth.right, tooth.bottom]))
    inner = np.setdiff1d(np.arange(3 * len(solid.nodes)), shared)
    K = cylindrical_stiffness(solid, solid.elements, body.material)
    K_io = K[shared][:, inner]
    columns = np.zeros((K.shape[0], teeth))
    for t, nodal in forces.items():
        columns[:, t] = nodal
    with factorize(K[inner][:, inner]) as factor:
        held_displacement = factor.solve(columns[inner])
        passed = columns[shared] - K_io @ held_displacement
        blank, shared_displacement = _solved(body, mesh, tooth, {t: passed[:, [t]] for t in forces})
        columns[inner] = factor.solve(columns[inner] - K_io.T @ shared_displacement)
    columns[shared] = shared_displacement
    turned = [_cartesian(blank, mesh.blank_solid.angle)]
    turned += [_cartesian(columns[:, t], solid.angle + t * body.geometry.pitch_angle) for t in range(teeth)]
    return np.concatenate(turned)


def _solved(
    body: GearBody, mesh: GearMesh, tooth: CondensedTooth, passed: Mapping[int, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return the displacement of the blank's unknowns (3 n,) and of the shared ones of every tooth (3 n_i, teeth), m.

    passed: tooth → forces (3 n_i, 1) on its shared nodes in N.
    """
    with HeldBody(mesh, tooth, body.material, body.sector) as held:
        moved = np.append(held.solve([passed])[:, 0], 0.0)  # unknown −1, the bore, is at rest
        return moved[held.blank], moved[held.unknowns].T


def _cartesian(columns: FloatArray, angle: FloatArray) -> FloatArray:
    """Return vectors (n, 3) of cylindrical unknowns (3 n,) at angles (n,) in rad."""
    r, phi, z = columns.reshape(-1, 3).T
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * r - s * phi, s * r + c * phi, z], axis=1)


def _points(solid: SolidMesh, loads: FloatArray, turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where loads act (n, 3) in m, and their resultants (n, 3) in N.

    loads: (unknowns of the pitch, n) N.  turn: (n,) rad, of the teeth that carry them.

    The place is that on the element's face, whose shape functions spread the load.
    """
    forces = np.stack([_cartesian(column, solid.angle) for column in loads.T])
    total = forces.sum(axis=1)
    size = np.maximum((total**2).sum(axis=1), np.finfo(float).tiny)
    weight = np.einsum("sna,sa->sn", forces, total) / size[:, None]
    point = weight @ solid.nodes
    return _turned(point, turn), _turned(total, turn)


def _turned(vectors: FloatArray, turn: FloatArray) -> FloatArray:
    """Return vectors (n, 3) turned about z by angles (n,) in rad."""
    x, y, z = vectors.T
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)
