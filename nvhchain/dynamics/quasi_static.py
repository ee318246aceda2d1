"""The gearbox standing still at given positions of its mesh laws: the torques fix the gear forces, the laws the
deflections."""

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

    position (n,): the unknowns x.  mesh_force (n_mesh,): N along the flank normal, < 0 on the back flank.
    bearing_force (n_bearing, 3): N on the housing.
    """

    position: FloatArray
    mesh_force: FloatArray
    bearing_force: FloatArray


def static_mesh_forces(assembly: Assembly, torque: FloatArray) -> FloatArray:
    """(n_mesh,) N along the flank normals, < 0 on back flanks: an open train is statically determinate."""
    # drive-flank rows serve both signs in torsion, where the back flank's row is their negative
    rows = assembly.contact[0::2, assembly.lateral :]
    force = np.linalg.solve(rows.T, assembly.free.T @ torque)
    # what rounding leaves on a mesh without torque is no contact
    force[np.abs(force) <= 1e-12 * np.abs(force).max(initial=0.0)] = 0.0
    return np.asarray(force)


def static_state(assembly: Assembly, table: LawTable, torque: FloatArray, phases: FloatArray) -> StaticState:
    """Equilibrium under external shaft torques (n_shaft,) N m at mesh-law `phases` (n_mesh,), in periods.

    The torques fix one force per mesh, bearings and housing deflect under them, and the laws, inverted, give the
    torsional positions. A mesh without force rests at the drive side's end of its gap. Raises SolverError when a
    law cannot carry its force.
    """
    force = static_mesh_forces(assembly, torque)
    back = force < 0.0
    flank = 2 * np.arange(len(force)) + back
    n = assembly.lateral
    rows = assembly.contact[flank]
    lateral = np.linalg.solve(assembly.stiffness[:n, :n], -rows[:, :n].T @ np.abs(force))
    wanted = np.array(
        [
            deflection_under(table.deflection[k, : table.cells[k]], row_at(table, k, phase), force[k])
            for k, phase in enumerate(phases)
        ]
    )
    pressed = np.where(back, -wanted, wanted)
    torsion = np.linalg.solve(rows[:, n:], pressed - rows[:, :n] @ lateral)
    position = np.concatenate([lateral, torsion])
    return StaticState(position, force, (assembly.bearing_stiffness @ position).reshape(-1, 3))


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
