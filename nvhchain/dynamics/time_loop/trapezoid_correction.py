"""Checks and start values of the fourth-order correction (`nvhchain.dynamics.time_loop._correction`) before a run."""

from __future__ import annotations

from itertools import product
from math import inf

import numpy as np

from nvhchain.dynamics.model.assembly import Assembly
from nvhchain.dynamics.time_loop.law_table import LawTable, force_at, row_at
from nvhchain.dynamics.time_loop.propagator import ModalForm, Propagator, propagator
from nvhchain.errors import InputError
from nvhchain.handoff import FloatArray

CORRECTION_LIMIT = 0.4
"""Largest mesh stiffness times step compliance, half of (ω h)² of the mesh, at which the correction resolves the
curvature of the path."""
GROWTH = 0.1
"""Largest growth rate of small motions (1/s) that the correction may cause beyond damping."""
TRIED = 0.9
"""Ratio of successive step lengths tried for the remedy, after a step that is too long."""


def check_bends(
    assembly: Assembly, modes: ModalForm, linear: FloatArray, load: FloatArray, step: float, table: LawTable
) -> None:
    """Raise InputError if a step is too long for the correction, or damping takes out less than it feeds in.

    linear : (2 n_row,) linear parts of the contacts (N/m).
    load : (n,) generalised force.
    step : length of the step (s).
    """
    rises = zip(table.force, table.deflection, table.rows, table.cells, strict=True)
    slopes = np.array([(np.diff(force[:n, :m]) / np.diff(grid[:m])).max() for force, grid, n, m in rises])

    def found(step: float) -> tuple[float, float]:
        trial_step = propagator(assembly, modes, load, step)
        stiffest = float((slopes * np.diag(trial_step.compliance).reshape(-1, 2).max(axis=1)).max())
        return stiffest, growth(assembly, trial_step, linear, slopes) if stiffest <= CORRECTION_LIMIT else inf

    stiffest, grown = found(step)
    if grown <= GROWTH:
        return
    short = TRIED * step
    while found(short)[1] > 0.9 * GROWTH:
        short *= TRIED
    why = (
        f"the stiffest mesh times what gives in a step is {stiffest:.3g}, of {CORRECTION_LIMIT:g} at most"
        if stiffest > CORRECTION_LIMIT
        else f"small motions grow by {grown:.3g} 1/s, more than damping takes out (limit {GROWTH:g} 1/s)"
    )
    raise InputError(
        f"time step {1e6 * step:.4g} µs is too long for path_correction: {why}: take {1e6 * short:.3g} µs or leave "
        "path_correction "
        "out"
    )


def growth(assembly: Assembly, step: Propagator, linear: FloatArray, slopes: FloatArray) -> float:
    """Return an upper bound of the growth rate (1/s) of small motions, with the flanks of every mesh open or closed.

    slopes : (n_row,) steepest slopes of the laws (N/m).

    With the excess s d of every contact, the forces of a step are linear in the state, in the path of the step before
    and in its change (`_correction`). The growth is that of the largest eigenvalue of this map.
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
    """Return phases (n_step, n_mesh) at the ends of steps from those at mid-step, possibly reduced to one period."""
    if len(phases) < 2:
        return phases
    turned = (np.diff(phases, axis=0) + 0.5) % 1.0 - 0.5
    last = 2.0 * turned[-1:] - turned[-2:-1] if len(turned) > 1 else turned
    return np.asarray(phases + 0.5 * np.concatenate([turned, last]))


def standing(table: LawTable, deflection: FloatArray, linear: FloatArray, phases: FloatArray) -> FloatArray:
    """Return the past (5, 2 n_row) of a standstill: zero paths and rises, and the excesses.

    deflection : (2 n_row,) contact deflections (m).
    linear : (2 n_row,) linear parts of the contacts (N/m).
    phases : (n_row,) phases of the laws, in periods.
    """
    past = np.zeros((5, len(deflection)))
    for i, pressed in enumerate(deflection):
        law, side = i // 2, 1.0 - 2.0 * (i % 2)
        grid = table.deflection[law, : table.cells[law]]
        force = force_at(grid, row_at(table, law, float(phases[law])), np.array([side * pressed]))
        past[3, i] = max(side * float(force[0]), 0.0) - linear[i] * pressed
    return past
