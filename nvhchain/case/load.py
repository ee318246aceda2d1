"""Reader of case files (TOML)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nvhchain.case._table import build
from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.radiator import RadiatorCase
from nvhchain.errors import InputError, require
from nvhchain.interop import ForceChannels
from nvhchain.kinds import NAMES, checked
from nvhchain.names import check_names, check_text

Case = GearboxCase | RadiatorCase

NAMES[RadiatorCase] = "a RadiatorCase, as load_case returns them"


def load_channels(path: str | Path) -> ForceChannels:
    """Read the meaning of the channels of an imported record of bearing forces (TOML).

    Parameters
    ----------
    path : str or Path
        TOML file.

    Returns
    -------
    ForceChannels
        Meaning of every channel.

    Raises
    ------
    InputError
        If the file cannot be used; the message states file, field, value, limit and remedy.
    """
    path = Path(path)
    return build(ForceChannels, _read(path, ()), str(path))


@checked
def load_case(path: str | Path) -> Case:
    """Read and validate a case file.

    Parameters
    ----------
    path : str or Path
        TOML file.

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
    _place_meshes(table.get("gears"), path.parent)
    _place_records(table.get("operation"), path.parent)
    return build(kinds[kind], table, str(path))


def _place_meshes(gears: Any, folder: Path) -> None:
    """Make the paths of gear meshes relative to the folder of the case."""
    for gear in gears if isinstance(gears, list) else []:
        blank = gear.get("blank") if isinstance(gear, Mapping) else None
        if isinstance(blank, dict) and blank.get("type") == "mesh" and isinstance(blank.get("file"), str):
            blank["file"] = str(folder / blank["file"])


def _place_records(operation: Any, folder: Path) -> None:
    """Make the path of a fluctuating drive's record relative to the folder of the case."""
    given = operation.get("fluctuation") if isinstance(operation, Mapping) else None
    if isinstance(given, dict) and isinstance(given.get("file"), str):
        given["file"] = str(folder / given["file"])


def _read(path: Path, open_files: tuple[Path, ...]) -> dict[str, Any]:
    require(path.resolve() not in open_files, f"{path}: base files refer to each other in a circle")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start + 1} is none of UTF-8 text: save the file as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None
    _check_texts(table, f"{path}")
    base = table.pop("base", None)
    if base is None:
        return table
    require(isinstance(base, str), f"{path}: base = {base!r} must be the path of a case file")
    return _merge(_read(path.parent / base, (*open_files, path.resolve())), table, f"{path}: ")


def _check_texts(value: Any, place: str) -> None:
    """Refuse (InputError) control characters in any text or key."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            check_text(key, f"{place}: key")
            _check_texts(inner, f"{place}.{key}")
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            _check_texts(inner, f"{place}[{number}]")
    elif isinstance(value, str):
        check_text(value, place)


def _merge(base: Mapping[str, Any], change: Mapping[str, Any], place: str) -> dict[str, Any]:
    """Return `base` with `change` merged into it; a table with another `type` replaces that of the base."""
    merged = dict(base)
    for key, value in change.items():
        old = merged.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping) and value.get("type") == old.get("type"):
            merged[key] = _merge(old, value, f"{place}{key}.")
        elif _named(value) and _named(old):
            for items in (old, value):
                check_names([item["name"] for item in items], f"{place}{key}")  # type: ignore[union-attr]
            by_name = {item["name"]: item for item in old}  # type: ignore[union-attr]
            for item in value:
                by_name[item["name"]] = _merge(by_name.get(item["name"], {}), item, f"{place}{key}.")
            merged[key] = list(by_name.values())
        else:
            merged[key] = value
    return merged


def _named(value: Any) -> bool:
    return (
        isinstance(value, list)
        and bool(value)
        and all(isinstance(v, Mapping) and isinstance(v.get("name"), str) for v in value)
    )
