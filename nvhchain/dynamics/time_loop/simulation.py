"""Time histories of the gearbox: the discretised system, its start, and its advance by blocks of steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.dynamics.model.assembly import Assembly, assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import LawTable, mean_slope, tabulate
from nvhchain.dynamics.time_loop.mesh_levels import ContactForce, ContactLoop, contact_loop
from nvhchain.dynamics.time_loop.propagator import (
    ModalForm,
    Propagator,
    modal_form,
    output_matrix,
    propagator,
    state_of,
)
from nvhchain.dynamics.time_loop.quasi_static import laws_of_rows, nominal_mesh_forces, static_state
from nvhchain.dynamics.time_loop.trapezoid_correction import check_bends, phases_at_ends, standing
from nvhchain.errors import SolverError, require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, MeshLaw, ReducedHousing

LANES = 16
"""Modes that the compiled loops process at once; a remainder would be processed one by one."""


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Solution for the contact forces of a step.

    tolerance : admissible residual of the contact forces (N), reached within `iterations`.
    corrected : True with the fourth-order correction of the excess forces (`_correction`).
    loop : solver of the contact problem at every step, in place of the table of laws; None for the table.
    """

    tolerance: float
    iterations: int
    corrected: bool = False
    loop: ContactLoop | None = None


@dataclass(frozen=True)
class InputMotion:
    """Motion of the input, as far as it changes the equations.

    acceleration : prescribed acceleration (rad/s²).
    gyroscopic_speed : speed for gyroscopic terms (rad/s); 0 omits them.
    fluctuating : True where a fluctuating torque acts on the input (`advance`).
    """

    acceleration: float = 0.0
    gyroscopic_speed: float = 0.0
    fluctuating: bool = False


@dataclass(frozen=True, eq=False)
class Simulation:
    """Gearbox under constant torques, and perhaps one that fluctuates, ready for the time loop.

    torque : (n_rotor,) constant external torques along the running directions (N m).
    contact_stiffness : (2 n_row,) share of each contact's stiffness in the linear system (N/m).
    bearing_output : (3 n_bearing, n_state) with bearing forces = bearing_output · s.
    bearing_jump : (3 n_bearing, 2 n_row) part subtracted from their samples per jump of the excess forces
        (`bearing_force`).
    contact_output : (2 n_row, n_state) with contact deflections = contact_output · s.
    deflection_output : (n_mesh, n_state) of the drive flanks, mean over the face.
    back_output : (n_mesh, n_state) of the back flanks, likewise, with the sign of the laws: < 0 where they are pressed.
    error_output : (n_mesh + 1, n_state) of the transmission errors of the meshes (m), then of the angle (rad) by which
        the output lags behind the input.
    kernel : decay, gain, read and drive of `step` for the time loop; `push` follows the rows of the drive. Each is
        (2, …), real over imaginary parts, padded with idle modes to whole vector registers.
    contact : solution for the contact forces of a step.
    """

    assembly: Assembly
    table: LawTable
    torque: FloatArray
    contact_stiffness: FloatArray
    modes: ModalForm
    step: Propagator
    bearing_output: FloatArray
    bearing_jump: FloatArray
    contact_output: FloatArray
    deflection_output: FloatArray
    back_output: FloatArray
    error_output: FloatArray
    kernel: tuple[FloatArray, ...]
    contact: ContactSolution


@dataclass(frozen=True, eq=False)
class Motion:
    """State of a simulation.

    state : (n_state,) state s.
    excess : (2 n_row + n_push,) contact forces beyond the linear system (N), mean over the last step, then the
        fluctuating torque on the input with its sign reversed (N m), where there is one.
    past : (5, 2 n_row) values that `_correction.kept` keeps of the last step; by default those of a standstill.
    """

    state: FloatArray
    excess: FloatArray
    past: FloatArray | None = None


def simulation(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
    time_step: float,
    fidelity: DynamicsFidelity,
    motion: InputMotion = InputMotion(),
    contact_forces: Sequence[ContactForce] | None = None,
) -> Simulation:
    """Assemble, diagonalise and discretise a gearbox.

    input_torque : torque along the input's rotation (N m), negative in coast.
    time_step : length of the step (s).
    motion : acceleration and speed of the input.
    contact_forces : one solver per mesh, for the mesh level `contact`, which needs the laws for its start and linear
        part.

    The inertia torques of an acceleration need no term of their own. Along the free torsion they do no work
    (`Assembly.free`), and the output torque is reduced by them.

    Raises InputError if the torque exceeds a law.
    """
    assembly = assemble(gearbox, mesh_laws, housing, input_speed=motion.gyroscopic_speed, fidelity=fidelity)
    torque = shaft_torques(gearbox, assembly.train, input_torque, assembly.inertia, motion.acceleration)
    nominal = nominal_mesh_forces(assembly, mesh_laws, torque)
    loop = None
    if fidelity.mesh_level == "contact":
        require(
            not gearbox.gear_bodies
            and gearbox.face_points == 1
            and all(mesh.friction is None and mesh.load_centre is None for mesh in gearbox.meshes),
            "the mesh level `contact` has neither friction, shuttling, gear bodies that vibrate nor points across the "
            "face: use the level `table` for them",
        )
        require(
            not fidelity.path_correction,
            "the mesh level `contact` has no path_correction: take a shorter time_step, or the level `table`",
        )
        loop = contact_loop(contact_forces, mesh_laws)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal), fidelity.angle_refinement)
    return _discretised(
        assembly,
        table,
        torque,
        mean_stiffness(assembly, table, nominal),
        time_step,
        ContactSolution(
            fidelity.contact_residual * float(np.abs(table.force).max()),
            fidelity.contact_iterations,
            fidelity.path_correction,
            loop,
        ),
        motion.fluctuating,
    )


