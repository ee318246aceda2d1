"""Mesh law prepared for the time loop: rows over the wheel angle, cells over deflection, tabulated potential.

F(θ, δ) is linear in θ between rows at fixed δ, and linear in δ inside a cell. The end slopes continue outside. The
tabulated law is first refined in θ by a local cubic (modified Akima) of its increments over δ. This keeps every row
monotone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from nvhchain.errors import SolverError
from nvhchain.handoff import FloatArray, IntArray, MeshLaw


@dataclass(frozen=True, eq=False)
class LawTable:
    """All mesh laws, padded into common arrays.

    rows, cells : (n_mesh,) numbers of angle rows (row index = rows · phase, phase in periods) and of deflections.
    deflection : (n_mesh, n_d) deflections (m).
    force : (n_mesh, n_row, n_d) forces (N).
    potential : (n_mesh, n_row, n_d) ∫ F dδ from the first deflection (J).
    """

    rows: IntArray
    cells: IntArray
    deflection: FloatArray
    force: FloatArray
    potential: FloatArray


def _interpolate(position: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """Interpolate `values` (n, k) ≥ 0 by a local cubic that stays ≥ 0, and 0 where both neighbours are 0."""
    result = np.maximum(Akima1DInterpolator(position, values, axis=0, method="makima")(wanted), 0.0)
    left = np.clip(np.searchsorted(position, wanted, side="right") - 1, 0, len(position) - 2)
    result[(values[left] == 0.0) & (values[left + 1] == 0.0)] = 0.0
    return np.asarray(result)


@lru_cache(maxsize=8)
def refine(law: MeshLaw, refinement: int) -> FloatArray:
    """Return the force (refinement · n_angle, n_defl) at equally spaced angles of one period, starting at angle 0.

    It is kept for further speeds and torques with the same law, and must not be changed.
    """
    n_row = refinement * len(law.angle)
    wanted = np.asarray(np.arange(n_row) * (law.period / n_row), dtype=float)
    if len(law.angle) == 1:
        return np.repeat(law.force, n_row, axis=0)
    extended_index = np.arange(-3, len(law.angle) + 4)
    turn, index = np.divmod(extended_index, len(law.angle))
    position = law.angle[index] + turn * law.period
    # the increments keep the interpolated rows monotone; the anchor is the column nearest to zero force
    anchor = int(np.argmin(np.abs(law.force).max(axis=0)))
    rise = _interpolate(position, np.maximum(np.diff(law.force, axis=1), 0.0)[index], wanted)
    anchored = law.force[:, anchor]
    lift = float(anchored.min())
    column = _interpolate(position, (anchored - lift)[index, None], wanted)[:, 0] + lift
    force = np.empty((n_row, len(law.deflection)))
    force[:, anchor] = column
    force[:, anchor + 1 :] = column[:, None] + np.cumsum(rise[:, anchor:], axis=1)
    force[:, :anchor] = column[:, None] - np.cumsum(rise[:, :anchor][:, ::-1], axis=1)[:, ::-1]
    force.setflags(write=False)
    return force


def tabulate(mesh_laws: Sequence[MeshLaw], refinement: int) -> LawTable:
    """Prepare `mesh_laws` for the time loop, with `refinement` rows per tabulated angle."""
    refined = [refine(law, refinement) for law in mesh_laws]
    n_row, n_defl = (max(force.shape[axis] for force in refined) for axis in (0, 1))
    deflection = np.zeros((len(refined), n_defl))
    force_table = np.zeros((len(refined), n_row, n_defl))
    potential = np.zeros_like(force_table)
    for k, (law, force) in enumerate(zip(mesh_laws, refined, strict=True)):
        n, m = force.shape
        deflection[k, :m] = law.deflection
        force_table[k, :n, :m] = force
        strip = 0.5 * (force[:, 1:] + force[:, :-1]) * np.diff(law.deflection)
        potential[k, :n, 1:m] = np.cumsum(strip, axis=1)
    return LawTable(
        np.array([force.shape[0] for force in refined]),
        np.array([force.shape[1] for force in refined]),
        deflection,
        force_table,
        potential,
    )


def row_at(table: LawTable, mesh: int, phase: float) -> FloatArray:
    """Return the force (n_defl,) of a mesh at `phase` (in periods)."""
    place = (phase % 1.0) * table.rows[mesh]
    row = int(place) % int(table.rows[mesh])
    weight = place - int(place)
    force = table.force[mesh, :, : table.cells[mesh]]
    return np.asarray((1.0 - weight) * force[row] + weight * force[(row + 1) % table.rows[mesh]])


def force_at(deflection: FloatArray, row: FloatArray, x: FloatArray) -> FloatArray:
    """Return the force of a row at deflections `x`; end slopes continue."""
    cell = np.clip(np.searchsorted(deflection, x, side="right") - 1, 0, len(deflection) - 2)
    return np.asarray(row[cell] + slope_at(deflection, row, x) * (x - deflection[cell]))


def slope_at(deflection: FloatArray, row: FloatArray, x: FloatArray) -> FloatArray:
    """Return the slope of a row at deflections `x` (N/m)."""
    cell = np.clip(np.searchsorted(deflection, x, side="right") - 1, 0, len(deflection) - 2)
    return np.asarray((np.diff(row) / np.diff(deflection))[cell])


def deflection_under(deflection: FloatArray, row: FloatArray, force: float) -> float:
    """Return the deflection at which a row carries `force`; for zero force the end of the gap at the drive flank.

    Raises SolverError if the law cannot carry the force (its end slope is zero).
    """
    last = len(row) - 2
    # for F ≥ 0 the last cell that starts at or below it, so that a gap ends at the drive side
    cell = int(np.searchsorted(row, force, side="right" if force >= 0 else "left")) - 1
    cell = min(max(cell, 0), last)
    rise = row[cell + 1] - row[cell]
    if rise <= 0:
        if row[cell] == force:
            return float(deflection[cell])
        raise SolverError(
            f"the mesh law carries {row[0]:.6g}…{row[-1]:.6g} N and rises no further, but {force:.6g} N are asked "
            "for: "
            "tabulate it to larger deflections"
        )
    return float(deflection[cell] + (force - row[cell]) * (deflection[cell + 1] - deflection[cell]) / rise)


def mean_slope(table: LawTable, mesh: int, force: float) -> float:
    """Return the slope (N/m) of a mesh law where it carries `force`, mean over its angles.

    It is at least 1e-3 of the steepest slope.
    """
    n_row, n_cell = int(table.rows[mesh]), int(table.cells[mesh])
    rows, deflection = table.force[mesh, :n_row, :n_cell], table.deflection[mesh, :n_cell]
    slope = np.diff(rows, axis=1) / np.diff(deflection)
    # the cell that holds the force; for zero force the first that rises from the gap on the drive side
    above = rows > force if force >= 0 else rows >= force
    cell = np.where(above.any(axis=1), above.argmax(axis=1), n_cell) - 1
    here = slope[np.arange(n_row), np.clip(cell, 0, n_cell - 2)]
    return float(max(here.mean(), 1e-3 * slope.max()))
