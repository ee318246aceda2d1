"""Contents of an Abaqus file as read so far, and the labels behind the names of its sets.

Names and labels belong to the place of their definition: an instance, with all definitions of its part, or the
assembly. Both may have a set TOP. Within the part, TOP is the part's own set. In the assembly and after it, TOP is the
assembly's set, or that of the only instance with such a set. `instance.TOP` is the instance's set.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray
from nvhchain.interop.notation.units import UnitSystem
from nvhchain.interop.solids._model_parts import Parts
from nvhchain.interop.solids._structure_parts import face_shares
from nvhchain.interop.solids.abaqus_keywords import Block, real

ASSEMBLY = "assembly"
"""Owner of the definitions of the assembly; names of instances are in upper case."""

_APART = 10**9
"""Distance between the labels of two owners, which may both have a node 1."""

HIDDEN = "NVHCHAIN_RIGID_"
"""Prefix of node sets that stand for rigid sets and are no groups of the model."""

Sets = dict[tuple[str, str], list[int]]
"""(owner, name in upper case) → labels. The owner is an instance in upper case, `ASSEMBLY`, or "" in a flat file."""

Motion = Callable[[FloatArray], FloatArray]
"""Function from points (n, 3) of a part to their places in the assembly."""


@dataclass
class AbaqusFile:
    """Contents of a file as read so far.

    groups: node sets by their names as first written.
    sections: owner, element set, material, area of trusses.
    closed: names defined by the part of the instance, by their kind.
    contents: keyword blocks of every part.
    offsets: owner → offset of its labels.
    motions: instance → its motion.
    late: level and instance of blocks that wait for all others.
    laws: owner and block of sections of shells, beams, masses and springs.
    faces: owner and name of a surface → nodes of its faces, corners first.
    transforms: node → axes (3, 3) of its motions, as columns.
    orientations: name → axes (3, 3).
    behaviors: name → stiffness of connectors by component 0 … 5; `behavior` is the current one.
    level: `part`, `instance` or `assembly`, the current place in the file.
    part: current part, in upper case.
    instance: last instance.
    """

    parts: Parts
    system: UnitSystem
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    nsets: Sets = field(default_factory=dict)
    elsets: Sets = field(default_factory=dict)
    surfaces: Sets = field(default_factory=dict)
    groups: dict[tuple[str, str], str] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    sections: list[tuple[str, str, str, float]] = field(default_factory=list)
    closed: dict[int, frozenset[tuple[str, str]]] = field(default_factory=dict)
    contents: dict[str, list[Block]] = field(default_factory=dict)
    offsets: dict[str, int] = field(default_factory=lambda: {"": 0, ASSEMBLY: _APART})
    motions: dict[str, Motion] = field(default_factory=dict)
    late: list[tuple[str, str, Block]] = field(default_factory=list)
    laws: list[tuple[str, Block]] = field(default_factory=list)
    faces: dict[tuple[str, str], list[tuple[int, ...]]] = field(default_factory=dict)
    transforms: dict[int, FloatArray] = field(default_factory=dict)
    orientations: dict[str, FloatArray] = field(default_factory=dict)
    behaviors: dict[str, dict[int, float]] = field(default_factory=dict)
    behavior: str = ""
    coupling: Block | None = None
    material: str = ""
    level: str = "part"
    part: str = ""
    instance: str = ""
    assembly: str = ""
    reading: str = "its first line"

    @property
    def owner(self) -> str:
        """Owner of the current definitions."""
        return ASSEMBLY if self.level == "assembly" else self.instance

    @property
    def offset(self) -> int:
        """Offset of the labels of current definitions."""
        return self.offsets[self.owner]

    def begin(self, instance: str, motion: Motion | None) -> None:
        """Let the following definitions belong to `instance`; labels of the first one stay unchanged."""
        self.offsets.pop("", None)
        before = len(self.offsets) - 1
        self.offsets[instance] = (before + 1) * _APART if before else 0
        if motion is not None:
            self.motions[instance] = motion
        self.level, self.instance = "part", instance

    def end_part(self) -> None:
        """Let the following definitions belong to the instance alone."""
        self.level = "instance"
        self.closed = {id(sets): frozenset(sets) for sets in (self.nsets, self.elsets, self.surfaces)}

    def add(self, sets: Sets, name: str, labels: list[int]) -> None:
        """Add labels to the set of this name."""
        key = (self.owner, name.upper())
        require(
            self.level != "instance" or key not in self.closed[id(sets)],
            f"{self.parts.source}: set {name} is defined in the part and in instance {self.instance}: rename one",
        )
        sets.setdefault(key, []).extend(labels)
        if sets is self.nsets:
            self.groups.setdefault(key, name)

    def named(self, sets: Sets, cell: str) -> list[int]:
        """Return the set that `cell` names here, with or without prefix `instance.`; InputError if there is none."""
        prefix, _, name = cell.strip("\"'").rpartition(".")
        own = self.owner_of(prefix, cell) if prefix else self.owner
        if (own, name.upper()) in sets:
            return sets[own, name.upper()]
        found = [] if prefix or own != ASSEMBLY else [one for one in self.offsets if (one, name.upper()) in sets]
        require(len(found) > 0, f"{self.parts.source}: set {cell!r} is not defined")
        require(
            len(found) == 1,
            f"{self.parts.source}: set {cell!r} is in instances {', '.join(found)}: write {found[0]}.{name}",
        )
        return sets[found[0], name.upper()]

    def labels(self, cell: str, sets: Sets, *, own: bool = False) -> list[int]:
        """Return labels behind one cell: a number, the name of a set, or either with the prefix `instance.`.

        own : True if a number is that of a node defined at this level; else it belongs to the owner of such a node or
            element.
        """
        prefix, _, name = cell.strip("\"'").rpartition(".")
        if not name.isdigit():
            return self.named(sets, cell)
        number = int(name)
        if prefix:
            return [number + self.offsets[self.owner_of(prefix, cell)]]
        if own or self.owner != ASSEMBLY:
            return [number + self.offset]
        what, known = ("element", self.elements) if sets is self.elsets else ("node", self.parts.nodes)
        holders = [one for one, offset in self.offsets.items() if number + offset in known] or [self.instance]
        instances = [one for one in holders if one != ASSEMBLY]
        places = ["the assembly"] * (ASSEMBLY in holders) + [f"instance {one}" for one in instances]
        require(
            len(holders) == 1,
            f"{self.parts.source}: {what} {number} is in {' and in '.join(places)}: write {instances[0]}.{number}, or "
            "name a set",
        )
        return [number + self.offsets[holders[0]]]

    def owner_of(self, prefix: str, cell: str) -> str:
        """Return the owner of a `cell` that begins with `prefix.`; raises InputError."""
        last = prefix.upper().rpartition(".")[2]
        if last and last in self.offsets:
            return last
        if last and last == self.assembly:
            return ASSEMBLY
        known = ", ".join(one for one in self.offsets if one not in ("", ASSEMBLY))
        raise InputError(
            f"{self.parts.source}: {cell!r} is in {prefix!r}, which is not read; there "
            f"{f'is instance {known}' if known else 'are no instances: leave it out'}"
        )

    def surface_nodes(self, cell: str) -> list[int]:
        """Return the nodes of a surface; CalculiX and old Abaqus take a node set, too."""
        try:
            return self.named(self.surfaces, cell)
        except InputError:
            return self.named(self.nsets, cell)

    def faces_of(self, cell: str) -> list[tuple[int, ...]]:
        """Return the faces of the surface that `cell` names; none for a surface of nodes."""
        nodes = self.named(self.surfaces, cell)
        return next((self.faces.get(key, []) for key, found in self.surfaces.items() if found is nodes), [])

    def face_areas(self, cell: str) -> dict[int, float]:
        """Return the share of the area of each node of a surface of faces; empty for a set of nodes."""
        try:
            faces = self.faces_of(cell)
        except InputError:
            return {}
        return face_shares(faces, self.parts.nodes)

    def group_names(self) -> dict[str, list[int]]:
        """Return node sets as groups; those of instances are called `instance.name` if another has the same name."""
        named = {}
        for (owner, key), name in self.groups.items():
            if key.startswith(HIDDEN):
                continue
            twice = owner != ASSEMBLY and sum((one, key) in self.groups for one in self.offsets) > 1
            named[f"{owner}.{name}" if twice else name] = self.nsets[owner, key]
        return named


MOST_NUMBERS = 20_000_000
"""Largest number of members of a set."""


def members_of(file: AbaqusFile, block: Block, sets: Sets) -> list[int]:
    """Return labels of a set: numbers, names, `GENERATE`d ranges, `instance.number`, of INSTANCE or of this level."""
    inside = block.get("INSTANCE")
    prefix = f"{inside}." if inside else ""
    cells = [cell for row in block.data for cell in row if cell]
    if "GENERATE" in block.parameters:
        ranges = [[int(c) for c in row if c] for row in block.data]
        spans = [range(r[0], r[1] + 1, r[2] if len(r) > 2 else 1) for r in ranges]
        require(
            sum(map(len, spans)) <= MOST_NUMBERS,
            f"{file.parts.source}: GENERATE makes {sum(map(len, spans))} numbers, more than {MOST_NUMBERS}: correct it",
        )
        cells = [str(n) for span in spans for n in span]
    return [n for cell in cells for n in file.labels(prefix + cell, sets, own=sets is file.nsets)]


def motion(block: Block) -> Motion | None:
    """Return the motion of *INSTANCE, or None.

    It is a translation, then a rotation by degrees about the axis from one point to another.
    """
    rows = [[real(c) if c else 0.0 for c in row] for row in block.data]
    if not any(value for row in rows for value in row):
        return None
    shift = np.array(next((row for row in rows if len(row) <= 3), [0.0] * 3))
    turn = next((row for row in rows if len(row) > 3), [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    foot, axis = np.array(turn[:3]), np.subtract(turn[3:6], turn[:3])
    length = float(np.linalg.norm(axis))
    require(length > 0, f"instance {block.get('NAME')} is turned about an axis between one point and itself: give two")
    turned = Rotation.from_rotvec(turn[6] * axis / length, degrees=True).as_matrix()
    return lambda points: np.asarray((points + shift - foot) @ turned.T + foot)