def mean_stiffness(assembly: Assembly, table: LawTable, nominal: FloatArray) -> FloatArray:
    """Return the contact stiffness (2 n_row,) (N/m): mean slope of each law, on the flank that carries.

    nominal : (n_mesh,) nominal mesh forces (N), at which the slope is taken.
    """
    stiffness = np.zeros(2 * len(assembly.mesh))
    for row, (mesh, share) in enumerate(zip(assembly.mesh, assembly.share, strict=True)):
        if share == 0.0:
            continue
        force = share * nominal[mesh]
        stiffness[2 * row + (force < 0.0)] = mean_slope(table, row, force)
    return stiffness


def _discretised(
    assembly: Assembly,
    table: LawTable,
    torque: FloatArray,
    contact_stiffness: FloatArray,
    time_step: float,
    contact: ContactSolution,
    fluctuating: bool,
) -> Simulation:
    """Diagonalise and discretise (fields of `Simulation`; time_step in s)."""
    modes = modal_form(assembly, contact_stiffness)
    first = assembly.gearbox.rotor_index(assembly.gearbox.input_shaft)
    push = assembly.torques[first : first + 1] if fluctuating else None
    step = propagator(assembly, modes, assembly.load(torque), time_step, push)
    if contact.corrected:
        check_bends(assembly, modes, contact_stiffness, assembly.load(torque), time_step, table)
    contact_output = output_matrix(modes, assembly.contact, np.zeros_like(assembly.contact))
    n_mesh = len(assembly.gearbox.meshes)
    mean = assembly.share * (assembly.mesh == np.arange(n_mesh)[:, None])
    error = np.vstack([assembly.mesh_error, assembly.transmission_error])
    return Simulation(
        assembly,
        table,
        torque,
        contact_stiffness,
        modes,
        step,
        output_matrix(modes, assembly.bearing_stiffness, assembly.bearing_damping),
        time_step / 12.0 * assembly.bearing_damping @ assembly.accelerations(assembly.contact.T),
        contact_output,
        mean @ contact_output[0::2],
        -mean @ contact_output[1::2],
        output_matrix(modes, error, np.zeros_like(error)),
        tuple(_pad_modes(part) for part in (step.decay, step.gain, step.read, np.concatenate([step.drive, step.push]))),
        contact,
    )


def set_input_speed(model: Simulation, input_speed: float) -> Simulation:
    """Return the model with the gyroscopic terms of another input speed (rad/s)."""
    return _discretised_again(model, model.assembly.set_speed(input_speed), model.step.step)


def set_time_step(model: Simulation, time_step: float) -> Simulation:
    """Return the model with another length of the step (s); it has the same modes."""
    return _discretised_again(model, model.assembly, time_step)


def _discretised_again(model: Simulation, assembly: Assembly, time_step: float) -> Simulation:
    """Return the model with another assembly of the same parts, and time step (s)."""
    given = (model.table, model.torque, model.contact_stiffness, time_step, model.contact)
    return _discretised(assembly, *given, len(model.step.push) > 0)


def carried_over(motion: Motion, source: Simulation, target: Simulation) -> Motion:
    """Return the motion of one model in the modes of another with the same unknowns."""
    z = motion.state.reshape(2, -1)
    z = z[0] + 1j * z[1]
    x, v = (source.modes.displacement @ z).real, (source.modes.velocity @ z).real
    return Motion(state_of(target.modes, x, v), motion.excess, motion.past)


