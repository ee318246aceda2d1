"""Values of a case by their paths, and outlines of its gears, kept beside its results in case.json."""

from __future__ import annotations

import dataclasses
import json
import typing
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.case import Case, GearboxCase
from nvhchain.dimensions import UNITS, si_unit
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.gear import GearBody
from nvhchain.handoff import FloatArray
from nvhchain.report.marks import mesh_orders, slot_orders
from nvhchain.scene.steps import DIRECTIVITY, NOISE_TRANSFER_FUNCTIONS, PRESSURE, PRESSURE_HISTORY, STEPS

_DRAWING_UNITS = {UNITS[unit][0]: unit for unit in ("mm", "deg", "rpm", "kg_cm2", "GPa")}
"""SI unit → suffix of the keys that state it as on drawings."""


_DERIVED = ("summary.json", "report.html", "error_bands.json")
"""Files made from the hand-offs of a folder, which a comparison does not write for each case."""

_ADDED = ("microphones", "balloon", "surface_pressure")
"""Names of files that commands add to a finished run."""

_UNHEARD = ("quantities", "spread", "targets", "background")
"""Fields of a case that change no result."""

_HEARD = (PRESSURE, NOISE_TRANSFER_FUNCTIONS, PRESSURE_HISTORY, DIRECTIVITY)
"""Steps whose results hold at the microphones of a case."""

FLANK, FILLET, SIDE = 9, 8, 7
"""Points along an involute, along a fillet, and along each of four sides of an opening."""


@contextmanager
def recorded_case(case: Case, fidelity: Fidelity, folder: Path) -> Iterator[None]:
    """Write case.json before a run, and remove summary, page, limits and sounds of an earlier one.

    The file holds values of the case, its orders, outlines of its gears, and the fidelity. A run that ends before its
    first hand-off leaves nothing. The sound of another case or fidelity is removed, too.

    folder: folder of the run; made if it is missing.
    """
    writable_folder(folder, "out")
    for path in _stale_files(case, fidelity, folder):
        path.unlink(missing_ok=True)
    for path in [*(folder / name for name in _DERIVED), *folder.glob("sound-*.wav")]:
        path.unlink(missing_ok=True)
    write_text(folder / "case.json", _record(case, fidelity))
    try:
        yield
    except BaseException:
        if not any(folder.glob("*.h5")):
            (folder / "case.json").unlink(missing_ok=True)
        raise


def _stale_files(case: Case, fidelity: Fidelity, folder: Path) -> list[Path]:
    """Return the sound of another case or fidelity in a folder.

    A run that is interrupted would leave it beside new forces. It costs little beside the forces and motions from which
    it follows, which stay. Where only microphones differ, results without microphones stay, too.
    """
    try:
        earlier = json.loads((folder / "case.json").read_text(encoding="utf-8"))
        now = json.loads(_record(case, fidelity))
        before, after = (
            _changing({key: record[key] for key in earlier.keys() & now.keys()}) for record in (earlier, now)
        )
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return []
    if before == after:
        return []
    alike = _changing(before, "field_points") == _changing(after, "field_points")
    gone = [
        step.file_of()
        for step in STEPS
        if not step.shared and not step.can_be_supplied and (not alike or step in _HEARD)
    ]
    named = [f"{name}.h5" for name in (*gone, *_ADDED)] + [f"{name}.csv" for name in (*_ADDED, "levels_over_speed")]
    return [*(folder / name for name in named), *folder.glob("contributions-*")]


def _changing(record: dict[str, Any], *others: str) -> dict[str, Any]:
    """Return what changes results in a record, without other fields of the case."""
    excluded = (*_UNHEARD, *others)
    kept = {path: value for path, value in record["values"].items() if path.partition(".")[0] not in excluded}
    return {name: value for name, value in record.items() if name not in others} | {"values": kept}


def is_recorded(case: Case, fidelity: Fidelity, folder: Path) -> bool:
    """Return True if case.json in a folder is that of the case at this fidelity."""
    path = folder / "case.json"
    return path.is_file() and path.read_bytes() == _record(case, fidelity).encode()


