"""Contents of a REXS file as it stands: components with attributes, relations, load cases."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from nvhchain.errors import FileFormatError, require

MOST_COMPONENTS = 100_000
"""Largest number of components or relations of a file."""


@dataclass(frozen=True)
class Attribute:
    """Value of a component.

    value: text, number, flag, or lists of them.
    unit: unit in the file; empty where it has none.
    """

    value: Any
    unit: str = ""


@dataclass(frozen=True)
class Component:
    """Part of a gear unit.

    id: number, unique in the file.
    type: kind of component, by its name in REXS 2.0.
    name: name in the file.
    attributes: attributes by their name in REXS 2.0.
    """

    id: int
    type: str
    name: str
    attributes: dict[str, Attribute] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Words for messages: type, number and name."""
        return f"{self.type} {self.id}" + (f" ({self.name})" if self.name else "")


@dataclass(frozen=True)
class Relation:
    """Relation of components.

    id: number.
    type: kind, such as "assembly".
    order: position among ordered relations.
    refs: role and component of every end.
    """

    id: int
    type: str
    order: int
    refs: tuple[tuple[str, int], ...]

    def end(self, role: str) -> int | None:
        """Return the component in a role, or None."""
        return next((component for own_role, component in self.refs if own_role == role), None)


@dataclass(frozen=True)
class LoadCase:
    """Load case: components with the attributes that hold in it.

    name: number, after that of its spectrum where the file has several.
    components: attributes by component.
    """

    name: str
    components: dict[int, dict[str, Attribute]]


@dataclass(frozen=True)
class Document:
    """Contents of a file.

    version: version of REXS.
    application: program that wrote the file.
    components: components by number.
    relations: relations, by order.
    """

    version: str
    application: str
    components: dict[int, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[LoadCase, ...]

    def related(self, kind: str, role: str, component: int) -> list[Relation]:
        """Return the relations of a kind in which a component has a role."""
        return [relation for relation in self.relations if relation.type == kind and (role, component) in relation.refs]

    def parts(self, component: int, *types: str) -> list[Component]:
        """Return the parts of an assembly, or what a component references, of the given types, by order."""
        found = []
        for relation in self.relations:
            if relation.end("assembly") == component and relation.type in ("assembly", "ordered_assembly"):
                ends = [other for role, other in relation.refs if role == "part"]
            elif relation.end("origin") == component and relation.type == "reference":
                ends = [other for role, other in relation.refs if role == "referenced"]
            else:
                continue
            found += [self.components[end] for end in ends if self.components[end].type in types]
        return found

    def owner(self, component: int, *types: str) -> Component | None:
        """Return the assembly of one of the given types that a component is part of, or None."""
        for relation in self.relations:
            if relation.type in ("assembly", "ordered_assembly") and ("part", component) in relation.refs:
                end = relation.end("assembly")
                if end is not None and self.components[end].type in types:
                    return self.components[end]
        return None

    def typed(self, *types: str) -> list[Component]:
        """Return the components of the given types, by number."""
        return [self.components[key] for key in sorted(self.components) if self.components[key].type in types]


def check_size(count: int, what: str, path: str) -> None:
    """Refuse (InputError) an absurd number of entries."""
    require(
        count <= MOST_COMPONENTS,
        f"{path}: {count} {what}, of {MOST_COMPONENTS} at most: cut the file to one gear unit",
    )


def whole(text: Any, what: str, path: str) -> int:
    """Return an identifier as a whole number."""
    try:
        return int(str(text).strip())
    except ValueError:
        raise FileFormatError(f"{path}: {what} = {text!r} is no whole number: export the file anew") from None
