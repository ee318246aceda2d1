"""Mesh level `contact`: the contact problem solved in every step, the reference of the table F(θ, δ)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.legendre import leggauss

from nvhchain.errors import InputError, SolverError
from nvhchain.handoff import FloatArray, MeshLaw

if TYPE_CHECKING:
    from nvhchain.dynamics.time_loop.simulation import Motion, Simulation

FLAT = 0.3
"""Slope at which a line search of the level `contact` ends, relative to the slope at its start."""
ContactForce = Callable[[float, FloatArray], FloatArray]
"""Force of a mesh (n,) along the flank normal (N) at a wheel angle (rad) and deflections (n,) (m), as tabulated in a
`MeshLaw`: > 0 on the drive flank, 0 in the gap, < 0 on the back flank."""


@dataclass(frozen=True, eq=False)
class ContactLoop:
    """Time loop with the contact problem solved at every step, the reference of the table.

    It has the same propagator and the same mean force along the deflection path, here by Gauss quadrature.

    contact_forces : one per mesh.
    period : (n_mesh,) periods of the laws (rad of wheel angle).
    points : points of the quadrature; with two the energy is exact where the force is a cubic of the deflection.
    """

    contact_forces: tuple[ContactForce, ...]
    period: FloatArray
    points: int = 2

    def mean(self, angle: FloatArray, start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the mean contact forces (2 n_mesh,) (N) along the path, and their slopes by `end`.

        start, end : (2 n_mesh,) contact deflections (m).
        """
        node, weight = leggauss(self.points)
        share = np.append(0.5 * (node + 1.0), 1.0)  # the force at the end gives the slope
        force = np.empty((len(start), len(share)))
        for k, solve in enumerate(self.contact_forces):
            drive, back = (start[i] + share * (end[i] - start[i]) for i in (2 * k, 2 * k + 1))
            found = solve(float(angle[k]), np.concatenate([drive, -back]))
            force[2 * k] = np.maximum(found[: len(share)], 0.0)
            force[2 * k + 1] = np.maximum(-found[len(share) :], 0.0)
        mean = force[:, :-1] @ (0.5 * weight)
        travelled = end - start
        rate = np.zeros(len(start))
        np.divide(force[:, -1] - mean, travelled, out=rate, where=np.abs(travelled) > 1e-12)
        return mean, np.maximum(rate, 0.0)

    def _excess(
        self,
        compliance: FloatArray,
        linear: FloatArray,
        angle: FloatArray,
        start: FloatArray,
        free: FloatArray,
        y: FloatArray,
        tolerance: float,
        iterations: int,
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return the excess forces of a step and its end deflections, from a guess `y`; None without convergence.

        They minimise ψ of the table's time loop (`nvhchain.dynamics.time_loop._march`). Slopes are approximate here, so
        Newton's direction is followed until ψ is nearly flat along it.
        """

        def evaluate(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            end = free - compliance @ y
            mean, rate = self.mean(angle, start, end)
            return end, y - mean + 0.5 * linear * (start + end), rate - 0.5 * linear

        end, residual, slope = evaluate(y)
        for _ in range(iterations):
            if float(np.abs(residual).max()) <= tolerance:
                return y, end
            move = -np.linalg.solve(np.eye(len(y)) + slope[:, None] * compliance, residual)
            fall = -abs(float(move @ compliance @ residual))
            short, reach = (0.0, fall), 1.0
            far: tuple[float, float] | None = None
            for _ in range(iterations):
                trial = y + reach * move
                end, left, rate = evaluate(trial)
                found = float(move @ compliance @ left)
                if float(np.abs(left).max()) <= tolerance or abs(found) <= -FLAT * fall:
                    break
                if found < 0.0:
                    short = reach, found
                else:
                    far = reach, found
                if far is None:
                    reach *= 2.0
                else:
                    share = short[1] / (short[1] - far[1])
                    reach = short[0] + min(max(share, 0.1), 0.9) * (far[0] - short[0])
            y, residual, slope = trial, left, rate
        return (y, end) if float(np.abs(residual).max()) <= tolerance else None

    def march(
        self,
        model: Simulation,
        motion: Motion,
        phases: FloatArray,
        given: FloatArray,
        *,
        stride: int,
        start_time: float,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return state and excess after len(phases) steps, states before every `stride`-th step, and all excesses.

        given : (n_step, n_push) forces r of the rows `step.push`; other arguments and results as in `advance`.
        """
        step, linear, contact = model.step, model.contact_stiffness, model.contact
        tolerance, iterations, excess = contact.tolerance, contact.iterations, motion.excess[: len(linear)]
        n_z = len(step.decay)
        z = motion.state[:n_z] + 1j * motion.state[n_z:]
        y, start = excess.copy(), (step.read @ z).real
        states, excesses = [], np.hstack([np.empty((len(phases), len(excess))), given])
        for n, phase in enumerate(phases):
            if n % stride == 0:
                states.append(np.concatenate([z.real, z.imag]))
            z = step.decay * z + step.gain - step.push.T @ given[n]
            free = (step.read @ z).real
            angle = np.mod(phase, 1.0) * self.period
            solved = self._excess(step.compliance, linear, angle, start, free, y, tolerance, iterations)
            if solved is None:
                raise SolverError(
                    f"mesh forces did not converge at t = {start_time + n * step.step:.6g} s within {iterations} "
                    f"iterations to {tolerance:.3g} N: take a smaller time step"
                )
            y, end = solved
            excesses[n, : len(y)], start = y, end
            z = z - step.drive.T @ y
        return np.concatenate([z.real, z.imag]), excesses[-1].copy(), np.array(states), excesses


def contact_loop(contact_forces: Sequence[ContactForce] | None, mesh_laws: Sequence[MeshLaw]) -> ContactLoop:
    """Return the loop of the mesh level `contact`; raise InputError if solvers are missing."""
    if contact_forces is None or len(contact_forces) != len(mesh_laws):
        given = "none" if contact_forces is None else str(len(contact_forces))
        raise InputError(
            f"mesh level `contact` needs the contact solver of each of the {len(mesh_laws)} meshes, but {given} given: "
            "hand in contact_forces, or use the level `table`"
        )
    return ContactLoop(tuple(contact_forces), np.array([law.period for law in mesh_laws]))
