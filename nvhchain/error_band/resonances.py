"""Change of bearing forces with a housing that is softer or stiffer than its finite elements.

Shafts on bearings and seats resonate far below the housing's own modes. Such a resonance moves with these modes. The
forces near it then change by more than any single mode indicates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nvhchain.case import GearboxCase
from nvhchain.dynamics import Gearbox, LoadCentre, MeshFriction, flank_transfers
from nvhchain.error_band.housing import shifted
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import ComplexArray, ForceSpectrum, MeshLaw, ReducedHousing
from nvhchain.handoff.forces import force_and_moment

ALIKE = 1e-6
"""Ratio of singular values below which forces of meshes count as one: friction often acts as the flanks do."""


@dataclass(frozen=True, eq=False)
class ForceChange:
    """Change of bearing forces from matrices in the order of `names`.

    away : (n_f, motions · n_bearing, n_source) force on the bearings per force of the meshes (N/N).
    flanks : (n_f, n_source, motions · n_bearing) force of the meshes per force on the bearings (N/N).
    names : names of the bearings.
    """

    away: ComplexArray
    flanks: ComplexArray
    names: tuple[str, ...]

    def apply(self, forces: ForceSpectrum) -> ForceSpectrum:
        """Return the change of forces (N), at the lines that it was made for."""
        motions = self.away.shape[1] // len(self.names)
        moved = self.away @ (self.flanks @ forces.sort_bearings(self.names, motions)[..., None])
        moved = moved.reshape(len(moved), -1, motions)
        return forces.replace(names=self.names, **force_and_moment(moved))


def force_change(
    case: GearboxCase, fidelity: Fidelity, housing: ReducedHousing, mesh_laws: Sequence[MeshLaw], forces: ForceSpectrum
) -> ForceChange:
    """Return the change of bearing forces if every mode is lowered or raised by the estimated error of its frequency.

    The forces of the meshes stay: between the flanks, of friction, and by the place of the load. They are found from
    the bearing forces by least squares, in the gearbox linearised at its mean load. The moved housing transmits them to
    the bearings in another way; each line takes the direction that changes more. The change is zero without
    `mesh_laws`, with a rigid housing, and for a housing without an estimate.
    """
    soft, stiff = shifted(housing, -1.0), shifted(housing, 1.0)
    moved = [] if soft is None or stiff is None else [soft, stiff]
    changes = force_changes(case, fidelity, housing, moved, mesh_laws, forces)
    if len(changes) < 2:
        none = np.zeros((len(forces.frequency), forces.wrench.shape[2] * len(forces.names), 0), dtype=complex)
        return ForceChange(none, none.transpose(0, 2, 1), forces.names)
    lower, higher = (np.linalg.norm(change.apply(forces).wrench, axis=(1, 2)) for change in changes)
    away = np.where((lower >= higher)[:, None, None], changes[0].away, changes[1].away)
    return replace(changes[0], away=away)


def force_changes(
    case: GearboxCase,
    fidelity: Fidelity,
    housing: ReducedHousing,
    moved: Sequence[ReducedHousing],
    mesh_laws: Sequence[MeshLaw],
    forces: ForceSpectrum,
) -> list[ForceChange]:
    """Return the change of bearing forces in each of some housings, as of `force_change`; empty where there is none."""
    if not moved or not mesh_laws or case.options.rigid_housing:
        return []
    gearbox = _pushed(case, mesh_laws)
    here, *there = flank_transfers(
        gearbox,
        mesh_laws,
        [housing, *moved],
        forces.frequency,
        input_torque=case.operation.input_torque,
        input_speed=forces.input_speed,
        fidelity=fidelity.dynamics,
    )
    names, back = tuple(bearing.name for bearing in gearbox.bearings), np.asarray(np.linalg.pinv(here, rcond=ALIKE))
    return [ForceChange(each - here, back, names) for each in there]


def _pushed(case: GearboxCase, mesh_laws: Sequence[MeshLaw]) -> Gearbox:
    """Return the gearbox with the friction and load centres of its options: places and directions, without their sizes.

    Points that follow a tilt carry unevenly, which is a moment about mid-width as that of a load centre.
    """
    gearbox, options, none = case.gearbox_on_rigid_seats, case.options, np.zeros(1)
    meshes = []
    loaded = [not case.idles(stage) for stage in case.stages]
    for mesh, law, force, pressed in zip(gearbox.meshes, mesh_laws, case.mesh_forces, loaded, strict=True):
        rubbed = pressed and options.models("friction")
        uneven = options.models("tilt") and force > 0.0 < case.operation.input_torque
        meshes.append(
            replace(
                mesh,
                friction=MeshFriction(options.coefficient, law.period, none, none, none) if rubbed else None,
                load_centre=LoadCentre(law.period, none, none)
                if pressed and (options.models("shuttling") or uneven)
                else None,
            )
        )
    return replace(gearbox, meshes=tuple(meshes))
