"""Writer of REXS (XML, version 1.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from nvhchain.files.atomic_write import write_output

VERSION = "1.4"

Value = tuple[float | int | str | bool | Sequence[float], str]
"""Value of an attribute with its unit."""


@dataclass
class Draft:
    """Components and relations of a file in the making.

    components: type, name and attributes of every component; numbers follow from 1 on.
    relations: type and ends (role, component) of every relation.
    load_case: attributes by component.
    """

    components: list[tuple[str, str, dict[str, Value]]] = field(default_factory=list)
    relations: list[tuple[str, dict[str, int]]] = field(default_factory=list)
    load_case: dict[int, dict[str, Value]] = field(default_factory=dict)

    def add(self, kind: str, name: str, attributes: Mapping[str, Value]) -> int:
        """Add a component and return its number."""
        self.components.append((kind, name, dict(attributes)))
        return len(self.components)

    def relate(self, kind: str, **ends: int) -> None:
        """Add a relation of components by role."""
        self.relations.append((kind, ends))


def write_draft(draft: Draft, path: Path, *, application: str, application_version: str, date: str) -> Path:
    """Write a file, whole or not at all.

    application, application_version, date: program, its version, and the time of writing (ISO 8601).
    """
    root = Element(
        "model",
        version=VERSION,
        applicationId=application,
        applicationVersion=application_version,
        date=date,
    )
    relations, components = SubElement(root, "relations"), SubElement(root, "components")
    for number, (kind, ends) in enumerate(draft.relations, start=1):
        relation = SubElement(relations, "relation", id=str(number), type=kind)
        if kind in ("ordered_assembly", "manufacturing_step"):
            relation.set("order", "1")
        for role, end in ends.items():
            SubElement(relation, "ref", role=role, id=str(end), hint=draft.components[end - 1][0])
    for number, (kind, name, attributes) in enumerate(draft.components, start=1):
        _component(components, number, kind, name, attributes)
    case = SubElement(SubElement(root, "load_spectrum", id="1"), "load_case", id="1")
    for number, attributes in draft.load_case.items():
        kind, name, _ = draft.components[number - 1]
        _component(case, number, kind, name, attributes)
    indent(root)
    return write_output(path, tostring(root, encoding="UTF-8", xml_declaration=True))


def _component(parent: Element, number: int, kind: str, name: str, attributes: Mapping[str, Value]) -> None:
    component = SubElement(parent, "component", id=str(number), type=kind, name=name)
    for key, (value, unit) in attributes.items():
        attribute = SubElement(component, "attribute", id=key, unit=unit)
        if isinstance(value, bool | str):
            attribute.text = str(value).lower() if isinstance(value, bool) else value
        elif isinstance(value, int | float):
            attribute.text = f"{value:.12g}"
        else:
            array = SubElement(attribute, "array")
            for entry in value:
                SubElement(array, "c").text = f"{entry:.12g}"
