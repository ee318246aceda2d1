"""Imported finite element model: nodes, solids by kind and material, rigid sets, fixed freedoms, groups, structure.

All in SI units. Node numbers are rows of `nodes`; `labels` are the numbers in the imported file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import require
from nvhchain.fem.structural.model import Structure
from nvhchain.handoff import FloatArray, IntArray

EDGES: dict[str, tuple[tuple[int, int], ...]] = {
    "tet": ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "hex": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
}
"""Corner pairs in the order of the mid-edge nodes, which follow the corners."""

FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hex": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Corners of each face, counter-clockwise seen from outside."""

CORNERS = {"tet": 4, "wedge": 6, "hex": 8}

KINDS = {"tet4": "tet", "tet10": "tet", "wedge6": "wedge", "wedge15": "wedge", "hex8": "hex", "hex20": "hex"}
"""Shape of every known kind of element; the number in a kind counts its nodes."""


@dataclass(frozen=True, eq=False)
class ElementBlock:
    """Elements of one kind and material.

    kind : key of `KINDS`.
    nodes : (m, k) node numbers, corners first, then mid-edge nodes in the order of `EDGES`.
    labels : (m,) numbers in the imported file.
    group : name of the property or section.
    """

    kind: str
    nodes: IntArray
    material: Material
    labels: IntArray
    group: str = ""

    def __post_init__(self) -> None:
        require(self.kind in KINDS, f"element kind {self.kind!r} is not known: use {', '.join(KINDS)}")
        count = int(self.kind.lstrip("abcdefghijklmnopqrstuvwxyz"))
        require(
            self.nodes.ndim == 2 and self.nodes.shape[1] == count and len(self.nodes) > 0,
            f"{self.kind} elements of shape {self.nodes.shape}: (at least one, {count}) is needed",
        )
        require(len(self.labels) == len(self.nodes), f"{len(self.labels)} labels for {len(self.nodes)} elements")

    @property
    def shape(self) -> str:
        """`tet`, `wedge` or `hex`."""
        return KINDS[self.kind]

    @property
    def quadratic(self) -> bool:
        """True if the block has its mid-edge nodes."""
        return self.nodes.shape[1] > CORNERS[self.shape]


@dataclass(frozen=True, eq=False)
class RigidSet:
    """Nodes that move with a reference point as a rigid body (RBE2, kinematic coupling).

    name : number or name in the file.
    reference : (3,) reference point (m).
    nodes : node numbers.
    label : label of the reference node.
    held : (6,) bool, True for the fixed translations and rotations of the reference point.
    rotations : True if the rotations of nodes of shells and beams follow, too.
    motions : 3 for a seat that takes forces, 5 for one that takes moments about x and y, too.
    """

    name: str
    reference: FloatArray
    nodes: IntArray
    label: int = 0
    held: IntArray = field(default_factory=lambda: np.zeros(6, dtype=bool))
    rotations: bool = True
    motions: int = 3


@dataclass(frozen=True, eq=False)
class SolidModel:
    """Imported solid model in SI units.

    nodes : (n, 3) nodes (m).
    labels : (n,) numbers in the imported file.
    blocks, rigid_sets : elements and rigid sets.
    held : (n, 3) bool, True for fixed translations.
    groups : name → node numbers.
    source : the file.
    structure : shells, beams, springs, masses and relations.
    notes : what the reader excluded or assumed.
    """

    nodes: FloatArray
    labels: IntArray
    blocks: tuple[ElementBlock, ...]
    rigid_sets: tuple[RigidSet, ...]
    held: IntArray
    groups: Mapping[str, IntArray] = field(default_factory=dict)
    source: str = "model"
    structure: Structure = field(default_factory=Structure)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.nodes)
        require(self.nodes.shape == (n, 3) and n > 0, f"{self.source}: nodes of shape {self.nodes.shape}")
        require(bool(np.isfinite(self.nodes).all()), f"{self.source}: a node has a coordinate that is not finite")
        require(len(self.labels) == n, f"{self.source}: {len(self.labels)} labels for {n} nodes")
        require(self.held.shape == (n, 3), f"{self.source}: held of shape {self.held.shape}, ({n}, 3) is needed")
        require(
            bool(self.blocks or self.structure.shells),
            f"{self.source}: no solid elements (tetrahedra, wedges or bricks) and no shells",
        )
        sets = [b.nodes for b in self.blocks] + [r.nodes for r in self.rigid_sets] + list(self.groups.values())
        sets.append(self.structure.used)
        for members in sets:
            require(
                members.size == 0 or (members.min() >= 0 and members.max() < n),
                f"{self.source}: elements, rigid sets or groups refer to nodes that do not exist",
            )

    @property
    def supported(self) -> bool:
        """True if freedoms are held or springs stand on the ground."""
        springs = self.structure.springs
        grounded = springs is not None and bool((springs.nodes < 0).any())
        return grounded or bool(self.held.any()) or any(bool(rigid.held.any()) for rigid in self.rigid_sets)

    @property
    def elements(self) -> int:
        """Number of solid elements."""
        return sum(len(block.nodes) for block in self.blocks)
