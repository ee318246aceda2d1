"""Exact propagator of the gearbox's linear part over one step, in complex diagonal first-order form.

State s = [τ, τ̇, Re z, Im z]: torsional coordinates relative to the nominal spin, which are free between the meshes (double
zero, advanced as such), and one complex coordinate per conjugate pair (or per real eigenvalue) of bearings, shafts and housing.
With contact forces constant over a step h, z ← e^{λh} z + (e^{λh} − 1)/λ b F and τ ← τ + hτ̇ + h²/2 τ̈ hold exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig, eigh

from nvhchain.dynamics.assembly import Assembly
from nvhchain.errors import SolverError
from nvhchain.handoff import ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class ModalForm:
    """First-order modes of y: y = Re(displacement z), ẏ = Re(velocity z), ż = eigenvalue z + input Q(y).

    eigenvalue (n_z,): Im ≥ 0.  displacement, velocity (n, n_z).  input (n_z, n).
    """

    eigenvalue: ComplexArray
    displacement: ComplexArray
    velocity: ComplexArray
    input: ComplexArray


def modal_form(assembly: Assembly) -> ModalForm:
    """Diagonalise M ÿ + C ẏ + K y = Q in first-order form.

    In undamped modal coordinates η and x = [ω η, η̇], ẋ = [[0, ω], [−ω, −Ĉ]] x + [0, Q̂] is skew plus damping: nearly
    normal, so its eigenvectors are well conditioned. Raises SolverError when they are not (a mode exactly at critical damping).
    """
    root = 1.0 / np.sqrt(assembly.mass)
    squared, shapes = eigh(root[:, None] * assembly.stiffness * root)
    omega, shapes = np.sqrt(squared), root[:, None] * shapes
    n = len(omega)
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.diag(omega)
    system[n:, :n] = -np.diag(omega)
    system[n:, n:] = -shapes.T @ assembly.damping @ shapes
    eigenvalue, right = eig(system)
    left = np.linalg.inv(right)
    rebuilt = float(np.abs((right * eigenvalue) @ left - system).max())
    if not rebuilt <= 1e-8 * float(omega.max()):
        raise SolverError(
            f"the damped modes of the gearbox cannot be separated (rebuilding error {rebuilt / omega.max():.1e}): a mode sits at "
            "critical damping; change the bearing damping slightly"
        )
    keep = eigenvalue.imag >= 0.0
    weight = np.where(eigenvalue.imag[keep] > 0.0, 2.0, 1.0)  # a kept pair stands for both of its members
    right = right[:, keep] * weight
    return ModalForm(
        eigenvalue[keep],
        (shapes / omega) @ right[:n],
        shapes @ right[n:],
        left[keep][:, n:] @ shapes.T,
    )


@dataclass(frozen=True, eq=False)
class Propagator:
    """One step of `step` seconds under constant contact forces F (n_contact,).

    decay (n_z,) complex.  read (n_contact, n_z): deflection of contact i has the part Re(read z).
    drive (n_contact, n_z): z gains −Σ drive F.  read_torsion (n_contact, n_t).
    torsion_acceleration (n_t,): of the external torques.  compliance (n_contact, n_contact) m/N: fall of the end
    deflections per unit contact force over the step; symmetric, not negative.
    """

    step: float
    decay: ComplexArray
    read: ComplexArray
    drive: ComplexArray
    read_torsion: FloatArray
    torsion_acceleration: FloatArray
    compliance: FloatArray


def propagator(assembly: Assembly, modes: ModalForm, torque: FloatArray, step: float) -> Propagator:
    """Discretise exactly.  torque (n_shaft,): external, N m, along each shaft's running direction.  step: s."""
    decay = np.exp(modes.eigenvalue * step)
    read = assembly.to_lateral @ modes.displacement
    # expm1 keeps (e^{λh} − 1)/λ accurate for slow modes
    hold = np.expm1(modes.eigenvalue * step) / modes.eigenvalue
    drive = (hold[:, None] * (modes.input @ assembly.to_lateral.T)).T
    read_torsion = assembly.to_torsion @ assembly.free
    compliance = (read @ drive.T).real + 0.5 * step**2 * read_torsion @ read_torsion.T
    compliance = 0.5 * (compliance + compliance.T)
    lowest = float(np.linalg.eigvalsh(compliance)[0])
    if lowest < -1e-9 * float(compliance.max()):
        raise SolverError(
            f"the step compliance of the meshes is not positive at a step of {step:g} s (lowest eigenvalue {lowest:.2e} m/N): "
            "take a smaller time step"
        )
    return Propagator(
        step,
        decay,
        np.ascontiguousarray(read),
        np.ascontiguousarray(drive),
        np.ascontiguousarray(read_torsion),
        assembly.free.T @ torque,
        compliance,
    )


def output_matrix(modes: ModalForm, n_torsion: int, on_position: FloatArray, on_velocity: FloatArray) -> FloatArray:
    """(n_out, n_state) so that outputs = matrix · s for on_position y + on_velocity ẏ."""
    rows = on_position @ modes.displacement + on_velocity @ modes.velocity
    return np.hstack([np.zeros((len(rows), 2 * n_torsion)), rows.real, -rows.imag])


def state_of(modes: ModalForm, torsion: FloatArray, position: FloatArray) -> FloatArray:
    """(n_state,) of a standstill at torsional coordinates `torsion` and lateral unknowns `position`."""
    both = np.vstack([modes.displacement, modes.velocity])
    # y and ẏ determine z: [y; ẏ] = Re(both z), square once split into real and imaginary parts
    pairs = modes.eigenvalue.imag > 0
    real_form = np.hstack([both.real, -both.imag[:, pairs]])
    # scaled rows: displacements and velocities differ by a frequency
    scale = 1.0 / np.abs(real_form).max(axis=1)
    wanted = np.concatenate([position, np.zeros_like(position)])
    solution = np.linalg.solve(scale[:, None] * real_form, scale * wanted)
    imaginary = np.zeros(len(pairs))
    imaginary[pairs] = solution[len(pairs) :]
    return np.concatenate([torsion, np.zeros_like(torsion), solution[: len(pairs)], imaginary])
