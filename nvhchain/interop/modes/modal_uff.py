"""Normal modes in the universal file format: nodes 15, 2411, elements 2412, shapes 55, 2414, units 164, groups 2467.

The blocks are read here and not by pyuff. It accepts no element of more than eight nodes and splits a 2414 only at
blanks, but numbers may stand without blanks between them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError, InputError, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.interop.modes.assembled import Geometry, Mode, modal_model
from nvhchain.interop.modes.uff_frames import axes_of, frames_of
from nvhchain.interop.modes.uff_skin import select_rows
from nvhchain.interop.notation._texts import damaged
from nvhchain.interop.notation.units import UnitSystem, unit_system

_NUMBER = re.compile(r"[+-]?(?:\d+\.\d*[+-]\d{3}(?![\d.])|(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?)")
_BARE_EXPONENT = re.compile(r"(?<=[\d.])(?=[+-]\d{3}$)")
"""Position of the missing E: Fortran writes 1.0-101 for an exponent of three digits."""

_GROUPS = {2435, 2452, 2467, 2477}
"""Datasets of groups of one layout: eight numbers and a name, then type, label and two more numbers of every member."""

NODE, _ELEMENT = 7, 8
"""Types of members of a group."""

_BEAMS = {11, 21, 22, 23, 24}
"""Descriptors with a record of orientation before the nodes."""

NORMAL_MODE, DISPLACEMENT = 2, 8


def read_modal_uff(path: str | Path, *, units: str | None = None, mass_normalized: bool = False) -> ModalModel:
    """Read real normal modes of a universal file, with the skin of its elements.

    units: units of the file, a key of `UNIT_SYSTEMS`; by default those of its dataset 164, or SI without one.
    Returns modes in SI units.

    Parabolic elements keep mid-edge nodes that have displacements. Their four-cornered faces get a node in the middle.
    Nodes without displacements stand still. Other results of a mode are ignored; complex modes are refused.
    """
    path = Path(path)
    asked = None if units is None else unit_system(units)
    nodes: dict[int, list[float]] = {}
    elements: dict[int, tuple[int, list[int]]] = {}
    groups: dict[str, tuple[list[int], list[int]]] = {}
    modes: list[Mode] = []
    others: set[int] = set()
    systems: dict[int, int] = {}
    frames: dict[int, FloatArray | None] = {}
    stated: UnitSystem | None = None
    with damaged(path, lambda error: f"not a universal file: {error}"):
        for kind, lines in _blocks(path):
            if kind == 164:
                length, force = (1.0 / value for value in _floats(" ".join(lines[1:3]))[:2])
                stated = UnitSystem("dataset 164", length, force / length, 1.0)  # its time is the second
            elif kind in (15, 2411):
                nodes.update(_nodes(kind, lines, systems))
            elif kind in (18, 2420):
                frames.update(frames_of(kind, [line.split() for line in lines]))
            elif kind == 2412:
                for label, element in _elements(lines):
                    if elements.setdefault(label, element) != element:
                        raise FileFormatError(f"{path}: element {label} is defined twice")
            elif kind in _GROUPS:
                groups.update(_groups(lines))
            elif kind in (55, 2414):
                modes += _mode(kind, lines, others)
    require(bool(nodes), f"{path}: no nodes (dataset 15 or 2411)")
    require(
        bool(modes),
        f"{path}: no displacements of normal modes (dataset 55 or 2414 with analysis type 2 and result type 8), "
        f"{f'only of result type {sorted(others)}' if others else 'nor other results of them'}: export displacements",
    )
    turned = {label: axes_of(system, label, frames, str(path)) for label, system in systems.items()}
    labels = np.array(sorted(nodes), dtype=np.int64)
    geometry = Geometry(nodes, list(elements.values()), turned, f"{path}: dataset 2412")
    units_of_file = _agreed(stated, asked, path)
    model = modal_model(modes, geometry, units_of_file, str(path), mass_normalized=mass_normalized)
    members = {name: _members(group, elements, labels, f"{path}: group {name}") for name, group in groups.items()}
    return replace(model, groups=members)


def _agreed(stated: UnitSystem | None, requested: UnitSystem | None, path: Path) -> UnitSystem:
    """Return the file's units, else the requested ones, else SI; file and request must agree."""
    if stated is None:
        return requested or unit_system("m-kg-s")
    if requested is not None:
        same = np.allclose([stated.length, stated.mass], [requested.length, requested.mass], rtol=1e-6)
        require(
            bool(same) and requested.time == 1.0,
            f"{path}: dataset 164 states units of {stated.length:g} m and {stated.mass:g} kg, not those of "
            f"{requested.name}: leave units out",
        )
    return stated


