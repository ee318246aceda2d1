"""Tables of dataclass fields, generated so that no name, default or preset value is typed twice.

`fidelity-table`: every knob of `nvhchain.fidelity` with the values of all presets.
`case-tables`: every field of the case classes, down through the nested ones.  `unit-table`: unit suffixes of keys.
`handoff-tables`: every field of the hand-offs.  `accuracy-tables`: every field of their accuracies.
"""

import dataclasses
import importlib
import sys
import types
import typing

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from nvhchain import case, dimensions
from nvhchain.case.toml.meanings import meanings
from nvhchain.fidelity import PRESETS, declared
from nvhchain.handoff import ACCURACIES, HAND_OFFS

HOMES = [
    f"nvhchain.{package}" for package in ("case", "gear", "bearings", "dynamics", "housing", "conventions", "handoff")
]
"""Packages that offer the classes of a case."""


def summary(cls):
    """First paragraph of the docstring; empty for a generated docstring."""
    text = (cls.__doc__ or "").split("\n\n")[0]
    return "" if text.startswith(f"{cls.__name__}(") else " ".join(text.split())


def shown(value):
    return f"{value:g}" if isinstance(value, float) else str(value)


def inline(text):
    """Text nodes, with what stands between backticks as code."""
    return [nodes.literal(text=t) if i % 2 else nodes.Text(t) for i, t in enumerate(text.split("`")) if t]


def plain(text):
    return text.replace("`", "")


def table(header, rows):
    """Table whose last column has one cell for consecutive rows of the same text."""
    node = nodes.table(classes=["colwidths-auto"])
    group = nodes.tgroup(cols=len(header))
    node += group
    widest = [min(60, 2 + max(map(len, column))) for column in zip(header, *rows, strict=True)]
    group += [nodes.colspec(colwidth=width) for width in widest]
    for part, lines in ((nodes.thead(), [header]), (nodes.tbody(), rows)):
        group += part
        last = None
        for line in lines:
            row = nodes.row()
            part += row
            for number, cell in enumerate(line):
                if number == len(line) - 1 and last is not None and cell and last.astext() == plain(cell):
                    last["morerows"] = last.get("morerows", 0) + 1
                    continue
                code = number == 0 and isinstance(part, nodes.tbody)
                entry = nodes.entry("", nodes.paragraph("", "", *inline(f"`{cell}`" if code else cell)))
                row += entry
                last = entry if number == len(line) - 1 else last
    return node


def section(title, anchor, *content):
    node = nodes.section(ids=[anchor], names=[anchor])
    node += nodes.title(text=title)
    node += [item for item in content if item is not None]
    return node


def limits(field):
    """Limits of a knob with its unit, or its choices."""
    of = declared(field)
    if of.choices:
        return ", ".join(of.choices)
    if "tuple" in field.type:
        return ""
    return "yes or no" if field.type == "bool" else f"{of.low:g} … {of.high:g} {of.unit}".rstrip()


class FidelityTable(SphinxDirective):
    """One section per stage, one row per knob, one column per preset."""

    def run(self):
        presets = list(PRESETS.values())
        result = []
        self.env.note_dependency(sys.modules[type(presets[0]).__module__].__file__)
        for stage in dataclasses.fields(presets[0]):
            knobs = [getattr(preset, stage.name) for preset in presets]
            if not dataclasses.is_dataclass(knobs[0]):
                continue
            self.env.note_dependency(sys.modules[type(knobs[0]).__module__].__file__)
            rows = [
                [one.name, *(shown(getattr(k, one.name)) for k in knobs), limits(one), declared(one).meaning]
                for one in dataclasses.fields(knobs[0])
            ]
            header = ["knob", *(preset.name for preset in presets), "limits", "meaning"]
            result.append(section(stage.name.capitalize(), f"fidelity-{stage.name}", table(header, rows)))
        return result


def classes_in(hint):
    """Dataclasses a type hint mentions."""
    if dataclasses.is_dataclass(hint):
        return [hint]
    return [cls for part in typing.get_args(hint) for cls in classes_in(part)]


def type_name(hint):
    if hint is type(None):
        return "none"
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return " or ".join(type_name(part) for part in typing.get_args(hint))
    if typing.get_origin(hint) is typing.Literal:
        return " or ".join(f"“{value}”" for value in typing.get_args(hint))
    if typing.get_origin(hint) is tuple:
        parts = [part for part in typing.get_args(hint) if part is not Ellipsis]
        many = Ellipsis in typing.get_args(hint)
        return f"list of {type_name(parts[0])}" if many else f"({', '.join(map(type_name, parts))})"
    return {"str": "text", "float": "number", "int": "whole number", "bool": "true or false"}.get(
        getattr(hint, "__name__", ""), getattr(hint, "__name__", str(hint))
    )


def default(field):
    if field.default is not dataclasses.MISSING:
        value = field.default
        return "its defaults" if dataclasses.is_dataclass(value) else shown(value)
    return "its defaults" if field.default_factory is not dataclasses.MISSING else "required"


class CaseTables(SphinxDirective):
    """One section per class of a case file, from the outermost inwards."""

    def run(self):
        self.env.note_dependency(case.__file__)
        waiting, seen, result = [case.GearboxCase, case.RadiatorCase], set(), []
        while waiting:
            cls = waiting.pop(0)
            if cls in seen:
                continue
            seen.add(cls)
            hints, text = typing.get_type_hints(cls), meanings(cls)
            fields = [field for field in dataclasses.fields(cls) if field.init and not field.name.startswith("_")]
            waiting += [inner for field in fields for inner in classes_in(hints[field.name])]
            rows = [
                [field.name, type_name(hints[field.name]), default(field), text.get(field.name, "")] for field in fields
            ]
            place = next(home for home in HOMES if getattr(importlib.import_module(home), cls.__name__, None) is cls)
            about = nodes.paragraph("", "", *inline(f"{summary(cls)} Import: `from {place} import {cls.__name__}`"))
            body = table(["field", "type", "default", "meaning (SI)"], rows) if rows else None
            result.append(section(cls.__name__, f"case-{cls.__name__.lower()}", about, body))
        return result


class UnitTable(SphinxDirective):
    def run(self):
        self.env.note_dependency(dimensions.__file__)
        rows = [[f"_{suffix}", unit, f"{factor:.9g}"] for suffix, (unit, factor) in dimensions.UNITS.items()]
        return [table(["suffix", "of fields in", "factor to SI"], rows)]


class DeclaredTables(SphinxDirective):
    """One section per class of declared fields, one row per field."""

    classes, anchor = HAND_OFFS, "handoff"

    def run(self):
        result = []
        for name, cls in sorted(self.classes.items()):
            self.env.note_dependency(sys.modules[cls.__module__].__file__)
            rows = [[q.name, q.kind_name, ", ".join(q.dims), q.unit, q.meaning] for q in cls.declared.values()]
            about = nodes.paragraph(text=cls.__doc__.split("\n\n")[0])
            body = table(["field", "kind", "axes", "unit", "meaning"], rows)
            result.append(section(name, f"{self.anchor}-{name.lower()}", about, body))
        return result


class AccuracyTables(DeclaredTables):
    """The same of the kinds of accuracy."""

    classes, anchor = ACCURACIES, "accuracy"


def setup(app):
    app.add_directive("fidelity-table", FidelityTable)
    app.add_directive("case-tables", CaseTables)
    app.add_directive("unit-table", UnitTable)
    app.add_directive("handoff-tables", DeclaredTables)
    app.add_directive("accuracy-tables", AccuracyTables)
    return {"parallel_read_safe": True}
