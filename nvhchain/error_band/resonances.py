"""How bearing forces change where the housing gives way more than its mesh lets it.

Shafts on bearings and seats resonate far below the housing's own modes; such a resonance falls with them, and the
forces beside it change by more than any single mode would tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.case import GearboxCase
from nvhchain.dynamics import flank_transfer
from nvhchain.error_band.housing import lowered
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import ComplexArray, ForceSpectrum, MeshLaw, ReducedHousing


@dataclass(frozen=True, eq=False)
class ForceChange:
    """away: (n_f, 3 n_bearing, n_mesh) N on the bearings per N between flanks, in the order of `names`.  flanks: (n_f,
    n_mesh, 3 n_bearing) what acts between the flanks per force on the bearings."""

    away: ComplexArray
    flanks: ComplexArray
    names: tuple[str, ...]

    def of(self, forces: ForceSpectrum) -> ForceSpectrum:
        """N, at the lines that it was made for."""
        moved = self.away @ (self.flanks @ forces.in_order(self.names)[..., None])
        return forces.replace(force=moved.reshape(len(moved), -1, 3), names=self.names)


def force_change(
    case: GearboxCase,
    fidelity: Fidelity,
    housing: ReducedHousing,
    mesh_laws: Sequence[MeshLaw],
    forces: ForceSpectrum,
) -> ForceChange:
    """Of bearing forces at the lines and speed of `forces`, where every mode lies lower by what its mesh leaves open.

    What acts between the flanks stays: its amplitudes are those that give the forces (least squares) in the gearbox
    linearised at its mean load, which passes them on otherwise.  Nothing changes where the forces were not made from
    `mesh_laws`, or the housing does not tell of its mesh.
    """
    lines = forces.frequency
    gearbox, moved = case.gearbox_with_gears, lowered(housing)
    if moved is None or not mesh_laws or case.options.rigid_housing:
        none = np.zeros((len(lines), 3 * len(forces.names), 0), dtype=complex)
        return ForceChange(none, none.transpose(0, 2, 1), forces.names)
    here, there = (
        flank_transfer(
            gearbox,
            mesh_laws,
            of,
            lines,
            input_torque=case.operation.input_torque,
            input_speed=forces.input_speed,
            fidelity=fidelity.dynamics,
        )
        for of in (housing, moved)
    )
    names = tuple(bearing.name for bearing in gearbox.bearings)
    return ForceChange(there - here, np.asarray(np.linalg.pinv(here)), names)
