"""Modes of the coupled gearbox at a load: where they move, and what they strain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from nvhchain.dynamics.model.assembly import Assembly, assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.sections import Wrench
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.propagator import modal_form
from nvhchain.dynamics.time_loop.quasi_static import laws_of_rows, nominal_mesh_forces
from nvhchain.dynamics.time_loop.simulation import mean_stiffness
from nvhchain.fidelity import STANDARD, DynamicsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, MeshLaw, ReducedHousing
from nvhchain.kinds import checked
from nvhchain.runtime.threads import one_blas_thread

HOUSING = "housing"
"""Part that holds the energy of the housing, and the strain of the bearing seats."""


@dataclass(frozen=True, eq=False)
class SystemModes:
    """Modes of a gearbox, linear about its mean load.

    input_speed: speed of the input (rad/s), whose gyroscopic terms the modes hold.
    input_torque: torque of the input (N m), at which meshes and bearings are linear.
    frequency (n,): frequencies |λ|/2π without damping, or Im λ/2π with it (Hz), ascending.
    damping (n,): damping ratios −Re λ/|λ|; 0 without damping.
    kinetic_parts: names of the columns of `kinetic`: shafts, loose gears, housing.
    kinetic (n, n_part): shares of the kinetic energy; rows add up to 1.
    strain_parts: names of the columns of `strain`: meshes, bearings, flexible shafts, housing.
    strain (n, n_part): shares of the strain energy; rows add up to 1. A coupled stiffness, such as that of a seat, may
        give a negative share.
    plane_motion (n, n_plane, 6): translations and rotations of cross-sections along x, y, z (m, rad), for a modal mass
        of 1 kg.
    housing_motion (n, n_mode): modal coordinates of the housing, for a modal mass of 1 kg.
    """

    input_speed: float
    input_torque: float
    frequency: FloatArray
    damping: FloatArray
    kinetic_parts: tuple[str, ...]
    kinetic: FloatArray
    strain_parts: tuple[str, ...]
    strain: FloatArray
    plane_motion: ComplexArray
    housing_motion: ComplexArray


@checked
@one_blas_thread
def system_modes(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
    input_speed: float = 0.0,
    damped: bool = True,
    planes: Sequence[tuple[str, float]] = (),
    fidelity: DynamicsFidelity | None = None,
) -> SystemModes:
    """Return the modes of shafts, meshes, bearings and housing at a load.

    gearbox: gearbox; its bearings have the stiffness of this load (`equilibrium`).
    mesh_laws: one law per mesh, in the gearbox's order.
    housing: housing; None for rigid seats.
    input_torque: torque along the input's rotation (N m).
    input_speed: speed of the input (rad/s), for gyroscopic terms if `gearbox.gyroscopic`.
    damped: False leaves all damping out.
    planes sequence of (str, float): cross-sections whose motion is returned: shaft or loose gear, and z (m).
    Returns modes by ascending frequency; overdamped motions are excluded.

    Meshes are springs of the mean slope of their laws at the load. With u = [ω η, η̇] of the undamped modal coordinates
    η, undamped modes with gyroscopic terms are those of a Hermitian matrix. The seats' residual flexibility counts as
    housing.
    """
    fidelity = fidelity or STANDARD.dynamics
    speed = input_speed if gearbox.depends_on_speed else 0.0
    assembly = assemble(gearbox, mesh_laws, housing, input_speed=speed, fidelity=fidelity)
    torque = shaft_torques(gearbox, assembly.train, input_torque, assembly.inertia, 0.0)
    nominal = nominal_mesh_forces(assembly, mesh_laws, torque)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal), fidelity.angle_refinement)
    contact = mean_stiffness(assembly, table, nominal)
    if damped:
        form = modal_form(assembly, contact)
        turning = form.eigenvalue.imag > 0.0
        eigenvalue, shapes = form.eigenvalue[turning], form.displacement[:, turning]
    else:
        eigenvalue, shapes = _undamped(replace(assembly, damping=speed * assembly.gyroscopic), contact)
    order = np.argsort(eigenvalue.imag)
    eigenvalue, shapes = eigenvalue[order], shapes[:, order]
    shapes = shapes / np.sqrt((shapes.conj() * assembly.times_mass(shapes)).real.sum(axis=0))
    kinetic_parts, kinetic = _kinetic(assembly, shapes)
    strain_parts, strain = _strain(assembly, contact, shapes)
    size = np.abs(eigenvalue)
    return SystemModes(
        input_speed,
        input_torque,
        eigenvalue.imag / (2.0 * np.pi),
        -eigenvalue.real / size,
        kinetic_parts,
        kinetic,
        strain_parts,
        strain,
        np.moveaxis(_plane_motion(assembly, planes) @ shapes, 2, 0),
        shapes[5 * len(gearbox.shafts) : assembly.waves.start - len(assembly.elastic_shaft)].T,
    )


def _plane_motion(assembly: Assembly, planes: Sequence[tuple[str, float]]) -> FloatArray:
    """Return the motion (n_plane, 6, n) of cross-sections per unit of the unknowns."""
    box, rows, still = assembly.gearbox, [], np.zeros(len(assembly.body_of_wave))
    for name, z in planes:
        rotor, shaft = box.rotor_index(name), box.shaft_index(name)
        wrenches = [Wrench(shaft, z, push, rotor if rotor != shaft else -1) for push in np.eye(6)]
        found = [assembly.sections.rows([wrench]) for wrench in wrenches]
        rows.append([np.concatenate([motion, still, spin @ assembly.free]) for motion, spin in found])
    return np.array(rows).reshape(len(planes), 6, len(assembly.mass))


def _undamped(assembly: Assembly, contact: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return eigenvalues (n,) (rad/s) and shapes (n_unknown, n); the damping of the assembly is gyroscopic alone."""
    squared, shapes = assembly.undamped_modes(contact)
    omega = np.sqrt(squared)
    if not assembly.damping.any():
        return 1j * omega, shapes.astype(complex)
    n = len(omega)
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:], system[n:, :n] = np.diag(omega), -np.diag(omega)
    system[n:, n:] = -shapes.T @ assembly.damping @ shapes
    turning, vectors = eigh(-1j * system)
    kept = turning > 0.0
    return 1j * turning[kept], (shapes / omega) @ vectors[:n, kept]


