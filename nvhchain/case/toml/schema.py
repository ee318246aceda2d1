"""JSON Schema of case files, made from the fields of the case classes, for editors."""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Iterator
from dataclasses import MISSING
from typing import Any

from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.radiator import RadiatorCase
from nvhchain.case.toml.meanings import bare, classes, fields_in_files, is_union, keys, meanings, type_name

FILE_NAME = "case.schema.json"
"""Name of the schema beside a case file, whose first line `#:schema ./case.schema.json` refers to it."""

_KINDS = {"gearbox": GearboxCase, "radiator": RadiatorCase}
_SIMPLE = {float: "number", int: "integer", bool: "boolean", str: "string"}


def case_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of case files.

    Returns schema. Keys with and without units, kinds, types and choices are checked.

    No field is required, since a file with a `base` has only the differences. `check` finds missing fields and wrong
    values.
    """
    definitions: dict[str, Any] = {}
    roots = [_reference(cls, definitions) for cls in _KINDS.values()]
    for name, root in zip(_KINDS, _KINDS.values(), strict=True):
        properties = definitions[root.__name__]["properties"]
        properties["kind"] = {"const": name, "description": "Kind of the case"}
        properties["base"] = {"type": "string", "description": "Case file to start from; this one has the differences"}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Case file of nvhchain",
        "type": "object",
        "anyOf": [{"required": ["kind"], **roots[0]}, {"required": ["kind"], **roots[1]}]
        + [{"required": ["base"], **root} for root in roots],
        "$defs": dict(sorted(definitions.items())),
    }


def schema_text() -> str:
    """Return the schema as the text of a file."""
    return json.dumps(case_schema(), indent=1, ensure_ascii=False) + "\n"


def _reference(cls: type, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return a reference to the definition of a class, which is added if needed."""
    if cls.__name__ not in definitions:
        definitions[cls.__name__] = {}
        definitions[cls.__name__].update(_definition(cls, definitions))
    return {"$ref": f"#/$defs/{cls.__name__}"}


def _definition(cls: type, definitions: dict[str, Any]) -> dict[str, Any]:
    said, properties = meanings(cls), {}
    for field, hint in fields_in_files(cls):
        for key in keys(field.name, hint):
            form = _form(hint, definitions)
            text = said.get(field.name, "")
            if key != field.name:
                text = f"{text} In {key.removeprefix(field.name + '_').replace('_', ' ')}; SI without the unit."
            form |= {"description": text} if text else {}
            if key == field.name and isinstance(field.default, float | int | str) and field.default is not MISSING:
                form["default"] = field.default
            properties[key] = form
    return {
        "type": "object",
        "description": (cls.__doc__ or "").split("\n\n")[0].replace("\n", " "),
        "properties": properties,
        "additionalProperties": False,
    }


def _form(hint: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a value."""
    plain = bare(hint)
    if is_union(plain):
        return {"anyOf": list(_alternatives(plain, definitions))}
    origin, inner = typing.get_origin(plain), typing.get_args(plain)
    if origin is typing.Literal:
        return {"enum": list(inner)}
    if origin is tuple and inner[-1] is Ellipsis:
        return {"type": "array", "items": _form(inner[0], definitions)}
    if origin is tuple:
        return {
            "type": "array",
            "prefixItems": [_form(part, definitions) for part in inner],
            "minItems": len(inner),
            "maxItems": len(inner),
        }
    if dataclasses.is_dataclass(plain):
        return _reference(typing.cast(type, plain), definitions)
    return {"type": _SIMPLE[plain]}


def _alternatives(hint: types.UnionType, definitions: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the schema of every kind of a union; tables have a `type`, which the first may leave out."""
    choices = classes(hint)
    for cls in choices:
        _reference(cls, definitions)
        definition = definitions[cls.__name__]
        if len(choices) == 1:
            yield {"$ref": f"#/$defs/{cls.__name__}"}
            continue
        names = list(dict.fromkeys([type_name(cls), cls.__name__.lower()]))
        definition["properties"]["type"] = {"enum": names, "description": "Class of the table"}
        yield {"$ref": f"#/$defs/{cls.__name__}"} | ({} if cls is choices[0] else {"required": ["type"]})
    for kind in typing.get_args(hint):
        if kind is not type(None) and not dataclasses.is_dataclass(kind):
            yield _form(kind, definitions)
