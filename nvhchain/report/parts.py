"""Contributions of paths, modes and panels of a gearbox's housing to its sound: tables and bars."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import acoustics, chain, levels, plots
from nvhchain.case import Case, GearboxCase
from nvhchain.chain.result import Result
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.files.result_cache import Watcher
from nvhchain.housing import respond
from nvhchain.housing.casting.contributions import (
    Contributions,
    panel_contributions,
)
from nvhchain.plots.files import save
from nvhchain.report.case_record import is_recorded, recorded_case
from nvhchain.report.causes.paths import force_parts
from nvhchain.report.causes.run_up import order_load, result_parts
from nvhchain.report.marks import order_marks
from nvhchain.report.run_up import curves_of, loudest, run_up_maps
from nvhchain.report.stored import SAME_LEVEL, stored_results
from nvhchain.report.summary import write_summary


def contributions(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path,
    frequency: float | None = None,
    order: float | None = None,
    supplied: Mapping[str, Any] | None = None,
    watcher: Watcher | None = None,
) -> dict[str, Contributions]:
    """Run a gearbox and write the contributions of paths, modes and panels to its pressure.

    Parameters
    ----------
    case : GearboxCase
        Gearbox that asks for `pressure`.
    fidelity : Fidelity
        Fidelity of the run.
    out : str or Path
        Folder of the run; cached results in it are used.
    frequency : float, optional
        Frequency (Hz) of the bars: the nearest line. By default the line that is loudest in dB(A).
    order : float, optional
        Order of the input whose parts over a run-up are written. By default the order with most A-weighted energy.
    supplied : mapping of str to hand-off, optional
        Supplied hand-offs, as for `chain.run`.
    watcher : Watcher, optional
        Receives the progress of the steps.

    Returns
    -------
    dict of str to Contributions
        `paths`, `modes` and, where the housing has named parts, `panels`. The frequencies of a run-up are those of the
        order at rising speeds.

    Raises
    ------
    InputError
        If the case has no pressure lines, or the level of radiation no transfer vectors.

    Notes
    -----
    A path is a bearing and a direction: its force times its noise transfer function.
    The contribution of part i is the share Re(p_i p*)/|p|². All lines and field points are in contributions-<kind>.csv.
    The bars in contributions-<kind>.png are those of one line at the first field point. The panels of a casting are its
    bosses, walls and flange; those of an imported model are its node groups.
    """
    case = _gearbox(case, fidelity, order)
    out = writable_folder(out, "out")
    recorded = is_recorded(case, fidelity, out)
    with nullcontext() if recorded else recorded_case(case, fidelity, out):
        result = chain.run(case, fidelity=fidelity, out=out, watcher=watcher, **(supplied or {}))
    if not (recorded and _summarised(result, out)):
        write_summary({case.name: result}, out)  # for the page of this folder
    forces = "bearing_forces" if case.operation.ramp else "force_spectrum"
    hand_offs: dict[str, Any] = {
        "housing": result.housing,
        forces: result.bearing_forces if case.operation.ramp else result.force_spectrum,
        "transfer_vectors": result.transfer_vectors,
    }
    missing = [name for name, one in hand_offs.items() if one is None]
    require(
        not missing, f"contributions take {', '.join(missing)}, which this run did not need: do not hand in a result"
    )
    turns: float | None = None
    if case.operation.ramp:
        turns = _loudest_order(result) if order is None else order
        split = result_parts(result, turns)
    else:
        split = force_parts(hand_offs[forces], hand_offs["housing"], hand_offs["transfer_vectors"], fidelity.acoustics)
    if split is None:
        raise InputError(
            f"order {turns:g} has no speed in the band of {case.name}: give another order"
            if turns
            else "the housing radiates from another surface than the transfer vectors: do not hand in a result"
        )
    found = dict(zip(("paths", "modes"), split, strict=True))
    velocity = result.surface_velocity
    if turns is not None:
        load = order_load(hand_offs[forces], hand_offs["transfer_vectors"], turns, high=float(case.band.high))
        velocity = None if load is None else respond(hand_offs["housing"], load)
    panels = None if velocity is None else case.housing.panels(case, velocity.surface)
    if panels is not None and velocity is not None:
        radiate = partial(acoustics.radiate, hand_offs["transfer_vectors"], fidelity=fidelity.acoustics)
        found["panels"] = panel_contributions(velocity, panels, radiate)
    points = [point.name for point in case.field_points]
    for kind, parts in found.items():
        write_text(Path(out) / f"contributions-{kind}.csv", _table(parts, points, turns).csv())
        line = _line(parts, frequency)
        axes = plots.contribution_bars(
            parts.names,
            parts.pressure[line, 0],
            frequency=float(parts.frequency[line]),
            title=f"{case.name}, {case.field_points[0].name}",
        )
        save([axes], Path(out) / f"contributions-{kind}.png")
    return found


def _gearbox(case: Case, fidelity: Fidelity, order: float | None) -> GearboxCase:
    """Return the case if it is a gearbox whose pressure has parts; else InputError."""
    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} has no housing: contributions are those of a gearbox")
    require("pressure" in case.quantities, f"{case.name} does not ask for `pressure`, to which modes contribute")
    require(
        fidelity.acoustics.radiation != "equivalent_radiated_power",
        "the equivalent radiated power has no phase, so that no parts add up to it: choose another level of radiation",
    )
    require(
        order is None or case.operation.ramp is not None,
        f"order = {order}: {case.name} has constant speed and all its lines are written: choose the bars by frequency",
    )
    require(order is None or order > 0, f"order = {order}: give an order of the input above 0")
    return case


def _summarised(result: Result, out: Path) -> bool:
    """Return True if the folder has a summary with the level of the result."""
    stored = stored_results(out)
    level = stored.runs[0].summary.get("overall_dBA")
    return stored.finished and level is not None and abs(level - float(result.overall[0])) < SAME_LEVEL


def _loudest_order(result: Result) -> float:
    """Return the order with most A-weighted energy over a run-up."""
    assert result.pressure_history is not None
    marks = order_marks([result.case])
    high = float(result.case.band.high)  # type: ignore[union-attr]
    curves = curves_of(run_up_maps({"": result.pressure_history}, marks, high=high), marks)[""]
    cuts = [curve for curve in curves if curve.order is not None]
    require(len(cuts) > 0, f"{result.case.name} has no loud order over its run-up: give `order`")
    return loudest(cuts)[0]


def _line(parts: Contributions, frequency: float | None) -> int:
    """Index of the line nearest to `frequency` (Hz), by default of the loudest in dB(A), at the first point."""
    if frequency is not None:
        low, high = parts.frequency[[0, -1]]
        require(low <= frequency <= high, f"at = {frequency:g} Hz: the lines lie between {low:g} and {high:g} Hz")
        return int(np.abs(parts.frequency - frequency).argmin())
    return int((levels.decibel(parts.total[:, 0]) + levels.a_weighting(parts.frequency)).argmax())


def _table(parts: Contributions, points: list[str], order: float | None) -> plots.Table:
    """One row per field point and line with sound: its level and the share of every part; of a run-up, the speed."""
    total, shares = parts.total, parts.shares
    rows = [
        (
            name,
            *([] if order is None else [f"{60 * f / order:.6g}"]),
            f"{f:.6g}",
            f"{float(levels.decibel(total[line, point])):.2f}",
            *(f"{s:.12g}" for s in shares[line, point]),
        )
        for point, name in enumerate(points)
        for line, f in enumerate(parts.frequency)
        if total[line, point] != 0
    ]
    head = ("field point", *([] if order is None else ["input speed / rpm"]), "frequency / Hz", "level / dB")
    return plots.Table((*head, *parts.names), tuple(rows))