def _shares(energies: dict[str, FloatArray]) -> tuple[tuple[str, ...], FloatArray]:
    """Return names and shares (n, n_part) of energies (n,) by part."""
    values = np.array(list(energies.values())).T
    return tuple(energies), values / values.sum(axis=1, keepdims=True)


def _kinetic(assembly: Assembly, shapes: ComplexArray) -> tuple[tuple[str, ...], FloatArray]:
    """Return parts and their shares of the kinetic energy."""
    box, lateral = assembly.gearbox, assembly.lateral
    own = assembly.mass[:, None] * np.abs(shapes) ** 2
    spins = assembly.inertia[:, None] * np.abs(assembly.free @ shapes[lateral:]) ** 2
    n_shaft, found = len(box.shafts), dict[str, FloatArray]()
    waves = assembly.waves
    first = waves.start - len(assembly.elastic_shaft)
    for i, shaft in enumerate(box.shafts):
        bent = own[first : waves.start][assembly.elastic_shaft == i].sum(axis=0)
        found[f"shaft {shaft.name}"] = own[5 * i : 5 * i + 5].sum(axis=0) + spins[i] + bent
    for i, gear in enumerate(box.loose_gears, start=n_shaft):
        found[f"gear {gear.name}"] = spins[i]
    if first > 5 * n_shaft:
        found[HOUSING] = own[5 * n_shaft : first].sum(axis=0)
    shared: FloatArray | float = 0.0
    if assembly.coupling is not None:
        double = 2.0 * assembly.coupling
        double[waves, waves] /= 2.0
        shared = (shapes.conj() * (double @ shapes)).real[waves]
    for i, body in enumerate(box.gear_bodies):
        found[f"body of {body.name}"] = (own[waves] + shared)[assembly.body_of_wave == i].sum(axis=0)
    return _shares(found)


def _strain(assembly: Assembly, contact: FloatArray, shapes: ComplexArray) -> tuple[tuple[str, ...], FloatArray]:
    """Return parts and their shares of the strain energy."""
    box, lateral = assembly.gearbox, assembly.lateral
    n_shaft = len(box.shafts)
    pressed = contact[:, None] * np.abs(assembly.contact @ shapes) ** 2
    row_energy = pressed[0::2] + pressed[1::2]
    found = {
        f"mesh {mesh.pinion_shaft}/{mesh.wheel_shaft}": row_energy[assembly.mesh == i].sum(axis=0)
        for i, mesh in enumerate(box.meshes)
    }
    moved = assembly.bearing_map @ shapes
    force = assembly.bearings.stiffness @ moved
    given = assembly.bearings.residual @ force
    own, seats = ((force.conj() * each).real for each in (moved - given, given))
    link_motion = assembly.link_map @ shapes
    linked = (link_motion.conj() * (assembly.links.stiffness @ link_motion)).real
    n = shapes.shape[1]
    parts = ((own, assembly.bearings.motions), (linked, assembly.links.motions))
    bearing_energy = np.concatenate([energy.reshape(-1, motions, n).sum(axis=1) for energy, motions in parts])
    for bearing, energy in zip(box.supports, bearing_energy, strict=True):
        found[f"bearing {bearing.name}"] = energy
    stretched = assembly.own_stiffness[:, None] * np.abs(shapes[:lateral]) ** 2
    waves = assembly.waves
    first = waves.start - len(assembly.elastic_shaft)
    for i, shaft in enumerate(box.shafts if first < waves.start else ()):
        found[f"shaft {shaft.name}"] = stretched[first : waves.start][assembly.elastic_shaft == i].sum(axis=0)
    if first > 5 * n_shaft:
        found[HOUSING] = stretched[5 * n_shaft : first].sum(axis=0) + seats.sum(axis=0)
    for i, body in enumerate(box.gear_bodies):
        found[f"body of {body.name}"] = stretched[waves][assembly.body_of_wave == i].sum(axis=0)
    return _shares(found)