def _pad_modes(modal: ComplexArray) -> FloatArray:
    """Return real and imaginary parts (2, …, n_z), n_z padded with zeros to a multiple of `LANES`."""
    n_z = modal.shape[-1]
    filled = np.zeros((2, *modal.shape[:-1], -(-n_z // LANES) * LANES))
    filled[0, ..., :n_z], filled[1, ..., :n_z] = modal.real, modal.imag
    return filled


def quasi_static_state(model: Simulation, phases: FloatArray) -> Motion:
    """Return the quasi-static solution at mesh-law `phases` (n_mesh,), in periods."""
    static = static_state(model.assembly, model.table, model.torque, phases)
    return Motion(state_of(model.modes, static.position), np.zeros(len(model.contact_stiffness) + len(model.step.push)))


def compile_time_loop() -> None:
    """Compile the time loop, or read it from disk, as `advance` does at its first call."""
    from nvhchain.dynamics.time_loop._march import march_of

    march_of(False, False)


def advance(
    model: Simulation,
    motion: Motion,
    phases: FloatArray,
    *,
    stride: int = 1,
    start_time: float = 0.0,
    torque: FloatArray | None = None,
) -> tuple[Motion, FloatArray, FloatArray]:
    """Advance a motion by len(phases) steps.

    phases : (n_step, n_mesh) mesh-law phases at mid-step, in periods.
    stride : number of steps from one stored state to the next.
    start_time : time of the first step (s), for messages.
    torque : (n_step,) torque that fluctuates on the input (N m), mean over the step; by default there is none.

    Returns the motion at the end and the states before steps 0, stride, 2 stride … (n_store, n_state). The excess
    forces of all steps (n_step, 2 n_row + n_push) follow, as in `Motion`. Raises SolverError with the time of a step
    that did not converge.
    """
    n_c, n_push = len(model.contact_stiffness), len(model.step.push)
    given = np.zeros((len(phases), n_push))
    if torque is not None:
        given[:] = -torque[:, None]
    contact = model.contact
    if contact.loop is not None:
        state, excess, states, excesses = contact.loop.march(
            model, motion, phases, given, stride=stride, start_time=start_time
        )
        return Motion(state, excess), states, excesses
    from nvhchain.dynamics.time_loop._march import march_of  # compiles, or reads its cache, when first needed

    position = _row_coordinates(model, phases)
    turned_to = _row_coordinates(model, phases_at_ends(phases) if contact.corrected else phases[:0])
    n_step = len(position)
    states = np.empty((-(-n_step // stride), len(motion.state)))
    excesses = np.empty((n_step, n_c + n_push))
    excesses[:, n_c:] = given
    excess = motion.excess[:n_c].copy()
    n_z = model.kernel[0].shape[-1]
    re_im = np.zeros((2, n_z))
    re_im[:, : len(motion.state) // 2] = motion.state.reshape(2, -1)
    scratch = np.zeros((17, n_c))
    past = np.zeros((5, n_c)) if motion.past is None else motion.past.copy()
    if contact.corrected and motion.past is None and n_step > 0:
        deflection = model.contact_output @ motion.state
        past = standing(model.table, deflection, model.contact_stiffness, phases[0, model.assembly.mesh])
    failed = march_of(contact.corrected, n_push > 0)(
        *model.kernel, model.step.compliance, model.contact_stiffness,
        model.table.deflection, model.table.force, model.table.potential, model.table.rows, model.table.cells, position,
        re_im, excess, contact.tolerance, contact.iterations, stride, states, excesses, turned_to, past,
        scratch, np.zeros((7, n_c), np.int64), np.zeros((n_c, n_c + 1)), np.zeros(n_z),
    )  # fmt: skip
    if failed >= 0:
        raise SolverError(
            f"mesh forces did not converge at t = {start_time + failed * model.step.step:.6g} s within "
            f"{contact.iterations} iterations "
            f"to {contact.tolerance:.3g} N: take a smaller time step"
        )
    last = np.append(excess, given[-1:])
    return Motion(re_im[:, : len(motion.state) // 2].ravel(), last, past), states, excesses


def _row_coordinates(model: Simulation, phases: FloatArray) -> FloatArray:
    """Return the row coordinates (n, n_row) in the laws of the time loop at mesh-law phases (n, n_mesh)."""
    rows, mesh = model.table.rows, model.assembly.mesh
    place = phases if len(mesh) == phases.shape[1] else np.take(phases, mesh, axis=1)
    position = (place - np.floor(place)) * rows  # np.mod gives the same bits but takes five times as long
    position[position >= rows] = 0.0  # 1 − ε rounds up to a whole period
    return np.ascontiguousarray(position)


def bearing_force(model: Simulation, states: FloatArray, excess_before: FloatArray, excesses: FloatArray) -> FloatArray:
    """Return bearing forces on the housing (n_step, 3 n_bearing) (N) at the step starts of an `advance` with stride 1.

    excess_before : (2 n_row + n_push,) excess forces of the step before the first (N).
    excesses : (n_step, 2 n_row + n_push) excess forces of the steps (N).

    Torques do not press bearings: only contact forces count here.

    The held forces jump from step to step. With bearing damping the slope of the bearing force jumps too, and its bare
    samples would alias this into the band. The sum over samples differs from the integral by −h²/12 Σ (slope jumps)
    (Euler–Maclaurin). Therefore h/12 times the jump is added to each sample. The spectrum of the record is then that of
    the force that moved the housing, to fourth order.
    """
    jump = np.diff(excesses, axis=0, prepend=excess_before[None, :])[:, : len(model.contact_stiffness)]
    return np.asarray(states @ model.bearing_output.T - jump @ model.bearing_jump.T)
