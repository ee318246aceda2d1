"""Stand-ins for the mistaken values of a case file, so that the checks of the rest still run."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import MISSING, fields
from difflib import get_close_matches
from math import cos, dist, radians
from typing import Any

from nvhchain.case.checks.names import unknown_references
from nvhchain.case.toml.lines import path_steps
from nvhchain.dimensions import strip_unit
from nvhchain.housing import Casting

_defaults = (field.name for field in fields(Casting) if field.default is not MISSING)
_UNKNOWN = re.compile(r": unknown field; (?:did you mean '(?P<meant>\w+)')?")

_PROPOSED = re.compile(r"if it is in [^,]+, write (?P<key>\w+) = (?P<value>(?:(?<=_deg = )-)?\d[-+.\de]*)")
"""Remedy of a value in another unit."""

_FIELD = re.compile(r"(\w+) = ")
_REQUIRED = ("name", "shaft", "z", "axis")
"""Fields of bearings and shafts for which no stand-in is at hand."""

_BEARING = {"radial_stiffness": 1e8, "axial_stiffness": 1e8}

_OPTIONAL = re.compile(rf"\bCasting (?P<field>{'|'.join(_defaults)}) = ")
"""Mistake in a field of a casting that has a default."""

_STAND_INS: dict[str, Any] = {
    "band": {"low": 1.0, "high": 1e4, "resolution": 1.0},
    "housing": {"type": "housing_model", "file": "none", "units": "m-kg-s"},
}
"""Field of a gearbox → value in whose place every other part is judged as before."""

_OPERATION = {"input_speed": 100.0, "input_torque": 10.0}
_NEEDED = ("name", "gears", "stages", "shafts", "bearings", "input_shaft", "output_shaft", "operation", "folder")


def mended(table: Mapping[str, Any], wrong: Sequence[str], path: str) -> dict[str, Any]:
    """Return a gearbox's table without the mistakes that messages name, as far as they have a plain remedy.

    A misspelt key or name takes the one that its message proposes. A mistaken part that the others do not need is left
    out, or has a stand-in.
    """
    right = deepcopy(dict(table))
    for text in wrong:
        steps, end = path_steps(text.removeprefix(path))
        unknown = _UNKNOWN.match(text.removeprefix(path), end)
        if unknown and steps:
            _rename(right, steps, unknown["meant"])
        elif steps and steps[0] != "band" and (proposed := _PROPOSED.search(text)):
            part = _part(right, steps)
            if isinstance(part, dict):
                _drop_field(part, strip_unit(proposed["key"]))
                part[proposed["key"]] = float(proposed["value"])
        elif len(steps) > 2 and steps[0] == "gears" and steps[2] == "geometry":
            _fit_gear(right, steps[1], text)
        elif len(steps) > 1 and steps[0] in ("bearings", "shafts"):
            _replace_support(right, steps, text)
        elif steps and steps[0] == "operation":
            _replace_operation(right.get("operation"), text)
        elif (named := _OPTIONAL.search(text)) and isinstance(right.get("housing"), dict):
            _drop_field(right["housing"], named["field"])
        elif steps and (steps[0] in _STAND_INS or steps[0] not in _NEEDED):
            right.pop(str(steps[0]), None)
    for name, value in _STAND_INS.items():
        right.setdefault(name, value)
    for part, field, known, _ in unknown_references(right):
        close = get_close_matches(part[field], known, 1)
        part[field] = close[0] if close else _shaft_through(right, part) or _end(right, field) or part[field]
    if any("give them opposite hands" in text for text in wrong):
        _oppose_hands(right)
    return right


def _part(table: Any, steps: Sequence[str | int]) -> Any:
    """Return the part of a table at a path; None where it is absent."""
    try:
        for step in steps:
            table = table[step]
    except (LookupError, TypeError):
        return None
    return table


def _fit_gear(table: Mapping[str, Any], number: str | int, text: str) -> None:
    """Replace the values of a gear that a message names by those with which it meshes with its mate."""
    try:
        gear = table["gears"][number]
        stage = next(one for one in table["stages"] if gear["name"] in (one["pinion"], one["wheel"]))
        other = stage["wheel"] if stage["pinion"] == gear["name"] else stage["pinion"]
        own, mate = gear["geometry"], next(one["geometry"] for one in table["gears"] if one["name"] == other)
    except (LookupError, TypeError, StopIteration):
        return
    if not isinstance(own, dict) or not isinstance(mate, dict):
        return
    shared = ("normal_module", "normal_pressure_angle", "helix_angle", "face_width", "bore_radius")
    for field in set(_FIELD.findall(text)):
        given = [(key, value) for key, value in mate.items() if strip_unit(key) == field]
        if field in shared and given and isinstance(given[0][1], int | float):
            _drop_field(own, field)
            own[given[0][0]] = -given[0][1] if field == "helix_angle" else given[0][1]
        elif field == "teeth":
            distance, module = (
                _metres(part, name) for part, name in ((stage, "centre_distance"), (mate, "normal_module"))
            )
            if distance and module and isinstance(mate.get("teeth"), int):
                angle = mate.get("helix_angle_deg", 0.0)
                slant = cos(radians(angle)) if isinstance(angle, int | float) else 1.0
                own["teeth"] = max(5, round(2 * distance * slant / module - mate["teeth"]))


def _metres(part: Mapping[str, Any], field: str) -> float:
    """Return a length (m) by its key in m or mm; 0 without it."""
    for key, factor in ((field, 1.0), (f"{field}_mm", 1e-3)):
        if isinstance(part.get(key), int | float):
            return factor * float(part[key])
    return 0.0


def _replace_support(table: Mapping[str, Any], steps: Sequence[str | int], text: str) -> None:
    """Replace mistaken values of a bearing; a shaft with mistaken segments has none, as a rigid one."""
    part = _part(table, steps[:2])
    if not isinstance(part, dict):
        return
    for field in set(_FIELD.findall(text)):
        if field not in _REQUIRED:
            _drop_field(part, field)
    if steps[0] == "shafts" and "segment" in text:
        part.pop("segments", None)
    for field in _BEARING if steps[0] == "bearings" else ():
        if not any(strip_unit(key) == field for key in part) and "model" not in part:
            part[field] = _BEARING[field]


def _shaft_through(table: Mapping[str, Any], bearing: Mapping[str, Any]) -> str:
    """Return the shaft whose axis goes through the bore of a bearing in a drawn casting; empty without one."""
    housing = table.get("housing")
    bores = housing.get("bores", ()) if isinstance(housing, dict) else ()
    try:
        (centre,) = [_point(bore, "centre") for bore in bores if bore["name"] == bearing["name"]]
        return next(str(shaft["name"]) for shaft in table["shafts"] if dist(_point(shaft, "axis"), centre) < 1e-4)
    except (KeyError, TypeError, ValueError, StopIteration):
        return ""


def _end(table: Mapping[str, Any], field: str) -> str:
    """Return a shaft with a single gear that is not the other end of the gearbox; empty for no end or without one."""
    ends = {"input_shaft": "output_shaft", "output_shaft": "input_shaft"}
    if field not in ends:
        return ""
    gears = [str(gear.get("shaft")) for gear in table.get("gears", ()) if isinstance(gear, dict)]
    return next((shaft for shaft in gears if gears.count(shaft) == 1 and shaft != table.get(ends[field])), "")


def _point(part: Mapping[str, Any], field: str) -> list[float]:
    """Return x and y (m) of a point by its key in m or mm."""
    return list(part[field][:2]) if field in part else [1e-3 * x for x in part[f"{field}_mm"][:2]]


def _oppose_hands(table: Mapping[str, Any]) -> None:
    """Give the wheel of every stage the helix angle of its pinion, of the other hand."""
    drawn = {gear["name"]: gear["geometry"] for gear in table["gears"]}
    for stage in table["stages"]:
        pinion, wheel = drawn.get(stage["pinion"], {}), drawn.get(stage["wheel"], {})
        for key in [key for key in wheel if strip_unit(key) == "helix_angle"]:
            wheel[key] = -pinion.get(key, -wheel[key])


def _rename(table: Any, steps: Sequence[str | int], meant: str | None) -> None:
    """Give a key the name that is meant, unless that is given, too; without one it is removed.

    A part that is absent by now is skipped.
    """
    try:
        for step in steps[:-1]:
            table = table[step]
    except (LookupError, TypeError):
        return
    value = table.pop(steps[-1], None) if isinstance(table, dict) else None
    if value is not None and meant and strip_unit(meant) not in map(strip_unit, table):
        table[meant] = value


def _drop_field(table: dict[str, Any], field: str) -> None:
    for key in [key for key in table if strip_unit(key) == field]:
        del table[key]


def _replace_operation(operation: Any, text: str) -> None:
    """Replace the speed or torque that a message names; other fields of the operation that it names are removed."""
    if not isinstance(operation, dict):
        return
    for key in list(operation):
        name = next((name for name in _OPERATION if key.startswith(name)), key)
        if re.search(rf"\b{re.escape(name)}", text):
            operation.pop(key)
    for name, value in _OPERATION.items():
        if not any(key.startswith(name) for key in operation):
            operation[name] = value
