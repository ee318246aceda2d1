"""Shells, beams, springs, masses and relations collected by readers, and their conversion to a `Structure`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import require
from nvhchain.fem.structural.division import divided_quadrilaterals, divided_triangles
from nvhchain.fem.structural.model import (
    Average,
    BeamBlock,
    BeamSection,
    Masses,
    Relation,
    ShellBlock,
    Springs,
    Structure,
    Tie,
)
from nvhchain.handoff import FloatArray, IntArray

Rows = Callable[[Iterable[int], str], IntArray]
"""Function from labels of nodes, and the name of the item, to their rows."""


@dataclass
class Shells:
    """Shells of one section as read: labels, nodes, thickness and offset (SI; None: that of the section)."""

    labels: list[int] = field(default_factory=list)
    nodes: list[list[int]] = field(default_factory=list)
    thickness: list[float | None] = field(default_factory=list)
    offset: list[float | None] = field(default_factory=list)

    def add(self, label: int, nodes: list[int], thickness: float | None = None, offset: float | None = None) -> None:
        """Add a shell."""
        self.labels.append(label)
        self.nodes.append(nodes)
        self.thickness.append(thickness)
        self.offset.append(offset)


@dataclass(frozen=True)
class ShellSection:
    """Section of shells, SI: material, thickness (m), factors of bending and shear, mass (kg/m²) and offset (m)."""

    material: Material
    thickness: float | None
    bending: float = 1.0
    shear: float = 5 / 6
    extra_mass: float = 0.0
    offset: float = 0.0


@dataclass
class Beams:
    """Beams of one section as read: labels, nodes, directions, arms (m) and released motions."""

    labels: list[int] = field(default_factory=list)
    nodes: list[tuple[int, int]] = field(default_factory=list)
    direction: list[FloatArray] = field(default_factory=list)
    arms: list[FloatArray] = field(default_factory=list)
    released: list[IntArray] = field(default_factory=list)

    def add(
        self,
        label: int,
        nodes: tuple[int, int],
        direction: FloatArray,
        arms: FloatArray | None = None,
        released: IntArray | None = None,
    ) -> None:
        """Add a beam, by default without arms and with all motions joined."""
        self.labels.append(label)
        self.nodes.append(nodes)
        self.direction.append(direction)
        self.arms.append(np.zeros((2, 3)) if arms is None else arms)
        self.released.append(np.zeros(12, dtype=bool) if released is None else released)


@dataclass
class StructureParts:
    """Items of a file with its labels of nodes, in SI.

    shells, beams: section → elements.
    shell_sections, beam_sections: section → its law.
    springs: label, two nodes (None: ground), stiffness (12, 12).
    masses: label, node, mass matrix (6, 6).
    averages: name, node, components (6,) bool, nodes, weights (k, 6).
    relations: name, node, component, others as (node, component, coefficient).
    ties: name, nodes, faces of eight nodes or None, tolerance (m), adjusting, with rotations.
    """

    shells: dict[str, Shells] = field(default_factory=lambda: defaultdict(Shells))
    shell_sections: dict[str, ShellSection] = field(default_factory=dict)
    beams: dict[str, Beams] = field(default_factory=lambda: defaultdict(Beams))
    beam_sections: dict[str, tuple[Material, BeamSection]] = field(default_factory=dict)
    springs: list[tuple[int, int | None, int | None, FloatArray]] = field(default_factory=list)
    masses: list[tuple[int, int, FloatArray]] = field(default_factory=list)
    averages: list[tuple[str, int, IntArray, list[int], FloatArray]] = field(default_factory=list)
    relations: list[tuple[str, int, int, list[tuple[int, int, float]]]] = field(default_factory=list)
    ties: list[tuple[str, list[int], list[list[int | None]], float | None, bool, bool]] = field(default_factory=list)

    @property
    def labels(self) -> set[int]:
        """Labels of all nodes that items refer to."""
        found = {n for shells in self.shells.values() for row in shells.nodes for n in row}
        found |= {n for beams in self.beams.values() for row in beams.nodes for n in row}
        found |= {n for _, a, b, _ in self.springs for n in (a, b) if n is not None}
        found |= {node for _, node, _ in self.masses}
        found |= {n for _, node, _, nodes, _ in self.averages for n in (node, *nodes)}
        found |= {n for _, node, _, others in self.relations for n in (node, *(other[0] for other in others))}
        return found

    def remove_leftovers(self, solid: set[int]) -> list[str]:
        """Remove shells and beams without a section on nodes of solids, which meshers leave; return notes on them."""
        notes = []
        for group in [one for one in self.shells if one not in self.shell_sections]:
            if solid.issuperset(n for row in self.shells[group].nodes for n in row):
                count = len(self.shells.pop(group).labels)
                notes.append(f"{count} shells of {group or 'no section'} on solids excluded: they have no section")
        for group in [one for one in self.beams if one not in self.beam_sections]:
            if solid.issuperset(n for ends in self.beams[group].nodes for n in ends):
                count = len(self.beams.pop(group).labels)
                notes.append(f"{count} beams of {group or 'no section'} on solids excluded: they have no section")
        return notes

    def structure(self, source: str, nodes: FloatArray, rows: Rows) -> tuple[Structure, FloatArray]:
        """Return the structure, and new nodes (q, 3) m that follow `nodes`; InputError for missing items."""
        blocks, added = [], nodes
        for group, own in self.shells.items():
            require(
                group in self.shell_sections,
                f"{source}: {len(own.labels)} shells of property {group!r}, first {own.labels[0]}, have no section: "
                "write PSHELL or *SHELL SECTION for them",
            )
            for count in sorted({len(row) for row in own.nodes}):
                block, added = self._shells(source, group, count, added, rows)
                blocks.append(block)
        springs = masses = None
        if self.springs:
            ends = np.array(
                [[-1 if n is None else int(rows([n], f"spring {label}")[0]) for n in (a, b)]
                 for label, a, b, _ in self.springs]
            )  # fmt: skip
            springs = Springs(ends, np.array([one[3] for one in self.springs]), np.array([s[0] for s in self.springs]))
        if self.masses:
            places = rows([node for _, node, _ in self.masses], "masses")
            masses = Masses(places, np.array([one[2] for one in self.masses]), np.array([m[0] for m in self.masses]))
        means = tuple(
            Average(name, int(rows([node], f"mean {name}")[0]), components, rows(members, f"mean {name}"), weights)
            for name, node, components, members, weights in self.averages
        )
        relations = tuple(
            Relation(
                name,
                int(rows([node], name)[0]),
                component,
                rows([other[0] for other in others], name),
                np.array([other[1] for other in others], dtype=np.int64),
                np.array([other[2] for other in others]),
            )
            for name, node, component, others in self.relations
        )
        ties = tuple(
            Tie(name, np.unique(rows(nodes, f"tie {name}")), _faces(faces, rows, name), tolerance, adjust, turns)
            for name, nodes, faces, tolerance, adjust, turns in self.ties
        )
        beams = tuple(self._beams(source, group, rows) for group in self.beams)
        return Structure(tuple(blocks), beams, springs, masses, means, relations, ties), added[len(nodes) :]

    def _shells(
        self, source: str, group: str, count: int, nodes: FloatArray, rows: Rows
    ) -> tuple[ShellBlock, FloatArray]:
        own, section = self.shells[group], self.shell_sections[group]
        chosen = [i for i, row in enumerate(own.nodes) if len(row) == count]
        members = rows([n for i in chosen for n in own.nodes[i]], f"shells of property {group}").reshape(-1, count)
        thickness = [section.thickness if own.thickness[i] is None else own.thickness[i] for i in chosen]
        first = own.labels[chosen[0]]
        require(
            all(t is not None and 0 < t < np.inf for t in thickness),
            f"{source}: shells of property {group!r}, first {first}, have no thickness",
        )
        offsets = [own.offset[i] for i in chosen]
        offset = np.array([section.offset if z is None else z for z in offsets])
        labels, t = np.array([own.labels[i] for i in chosen], dtype=np.int64), np.array(thickness, dtype=float)
        if count == 6:
            members = divided_triangles(members)
        elif count == 8:
            members, centres = divided_quadrilaterals(members, nodes)
            nodes = np.vstack([nodes, centres])
        if count > 4:
            labels, t, offset = (np.repeat(values, 4) for values in (labels, t, offset))
        law = (section.bending, section.shear, section.extra_mass)
        return ShellBlock(members, section.material, labels, t, offset, group, *law), nodes

    def _beams(self, source: str, group: str, rows: Rows) -> BeamBlock:
        own = self.beams[group]
        require(
            group in self.beam_sections,
            f"{source}: {len(own.labels)} beams of property {group!r}, first {own.labels[0]}, have no section: write "
            "PBAR, PBEAM, PROD or *BEAM SECTION for them",
        )
        material, section = self.beam_sections[group]
        return BeamBlock(
            rows([n for row in own.nodes for n in row], f"beams of property {group}").reshape(-1, 2),
            material,
            section,
            np.array(own.labels, dtype=np.int64),
            np.array(own.direction),
            np.array(own.arms),
            np.array(own.released),
            group,
        )


def _faces(faces: list[list[int | None]], rows: Rows, name: str) -> IntArray:
    """Return rows (f, 8) of the nodes of faces, −1 for None."""
    flat = [label for face in faces for label in face]
    known = np.array([label is not None for label in flat])
    result = np.full(len(flat), -1, dtype=np.int64)
    result[known] = rows([label for label in flat if label is not None], f"tie {name}")
    return result.reshape(-1, 8)


def padded(face: Sequence[int]) -> list[int | None]:
    """Return four corners and the middles of their edges; None for those that a face of 3, 4, 6 or 8 nodes lacks."""
    corners = 3 if len(face) in (3, 6) else 4
    middles = [*face[corners:], None, None, None, None]
    return [*face[:corners], *[None] * (4 - corners), *middles[:4]]


def node_weights(nodes: Sequence[int], shares: Mapping[int, float]) -> FloatArray:
    """Return weights (n, 6) of the translations of nodes: their shares of an area, or 1 without any."""
    weights = np.zeros((len(nodes), 6))
    weights[:, :3] = np.array([shares.get(n, 0.0) if shares else 1.0 for n in nodes])[:, None]
    return weights


def face_shares(faces: Iterable[Sequence[int]], nodes: Mapping[int, Sequence[float]]) -> dict[int, float]:
    """Return the share of the area of faces at each of their nodes."""
    shares: dict[int, float] = {}
    for face in faces:
        a, b, c = (np.array(nodes[face[i]]) for i in range(3))
        area = float(np.linalg.norm(np.cross(b - a, c - a))) / 2
        if len(face) not in (3, 6):
            area += float(np.linalg.norm(np.cross(c - a, np.array(nodes[face[3]]) - a))) / 2
        for node in face:
            shares[node] = shares.get(node, 0.0) + area / len(face)
    return shares
