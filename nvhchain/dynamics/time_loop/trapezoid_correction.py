"""What the time loop needs of a run whose ways bend (`nvhchain.dynamics.time_loop._correction`) before it starts."""

from __future__ import annotations

from itertools import product
from math import inf

import numpy as np

from nvhchain.dynamics.model.assembly import Assembly
from nvhchain.dynamics.time_loop.law_table import LawTable, force_at, row_at
from nvhchain.dynamics.time_loop.propagator import ModalForm, Propagator, propagator
from nvhchain.errors import InputError
from nvhchain.handoff import FloatArray

BENT_LIMIT = 0.4
"""Mesh stiffness times step compliance, half of (ω h)² of the mesh, up to which `_bend` tells the bend of a way."""
GROWTH = 0.1
"""1/s, of small motions: what `_bend` may feed in where damping does not take it out."""
TRIED = 0.9
"""Of a step that is too long: the next that is tried for the remedy."""


def check_bends(
    assembly: Assembly, modes: ModalForm, linear: FloatArray, load: FloatArray, step: float, table: LawTable
) -> None:
    """InputError where a step is too long for its ways to be told from those of the steps before, or feeds in more
    than the damping takes out.

    linear (2 n_row,): N/m, of the contacts' linear parts.  load (n,): generalised force.  step: s.
    """
    rises = zip(table.force, table.deflection, table.rows, table.cells, strict=True)
    slopes = np.array([(np.diff(force[:n, :m]) / np.diff(grid[:m])).max() for force, grid, n, m in rises])

    def found(step: float) -> tuple[float, float]:
        by = propagator(assembly, modes, load, step)
        stiffest = float((slopes * np.diag(by.compliance).reshape(-1, 2).max(axis=1)).max())
        return stiffest, growth(assembly, by, linear, slopes) if stiffest <= BENT_LIMIT else inf

    stiffest, grown = found(step)
    if grown <= GROWTH:
        return
    short = TRIED * step
    while found(short)[1] > 0.9 * GROWTH:
        short *= TRIED
    why = (
        f"the stiffest mesh times what gives in a step is {stiffest:.3g}, of {BENT_LIMIT:g} at most"
        if stiffest > BENT_LIMIT
        else f"small motions grow by {grown:.3g} 1/s, more than damping takes out (limit {GROWTH:g} 1/s)"
    )
    raise InputError(
        f"time step {1e6 * step:.4g} µs is too long for bent_ways: {why}: take {1e6 * short:.3g} µs or leave bent_ways "
        "out"
    )


def growth(assembly: Assembly, step: Propagator, linear: FloatArray, slopes: FloatArray) -> float:
    """1/s, at most, by which small motions of the time loop grow with the flanks of every mesh open or closed.

    slopes (n_row,): N/m, of the laws where they are steepest.  With the excess s d of every contact, the forces of a
    step are linear in the state, the way of the step before and its change (`_bend`): the growth is that of the largest
    eigenvalue of this map.
    """
    n_c, n_z = len(linear), len(step.decay)
    decay, read = step.decay, np.hstack([step.read.real, -step.read.imag])
    drive = np.vstack([step.drive.real.T, step.drive.imag.T])
    free = np.block([[np.diag(decay.real), -np.diag(decay.imag)], [np.diag(decay.imag), np.diag(decay.real)]])
    start, way, change = np.split(np.eye(2 * n_z + 2 * n_c), [2 * n_z, 2 * n_z + n_c])
    largest = 0.0
    for closed in product((False, True), repeat=len(assembly.gearbox.meshes)):
        held = np.array(closed)[assembly.mesh] & (assembly.share > 0.0)
        excess = np.where(np.repeat(held, 2) & (linear > 0.0), np.repeat(slopes, 2), 0.0) - linear
        d, ahead = read @ start, read @ free @ start
        # y = s (d + d⁺)/2 − s/12 (3 Δw − Δw of the step before), d⁺ = ahead − G y
        known = 0.5 * (d + ahead) - 0.25 * (ahead - d - way) + change / 12.0
        force = np.linalg.solve(np.eye(n_c) + 0.25 * excess[:, None] * step.compliance, excess[:, None] * known)
        moved = ahead - step.compliance @ force - d
        after = np.vstack([free @ start - drive @ force, moved, moved - way])
        largest = max(largest, float(np.abs(np.linalg.eigvals(after)).max()))
    return (largest - 1.0) / step.step


def phases_at_ends(phases: FloatArray) -> FloatArray:
    """(n_step, n_mesh) at the ends of steps from those in their middles, which may be reduced to one period."""
    if len(phases) < 2:
        return phases
    turned = (np.diff(phases, axis=0) + 0.5) % 1.0 - 0.5
    last = 2.0 * turned[-1:] - turned[-2:-1] if len(turned) > 1 else turned
    return np.asarray(phases + 0.5 * np.concatenate([turned, last]))


def standing(table: LawTable, deflection: FloatArray, linear: FloatArray, phases: FloatArray) -> FloatArray:
    """(5, 2 n_row) past of a standstill: no ways, no rises, and the excesses at contact deflections (2 n_row,) m.

    linear (2 n_row,): N/m, of the contacts' linear parts.  phases (n_row,): of the laws, in periods.
    """
    past = np.zeros((5, len(deflection)))
    for i, at in enumerate(deflection):
        law, side = i // 2, 1.0 - 2.0 * (i % 2)
        grid = table.deflection[law, : table.cells[law]]
        force = force_at(grid, row_at(table, law, float(phases[law])), np.array([side * at]))
        past[3, i] = max(side * float(force[0]), 0.0) - linear[i] * at
    return past
