"""Gearbox linearised at its mean load: bearing forces per alternating force of the meshes."""

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


def flank_transfers(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housings: Sequence[ReducedHousing],
    frequency: FloatArray,
    *,
    input_torque: float,
    input_speed: float,
    fidelity: DynamicsFidelity,
) -> ComplexArray:
    """Return the forces on each of some housings per force of the meshes.

    These are one between the flanks of each mesh, and then its friction and shuttling, if it has them: force and moment
    of friction, moment of the load about mid-width.

    mesh_laws: one law per mesh, in the gearbox's order.
    housings: housings that differ by their natural frequencies alone.
    frequency (n_f,): frequencies (Hz).
    input_torque: mean torque along the input's rotation (N m).
    input_speed: speed of the input (rad/s), for gyroscopic terms if `gearbox.gyroscopic`.
    Returns (n_housing, n_f, motions · n_bearing, n_source) complex array: transfer functions (N/N).

    Meshes are springs of the mean slope of their laws. The housing meets the shafts at its seats alone: with other
    natural frequencies their compliance differs by ΔG, and the bearing forces become (1 + S ΔG)⁻¹ f. S are the bearing
    forces per relative displacement of the seats.
    """
    speed = input_speed if gearbox.depends_on_speed else 0.0
    assembly = assemble(gearbox, mesh_laws, housings[0], input_speed=speed, fidelity=fidelity)
    torque = shaft_torques(gearbox, assembly.train, input_torque, assembly.inertia, 0.0)
    nominal = nominal_mesh_forces(assembly, mesh_laws, torque)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal), fidelity.angle_refinement)
    pairs = np.arange(len(assembly.mesh))
    carrying = assembly.contact[2 * pairs + (nominal[assembly.mesh] < 0.0)]
    shares = np.where(assembly.mesh == np.arange(len(mesh_laws))[:, None], assembly.share, 0.0)
    pushes = np.vstack([shares @ carrying, assembly.contact[2 * pairs[assembly.share == 0.0]]])
    modes = modal_form(assembly, mean_stiffness(assembly, table, nominal))
    seats, turning = assembly.bearing_map, 2j * np.pi * frequency[:, None]
    modal_input = modes.input @ np.hstack([-pushes.T, seats.T])
    residues = ((seats @ modes.displacement).T[:, :, None] * modal_input[:, None, :]).reshape(len(modal_input), -1)
    # Re(out z) is half of the sum over z and its conjugate
    moved = 0.5 / (turning - modes.eigenvalue) @ residues + 0.5 / (turning - modes.eigenvalue.conj()) @ residues.conj()
    springs = assembly.bearings.stiffness + turning[..., None] * assembly.bearings.damping
    force = springs @ moved.reshape(len(frequency), len(seats), -1)
    own, held = force[..., : len(pushes)], springs - force[..., len(pushes) :] @ springs
    shapes = assembly.seat_shapes
    pairs_of_seats = (shapes[:, None, :] * shapes[None, :, :]).reshape(-1, shapes.shape[1]).T
    still, *others = (housing.receptance(frequency, structural=False) for housing in housings)
    softer = (((compliance - still) @ pairs_of_seats).reshape(held.shape) for compliance in others)
    return np.array([own, *(np.linalg.solve(np.eye(len(seats)) + held @ each, own) for each in softer)])
