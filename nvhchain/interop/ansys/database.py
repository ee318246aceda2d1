"""Tables of an archive by number: nodes, element types, constants, materials, sections, elements, components."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import FileFormatError, InputError, require
from nvhchain.handoff import FloatArray
from nvhchain.interop.ansys.archive import Command
from nvhchain.interop.notation.units import UnitSystem
from nvhchain.interop.solids._model_parts import Parts

_HEAD = 11
"""Numbers before the nodes in a line of EBLOCK."""


@dataclass(frozen=True)
class Element:
    """Element with the numbers of its tables; nodes that repeat and zeros are kept."""

    label: int
    kind: int
    material: int
    constants: int
    section: int
    nodes: tuple[int, ...]


@dataclass
class Section:
    """Section: SHELL, BEAM or LINK, its subtype, offset and rows of data."""

    kind: str
    subtype: str
    offset: list[str] = field(default_factory=lambda: ["MID"])
    data: list[list[str]] = field(default_factory=list)


@dataclass
class Database:
    """Tables of an archive.

    parts: contents of the model as read so far.
    system: units of the file.
    types: number → type of the element and its key options.
    constants: number → real constants.
    constants_of: number → property label → value, of materials.
    sections: number → section.
    elements: all elements.
    axes: node → its own axes (3, 3) as columns.
    """

    parts: Parts
    system: UnitSystem
    types: dict[int, tuple[int, dict[int, int]]] = field(default_factory=dict)
    constants: dict[int, list[float]] = field(default_factory=dict)
    properties: dict[int, dict[str, float]] = field(default_factory=dict)
    sections: dict[int, Section] = field(default_factory=dict)
    elements: list[Element] = field(default_factory=list)
    axes: dict[int, FloatArray] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """Path of the file."""
        return self.parts.source

    def key(self, element: Element, option: int) -> int:
        """Return a key option of the element's type."""
        return self.types[element.kind][1].get(option, 0)

    def elements_by_type(self, numbers: Iterable[int]) -> list[Element]:
        """Return all elements of the types, in the order of the file."""
        wanted = {kind for kind, (number, _) in self.types.items() if number in set(numbers)}
        return [element for element in self.elements if element.kind in wanted]

    def material(self, number: int, subject: str) -> Material:
        """Return a material; InputError where it lacks a constant or is not isotropic."""
        found, where = self.properties.get(number, {}), f"{self.source}: material {number} of {subject}"
        poisson = found.get("PRXY", found.get("NUXY"))
        if "EX" not in found or poisson is None or "DENS" not in found:
            raise InputError(f"{where} must state EX, PRXY or NUXY, and DENS; it has {', '.join(found) or 'none'}")
        others = {found[label] for label in ("EY", "EZ") if label in found}
        require(others <= {found["EX"]}, f"{where} is orthotropic (EX, EY, EZ): only isotropic ones are read")
        return self.system.material(found["EX"], poisson, found["DENS"], where)

    def place(self, node: int) -> FloatArray:
        """Return the place (3,) of a node in units of the file."""
        if node not in self.parts.nodes:
            raise FileFormatError(f"{self.source}: node {node} is not defined")
        return np.array(self.parts.nodes[node])


def read_tables(base: Database, found: list[Command]) -> None:
    """Read all tables; ValueError, IndexError and KeyError for damaged ones."""
    for command in found:
        reader = _READERS.get(command.name)
        if reader is not None:
            reader(base, command)
    twice = [label for label, count in Counter(one.label for one in base.elements).items() if count > 1]
    require(not twice, f"{base.source}: element {(twice or [0])[0]} is defined twice")


def _number(cells: list[str], place: int) -> float:
    return float(cells[place]) if place < len(cells) and cells[place] else 0.0


def _nodes(base: Database, command: Command) -> None:
    before, solid = len(base.parts.nodes), command.get(1).upper() == "SOLID"
    first = 3 if solid or not command.widths else command.widths[0][0]
    for cells in command.cells():
        if cells[0] == "-1":
            break
        label = int(cells[0])
        if label in base.parts.nodes:
            raise FileFormatError(f"{base.source}: node {label} is defined twice")
        x, y, z = (_number(cells, first + i) for i in range(3))
        base.parts.nodes[label] = (x, y, z)
        turned = [_number(cells, first + 3 + i) for i in range(3)]
        if any(turned):
            base.axes[label] = rotated_axes(*turned)
    _check_count(base, command, len(base.parts.nodes) - before, "nodes")


def rotated_axes(xy: float, yz: float, zx: float) -> FloatArray:
    """Return axes (3, 3), as columns, turned by degrees about z, then about the new x, then about the new y."""
    a, b, c = np.radians([xy, yz, zx])
    z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    y = np.array([[np.cos(c), 0, np.sin(c)], [0, 1, 0], [-np.sin(c), 0, np.cos(c)]])
    return np.asarray(z @ x @ y)


