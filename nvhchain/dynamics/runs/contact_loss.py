"""Contact loss: its duration in a record, and the time steps that keep the record accurate."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nvhchain.dynamics.time_loop.law_table import LawTable
from nvhchain.dynamics.time_loop.simulation import Simulation
from nvhchain.errors import require, warn_caller
from nvhchain.handoff import FloatArray, IntArray

Parted = dict[str, dict[str, float]]
"""Mesh, as `pinion shaft–wheel shaft`: time without contact (s), time step (s), and `bent_ways` (0 or 1)."""

ROUNDING = 1e-9
"""Interpolation error over the angle within the gap, relative to a law's largest force."""
APART = 1e-9
"""Rounding error (m) of the deflection of flanks that touch without load."""
HELD = 1.5e-6, 5e-6
"""Steps (s) that keep 1e-4 of the peak through contact loss and impact under load, without and with bent_ways
(docs/measured/dynamics/cuts.md)."""
ERROR = 4e-3, 2e-4
"""Error at steps of 10 µs, relative to the peak, without and with bent_ways (same page)."""


def parted_flanks(
    model: Simulation,
    drive: FloatArray,
    back: FloatArray,
    phases: Callable[[IntArray], FloatArray],
    sample_time: float,
) -> Parted:
    """Return the meshes without contact at some samples, with the duration of contact loss.

    drive, back : (n, n_mesh) deflections (m) of drive and back flanks, with the sign of the laws.
    phases : function from sample indices (n_s,) to phases of the laws (n_s, n_mesh), in periods.
    sample_time : time between samples (s).
    """
    found: Parted = {}
    for row in np.flatnonzero(model.assembly.share > 0.0):
        mesh = model.assembly.mesh[row]
        of = model.assembly.gearbox.meshes[mesh]
        behind, front = gap_ends(model.table, int(row))
        # outside these samples the flanks touch at every angle
        maybe = np.flatnonzero((drive[:, mesh] < front.max() - APART) & (back[:, mesh] > behind.min() + APART))
        place = np.mod(phases(maybe)[:, mesh], 1.0) * (len(front) - 1)
        nodes = np.arange(len(front))
        free = (drive[maybe, mesh] < np.interp(place, nodes, front) - APART) & (
            back[maybe, mesh] > np.interp(place, nodes, behind) + APART
        )
        if free.any():
            found[f"{of.pinion_shaft}–{of.wheel_shaft}"] = {
                "seconds": float(free.sum() * sample_time), "time_step": model.step.step, "bent_ways": model.bent
            }  # fmt: skip
    return found


def gap_ends(table: LawTable, row: int) -> tuple[FloatArray, FloatArray]:
    """Return the deflections (m) at which a law's back flank ends and its drive flank begins to carry.

    Both are (rows + 1,), over a whole period.
    """
    grid = table.deflection[row, : table.cells[row]]
    force = table.force[row, : table.rows[row], : table.cells[row]]

    def edge(grid: FloatArray, force: FloatArray) -> FloatArray:
        """Return where force, which rises along grid, leaves 0."""
        carries = force > ROUNDING * np.abs(force).max()
        at = np.argmax(carries, axis=1)
        rows = np.arange(len(force))
        before = np.maximum(at - 1, 0)
        low, high = force[rows, before], force[rows, at]
        share = np.where(high > low, -low / np.where(high > low, high - low, 1.0), 0.0)
        ends = grid[before] + share * (grid[at] - grid[before])
        ends[carries[:, 0]] = -np.inf
        ends[~carries.any(axis=1)] = np.inf
        return np.append(ends, ends[0])

    return -edge(-grid[::-1], -force[:, ::-1]), edge(grid, force)


def joined(parts: Sequence[Parted]) -> Parted:
    """Return the contact loss of several pieces of one record, with the times added up."""
    whole: Parted = {}
    for part in parts:
        for mesh, new in part.items():
            before = whole[mesh]["seconds"] if mesh in whole else 0.0
            whole[mesh] = new | {"seconds": before + new["seconds"]}
    return whole


def check_parted(found: Parted) -> None:
    """Warn of contact loss under steps longer than `HELD` (AccuracyWarning per mesh).

    Raises InputError if the expected error reaches the peak force.
    """
    for mesh, of in found.items():
        step, bent = of["time_step"], int(of["bent_ways"])
        if step <= HELD[bent] * (1.0 + 1e-6):
            continue
        error = parted_error(of)
        remedy = f"{1e6 * HELD[bent]:g} µs" + (not bent) * f", or {1e6 * HELD[True]:g} µs with bent_ways"
        told = (
            f"mesh {mesh}: its flanks part for {of['seconds']:.3g} s of the record. Steps of {1e6 * step:.3g} µs then "
            f"leave errors of about {error:.1g} of the peak force, more where flanks under little load fly far: for "
            f"1e-4 take a time_step of {remedy}, and halve it until the forces stay"
        )
        require(error < 1.0, f"{told}; at most {10 * ERROR[bent] ** -0.5:.3g} µs are taken")
        warn_caller(told)


def parted_error(of: dict[str, float]) -> float:
    """Return the expected error of contact loss, relative to the peak force; it grows as the step squared."""
    return ERROR[int(of["bent_ways"])] * (of["time_step"] / 1e-5) ** 2
