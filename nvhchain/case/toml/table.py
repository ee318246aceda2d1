"""Conversion of plain tables (parsed TOML) to frozen dataclasses, by field name, with units in the key.

A key may end in a unit: `face_width_mm = 22` fills the field `face_width` with 0.022 m. Without a unit it is SI.
"""

from __future__ import annotations

import dataclasses
import difflib
import types
import typing
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, TypeVar

from nvhchain.case.toml.meanings import type_name
from nvhchain.dimensions import UNITS, si_unit
from nvhchain.errors import InputError, Mistakes, mistakes
from nvhchain.names import LONGEST

T = TypeVar("T")

_FORMER = {"engine_plane": "mounting_plane"}
"""Former name of a field → its name; files with the former one are read."""


def build(cls: type[T], table: Any, path: str) -> T:
    """Make a `cls` from `table`; `path` names the table in messages.

    InputError lists all unknown, repeated or missing fields, wrong types, and units that do not fit their field. It is
    also raised for everything that `cls` itself refuses.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{path} = {table!r} must be a table of fields")
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}  # type: ignore[arg-type]
    hints = typing.get_type_hints(cls, include_extras=True)
    values: dict[str, Any] = {}
    wrong: list[str] = []
    given = {_split_unit(key, fields)[0] for key in table}
    known = sorted(fields, key=lambda name: (not _required(fields[name]), name in given))
    for key, raw in table.items():
        name, unit = _split_unit(key, fields)
        meant = _nearest(name, known)
        try:
            if name in values:
                raise InputError(f"{path}.{key}: field {name!r} is given twice, in two units: keep one")
            values[name] = None
            values[name] = _field(name, hints, raw, f"{path}.{key}", (unit, meant))
        except InputError as error:
            wrong += mistakes(error)
            if name not in fields and meant and meant not in given:
                values.setdefault(meant, None)  # misspelt, not missing
    wrong += [
        f"{path}: required field {name!r} is missing"
        for name, f in fields.items()
        if name not in values and _required(f)
    ]
    if wrong:
        raise Mistakes(wrong)
    try:
        return cls(**values)
    except InputError as error:
        raise Mistakes([f"{path}: {text}{_unit_hint(text, table, hints)}" for text in mistakes(error)]) from None


def _unit_hint(text: str, table: Mapping[str, Any], hints: Mapping[str, Any]) -> str:
    """Return the proposal of a key with a unit, for a refused number whose key has none: `face_width_mm = 30`."""
    for key, raw in table.items():
        unit = si_unit(hints.get(key))
        if unit is None or f"{key} = " not in text or not isinstance(raw, int | float | list) or raw == 0:
            continue
        suffix = next(suffix for suffix, (si, _) in UNITS.items() if si == unit)
        return f"; if it is in {suffix.replace('_', ' ')}, write {key}_{suffix} = {raw}"
    return ""


def _required(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _field(name: str, hints: Mapping[str, Any], raw: Any, place: str, key: tuple[str | None, str]) -> Any:
    """Return the value of one field in SI; `key` has the suffix of its unit, or None, and the field it may mean."""
    unit, close = key
    if name not in hints:
        owner = next((field for field in hints if name.startswith(f"{field}_")), None)
        if owner is not None:
            needed = si_unit(hints[owner])
            units = [f"{owner}_{other}" for other, (si, _) in UNITS.items() if needed and si == needed]
            unknown = f"{name.removeprefix(owner + '_')!r} is no unit of {owner!r}"
            raise InputError(f"{place}: {unknown}: write {' or '.join((owner, *units))} (SI without a unit)")
        fits = close and unit and si_unit(hints[close]) == UNITS[unit][0]
        meant = f"{close}_{unit}" if fits else close
        known = f"known fields: {', '.join(hints)}" if hints else "this type has none, choose another `type`"
        remedy = f"did you mean {meant!r}?" if close else known
        raise InputError(f"{place}: unknown field; {remedy}")
    if unit is None:
        return convert(hints[name], raw, place)
    given_unit, factor = UNITS[unit]
    needed = si_unit(hints[name])
    if given_unit != needed:
        others = [f"{name}_{other}" for other, (si, _) in UNITS.items() if si == needed]
        takes = f"is in {needed}: {', '.join((name, *others))} will do" if needed else f"takes no unit: write {name}"
        raise InputError(f"{place}: _{unit} does not fit; {name!r} {takes}")
    return convert(hints[name], raw, place, factor)


def convert(hint: Any, raw: Any, place: str, factor: float = 1.0) -> Any:
    """Turn the TOML value `raw` into the type `hint`, numbers multiplied by `factor`."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Annotated:
        return convert(arguments[0], raw, place, factor)
    if origin in (typing.Union, types.UnionType):
        return _convert_union([a for a in arguments if a is not type(None)], raw, place, factor)
    if origin is tuple:
        return _convert_tuple(arguments, raw, place, factor)
    if origin is typing.Literal:
        if raw not in arguments:
            raise InputError(f"{place} = {raw!r}: choose one of {', '.join(map(repr, arguments))}")
        return raw
    if dataclasses.is_dataclass(hint):
        return build(typing.cast(type, hint), raw, place)
    if hint is float:
        if isinstance(raw, bool) or not isinstance(raw, int | float) or not isfinite(raw):
            raise InputError(f"{place} = {raw!r} must be a finite number")
        return float(raw) * factor
    if isinstance(raw, bool) is not (hint is bool) or not isinstance(raw, hint):
        raise InputError(f"{place} = {raw!r} must be of type {hint.__name__}")
    return raw


