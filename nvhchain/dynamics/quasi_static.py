"""The gearbox standing still at given positions of its mesh laws: the torques fix the gear forces, the laws the deflections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.dynamics.assembly import Assembly, assemble
from nvhchain.dynamics.gearbox import Gearbox
from nvhchain.dynamics.law_table import LawTable, deflection_under, row_at, tabulate
from nvhchain.dynamics.train import shaft_torques
from nvhchain.handoff import FloatArray, MeshLaw, ReducedHousing


@dataclass(frozen=True, eq=False)
class StaticState:
    """Equilibrium without motion.

    position (n,): lateral unknowns, m and rad.  torsion (n_shaft − 1,): torsional coordinates.
    mesh_force (n_mesh,): N along the flank normal, < 0 on the back flank.
    bearing_force (n_bearing, 3): N on the housing.
    """

    position: FloatArray
    torsion: FloatArray
    mesh_force: FloatArray
    bearing_force: FloatArray


def static_state(assembly: Assembly, table: LawTable, torque: FloatArray, phases: Sequence[float]) -> StaticState:
    """Equilibrium under external shaft torques at mesh-law `phases` (in periods).

    An open train is statically determinate: the torsional balance gives one force per mesh, bearings and housing then
    deflect under them, and the laws, inverted, give the torsional positions. A mesh without force rests at the drive
    side's end of its gap. Raises SolverError when a law cannot carry its force.
    """
    # drive-flank rows serve both signs in torsion, where the back flank's row is their negative
    torsion_rows = assembly.to_torsion[0::2] @ assembly.free
    force = np.linalg.solve(torsion_rows.T, assembly.free.T @ torque)
    # what rounding leaves of a torque-free mesh is no contact
    force[np.abs(force) <= 1e-12 * np.abs(force).max(initial=0.0)] = 0.0
    back = force < 0.0
    flank = 2 * np.arange(len(force)) + back
    rows = assembly.to_lateral[flank]
    position = np.linalg.solve(assembly.stiffness, -rows.T @ np.abs(force))
    wanted = np.array(
        [
            deflection_under(table.deflection[k, : table.cells[k]], row_at(table, k, phase), force[k])
            for k, phase in enumerate(phases)
        ]
    )
    pressed = np.where(back, -wanted, wanted)
    torsion = np.linalg.solve(assembly.to_torsion[flank] @ assembly.free, pressed - rows @ position)
    bearing_force = (assembly.bearing_stiffness @ position).reshape(-1, 3)
    return StaticState(position, torsion, force, bearing_force)


def static_bearing_forces(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
) -> FloatArray:
    """(n_bearing, 3) N on the housing at standstill under `input_torque` (N m)."""
    assembly = assemble(gearbox, mesh_laws, housing)
    torque = shaft_torques(gearbox, assembly.train, input_torque)
    phases = law_phases(assembly, mesh_laws)
    return static_state(assembly, tabulate(mesh_laws, 1), torque, phases).bearing_force


def law_phases(assembly: Assembly, mesh_laws: Sequence[MeshLaw]) -> FloatArray:
    """(n_mesh,) phases of the laws, in periods, at time 0."""
    return np.array([mesh.phase / law.period for mesh, law in zip(assembly.gearbox.meshes, mesh_laws, strict=True)])
