"""What every mode and every panel of a gearbox's housing adds to its sound: tables and bars."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import acoustics, chain, interop, levels, plots
from nvhchain.case import Case, GearboxCase, HousingModel
from nvhchain.errors import InputError, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import write_text
from nvhchain.files.shelf import Watcher
from nvhchain.handoff import Surface
from nvhchain.housing import Casting
from nvhchain.housing.casting.contributions import Contributions, modal_contributions, panel_contributions
from nvhchain.housing.casting.panels import Panels, casting_panels, group_panels
from nvhchain.names import safe_names
from nvhchain.plots.files import save


def contributions(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path,
    at: float | None = None,
    given: Mapping[str, Any] | None = None,
    watcher: Watcher | None = None,
) -> dict[str, Contributions]:
    """Run a gearbox at constant speed (or find it in `out`) and leave what modes and panels contribute to its pressure.

    `modes` and, where the housing has named parts, `panels`: shares Re(p_i p*)/|p|² at every line and field point in
    contributions-<of>.csv, those of the line nearest to `at` (Hz; by default the loudest in dB(A)) at the first field
    point as bars in contributions-<of>.png.  Panels of a casting are its bosses, walls and flange, of a foreign model
    its node groups.  given: ready-made hand-offs, as for `chain.run`.
    Raises InputError for a case without pressure lines or a level of radiation without transfer vectors.
    """
    case = _steady_gearbox(case, fidelity)
    result = chain.run(case, fidelity=fidelity, out=out, watcher=watcher, **(given or {}))
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
        line = _line(parts, at)
        axes = plots.contribution_bars(
            parts.names,
            parts.pressure[line, 0],
            frequency=float(parts.frequency[line]),
            title=f"{case.name}, {case.field_points[0].name}",
        )
        save([axes], Path(out) / f"contributions-{kind}.png")
    return found


def _steady_gearbox(case: Case, fidelity: Fidelity) -> GearboxCase:
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
    """Parts of the surface that have names, or None where the housing has none."""
    if isinstance(case.housing, Casting):
        return casting_panels(case.housing, surface)
    given, path = case.housing, Path(case.folder) / case.housing.file
    model: SolidModel | ModalModel
    if isinstance(given, HousingModel):
        model = interop.read_solid_model(path, units=given.units, spc=given.spc)
    else:
        model = interop.read_modal_model(path, units=given.units)
    members = dict(model.groups)
    if isinstance(model, ModalModel):  # whose file may hold nodes beside the skin, as those of the seats
        members = {name: rows[np.isin(rows, model.triangles)] for name, rows in members.items()}
    names = safe_names(members)
    groups = {name: model.nodes[rows] for name, rows in zip(names, members.values(), strict=True) if len(rows)}
    return group_panels(surface, groups) if groups else None


def _line(parts: Contributions, at: float | None) -> int:
    """Of the frequency nearest to `at` Hz, by default the loudest in dB(A), at the first point."""
    if at is not None:
        low, high = parts.frequency[[0, -1]]
        require(low <= at <= high, f"at = {at:g} Hz: the lines lie between {low:g} and {high:g} Hz")
        return int(np.abs(parts.frequency - at).argmin())
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
