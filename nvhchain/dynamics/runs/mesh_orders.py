"""Bearing forces of the gearbox linearised at its mean load, at the orders of its meshes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from nvhchain.dynamics.model.assembly import Assembly, assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.propagator import ModalForm, modal_form
from nvhchain.dynamics.time_loop.quasi_static import laws_of_rows, nominal_mesh_forces
from nvhchain.dynamics.time_loop.simulation import mean_stiffness
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, MeshLaw, ReducedHousing


@dataclass(frozen=True, eq=False)
class OrderForces:
    """Alternating bearing forces of a linear gearbox.

    order (n,): orders of the input, increasing.
    force (n_speed, n, 3 n_bearing): amplitudes of the forces on the housing (N).
    """

    order: FloatArray
    force: ComplexArray


def order_forces(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    deflections: Sequence[FloatArray | None],
    *,
    input_torque: float,
    input_speeds: Sequence[float],
    fidelity: DynamicsFidelity,
) -> OrderForces:
    """Return the bearing forces at the harmonics of all meshes.

    gearbox: gearbox. Friction and load centres of its meshes have the angles of `deflections`.
    mesh_laws: one law per mesh, in the gearbox's order; of its forces the mean slope counts.
    housing: housing; None for rigid seats.
    deflections sequence of (n_angle,) array or None: quasi-static deflection (m) of each mesh at equally spaced angles
    of one mesh period; None for an idle mesh. Points across the face may have rows of their own: (n_point, n_angle).
    input_torque: mean torque along the input's rotation (N m).
    input_speeds: speeds of the input (rad/s).
    Returns forces at every speed. Meshes that share an order add with their phases.

    A mesh is a spring of mean stiffness k that the deflection e(θ) under the nominal force drives, F = k (δ − e(θ)).
    Friction and shuttling are forces that depend on the angle alone. Products of alternating quantities are neglected.
    """
    harmonics, modes, driven = range(1, _highest(deflections) + 1), None, dict[Fraction, ComplexArray]()
    found = []
    for speed in input_speeds:
        if modes is None or gearbox.depends_on_speed:
            assembly = assemble(
                gearbox, mesh_laws, housing, input_speed=speed if gearbox.depends_on_speed else 0.0, fidelity=fidelity
            )
            torque = shaft_torques(gearbox, assembly.train, input_torque, assembly.inertia, 0.0)
            nominal = nominal_mesh_forces(assembly, mesh_laws, torque)
            table = tabulate(laws_of_rows(assembly, mesh_laws, nominal), 1)
            stiffness = mean_stiffness(assembly, table, nominal)
            modes = modal_form(assembly, stiffness)
            if not driven:
                driven = _generalised_forces(assembly, mesh_laws, deflections, stiffness, nominal, harmonics)
        order = sorted(driven)
        frequency = np.array([float(each) for each in order]) * speed / (2.0 * np.pi)
        found.append(_response(assembly, modes, np.array([driven[each] for each in order]), frequency))
    return OrderForces(np.array([float(each) for each in sorted(driven)]), np.array(found))


def _highest(deflections: Sequence[FloatArray | None]) -> int:
    """Return the highest harmonic that all tables hold."""
    return min((each.shape[-1] for each in deflections if each is not None), default=0) // 2 - 1


def _generalised_forces(
    assembly: Assembly,
    mesh_laws: Sequence[MeshLaw],
    deflections: Sequence[FloatArray | None],
    stiffness: FloatArray,
    nominal: FloatArray,
    harmonics: Sequence[int],
) -> dict[Fraction, ComplexArray]:
    """Return order → generalised force (n,), the sum over all rows of the meshes with this order."""
    gearbox, angle_rows = assembly.gearbox, _angle_rows(assembly.gearbox, mesh_laws, nominal)
    count = int((assembly.share > 0.0).sum())
    found, points = dict[Fraction, ComplexArray](), Counter[int]()
    for row, mesh in enumerate(assembly.mesh):
        deflection, law, gear_mesh = deflections[mesh], mesh_laws[mesh], gearbox.meshes[mesh]
        if deflection is None:
            continue
        active = 2 * row + int(row < count and stiffness[2 * row + 1] > 0.0)
        if row < count:
            values = -stiffness[active] * (deflection if deflection.ndim == 1 else deflection[points[mesh]])
            points[mesh] += 1
        else:
            values = angle_rows[row - count]
        series = 2.0 * np.fft.rfft(values) / len(values)
        wheel = Fraction(assembly.train.speed_ratio[gearbox.rotor_index(gear_mesh.wheel_shaft)])
        for harmonic in harmonics:
            order = harmonic * wheel * law.teeth[1]
            push = -series[harmonic] * np.exp(1j * harmonic * law.teeth[1] * gear_mesh.phase) * assembly.contact[active]
            found[order] = found.get(order, 0.0) + push
    return found


def _angle_rows(gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], nominal: FloatArray) -> list[FloatArray]:
    """Return the forces (n_angle,) (N) of the rows that depend on the angle alone, in the order of `all_wrenches`."""
    rows = []
    for mesh, law, force in zip(gearbox.meshes, mesh_laws, nominal, strict=True):
        if mesh.friction is not None:
            push = mesh.friction.coefficient * force
            rows += [push * mesh.friction.sliding, push * mesh.friction.arm / law.base_radius[0]]
        if mesh.load_centre is not None:
            rows.append(force * mesh.load_centre.offset / law.face_width)
    return rows


def _response(assembly: Assembly, modes: ModalForm, push: ComplexArray, frequency: FloatArray) -> ComplexArray:
    """Return the bearing forces (n_f, 3 n_bearing) under generalised forces (n_f, n) at frequencies (n_f,) in Hz."""
    out = assembly.bearing_stiffness @ modes.displacement + assembly.bearing_damping @ modes.velocity
    out = out[assembly.bearings.translations]
    turning = 2j * np.pi * frequency[:, None]
    # Re(out z) is half of the sum over z and its conjugate
    here = (push @ modes.input.T) / (turning - modes.eigenvalue) @ out.T
    there = (push @ modes.input.conj().T) / (turning - modes.eigenvalue.conj()) @ out.conj().T
    return np.asarray(0.5 * (here + there))
