"""Statements on a record: its contact loss, and deflections beyond the table of a mesh law."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.time_loop.law_table import LawTable
from nvhchain.dynamics.time_loop.simulation import Simulation
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray, ForceAccuracy, IntArray, MeshLaw, warn_of
from nvhchain.handoff.accuracy import CONTACT_LOSS
from nvhchain.handoff.declared import Label

ROUNDING = 1e-9
"""Interpolation error over the angle within the gap, relative to a law's largest force."""
TOUCHING_DEFLECTION = 1e-9
"""Rounding error (m) of the deflection of flanks that touch without load."""
ACCURATE_STEPS = (1.5e-6, 5e-6), (7e-7, 1.5e-6)
"""Steps (s) that keep 1e-4 of the peak through contact loss and impact, without and with path_correction: where one
flank strikes under load (docs/measured/dynamics/cuts.md), and where both strike (dynamics.md beside it)."""
ERROR = (4e-3, 2e-4), (2.1e-2, 1.3e-2)
"""Error at steps of 10 µs, relative to the peak, in the same order (same pages)."""


def parted_flanks(
    model: Simulation,
    drive: FloatArray,
    back: FloatArray,
    phases: Callable[[IntArray], FloatArray],
    sample_time: float,
    input_speed: FloatArray,
) -> ForceAccuracy:
    """State the meshes without contact at some samples, with duration and speeds of contact loss, and its error.

    drive, back : (n, n_mesh) deflections (m) of drive and back flanks, with the sign of the laws.
    phases : function from sample indices (n_s,) to phases of the laws (n_s, n_mesh), in periods.
    sample_time : time between samples (s).
    input_speed : (n,) speed of the input (rad/s).
    """
    seconds: dict[str, float] = {}
    speeds: dict[str, list[float]] = {}
    both = False
    for row in np.flatnonzero(model.assembly.share > 0.0):
        mesh = model.assembly.mesh[row]
        gear_mesh = model.assembly.gearbox.meshes[mesh]
        rear, front = gap_ends(model.table, int(row))
        # outside these samples the flanks touch at every angle
        maybe = np.flatnonzero(
            (drive[:, mesh] < front.max() - TOUCHING_DEFLECTION) & (back[:, mesh] > rear.min() + TOUCHING_DEFLECTION)
        )
        place = np.mod(phases(maybe)[:, mesh], 1.0) * (len(front) - 1)
        nodes = np.arange(len(front))
        free = (drive[maybe, mesh] < np.interp(place, nodes, front) - TOUCHING_DEFLECTION) & (
            back[maybe, mesh] > np.interp(place, nodes, rear) + TOUCHING_DEFLECTION
        )
        if free.any():
            name, parted = f"{gear_mesh.pinion_shaft}–{gear_mesh.wheel_shaft}", input_speed[maybe[free]]
            seconds[name] = float(free.sum() * sample_time)
            parted = np.append(parted, speeds.get(name, ()))  # of another part of the face
            speeds[name] = [float(parted.min()), float(parted.max())]
            both |= bool((drive[:, mesh] > front.min()).any() and (back[:, mesh] < rear.max()).any())
    lost = stated_loss(seconds, model.step.step, model.contact.corrected, both)
    if not speeds:
        return lost
    lowest, highest = np.array(list(speeds.values())).T
    return lost.replace(parted_lowest_speed=lowest, parted_highest_speed=highest)


def stated_loss(seconds: Mapping[str, float], time_step: float, bent: bool, both: bool = False) -> ForceAccuracy:
    """State contact loss by mesh (s) under steps (s), with or without `path_correction`, of one flank or both."""
    if not seconds:
        return ForceAccuracy()
    return ForceAccuracy(
        parted=tuple(map(Label, seconds)),
        parted_time=np.array(list(seconds.values())),
        parted_error=ERROR[both][bent] * (time_step / 1e-5) ** 2,
        time_step=time_step,
        needed_step=ACCURATE_STEPS[both][bent],
        needed_step_corrected=None if bent else ACCURATE_STEPS[both][True],
    )


