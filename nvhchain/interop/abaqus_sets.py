"""What has been read of an Abaqus file, and the labels behind the names of its sets."""

from __future__ import annotations

from dataclasses import dataclass, field

from nvhchain.errors import InputError
from nvhchain.interop._model_parts import Parts
from nvhchain.interop.abaqus_keywords import Block
from nvhchain.interop.units import UnitSystem

ASSEMBLY = 10**9
"""Added to the labels of nodes that the assembly defines: they may repeat those of the part."""


@dataclass
class AbaqusFile:
    """What has been read so far; set names in upper case."""

    parts: Parts
    system: UnitSystem
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    nsets: dict[str, list[int]] = field(default_factory=dict)
    elsets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[int]] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    sections: list[tuple[str, str]] = field(default_factory=list)
    coupling: Block | None = None
    material: str = ""
    depth: str = ""
    instances: int = 0


def extend(sets: dict[str, list[int]], name: str, labels: list[int]) -> None:
    sets.setdefault(name.upper(), []).extend(labels)


def members_of(block: Block, sets: dict[str, list[int]], offset: int) -> list[int]:
    """Labels of a set: numbers, names of sets, `GENERATE`d ranges, `instance.number`."""
    if "GENERATE" in block.parameters:
        ranges = [[int(c) for c in row if c] for row in block.data]
        return [offset + n for r in ranges for n in range(r[0], r[1] + 1, r[2] if len(r) > 2 else 1)]
    return [n for row in block.data for cell in row if cell for n in labels_of(cell, sets, offset)]


def labels_of(cell: str, sets: dict[str, list[int]], offset: int) -> list[int]:
    """Labels behind one cell: a number, the name of a set, or either with `instance.` before it."""
    prefix, dot, name = cell.strip("\"'").rpartition(".")
    if dot and prefix:
        offset = 0
    if name.isdigit():
        return [int(name) + offset]
    key = name.upper()
    if key not in sets:
        raise InputError(f"set {cell!r} is not defined")
    return sets[key]
