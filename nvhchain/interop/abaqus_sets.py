"""What has been read of an Abaqus file, and the labels behind the names of its sets.

Names belong to where they are defined: a part and the assembly may both have a set TOP. Within the part its own is
meant; in the assembly and after it the assembly's, or the part's where the assembly has none; `instance.TOP` is the
part's.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from nvhchain.errors import InputError, require
from nvhchain.interop._model_parts import Parts
from nvhchain.interop.abaqus_keywords import Block
from nvhchain.interop.units import UnitSystem

ASSEMBLY = 10**9
"""Added to the labels of nodes that the assembly defines: they may repeat those of the part."""

HIDDEN = "NVHCHAIN_RIGID_"
"""Starts the names of node sets that stand for rigid sets and are no groups of the model."""

Sets = dict[tuple[str, str], list[int]]
"""(`part` or `assembly`, name in upper case) → labels."""


@dataclass
class AbaqusFile:
    """What has been read so far.  level: `part`, `instance` or `assembly`, where the file has got to.

    part, instance, assembly: their names in upper case, "" before they come.  groups: node sets by their names as
    written first.
    """

    parts: Parts
    system: UnitSystem
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    nsets: Sets = field(default_factory=dict)
    elsets: Sets = field(default_factory=dict)
    surfaces: Sets = field(default_factory=dict)
    groups: dict[tuple[str, str], str] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    sections: list[tuple[str, str]] = field(default_factory=list)
    coupling: Block | None = None
    material: str = ""
    level: str = "part"
    part: str = ""
    instance: str = ""
    assembly: str = ""

    @property
    def owner(self) -> str:
        """To whom what is defined now belongs."""
        return "assembly" if self.level == "assembly" else "part"

    @property
    def offset(self) -> int:
        """Added to labels that are defined now."""
        return ASSEMBLY if self.owner == "assembly" else 0

    def add(self, sets: Sets, name: str, labels: list[int]) -> None:
        """Labels join the set of this name."""
        key = (self.owner, name.upper())
        require(
            self.level != "instance" or key not in sets,
            f"{self.parts.source}: set {name} is defined in the part and in instance {self.instance}: rename one",
        )
        sets.setdefault(key, []).extend(labels)
        if sets is self.nsets:
            self.groups.setdefault(key, name)

    def named(self, sets: Sets, cell: str) -> list[int]:
        """The set that `cell` names from here, with `instance.` before it or without.  Raises InputError."""
        prefix, _, name = cell.strip("\"'").rpartition(".")
        owners = [self._owner_of(prefix, cell)] if prefix else ["assembly", "part"][self.owner == "part" :]
        for owner in owners:
            if (owner, name.upper()) in sets:
                return sets[owner, name.upper()]
        raise InputError(f"{self.parts.source}: set {cell!r} is not defined")

    def labels(self, cell: str, sets: Sets, *, own: bool = False) -> list[int]:
        """Labels behind one cell: a number, the name of a set, or either with `instance.` before it.

        own: a number is that of a node defined at this level; else of whoever has such a node, or is an element.
        """
        prefix, _, name = cell.strip("\"'").rpartition(".")
        if not name.isdigit():
            return self.named(sets, cell)
        number = int(name)
        if prefix:
            return [number + (ASSEMBLY if self._owner_of(prefix, cell) == "assembly" else 0)]
        if own:
            return [number + self.offset]
        if sets is self.elsets or number + ASSEMBLY not in self.parts.nodes or self.owner == "part":
            return [number]
        require(
            number not in self.parts.nodes,
            f"{self.parts.source}: node {number} is in the assembly and in instance {self.instance}: write "
            f"{self.instance}.{number}, or name a set",
        )
        return [number + ASSEMBLY]

    def _owner_of(self, prefix: str, cell: str) -> str:
        last = prefix.upper().rpartition(".")[2]
        if last and last == self.instance:
            return "part"
        if last and last == self.assembly:
            return "assembly"
        raise InputError(
            f"{self.parts.source}: {cell!r} is in {prefix!r}, which is not read; there "
            f"{f'is instance {self.instance}' if self.instance else 'are no instances: leave it out'}"
        )

    def group_names(self) -> dict[str, list[int]]:
        """Node sets as groups; where the assembly has one of the same name the part's is called `instance.name`."""
        named = {}
        for (owner, key), name in self.groups.items():
            if key.startswith(HIDDEN):
                continue
            twice = owner == "part" and ("assembly", key) in self.groups
            named[f"{self.instance}.{name}" if twice else name] = self.nsets[owner, key]
        return named


def members_of(file: AbaqusFile, block: Block, sets: Sets) -> list[int]:
    """Labels of a set: numbers, names of sets, `GENERATE`d ranges, `instance.number`, of INSTANCE or of this level."""
    inside = block.get("INSTANCE")
    prefix = f"{inside}." if inside else ""
    own = sets is file.nsets
    if "GENERATE" in block.parameters:
        ranges = [[int(c) for c in row if c] for row in block.data]
        steps = [n for r in ranges for n in range(r[0], r[1] + 1, r[2] if len(r) > 2 else 1)]
        offset = 0 if inside or not own else file.offset
        return [offset + n for n in steps]
    return [n for row in block.data for cell in row if cell for n in file.labels(prefix + cell, sets, own=own)]
