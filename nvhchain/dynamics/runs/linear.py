"""Gearbox linearised at its mean load: bearing forces per alternating force between the flanks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.propagator import modal_form
from nvhchain.dynamics.time_loop.quasi_static import laws_of_rows, nominal_mesh_forces
from nvhchain.dynamics.time_loop.simulation import mean_stiffness
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, MeshLaw, ReducedHousing


def body_compliance(gearbox: Gearbox, mesh_laws: Sequence[MeshLaw]) -> FloatArray:
    """Return the static compliance that the modes of gear bodies have at the drive flanks.

    mesh_laws: one law per mesh, in the gearbox's order; their forces do not count.
    Returns (n_mesh,): compliance (m/N).
    """
    found = assemble(gearbox, mesh_laws, None).body_compliance
    return np.zeros(len(mesh_laws)) if found is None else found[:, 0]


def flank_transfer(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing,
    frequency: FloatArray,
    *,
    input_torque: float,
    input_speed: float,
    fidelity: DynamicsFidelity,
) -> ComplexArray:
    """Return the forces on the housing per force between the flanks of each mesh.

    mesh_laws: one law per mesh, in the gearbox's order.
    frequency (n_f,): frequencies (Hz).
    input_torque: mean torque along the input's rotation (N m).
    input_speed: speed of the input (rad/s), for gyroscopic terms if `gearbox.gyroscopic`.
    Returns (n_f, motions · n_bearing, n_mesh) complex array: transfer functions (N/N).

    Meshes are springs of the mean slope of their laws.
    """
    speed = input_speed if gearbox.depends_on_speed else 0.0
    assembly = assemble(gearbox, mesh_laws, housing, input_speed=speed, fidelity=fidelity)
    torque = shaft_torques(gearbox, assembly.train, input_torque, assembly.inertia, 0.0)
    nominal = nominal_mesh_forces(assembly, mesh_laws, torque)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal), fidelity.angle_refinement)
    modes = modal_form(assembly, mean_stiffness(assembly, table, nominal))
    pairs = np.arange(len(assembly.mesh))
    carrying = assembly.contact[2 * pairs + (nominal[assembly.mesh] < 0.0)]
    shares = np.where(assembly.mesh == np.arange(len(mesh_laws))[:, None], assembly.share, 0.0)
    into = modes.input @ -(shares @ carrying).T
    out = assembly.bearing_stiffness @ modes.displacement + assembly.bearing_damping @ modes.velocity
    residues = (out.T[:, :, None] * into[:, None, :]).reshape(len(into), -1)
    turning = 2j * np.pi * frequency[:, None]
    # Re(out z) is half of the sum over z and its conjugate
    there = 0.5 / (turning - modes.eigenvalue) @ residues + 0.5 / (turning - modes.eigenvalue.conj()) @ residues.conj()
    return np.asarray(there.reshape(len(frequency), len(out), -1))