def _blocks(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield dataset number and lines of every block, one at a time: a file of many modes is larger than its modes."""
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            block: list[str] | None = None
            for number, line in enumerate(file, start=1):
                if line[:6].strip() != "-1" or line.strip() != "-1":
                    if block is not None:
                        block.append(line)
                elif block is None:
                    block, first = [], number
                else:
                    kind = "".join(block[:1]).split()
                    if kind and kind[0].isdigit():
                        yield int(kind[0]), block[1:]
                    block = None
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    if block is not None:
        raise FileFormatError(
            f"{path}: the block that begins in line {first} (dataset {''.join(block[:1]).strip() or 'not named'}) does "
            "not end: the file is cut off, export it again"
        )


def _floats(text: str) -> list[float]:
    try:
        return list(map(float, text.split()))
    except ValueError:  # numbers without blanks between them, exponents of Fortran
        return list(map(_float, _NUMBER.findall(text)))


def _float(token: str) -> float:
    return float(_BARE_EXPONENT.sub("E", token.upper().replace("D", "E")))


def _integer(text: str) -> int:
    """Return an integer of at most 63 bits, as arrays of labels hold it."""
    number = int(text)
    if abs(number) >= 2**63:
        raise ValueError(f"label {number} has more than 63 bits")
    return number


def _nodes(kind: int, lines: list[str], systems: dict[int, int]) -> Iterator[tuple[int, list[float]]]:
    """Yield label and place; numbers of systems in which nodes move go into `systems`."""
    step = 1 if kind == 15 else 2
    for i in range(0, len(lines) - step + 1, step):
        head = lines[i].split()
        place = [_float(x) for x in (head[4:7] if step == 1 else _NUMBER.findall(lines[i + 1]))]
        if len(place) != 3:
            raise ValueError(f"node {head[0]} has {len(place)} coordinates, 3 are needed")
        if int(head[2]) > 1:  # 0 and 1 are the part's own rectangular system
            systems[_integer(head[0])] = int(head[2])
        yield _integer(head[0]), place


def _elements(lines: list[str]) -> Iterator[tuple[int, tuple[int, list[int]]]]:
    """Yield label, descriptor and nodes."""
    i = 0
    while i < len(lines):
        head = [_integer(x) for x in lines[i].split()]
        descriptor, count = head[1], head[5]
        i += 2 if descriptor in _BEAMS else 1
        members: list[int] = []
        while len(members) < count:
            members += [_integer(x) for x in lines[i].split()]
            i += 1
        yield head[0], (descriptor, members)


def _groups(lines: list[str]) -> Iterator[tuple[str, tuple[list[int], list[int]]]]:
    """Yield name, labels of nodes and of elements of every group that has any."""
    i = 0
    while i < len(lines):
        count, name = int(lines[i].split()[-1]), lines[i + 1].strip()
        end = i + 2 + (count + 1) // 2
        cells = [_integer(x) for line in lines[i + 2 : end] for x in line.split()]
        nodes, elements = (
            [label for t, label in zip(cells[::4], cells[1::4], strict=True) if t == kind] for kind in (NODE, _ELEMENT)
        )
        if nodes or elements:
            yield name, (nodes, elements)
        i = end


def _members(
    found: tuple[list[int], list[int]], elements: Mapping[int, tuple[int, list[int]]], labels: IntArray, subject: str
) -> IntArray:
    """Return rows of the nodes of a group and of its elements."""
    nodes, element_labels = found
    missing = [label for label in element_labels if label not in elements]
    if missing:
        raise FileFormatError(f"{subject}: element {missing[0]} is not defined")
    return np.unique(
        select_rows(labels, [*nodes, *(n for label in element_labels for n in elements[label][1])], subject)
    )


def _mode(kind: int, lines: list[str], others: set[int]) -> Iterator[Mode]:
    """Yield the mode of one block, if it holds a real normal mode.

    others : receives the result type of a block with other results of a mode, such as reaction forces.
    """
    first = 5 if kind == 55 else 8
    head = [int(x) for x in lines[first].split()]
    analysis, characteristic, result, data_type, count = head[1:6]
    if kind == 2414 and int(lines[2]) != 1:
        return  # not at nodes
    if analysis in (3, 7):
        raise InputError("complex modes are not read: export real normal modes")
    if analysis != NORMAL_MODE or characteristic not in (2, 3):
        return
    if result != DISPLACEMENT:
        others.add(result)
        return
    require(data_type in (2, 4), f"mode shapes of data type {data_type} are complex or whole numbers: export real ones")
    if kind == 55:
        reals, body = _floats(lines[first + 2]), lines[first + 3 :]
        frequency, mass, viscous, hysteretic = (*reals, 0.0, 0.0, 0.0)[:4]
    else:
        reals, body = _floats(lines[first + 3]), lines[first + 5 :]
        _, frequency, _, mass, viscous, hysteretic = (*reals, *[0.0] * 6)[:6]
    step = 1 + _lines_of(body[1:], count)
    labels = np.array([_integer(line.split()[0]) for line in body[::step]], dtype=np.int64)
    numbers = _floats("".join(line for i, line in enumerate(body) if i % step))
    if len(numbers) != count * len(labels):
        raise ValueError(f"{len(numbers)} displacements of {len(labels)} nodes, {count} of each are needed")
    motion = np.array(numbers, dtype=float).reshape(-1, count)[:, :3].copy()  # rotations are not kept
    # a loss factor η of a mode damps it as η/2 of critical
    yield Mode(frequency, mass, viscous + hysteretic / 2, labels, motion)


def _lines_of(body: list[str], count: int) -> int:
    """Return the number of lines of the first `count` numbers: six per line are usual, fewer in wider fields."""
    found = 0
    for index, line in enumerate(body):
        found += len(_floats(line))
        if found >= count:
            return index + 1
    return len(body)
