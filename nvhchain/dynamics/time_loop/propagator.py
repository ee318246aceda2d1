"""Exact propagator of the gearbox's linear part over one step, in complex diagonal first-order form.

The linear part holds shafts, bearings, housing and, at every mesh, a constant stiffness k₀ on its loaded flank. The
excess of the mesh law, r = F − k₀δ, acts from outside, constant over a step. The state s = [Re z, Im z] has one complex
coordinate per conjugate pair (or per real eigenvalue) λ. With constant r over a step h, exactly,

    z ← e^{λh} z + (e^{λh} − 1)/λ (load − drive r).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from nvhchain.dynamics.model.assembly import Assembly
from nvhchain.errors import SolverError
from nvhchain.handoff import ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class ModalForm:
    """First-order modes of x: x = Re(displacement z), ẋ = Re(velocity z), ż = eigenvalue z + input Q(x).

    eigenvalue : (n_z,) with Im ≥ 0.
    displacement, velocity : (n, n_z) mode shapes.
    input : (n_z, n) modal participation of generalised forces.
    """

    eigenvalue: ComplexArray
    displacement: ComplexArray
    velocity: ComplexArray
    input: ComplexArray


def modal_form(assembly: Assembly, contact_stiffness: FloatArray) -> ModalForm:
    """Diagonalise M ẍ + C ẋ + (K + Wᵀ k₀ W) x = Q in first-order form.

    contact_stiffness : (2 n_mesh,) stiffness k₀ (N/m), positive on one flank of every mesh, so that no torsional motion
        is free.

    Let η be undamped modal coordinates and u = [ω η, η̇]. Then u̇ = [[0, ω], [−ω, −Ĉ]] u + [0, Q̂] is skew plus
    damping. It is nearly normal, so its eigenvectors are well conditioned.

    Raises SolverError if they are not (a mode exactly at critical damping).
    """
    squared, shapes = assembly.undamped_modes(contact_stiffness)
    omega = np.sqrt(squared)
    n = len(omega)
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.diag(omega)
    system[n:, :n] = -np.diag(omega)
    system[n:, n:] = -shapes.T @ assembly.damping @ shapes
    eigenvalue, right = eig(system)
    left = np.linalg.inv(right)
    error = float(np.abs((right * eigenvalue) @ left - system).max() / omega.max())
    if not error <= 1e-8:
        raise SolverError(
            f"the damped modes of the gearbox cannot be separated (rebuilding error {error:.1e}): a mode sits at "
            "critical damping; change the bearing damping slightly"
        )
    keep = eigenvalue.imag >= 0.0
    weight = np.where(eigenvalue.imag[keep] > 0.0, 2.0, 1.0)  # a retained mode represents both members of its pair
    right = right[:, keep] * weight
    return ModalForm(
        eigenvalue[keep],
        (shapes / omega) @ right[:n],
        shapes @ right[n:],
        left[keep][:, n:] @ shapes.T,
    )


@dataclass(frozen=True, eq=False)
class Propagator:
    """Propagator over one step.

    step : length of the step (s).
    decay : (n_z,) complex e^{λh}.
    gain : (n_z,) complex change of z by the external torques.
    read : (n_contact, n_z) with contact deflection = Re(read z).
    drive : (n_contact, n_z) with loss of z = Σ drive r.
    push : (n_push, n_z) likewise of given forces that vary, one row or none; r is the force with its sign reversed.
    compliance : (n_contact, n_contact) fall of the end deflections per unit contact force r over the step (m/N).

    The linear part is passive, so the compliance is at least 0 and at most twice the static compliance. It is symmetric
    except for gyroscopic terms.
    """

    step: float
    decay: ComplexArray
    gain: ComplexArray
    read: ComplexArray
    drive: ComplexArray
    push: ComplexArray
    compliance: FloatArray


def propagator(
    assembly: Assembly, modes: ModalForm, load: FloatArray, step: float, push: FloatArray | None = None
) -> Propagator:
    """Discretise exactly, under a constant generalised force `load` (n,), in steps of `step` (s).

    push : (n_push, n) generalised forces per unit of the given forces that vary; none by default.
    """
    # expm1 keeps (e^{λh} − 1)/λ accurate for slow modes
    hold = np.expm1(modes.eigenvalue * step) / modes.eigenvalue
    read = assembly.contact @ modes.displacement
    drive = (hold[:, None] * (modes.input @ assembly.contact.T)).T
    given = np.zeros((0, len(load))) if push is None else push
    compliance = np.ascontiguousarray((read @ drive.T).real)
    if np.array_equal(assembly.damping, assembly.damping.T):
        compliance = 0.5 * (compliance + compliance.T)
    return Propagator(
        step,
        np.exp(modes.eigenvalue * step),
        hold * (modes.input @ load),
        np.ascontiguousarray(read),
        np.ascontiguousarray(drive),
        np.ascontiguousarray((hold[:, None] * (modes.input @ given.T)).T),
        compliance,
    )


def output_matrix(modes: ModalForm, position_factor: FloatArray, velocity_factor: FloatArray) -> FloatArray:
    """Return the matrix (n_out, n_state) with outputs = matrix · s for on_position x + on_velocity ẋ."""
    rows = position_factor @ modes.displacement + velocity_factor @ modes.velocity
    return np.hstack([rows.real, -rows.imag])


def state_of(modes: ModalForm, position: FloatArray, velocity: FloatArray | None = None) -> FloatArray:
    """Return the state (n_state,) at `position` (n,) and `velocity` (n,); by default at standstill.

    z satisfies Re(displacement z) = position and Re(velocity z) = velocity.
    """
    both = np.vstack([modes.displacement, modes.velocity])
    pairs = modes.eigenvalue.imag > 0
    # a real coordinate has no imaginary part, so there are as many unknowns as equations
    real_form = np.hstack([both.real, -both.imag[:, pairs]])
    # displacements and velocities differ by a frequency: scale the rows to one size
    scale = 1.0 / np.abs(real_form).max(axis=1)
    wanted = np.concatenate([position, np.zeros_like(position) if velocity is None else velocity])
    solution = np.linalg.solve(scale[:, None] * real_form, scale * wanted)
    imaginary = np.zeros(len(pairs))
    imaginary[pairs] = solution[len(pairs) :]
    return np.concatenate([solution[: len(pairs)], imaginary])