def _elements(base: Database, command: Command) -> None:
    require(
        command.get(0) == "19" and command.get(1).upper() == "SOLID",
        f"{base.source}: line {command.line}: EBLOCK, {command.get(0)} without SOLID is of an input for the solver: "
        "write an archive by CDWRITE, DB",
    )
    rows = iter([int(cell or 0) for cell in cells] for cells in command.cells())
    count = 0
    for row in rows:
        if row[0] == -1:
            break
        head, nodes = row[:_HEAD], row[_HEAD:]
        require(len(head) == _HEAD, f"{base.source}: element {count + 1} of EBLOCK ends after {len(row)} numbers")
        while len(nodes) < min(head[8], 40):
            more = next(rows, None)
            if more is None:
                raise FileFormatError(f"{base.source}: element {head[10]} ends after {len(nodes)} nodes of {head[8]}")
            nodes += more
        base.elements.append(Element(head[10], head[1], head[0], head[2], head[3], tuple(nodes[: head[8]])))
        count += 1
    _check_count(base, command, count, "elements")


def _check_count(base: Database, command: Command, count: int, subject: str) -> None:
    """Raise FileFormatError where a block holds fewer items than it declares."""
    declared = [int(one) for one in command.fields[-2:] if one.isdigit()]
    if len(declared) == 2 and count < min(declared):
        raise FileFormatError(
            f"{base.source}: line {command.line}: {command.name} declares {min(declared)} {subject} and holds {count}: "
            "the file is cut off, write it again"
        )


def _type(base: Database, command: Command) -> None:
    digits = "".join(filter(str.isdigit, command.get(1)))
    keys = {place - 1: int(float(command.get(place))) for place in range(2, 8) if command.get(place)}
    base.types[int(command.get(0))] = int(digits), keys


def _types(base: Database, command: Command) -> None:
    """Read lines of number, element and key options."""
    for cells in command.cells():
        if cells[0] == "-1":
            break
        number, kind, *keys = (int(cell or 0) for cell in cells)
        base.types[number] = kind, {place: key for place, key in enumerate(keys, start=1) if key}


def _key(base: Database, command: Command) -> None:
    number = int(command.get(0))
    require(number in base.types, f"{base.source}: line {command.line}: key option of element type {number}, no ET")
    base.types[number][1][int(command.get(1))] = int(float(command.get(2, "0")))


def _constants(base: Database, command: Command) -> None:
    cells = [_number(command.fields, place) for place in range(len(command.fields))]
    if command.name == "RMORE":
        require(bool(base.constants), f"{base.source}: line {command.line}: RMORE without R")
        base.constants[list(base.constants)[-1]] += cells
    else:
        base.constants[int(cells[0])] = cells[1:]


def _constant_block(base: Database, command: Command) -> None:
    own: list[float] = []
    left = 0
    for row in command.rows:
        widths = (8, 8, *[16] * 6) if left <= 0 else (16,) * 7
        ends = np.cumsum((0, *widths))
        cells = [row[a:b].strip() for a, b in pairwise(ends)]
        if left <= 0:
            own = base.constants[int(cells[0])] = []
            left, cells = int(cells[1]), cells[2:]
        values = [float(cell or 0) for cell in cells[: max(left, 0)]]
        own += values
        left -= len(values)


def _property(base: Database, command: Command) -> None:
    """Read `MP, label, material, value` or `MPDATA, length, label, material, start, values`."""
    fields = command.fields
    if command.name == "MPDATA" and fields[0].isdigit():
        label, material, values = fields[1], fields[2], fields[4:]
    elif command.name == "MPDATA":
        label, material, values = fields[0], fields[1], fields[3:]
    else:
        label, material, values = fields[0], fields[1], fields[2:3]
    numbers = {float(one) for one in values if one}
    require(
        len(numbers) <= 1,
        f"{base.source}: line {command.line}: {label} of material {material} depends on temperature: "
        "write the value at the temperature wanted",
    )
    if numbers:
        base.properties.setdefault(int(material), {})[label.upper()] = numbers.pop()


def _section(base: Database, command: Command) -> None:
    base.sections[int(command.get(0))] = Section(command.get(1).upper()[:4], command.get(2).upper())


def _section_data(base: Database, command: Command) -> None:
    require(bool(base.sections), f"{base.source}: line {command.line}: {command.name} without SECTYPE")
    own = base.sections[list(base.sections)[-1]]
    if command.name == "SECOFFSET":
        own.offset = [one.upper() for one in command.fields]
    else:
        own.data += list(command.cells()) if command.name == "SECBLOCK" else [command.fields]


def _component(base: Database, command: Command) -> None:
    if command.get(1).upper() != "NODE":
        return
    labels: list[int] = []
    for cells in command.cells():
        for cell in filter(None, cells):
            number = int(cell)
            if number < 0:  # end of a range
                require(bool(labels), f"{base.source}: component {command.get(0)} begins with the end of a range")
                labels += [n for n in range(labels[-1] + 1, -number + 1) if n in base.parts.nodes] if (
                    -number - labels[-1] <= len(base.parts.nodes)
                ) else sorted(n for n in base.parts.nodes if labels[-1] < n <= -number)  # fmt: skip
            else:
                labels.append(number)
    if labels:
        base.parts.groups[command.get(0)] = labels


_READERS = {
    "NBLOCK": _nodes,
    "EBLOCK": _elements,
    "ET": _type,
    "ETBLOCK": _types,
    "KEYOP": _key,
    "KEYOPT": _key,
    "R": _constants,
    "RMORE": _constants,
    "RLBLOCK": _constant_block,
    "MP": _property,
    "MPDATA": _property,
    "SECTYPE": _section,
    "SECOFFSET": _section_data,
    "SECDATA": _section_data,
    "SECBLOCK": _section_data,
    "CMBLOCK": _component,
}
TABLES = frozenset(_READERS)
"""Commands that are read here."""
