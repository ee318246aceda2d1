"""Mesh models beside the table F(θ, δ): its tangent k(θ) below it, the contact problem itself above it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.interpolate import PchipInterpolator

from nvhchain.dynamics.model.assembly import Assembly
from nvhchain.dynamics.time_loop.law_table import LawTable
from nvhchain.dynamics.time_loop.propagator import Propagator
from nvhchain.errors import InputError, SolverError
from nvhchain.handoff import FloatArray, MeshLaw

TANGENT_REACH = 5.0
"""Motion beyond so many times the ends of a tangent law, ten times the deflections of the law itself, is none of it."""
FLAT = 0.3
"""Of the slope at its start, to which a line search of the level `contact` leads."""
ContactForce = Callable[[float, FloatArray], FloatArray]
"""Force of a mesh, (n,) N along the flank normal, at a wheel angle in rad and deflections (n,) m: what a `MeshLaw`
tabulates, > 0 on the drive flank, 0 in the gap, < 0 on the back flank."""


def tangent_law(law: MeshLaw, force: float, edge_cells: int = 0) -> MeshLaw:
    """The law's tangent at `force` (N, along the flank normal), k(θ) (δ − e(θ)).

    Tangents are those of a monotone cubic through each row. Without `edge_cells` there is no gap: where the tangent
    pulls, the back flank carries, along its own normal. With them the drive flank carries by its tangent from
    δ = e(θ) on, the back flank by the one at −`force` up to its own zero, nothing in between, and both ends of the gap
    are resolved by so many cells over all that the angle moves them. Raises InputError where the law has no stiffness
    at `force`.
    """
    stiffness, offset = _tangents(law, force)
    reach = 2.0 * float(np.abs(law.deflection).max())
    line = np.array([-reach, reach])
    if not edge_cells:
        return law.replace(deflection=line, force=stiffness[:, None] * (line - offset[:, None]))
    other = _tangents(law, -force)
    (drive, front), (back, behind) = ((stiffness, offset), other) if force > 0.0 else (other, (stiffness, offset))
    ends = [np.linspace(edge.min(), edge.max(), edge_cells + 1) for edge in (behind, front)]
    # the slope of a row is whole from the first node beyond its own end of the gap
    grid = np.unique(np.concatenate([line, *(np.append(e, [2 * e[0] - e[1], 2 * e[-1] - e[-2]]) for e in ends)]))
    pushed = drive[:, None] * np.maximum(grid - front[:, None], 0.0)
    return law.replace(deflection=grid, force=pushed + back[:, None] * np.minimum(grid - behind[:, None], 0.0))


def _tangents(law: MeshLaw, force: float) -> tuple[FloatArray, FloatArray]:
    """Slope in N/m and zero in m of the tangent of every row at `force`."""
    stiffness, offset = np.empty(len(law.angle)), np.empty(len(law.angle))
    for i, row in enumerate(law.force):
        curve = PchipInterpolator(law.deflection, row, extrapolate=True)
        where = [x for x in np.atleast_1d(curve.solve(force)) if curve(x, 1) > 0.0]
        if not where:
            raise InputError(
                f"mesh level `stiffness`: the law with teeth {law.teeth} has no stiffness at {force:.6g} N, what its "
                "torque asks for: load the gearbox or use the level `table`"
            )
        at = where[-1] if force >= 0.0 else where[0]
        stiffness[i] = curve(at, 1)
        offset[i] = at - force / stiffness[i]
    return stiffness, offset


def check_tangents(
    assembly: Assembly, table: LawTable, force: FloatArray, time: FloatArray, deflection: FloatArray
) -> None:
    """SolverError where motion has outgrown the tangents of `table`, taken at `force` (n_mesh,) N.

    A tangent that varies much over the angle, as it does where the load hardly closes the flanks, drives the motion
    like any parametric stiffness, and nothing limits it.
    time (n,): s.  deflection (n, 2 n_row): m, of the contacts.
    """
    for row in np.flatnonzero(assembly.share > 0.0):
        mesh = assembly.mesh[row]
        limit = TANGENT_REACH * float(np.abs(table.deflection[row]).max())
        # of the flank that is pressed: soft bearings let the other one out of reach
        reached = deflection[:, 2 * row : 2 * row + 2].max(axis=1)
        beyond = np.flatnonzero(~(reached <= limit))
        if len(beyond) > 0:
            cells, rows = table.cells[row], table.rows[row]
            ends = slice(cells - 2, cells) if force[mesh] >= 0.0 else slice(0, 2)
            rise = np.diff(table.force[row, :rows, ends], axis=1) / np.diff(table.deflection[row, ends])
            slope, of = rise / assembly.share[row], assembly.gearbox.meshes[mesh]
            raise SolverError(
                f"mesh {of.pinion_shaft}–{of.wheel_shaft}: the motion has grown to {1e6 * reached[beyond[0]]:.4g} µm "
                f"at t = {time[beyond[0]]:.6g} s (limit {1e6 * limit:.4g} µm). The mesh level `stiffness` takes the "
                f"law's tangent at {force[mesh]:.4g} N, {slope.min():.3g}…{slope.max():.3g} N/m over the angle, "
                "which drives such motion and has no meaning there: use the level `table`"
            )


@dataclass(frozen=True, eq=False)
class ContactLoop:
    """The time loop with the contact problem solved at every step, the yardstick of the table: the same propagator, the
    same mean force along the deflection travelled, here by Gauss quadrature.

    contact_forces: one per mesh.  period (n_mesh,): rad of wheel angle, of the laws.  points: of the quadrature; with
    two the energy is exact where the force is a cubic of the deflection.
    """

    contact_forces: tuple[ContactForce, ...]
    period: FloatArray
    points: int = 2

    def mean(self, angle: FloatArray, start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean contact forces (2 n_mesh,) N on the way from `start` to `end` (2 n_mesh,) m, and their slopes by
        `end`."""
        node, weight = leggauss(self.points)
        share = np.append(0.5 * (node + 1.0), 1.0)  # the end itself gives the slope
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
        """Excess forces of a step and the deflections at its end, from a guess `y`; None when they did not converge.

        They are where ψ of the table's time loop (`nvhchain.dynamics.time_loop._march`) is least. Slopes are known
        roughly here, so that Newton's direction is followed to where ψ is nearly flat along it.
        """

        def at(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            end = free - compliance @ y
            mean, rate = self.mean(angle, start, end)
            return end, y - mean + 0.5 * linear * (start + end), rate - 0.5 * linear

        end, residual, slope = at(y)
        for _ in range(iterations):
            if float(np.abs(residual).max()) <= tolerance:
                return y, end
            move = -np.linalg.solve(np.eye(len(y)) + slope[:, None] * compliance, residual)
            fall = -abs(float(move @ compliance @ residual))
            short, reach = (0.0, fall), 1.0
            far: tuple[float, float] | None = None
            for _ in range(iterations):
                trial = y + reach * move
                end, left, rate = at(trial)
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
        step: Propagator,
        linear: FloatArray,
        phases: FloatArray,
        state: FloatArray,
        excess: FloatArray,
        *,
        tolerance: float,
        iterations: int,
        stride: int,
        start_time: float,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """State and excess after len(phases) steps, states before every `stride`-th step and excesses of all (as
        `advance`)."""
        n_z = len(step.decay)
        z = state[:n_z] + 1j * state[n_z:]
        y, start = excess.copy(), (step.read @ z).real
        states, excesses = [], np.empty((len(phases), len(excess)))
        for n, phase in enumerate(phases):
            if n % stride == 0:
                states.append(np.concatenate([z.real, z.imag]))
            z = step.decay * z + step.gain
            free = (step.read @ z).real
            angle = np.mod(phase, 1.0) * self.period
            solved = self._excess(step.compliance, linear, angle, start, free, y, tolerance, iterations)
            if solved is None:
                raise SolverError(
                    f"mesh forces did not converge at t = {start_time + n * step.step:.6g} s within {iterations} "
                    f"iterations to {tolerance:.3g} N: take a smaller time step"
                )
            y, end = solved
            excesses[n], start = y, end
            z = z - step.drive.T @ y
        return np.concatenate([z.real, z.imag]), y, np.array(states), excesses


def contact_loop(contact_forces: Sequence[ContactForce] | None, mesh_laws: Sequence[MeshLaw]) -> ContactLoop:
    """The loop for the mesh level `contact`; InputError where the solvers are missing."""
    if contact_forces is None or len(contact_forces) != len(mesh_laws):
        given = "none" if contact_forces is None else str(len(contact_forces))
        raise InputError(
            f"mesh level `contact` needs the contact solver of each of the {len(mesh_laws)} meshes, but {given} given: "
            "hand in contact_forces, or use the level `table`"
        )
    return ContactLoop(tuple(contact_forces), np.array([law.period for law in mesh_laws]))
