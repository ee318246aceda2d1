"""Fields of the case classes: their meaning, from docstrings, and the units of their keys."""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from collections.abc import Iterator
from inspect import cleandoc
from typing import Any

from nvhchain.dimensions import UNITS, si_unit

_ENTRY = re.compile(r"(?m)^(?P<names>\w+(?:, \w+)*) : .*\n(?P<text>(?:[ \t]+\S.*\n?)+)")

UNWRITTEN = frozenset({"folder"})
"""Fields that follow from the place of a file."""


def fields_in_files(cls: type) -> Iterator[tuple[dataclasses.Field[Any], Any]]:
    """Yield every field of a class that a case file can have, with its annotation."""
    hints = typing.get_type_hints(cls, include_extras=True)
    for field in dataclasses.fields(cls):
        if field.init and field.name not in UNWRITTEN:
            yield field, hints[field.name]


def meanings(cls: type) -> dict[str, str]:
    """Return the meaning of every field, from the docstrings of the class and its bases; empty without docstrings.

    An entry "As in `Base`." leaves the meaning of the base.
    """
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        for entry in _ENTRY.finditer(cleandoc(base.__doc__ or "") + "\n"):
            text = " ".join(entry["text"].split())
            if not text.startswith("As in `"):
                found |= dict.fromkeys(entry["names"].split(", "), text)
    return found


def is_union(hint: Any) -> bool:
    """Return True for an annotation of several kinds."""
    return typing.get_origin(hint) in (typing.Union, types.UnionType)


def bare(hint: Any) -> Any:
    """Return an annotation without unit and without None; a union where several kinds remain."""
    if typing.get_origin(hint) is typing.Annotated:
        return bare(typing.get_args(hint)[0])
    if is_union(hint):
        kinds = [kind for kind in typing.get_args(hint) if kind is not type(None)]
        return bare(kinds[0]) if len(kinds) == 1 else hint
    return hint


def classes(hint: Any) -> list[Any]:
    """Return the dataclasses among which a field chooses; the first is the one without a `type`."""
    kinds = typing.get_args(bare(hint)) if is_union(bare(hint)) else (bare(hint),)
    return [kind for kind in kinds if dataclasses.is_dataclass(kind)]


def type_name(cls: type) -> str:
    """Return the value of the key `type` that chooses a class."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", cls.__name__).lower()


def keys(name: str, hint: Any) -> dict[str, float]:
    """Return the keys that fill a field, each with the factor of its unit to SI; the bare key is first."""
    unit = si_unit(hint)
    return {name: 1.0} | {f"{name}_{suffix}": factor for suffix, (si, factor) in UNITS.items() if unit and si == unit}