def _record(case: Case, fidelity: Fidelity) -> str:
    """Return the content of case.json."""
    return json.dumps(_recorded(case, fidelity), indent=1) + "\n"


def _recorded(case: Case, fidelity: Fidelity) -> dict[str, Any]:
    return {
        "name": case.name,
        "fidelity": fidelity.name,
        "acoustics": dataclasses.asdict(fidelity.acoustics),
        "field_points": [{"name": point.name, "position_m": list(point.position)} for point in case.field_points],
        "mesh_orders": mesh_orders(case),
        "slot_orders": slot_orders(case),
        "values": dict(case_values(case)),
        "drawings": gear_outlines(case),
    }


def case_values(part: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of every field of a case, such as ("gears.gear2.blank.count", 5).

    Paths are those of `--set`; lengths are in mm, angles in degrees, speeds in rpm. Absent values are excluded.
    """
    hints = typing.get_type_hints(type(part), include_extras=True)
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if value is None or not field.init or (field.name in ("name", "folder")):
            continue
        unit = _DRAWING_UNITS.get(si_unit(hints[field.name]) or "")
        place = f"{path}.{field.name}" if path else field.name
        if dataclasses.is_dataclass(value):
            if typing.get_args(hints[field.name]):
                yield f"{place}.type", type(value).__name__
            yield from case_values(value, place)
        elif isinstance(value, tuple) and value and all(map(dataclasses.is_dataclass, value)):
            for number, inner in enumerate(value):
                yield from case_values(inner, f"{place}.{getattr(inner, 'name', number)}")
        else:
            yield f"{place}_{unit}" if unit else place, _drawn(value, UNITS[unit][1] if unit else 1.0)


def _drawn(value: Any, factor: float) -> Any:
    """Return a value in the unit of drawings, for JSON."""
    if isinstance(value, list | tuple):
        return [_drawn(inner, factor) for inner in value]
    if isinstance(value, bool | str | int):
        return value
    return float(f"{value / factor:.9g}") if isinstance(value, float) else str(value)


def gear_outlines(case: Case) -> dict[str, Any]:
    """Return the outlines of the gears and the places of the stages, for case.json; empty for a radiator.

    `gears`: name → teeth, tooth (radius in m and angle in rad from its centre line, one half from the root to the tip),
    bore (m), openings (radius, angle; count). `stages`: names of both gears and their places (m).
    """
    if not isinstance(case, GearboxCase):
        return {}
    axes = {shaft.name: list(shaft.axis) for shaft in case.shafts}
    places = {gear.name: axes[gear.shaft] for gear in case.gears}
    return {
        "gears": {gear.name: _outline(gear.body) for gear in case.gears},
        "stages": {
            stage.name: [{"gear": name, "place": places[name]} for name in (stage.pinion, stage.wheel)]
            for stage in case.stages
        },
    }


def _outline(body: GearBody) -> dict[str, Any]:
    geometry = body.geometry
    root, angle = geometry.fillet(np.linspace(1.0, 0.0, FILLET, endpoint=False))
    flank, half = geometry.outline(FLANK)
    tooth = np.column_stack([np.append(root, flank), np.append(angle, half)])
    found: dict[str, Any] = {"teeth": geometry.teeth, "tooth": _short(tooth), "bore": geometry.bore_radius}
    web, cut = body.blank.web, body.blank.cutouts
    if web is not None:
        found["web"] = [web.hub_radius, web.rim_radius]
    if cut is not None:
        sides = [np.column_stack(cut.outline(side, np.linspace(0.0, 1.0, SIDE, endpoint=False))) for side in range(4)]
        found["openings"] = {"count": cut.count, "phase": cut.phase, "outline": _short(np.concatenate(sides))}
    return found


def _short(points: FloatArray) -> list[list[float]]:
    return [[float(f"{r:.6g}"), float(f"{angle:.6g}")] for r, angle in points]