def gap_ends(table: LawTable, row: int) -> tuple[FloatArray, FloatArray]:
    """Return the deflections (m) at which a law's back flank ends and its drive flank begins to carry.

    Both are (rows + 1,), over a whole period.
    """
    grid = table.deflection[row, : table.cells[row]]
    force = table.force[row, : table.rows[row], : table.cells[row]]

    def edge(grid: FloatArray, force: FloatArray) -> FloatArray:
        """Return where force, which rises along grid, leaves 0."""
        carries = force > ROUNDING * np.abs(force).max()
        first = np.argmax(carries, axis=1)
        rows = np.arange(len(force))
        before = np.maximum(first - 1, 0)
        low, high = force[rows, before], force[rows, first]
        share = np.where(high > low, -low / np.where(high > low, high - low, 1.0), 0.0)
        ends = grid[before] + share * (grid[first] - grid[before])
        ends[carries[:, 0]] = -np.inf
        ends[~carries.any(axis=1)] = np.inf
        return np.append(ends, ends[0])

    return -edge(-grid[::-1], -force[:, ::-1]), edge(grid, force)


def warn_or_refuse(stated: ForceAccuracy) -> None:
    """Warn of the accuracy of a record.

    Raises InputError if the expected error of contact loss reaches the peak force.
    """
    if (stated.parted_error or 0.0) >= 1.0 and stated.time_step is not None:
        text = next(doubt.text for doubt in stated.doubts() if doubt.kind == CONTACT_LOSS)
        largest = stated.time_step * (stated.parted_error or 1.0) ** -0.5
        raise InputError(f"{text}; at most {1e6 * largest:.3g} µs are taken")
    warn_of(stated)


def excursions(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], drive: FloatArray, back: FloatArray, fidelity: DynamicsFidelity
) -> ForceAccuracy:
    """State the meshes whose flanks carry beyond the table; none at the level `contact`, which uses no table.

    drive, back : (n, n_mesh) deflections (m) of drive and back flanks, with the sign of the laws.

    The two differ because the flank normals differ and the shafts move apart under load. Each flank counts on the side
    to which it is pressed. It counts on the other side too where the law still pushes, or pulls, at its end.
    """
    found: dict[str, tuple[float, float, float, float]] = {}
    if fidelity.mesh_level == "contact":
        return ForceAccuracy()
    for mesh, law, front, rear in zip(gearbox.meshes, mesh_laws, drive.T, back.T, strict=True):
        lowest, highest = float(rear.min()), float(front.max())
        if law.force[:, 0].max() > 0.0:
            lowest = min(lowest, float(front.min()))
        if law.force[:, -1].min() < 0.0:
            highest = max(highest, float(rear.max()))
        low, high = float(law.deflection[0]), float(law.deflection[-1])
        if lowest < low or highest > high:
            found[f"{mesh.pinion_shaft}–{mesh.wheel_shaft}"] = lowest, highest, low, high
    return _deflection_fields(found)


def _deflection_fields(found: Mapping[str, Sequence[float]]) -> ForceAccuracy:
    """State lowest and highest deflection and the ends of the table (m) by mesh."""
    if not found:
        return ForceAccuracy()
    lowest, highest, low, high = np.array(list(found.values())).T
    return ForceAccuracy(tuple(map(Label, found)), lowest, highest, low, high)


def joined(parts: Sequence[ForceAccuracy]) -> ForceAccuracy:
    """Return the accuracy of one record from those of its pieces: extremes of deflections, sums of times."""
    exceeded: dict[str, list[float]] = {}
    lost: dict[str, tuple[float, float, float]] = {}
    whole = ForceAccuracy()
    for part in parts:
        whole |= part.cleared("parted_lowest_speed", "parted_highest_speed")
        ends = (part.lowest_deflection, part.highest_deflection, part.table_lowest, part.table_highest)
        rows = (() if end is None else end.tolist() for end in ends)
        for mesh, *deflections in zip(part.law_exceeded or (), *rows, strict=True):
            lowest, highest, low, high = deflections
            before = exceeded.get(mesh, deflections)
            exceeded[mesh] = [min(before[0], lowest), max(before[1], highest), low, high]
        for mesh, time, low, high in part.contact_losses():
            seconds, lowest, highest = lost.get(mesh, (0.0, low, high))
            lost[mesh] = seconds + time, min(lowest, low), max(highest, high)
    whole |= _deflection_fields(exceeded)
    if lost:
        time, lowest, highest = np.array(list(lost.values())).T
        whole |= ForceAccuracy(parted=tuple(map(Label, lost)), parted_time=time)
        if np.isfinite(highest).all():  # pieces of an earlier version state no speeds
            whole |= ForceAccuracy(parted_lowest_speed=lowest, parted_highest_speed=highest)
    return whole
