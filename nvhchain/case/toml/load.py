"""Reader of case files (TOML)."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from nvhchain.case.checks.names import nearest, unknown_names
from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.radiator import RadiatorCase
from nvhchain.case.sound import check_targets
from nvhchain.case.toml.lines import Table, add_line, merged_places, placed
from nvhchain.case.toml.mended import mended
from nvhchain.case.toml.missing import REQUIRED, assumed_stiffness, missing_values
from nvhchain.case.toml.read import TOO_DEEP, TOO_LONG, check_texts, read_toml
from nvhchain.case.toml.table import build
from nvhchain.dimensions import strip_unit
from nvhchain.errors import InputError, Mistakes, mistakes, require
from nvhchain.interop import ForceChannels
from nvhchain.kinds import NAMES, checked
from nvhchain.names import check_names

Case = GearboxCase | RadiatorCase

_MISSING = re.compile(rf"\.housing: required field '({'|'.join(REQUIRED)})' is missing")

_LAYERS = 4
"""Largest number of rounds in which mistakes behind mistakes are looked for."""

NAMES[RadiatorCase] = "a RadiatorCase, as load_case returns them"


def load_channels(path: str | Path) -> ForceChannels:
    """Read the meaning of the channels of an imported record of bearing forces (TOML)."""
    path = Path(path)
    return build(ForceChannels, _read(path, ()), str(path))


@checked
def load_case(path: str | Path, *, changes: Sequence[str] = ()) -> Case:
    """Read and validate a case file.

    Parameters
    ----------
    path : str or Path
        TOML file.
    changes : sequence of str
        Values that replace those of the file, such as "operation.input_speed_rpm = 1800" or
        "gears.wheel.geometry.face_width_mm = 30"; entries of a list have their name in the path.

    Returns
    -------
    Case
        Gearbox or radiator.

    Raises
    ------
    InputError
        If the file cannot be used; the message states file, field, value, limit and remedy.

    Notes
    -----
    A file may name another as its `base` and contain only the differences. Lists of named tables are merged by name.
    """
    path = Path(path)
    table = _read(path, ())
    try:
        for change in changes:
            table = _merge(table, _list_named(parse_change(change), table, change), f"{change}: ")
        return _built(table, path)
    except InputError as error:
        raise Mistakes([add_line(text, str(path), table) for text in mistakes(error)]) from None


def _built(table: Table, path: Path) -> Case:
    """Return the case of a table."""
    table = Table(table, table.places, table.place)
    kind = table.pop("kind", None)
    kinds: dict[str, type[GearboxCase] | type[RadiatorCase]] = {"gearbox": GearboxCase, "radiator": RadiatorCase}
    if kind is None:
        raise InputError(
            f"{path}: kind is missing among {', '.join(table)[:200] or 'no keys'}: "
            f"give it ({' or '.join(kinds)}), or a base"
        )
    if not isinstance(kind, str) or kind not in kinds:
        raise InputError(f"{path}: kind = {kind!r}: choose one of {', '.join(kinds)}")
    table["folder"] = str(path.parent)
    _place_files(table, path.parent)
    missing = [f"{path}: {text}" for text in missing_values(table)] if kind == "gearbox" else []
    try:
        case = build(kinds[kind], table, str(path))
        if isinstance(case, GearboxCase):
            stated = [text for text in assumed_stiffness(table) if text not in case.assumptions]
            case = replace(case, assumptions=(*case.assumptions, *stated)) if stated else case
        _check_judgeable(case, str(path))
    except InputError as error:
        wrong = mistakes(error)
        if kind == "gearbox":
            wrong += [*missing, *(f"{path}: {text}" for text in unknown_names(table))]
            wrong += _hidden(table, wrong, str(path))
            wrong = _misnamed(table, wrong, str(path))
        raise Mistakes(list(dict.fromkeys(text for text in wrong if not _MISSING.search(text)))) from None
    if missing:
        raise Mistakes(missing)
    return case


def _misnamed(table: Table, wrong: Sequence[str], path: str) -> list[str]:
    """Return the mistakes, with one line for a part that the base has by a similar name and that lacks fields."""
    found = list(wrong)
    for key, items in table.items():
        for number, item in enumerate(items if _named(items) else ()):
            others = [
                one["name"] for one in items if any(file != path for file, _ in getattr(one, "places", {}).values())
            ]
            place = f"{path}.{key}[{number}]"
            lost = [text for text in found if text.startswith(place) and "required field" in text]
            close = get_close_matches(item["name"], others, n=1)
            if len(lost) > 1 and close and item["name"] not in others:
                said = f"{place} ({item['name']}): the base has no {key[:-1]} of this name, did you mean {close[0]!r}?"
                fields = ", ".join(re.findall(r"required field '(\w+)'", " ".join(lost)))
                found = [text for text in found if text not in lost]
                found.append(f"{said} A new one needs {fields}")
    return found


def _hidden(table: Table, wrong: Sequence[str], path: str) -> list[str]:
    """Return the mistakes of a gearbox that others hide, found with stand-ins for those."""
    found: list[str] = []
    for _ in range(_LAYERS):
        table = Table(mended(table, [*wrong, *found], path), {})
        try:
            build(GearboxCase, table, path)
            break
        except InputError as error:
            more = [text for text in mistakes(error) if text not in wrong and text not in found]
            found += more
            if not more:
                break
    return found


def _check_judgeable(case: Case, path: str) -> None:
    """Refuse (InputError) targets whose level a case does not have; cases derived from it may leave levels out."""
    band = (case.band.low, case.band.high) if isinstance(case, GearboxCase) else None
    try:
        check_targets(
            case.targets, case.quantities, tuple(point.name for point in case.field_points), case.speeds, band
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def parse_change(text: str) -> dict[str, Any]:
    """Return the nested tables of an assignment "path = value"; a value that is not TOML is a text.

    Raises InputError if the text has no path or no value.
    """
    path, equals, value = text.partition("=")
    require(
        bool(path.strip() and equals and value.strip()) and "\n" not in text,
        f"{text!r} is no assignment: write path=value, such as operation.input_speed_rpm=1800",
    )
    for right in (value, json.dumps(value.strip())):
        try:
            table = tomllib.loads(f"{path} = {right}")
        except tomllib.TOMLDecodeError:
            continue
        except ValueError:
            raise InputError(f"{path.strip()}: {TOO_LONG}") from None
        check_texts(table, text if len(text) < 200 else path.strip())
        return table
    raise InputError(f"{path.strip()!r} is no path of a value: separate keys by dots, and quote names with spaces")


def _list_named(change: Mapping[str, Any], table: Mapping[str, Any], text: str) -> Table:
    """Return a change in which tables by name are lists of named tables, where the case has such lists.

    Values have the text of the change as their place, in line 0.
    """
    placed = Table({}, {})
    for key, value in change.items():
        old = table.get(key)
        if isinstance(value, Mapping) and _named(old):
            names = [item["name"] for item in old]  # type: ignore[union-attr]
            for name in value:
                require(name in names, f"{text}: no {name!r} in {key}: {nearest(name, names)}")
            items = {item["name"]: item for item in old}  # type: ignore[union-attr]
            placed[key] = [
                _merge({"name": name}, _list_named(inner, items[name], text), text)
                if isinstance(inner, Mapping)
                else inner
                for name, inner in value.items()
            ]
            require(
                all(isinstance(item, Mapping) for item in placed[key]),
                f"{text}: {key} are tables: name the field that changes",
            )
        elif isinstance(value, Mapping) and isinstance(old, Mapping):
            placed[key] = _list_named(value, old, text)
            if "type" in old:
                placed[key].setdefault("type", old["type"])
        else:
            placed[key] = value
            placed.places[key] = text, 0
    return placed


def _place_files(table: Mapping[str, Any], folder: Path) -> None:
    """Make the paths of gear meshes, measured flanks and records of the drive relative to the folder of the case."""
    for path in (("gears", "blank"), ("gears", "deviations", "topography"), ("operation", "fluctuation")):
        parts: list[Any] = [table]
        for key in path:
            inside = [part.get(key) for part in parts if isinstance(part, Mapping)]
            parts = [part for found in inside for part in (found if isinstance(found, list) else [found])]
        for part in parts:
            if isinstance(part, dict) and isinstance(part.get("file"), str):
                part["file"] = str(folder / part["file"])


def _read(path: Path, open_files: tuple[Path, ...]) -> Table:
    require(path.resolve() not in open_files, f"{path}: base files refer to each other in a circle")
    content, text = read_toml(path)
    try:
        table: Table = placed(content, text, str(path))
        check_texts(table, f"{path}")
    except RecursionError:
        raise InputError(f"{path}: {TOO_DEEP}") from None
    base = table.pop("base", None)
    if base is None:
        return table
    require(isinstance(base, str), f"{path}: base = {base!r} must be the path of a case file")
    where, file = f"{path}:{table.places['base'][1]}: base = {base!r}", path.parent / base
    if not file.is_file():
        known = sorted(other.name for other in file.parent.glob("*.toml") if other.name != path.name)
        raise InputError(f"{where}: no such file" + (f": {nearest(file.name, known)}" if known else ""))
    return _merge(_read(file, (*open_files, path.resolve())), table, f"{path}: ")


def _merge(base: Mapping[str, Any], change: Mapping[str, Any], place: str) -> Table:
    """Return `base` with `change` merged into it; a table with another `type` replaces that of the base.

    A value also replaces one that the base gives in another unit.
    """
    merged = Table(base, merged_places(base, change), getattr(change, "place", None) or getattr(base, "place", None))
    for key, value in change.items():
        for other in [one for one in merged if one not in change and strip_unit(one) == strip_unit(key)]:
            del merged[other]
        old = merged.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping) and value.get("type") == old.get("type"):
            merged[key] = _merge(old, value, f"{place}{key}.")
        elif _named(value) and _named(old):
            for items in (old, value):
                check_names([item["name"] for item in items], f"{place}{key}")  # type: ignore[union-attr]
            merged_items = {item["name"]: item for item in old}  # type: ignore[union-attr]
            for item in value:
                merged_items[item["name"]] = _merge(merged_items.get(item["name"], {}), item, f"{place}{key}.")
            merged[key] = list(merged_items.values())
        else:
            merged[key] = value
    return merged


def _named(value: Any) -> bool:
    return (
        isinstance(value, list)
        and bool(value)
        and all(isinstance(v, Mapping) and isinstance(v.get("name"), str) for v in value)
    )