def _nearest(name: str, fields: Sequence[str]) -> str:
    """Return the field that a misspelt name means, or no text.

    A name that ends some fields means the first of them, such as "torque" in "input_torque".
    """
    longer = [field for field in fields if field.endswith(f"_{name}")]
    return "".join(longer[:1] or difflib.get_close_matches(name, fields, n=1))


def _split_unit(key: str, fields: Mapping[str, Any]) -> tuple[str, str | None]:
    """Name and unit of a key."""
    key = _FORMER.get(key, key) if key not in fields else key
    for unit in UNITS if key not in fields else ():
        if key.endswith(f"_{unit}"):
            return key.removesuffix(f"_{unit}"), unit
    return key, None


def _convert_union(choices: list[Any], raw: Any, place: str, factor: float) -> Any:
    """Convert a value to one of several types.

    A table becomes a dataclass, anything else another type. The key `type` of a table holds the name of its dataclass
    in lower case, words joined by underscores or not; without it the first dataclass is taken.
    """
    choices = [c for c in choices if dataclasses.is_dataclass(c) is isinstance(raw, Mapping)] or choices
    words = [c for c in choices if typing.get_origin(c) is typing.Literal]
    if words and len(choices) == 2:
        return _convert_word_or_value(words[0], next(c for c in choices if c not in words), raw, place, factor)
    if len(choices) == 1 or (isinstance(raw, Mapping) and "type" not in raw):
        return convert(choices[0], raw, place, factor)
    given = raw["type"] if isinstance(raw, Mapping) else raw
    chosen = [c for c in choices if type_name(c).replace("_", "") == str(given).replace("_", "")]
    if not chosen or not isinstance(raw, Mapping):
        raise InputError(f"{place}.type = {given!r}: choose one of {', '.join(map(type_name, choices))}")
    return build(chosen[0], {key: value for key, value in raw.items() if key != "type"}, place)


def _convert_word_or_value(word: Any, other: Any, raw: Any, place: str, factor: float) -> Any:
    """Convert one of some words, or a value of another type."""
    if isinstance(raw, bool) and other is float:
        words = ", ".join(map(repr, typing.get_args(word)))
        raise InputError(f"{place} = {str(raw).lower()}: give a number, 0 for none, or {words}")
    if not isinstance(raw, str):
        return convert(other, raw, place, factor)
    try:
        return convert(word, raw, place)
    except InputError as error:
        kind = {float: "a number", bool: "true or false"}.get(
            other, f"a value of type {getattr(other, '__name__', other)}"
        )
        raise InputError(f"{error}, or give {kind}") from None


def _convert_tuple(arguments: tuple[Any, ...], raw: Any, place: str, factor: float) -> tuple[Any, ...]:
    if not isinstance(raw, list | tuple):
        raise InputError(f"{place} = {raw!r} must be a list")
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        hints = [arguments[0]] * len(raw)
    elif len(arguments) == len(raw):
        hints = list(arguments)
    else:
        raise InputError(f"{place} has {len(raw)} entries, but {len(arguments)} are needed")
    values, wrong = [], []
    for number, (hint, item) in enumerate(zip(hints, raw, strict=True)):
        try:
            values.append(convert(hint, item, f"{place}[{number}]{_name_of(item)}", factor))
        except InputError as error:
            wrong += mistakes(error)
    if wrong:
        raise Mistakes(wrong)
    return tuple(values)


def _name_of(item: Any) -> str:
    """Return the name of a table in a list, in brackets."""
    name = item.get("name") if isinstance(item, Mapping) else None
    return f" ({name})" if isinstance(name, str) and 0 < len(name) <= LONGEST else ""
