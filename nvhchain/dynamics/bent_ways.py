"""What the time loop needs of a run whose ways bend (`nvhchain.dynamics._bend`) before it starts."""

from __future__ import annotations

from math import sqrt

import numpy as np

from nvhchain.dynamics.law_table import LawTable, force_at, row_at
from nvhchain.dynamics.propagator import Propagator
from nvhchain.errors import require
from nvhchain.handoff import FloatArray

BENT_LIMIT = 0.4
"""Mesh stiffness times step compliance, half of (ω h)² of the mesh, up to which `_bend` tells the bend of a way."""


def check_bends(step: Propagator, table: LawTable) -> None:
    """InputError where a step is too long for its ways to be told from those of the steps before."""
    steepest = max(
        float((np.diff(force[:n, :m]) / np.diff(deflection[:m])).max()) * float(give)
        for force, deflection, n, m, give in zip(
            table.force,
            table.deflection,
            table.rows,
            table.cells,
            np.diag(step.compliance).reshape(-1, 2).max(axis=1),
            strict=True,
        )
    )
    require(
        steepest <= BENT_LIMIT,
        f"time step {1e6 * step.step:.4g} µs is too long for bent_ways: the stiffest mesh times what gives in a step "
        f"is {steepest:.3g}, of {BENT_LIMIT:g} at most: take {1e6 * step.step * sqrt(BENT_LIMIT / steepest):.3g} µs or "
        "leave bent_ways out",
    )


def phases_at_ends(phases: FloatArray) -> FloatArray:
    """(n_step, n_mesh) at the ends of steps from those in their middles, which may be reduced to one period."""
    if len(phases) < 2:
        return phases
    turned = (np.diff(phases, axis=0) + 0.5) % 1.0 - 0.5
    last = 2.0 * turned[-1:] - turned[-2:-1] if len(turned) > 1 else turned
    return np.asarray(phases + 0.5 * np.concatenate([turned, last]))


def standing(table: LawTable, deflection: FloatArray, linear: FloatArray, phases: FloatArray) -> FloatArray:
    """(4, 2 n_row) past of a standstill: no ways, no rises, and the excesses at contact deflections (2 n_row,) m.

    linear (2 n_row,): N/m, of the contacts' linear parts.  phases (n_row,): of the laws, in periods.
    """
    past = np.zeros((4, len(deflection)))
    for i, at in enumerate(deflection):
        law, side = i // 2, 1.0 - 2.0 * (i % 2)
        grid = table.deflection[law, : table.cells[law]]
        force = force_at(grid, row_at(table, law, float(phases[law])), np.array([side * at]))
        past[3, i] = max(side * float(force[0]), 0.0) - linear[i] * at
    return past
