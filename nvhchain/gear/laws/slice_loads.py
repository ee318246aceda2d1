"""Nodal forces of a loaded mesh: slice forces and friction, spread by shape functions over the nodes about them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from nvhchain.gear.compliance.tooth_compliance import point_forces
from nvhchain.gear.contact.contact_lines import sliding_sense
from nvhchain.gear.drawing.pair import DRIVE, GearPair
from nvhchain.gear.elements.gear_mesh import SolidMesh
from nvhchain.gear.elements.pitch_mesh import PitchMesh
from nvhchain.gear.laws.transmission_error import LoadedMesh
from nvhchain.handoff import FloatArray


def slice_loads(
    pair: GearPair, gear: int, tooth: tuple[PitchMesh, SolidMesh], contact: LoadedMesh, friction: float
) -> sp.csr_matrix:
    """Return the forces of every slice on the unknowns of the pitch that carries it.

    gear: 0 for the pinion, 1 for the wheel.
    friction: coefficient μ; its forces act along the profile.
    Returns (unknowns of the pitch, n) sparse matrix: nodal forces (N).
    """
    lines, geometry = contact.lines, (pair.pinion, pair.wheel)[gear].geometry
    # friction pushes both flanks towards their tips where the pinion's flank slides ahead of the wheel's
    signed_friction = friction * sliding_sense(pair, lines) * (1.0 if lines.flank == DRIVE else -1.0)
    flank = np.full(len(contact.force), lines.side)
    axial = pair.face_positions(lines.axial)[gear]
    normal, slid = (
        point_forces(geometry, tooth, flank, lines.radius[gear], axial, profile_force=a) for a in (False, True)
    )
    return sp.csr_matrix(normal @ sp.diags(contact.force) + slid @ sp.diags(signed_friction * contact.force))


def nodal_forces(
    pair: GearPair, gear: int, tooth: tuple[PitchMesh, SolidMesh], contact: LoadedMesh, friction: float
) -> dict[int, FloatArray]:
    """Return the forces on the unknowns of the pitch `tooth` (N) for each tooth in contact, by its number 0 … z − 1.

    Parameters are those of `slice_loads`.
    """
    loads = slice_loads(pair, gear, tooth, contact, friction)
    number = contact.lines.tooth[gear] % (pair.pinion, pair.wheel)[gear].geometry.teeth
    return {int(t): np.asarray(loads[:, number == t].sum(axis=1)).ravel() for t in np.unique(number)}
