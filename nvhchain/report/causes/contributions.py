"""Contributions of modes and panels of a gearbox's housing to its sound: tables and bars."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import acoustics, chain, levels, plots
from nvhchain.case import Cad, Case, GearboxCase
from nvhchain.errors import InputError, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import write_text
from nvhchain.files.result_cache import Watcher
from nvhchain.handoff import Surface
from nvhchain.housing import Casting
from nvhchain.housing.casting.contributions import (
    Contributions,
    Panels,
    casting_panels,
    group_panels,
    modal_contributions,
    panel_contributions,
)
from nvhchain.names import safe_names
from nvhchain.plots.files import save


def contributions(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path,
    frequency: float | None = None,
    supplied: Mapping[str, Any] | None = None,
    watcher: Watcher | None = None,
) -> dict[str, Contributions]:
    """Run a gearbox at constant speed and write the contributions of modes and panels to its pressure.

    Parameters
    ----------
    case : GearboxCase
        Gearbox at constant speed that asks for `pressure`.
    fidelity : Fidelity
        Fidelity of the run.
    out : str or Path
        Folder of the run; cached results in it are used.
    frequency : float, optional
        Frequency (Hz) of the bars: the nearest line. By default the line that is loudest in dB(A).
    supplied : mapping of str to hand-off, optional
        Supplied hand-offs, as for `chain.run`.
    watcher : Watcher, optional
        Receives the progress of the steps.

    Returns
    -------
    dict of str to Contributions
        `modes` and, where the housing has named parts, `panels`.

    Raises
    ------
    InputError
        If the case has no pressure lines, or the level of radiation no transfer vectors.

    Notes
    -----
    The contribution of part i is the share Re(p_i p*)/|p|². All lines and field points are in contributions-<kind>.csv.
    The bars in contributions-<kind>.png are those of one line at the first field point. The panels of a casting are its
    bosses, walls and flange; those of an imported model are its node groups.
    """
    case = _steady_gearbox(case, fidelity)
    result = chain.run(case, fidelity=fidelity, out=out, watcher=watcher, **(supplied or {}))
    names = ("housing", "force_spectrum", "transfer_vectors", "surface_velocity")
    missing = [name for name in names if getattr(result, name) is None]
    require(
        not missing, f"contributions take {', '.join(missing)}, which this run did not need: do not hand in a result"
    )
    housing, forces, vectors, velocity = (getattr(result, name) for name in names)
    modal = acoustics.modal_transfer_vectors(vectors, housing, forces.frequency, fidelity=fidelity.acoustics)
    found = {"modes": modal_contributions(modal, housing, forces)}
    panels = _panels(case, velocity.surface)
    if panels is not None:
        radiate = partial(acoustics.radiate, vectors, fidelity=fidelity.acoustics)
        found["panels"] = panel_contributions(velocity, panels, radiate)
    for kind, parts in found.items():
        write_text(
            Path(out) / f"contributions-{kind}.csv", _table(parts, [point.name for point in case.field_points]).csv()
        )
        line = _line(parts, frequency)
        axes = plots.contribution_bars(
            parts.names,
            parts.pressure[line, 0],
            frequency=float(parts.frequency[line]),
            title=f"{case.name}, {case.field_points[0].name}",
        )
        save([axes], Path(out) / f"contributions-{kind}.png")
    return found


def _steady_gearbox(case: Case, fidelity: Fidelity) -> GearboxCase:
    """Return the case if it is a gearbox at constant speed with pressure; else InputError."""
    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} has no housing: contributions are those of a gearbox")
    require(case.operation.ramp is None, f"{case.name} runs up: contributions are given line by line at constant speed")
    require("pressure" in case.quantities, f"{case.name} does not ask for `pressure`, to which modes contribute")
    require(
        fidelity.acoustics.radiation != "equivalent_radiated_power",
        "the equivalent radiated power has no phase, so that no parts add up to it: choose another level of radiation",
    )
    return case


def _panels(case: GearboxCase, surface: Surface) -> Panels | None:
    """Return the named parts of the surface, or None where the housing has none."""
    if isinstance(case.housing, Casting):
        return casting_panels(case.housing, surface)
    if isinstance(case.housing, Cad):  # its faces have no names
        return None
    model: SolidModel | ModalModel = case.housing.model(case)
    members = dict(model.groups)
    if isinstance(model, ModalModel):  # its file may hold nodes off the skin, such as those of the seats
        members = {name: rows[np.isin(rows, model.triangles)] for name, rows in members.items()}
    names = safe_names(members)
    groups = {name: model.nodes[rows] for name, rows in zip(names, members.values(), strict=True) if len(rows)}
    return group_panels(surface, groups) if groups else None


def _line(parts: Contributions, frequency: float | None) -> int:
    """Index of the line nearest to `frequency` (Hz), by default of the loudest in dB(A), at the first point."""
    if frequency is not None:
        low, high = parts.frequency[[0, -1]]
        require(low <= frequency <= high, f"at = {frequency:g} Hz: the lines lie between {low:g} and {high:g} Hz")
        return int(np.abs(parts.frequency - frequency).argmin())
    return int((levels.decibel(parts.total[:, 0]) + levels.a_weighting(parts.frequency)).argmax())


def _table(parts: Contributions, points: list[str]) -> plots.Table:
    """One row per field point and line with sound: its level and the share of every part."""
    total, shares = parts.total, parts.shares
    rows = [
        (
            name,
            f"{f:.6g}",
            f"{float(levels.decibel(total[line, point])):.2f}",
            *(f"{s:.5f}" for s in shares[line, point]),
        )
        for point, name in enumerate(points)
        for line, f in enumerate(parts.frequency)
        if total[line, point] != 0
    ]
    return plots.Table(("field point", "frequency / Hz", "level / dB", *parts.names), tuple(rows))
