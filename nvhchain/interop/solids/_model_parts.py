"""Data collected by readers of solid models, and their conversion to a `SolidModel`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import FileFormatError, InputError, require
from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.interop.solids._structure_parts import StructureParts

TRANSLATIONS, ROTATIONS = frozenset("123"), frozenset("456")


@dataclass
class Rigid:
    """Rigid set as read: name, label of its reference node, labels of its nodes."""

    name: str
    reference: int
    nodes: list[int]
    rotations: bool = True


@dataclass
class Parts:
    """Contents of a file with the numbers of the file.

    nodes: label → (3,).
    elements: (kind, property) → labels and rows of node labels.
    materials: property → Material (SI).
    rigid: rigid sets.
    held: label → held components `1` … `6`.
    rotated: label → its own displacement frame.
    oblique: those of held nodes whose frame does not lie along the axes.
    groups: name → node labels.
    structure: shells, beams, springs, masses and relations.
    notes: findings in words.
    """

    source: str
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[tuple[str, str], tuple[list[int], list[list[int]]]] = field(
        default_factory=lambda: defaultdict(lambda: ([], []))
    )
    materials: dict[str, Material] = field(default_factory=dict)
    rigid: list[Rigid] = field(default_factory=list)
    held: dict[int, set[str]] = field(default_factory=lambda: defaultdict(set))
    rotated: dict[int, int] = field(default_factory=dict)
    oblique: dict[int, int] = field(default_factory=dict)
    groups: dict[str, list[int]] = field(default_factory=dict)
    structure: StructureParts = field(default_factory=StructureParts)
    notes: list[str] = field(default_factory=list)

    def model(self, length: float) -> SolidModel:
        """Return the model in SI; `length` is m per unit of the file. InputError for references to missing items."""
        try:
            return self._model(length)
        except OverflowError:
            raise FileFormatError(
                f"{self.source}: labels reach beyond {2**63 - 1}: number nodes and elements anew"
            ) from None

    def _model(self, length: float) -> SolidModel:
        require(len(self.nodes) > 0, f"{self.source}: no nodes")
        solid = {label for _, rows in self.elements.values() for row in rows for label in row}
        self.notes += self.structure.remove_leftovers(solid)
        require(
            bool(self.elements or self.structure.shells),
            f"{self.source}: no solid elements (tetrahedra, wedges or bricks) and no shells",
        )
        labels = np.array(sorted(self.nodes), dtype=np.int64)
        nodes = length * np.array([self.nodes[int(label)] for label in labels], dtype=float)
        held = np.zeros((len(nodes), 6), dtype=bool)
        free_points = {rigid.reference for rigid in self.rigid}
        for label, components in self.held.items():
            for whole in (TRANSLATIONS, ROTATIONS):
                require(
                    label not in self.oblique or components >= whole or not components & whole,
                    f"{self.source}: node {label} is held in part of the directions of its own frame "
                    f"{self.oblique.get(label)}: hold all three or use the basic system",
                )
            if label not in free_points:
                row = self._rows(labels, [label], "a constraint")[0]
                held[row] |= [str(axis + 1) in components for axis in range(6)]
        structure, added = self.structure.structure(
            self.source, nodes, lambda wanted, subject: self._rows(labels, wanted, subject)
        )
        if not structure.empty:
            structure = replace(
                structure, held_rotations=np.vstack([held[:, 3:], np.zeros((len(added), 3), dtype=bool)])
            )
        free = np.zeros((len(added), 3), dtype=bool)
        return SolidModel(
            nodes=np.vstack([nodes, added]),
            labels=np.concatenate([labels, labels[-1] + 1 + np.arange(len(added))]),
            blocks=tuple(self._block(labels, kind, group) for kind, group in self.elements),
            rigid_sets=tuple(self._rigid(labels, nodes, rigid) for rigid in self._rigid_bodies()),
            held=np.vstack([held[:, :3], free]),
            groups={name: self._rows(labels, members, f"group {name}") for name, members in self.groups.items()},
            source=self.source,
            structure=structure,
            notes=tuple(self.notes),
        )

    def _rigid_bodies(self) -> list[Rigid]:
        """Merge rigid sets with the same reference node; refuse a set that carries the reference of another.

        A reference node that belongs to an element moves with the set like the others.
        """
        used = {label for _, rows in self.elements.values() for row in rows for label in row} | self.structure.labels
        bodies: dict[int, Rigid] = {}
        for rigid in self.rigid:
            body = bodies.setdefault(rigid.reference, Rigid(rigid.name, rigid.reference, [], rigid.rotations))
            body.rotations &= rigid.rotations
            own = [rigid.reference] if rigid.reference in used else []
            body.nodes = list(dict.fromkeys([*body.nodes, *rigid.nodes, *own]))
        for body in bodies.values():
            chained = [label for label in body.nodes if label in bodies and label != body.reference]
            require(
                not chained,
                f"{self.source}: rigid set {body.name} carries node {(chained or [0])[0]}, the reference node of "
                "another rigid set: write both as one set",
            )
        return list(bodies.values())

    def _block(self, labels: IntArray, kind: str, group: str) -> ElementBlock:
        numbers, rows = self.elements[kind, group]
        if group not in self.materials:
            raise InputError(f"{self.source}: elements of property {group!r} have no material: assign one")
        members = self._rows(labels, np.array(rows).ravel(), f"{kind} elements").reshape(len(rows), -1)
        return ElementBlock(kind, members, self.materials[group], np.array(numbers, dtype=np.int64), group)

    def _rigid(self, labels: IntArray, nodes: FloatArray, rigid: Rigid) -> RigidSet:
        reference = int(self._rows(labels, [rigid.reference], f"rigid set {rigid.name}")[0])
        members = np.unique(self._rows(labels, rigid.nodes, f"rigid set {rigid.name}"))
        require(members.size > 0, f"{self.source}: rigid set {rigid.name} has no nodes")
        fixed = np.array([str(c + 1) in self.held.get(rigid.reference, ()) for c in range(6)])
        return RigidSet(rigid.name, nodes[reference].copy(), members, rigid.reference, fixed, rigid.rotations)

    def _rows(self, labels: IntArray, wanted: Iterable[int], subject: str) -> IntArray:
        numbers = np.asarray(list(wanted), dtype=np.int64)
        rows = np.searchsorted(labels, numbers)
        known = np.take(labels, np.minimum(rows, len(labels) - 1)) == numbers
        if not known.all():
            raise FileFormatError(f"{self.source}: {subject}: node {numbers[~known][0]} is not defined")
        return np.asarray(rows, dtype=np.int64)
