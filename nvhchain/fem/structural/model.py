"""Contents of an imported model beside its solids: shells, beams, springs, masses, weighted averages and ties.

All in SI units. Node numbers are rows of the model's nodes. Nodes have three translations and three rotations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from nvhchain.conventions import Material
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class ShellBlock:
    """Flat shells of one section.

    nodes (m, 3) or (m, 4): corners; the normal is right-handed about their order.
    labels (m,): numbers in the file.
    thickness (m,): thickness (m).
    offset (m,): distance of the middle surface from the nodes, along the normal (m).
    group: name of the property or section.
    bending: bending stiffness over that of the full thickness.
    shear: shear area over the full one; 0 for a shell that does not shear.
    extra_mass: mass without stiffness (kg/m²).
    """

    nodes: IntArray
    material: Material
    labels: IntArray
    thickness: FloatArray
    offset: FloatArray
    group: str = ""
    bending: float = 1.0
    shear: float = 5 / 6
    extra_mass: float = 0.0


@dataclass(frozen=True)
class BeamSection:
    """Cross-section of a beam.

    area: area (m²).
    bending_y, bending_z: second moments of area for bending along y and along z of the section (m⁴).
    product: product of area ∫yz dA (m⁴).
    torsion: torsion constant (m⁴).
    shear_y, shear_z: shear areas over the area; 0 for a beam that does not shear.
    extra_mass: mass without stiffness (kg/m).
    """

    area: float
    bending_y: float
    bending_z: float
    torsion: float
    product: float = 0.0
    shear_y: float = 0.0
    shear_z: float = 0.0
    extra_mass: float = 0.0


@dataclass(frozen=True, eq=False)
class BeamBlock:
    """Straight beams of one section.

    nodes (m, 2): ends.
    section: cross-section.
    labels (m,): numbers in the file.
    direction (m, 3): vector in the plane of the beam's axis and the y axis of its section.
    arms (m, 2, 3): position of the beam's ends relative to the nodes (m).
    released (m, 12): motions of both ends, in the beam's axes, that carry no force.
    group: name of the property or section.
    """

    nodes: IntArray
    material: Material
    section: BeamSection
    labels: IntArray
    direction: FloatArray
    arms: FloatArray
    released: IntArray
    group: str = ""


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs between two nodes, or from a node to the ground.

    nodes (m, 2): nodes; −1 for the ground.
    stiffness (m, 12, 12): stiffness in the axes of the model (N/m, N, N m).
    labels (m,): numbers in the file.
    """

    nodes: IntArray
    stiffness: FloatArray
    labels: IntArray


@dataclass(frozen=True, eq=False)
class Masses:
    """Concentrated masses: nodes (m,), and mass matrices (m, 6, 6) (kg, kg m, kg m²) about the nodes."""

    nodes: IntArray
    matrix: FloatArray
    labels: IntArray


@dataclass(frozen=True, eq=False)
class Average:
    """Node that moves as the weighted mean of others (RBE3, distributing coupling).

    name: number or name in the file.
    node: node that follows.
    components (6,): its motions that follow.
    nodes (k,): nodes averaged.
    weights (k, 6): weight of every motion of them.
    """

    name: str
    node: int
    components: IntArray
    nodes: IntArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Relation:
    """Motion that follows others: u(node, component) = Σ coefficient · u(nodes, components)."""

    name: str
    node: int
    component: int
    nodes: IntArray
    components: IntArray
    coefficients: FloatArray


@dataclass(frozen=True, eq=False)
class Tie:
    """Nodes that follow the nearest places on a surface.

    name: name in the file.
    nodes (s,): nodes that follow.
    faces (f, 8): four corners, −1 for the fourth of a triangle; then the middles of the edges, −1 for missing ones.
    tolerance: largest distance (m); None: a share of the mean edge of the faces.
    adjust: True for nodes that are moved onto the surface.
    rotations: True for rotations that follow, too.
    """

    name: str
    nodes: IntArray
    faces: IntArray
    tolerance: float | None = None
    adjust: bool = True
    rotations: bool = True


@dataclass(frozen=True, eq=False)
class Structure:
    """Shells, beams, springs, masses and relations of a model.

    shells, beams, tuple of blocks: elements by section.
    springs, masses: all of them.
    averages: weighted means.
    relations: multi-point constraints.
    held_rotations (n, 3): fixed rotations of the nodes.
    """

    shells: tuple[ShellBlock, ...] = ()
    beams: tuple[BeamBlock, ...] = ()
    springs: Springs | None = None
    masses: Masses | None = None
    averages: tuple[Average, ...] = ()
    relations: tuple[Relation, ...] = ()
    ties: tuple[Tie, ...] = ()
    held_rotations: IntArray = field(default_factory=lambda: np.zeros((0, 3), dtype=bool))

    @property
    def empty(self) -> bool:
        """True if there is nothing but solids and rigid sets."""
        items = (self.shells, self.beams, self.springs, self.masses, self.averages, self.relations, self.ties)
        return not any(items)

    @property
    def used(self) -> IntArray:
        """Nodes of all items, rising."""
        found = [shells.nodes.ravel() for shells in self.shells] + [beams.nodes.ravel() for beams in self.beams]
        if self.springs is not None:
            found.append(self.springs.nodes.ravel())
        if self.masses is not None:
            found.append(self.masses.nodes)
        found += [np.array([mean.node, *mean.nodes]) for mean in self.averages]
        found += [np.array([relation.node, *relation.nodes]) for relation in self.relations]
        nodes = np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.int64)
        return np.asarray(nodes[nodes >= 0], dtype=np.int64)

    @property
    def turning(self) -> IntArray:
        """Nodes of shells, beams, springs and means, whose rotations can meet a stiffness."""
        found = [shells.nodes.ravel() for shells in self.shells] + [beams.nodes.ravel() for beams in self.beams]
        if self.springs is not None:
            found.append(self.springs.nodes.ravel())
        found += [np.array([mean.node]) for mean in self.averages]
        return np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.int64)

    def renumbered(self, row: Callable[[IntArray], IntArray], kept: IntArray) -> Structure:
        """Return the structure with node numbers mapped by `row`; `kept` are the old numbers of the new nodes."""

        def moved(nodes: IntArray) -> IntArray:
            return np.where(nodes < 0, -1, row(np.maximum(nodes, 0)))

        return replace(
            self,
            shells=tuple(replace(block, nodes=moved(block.nodes)) for block in self.shells),
            beams=tuple(replace(block, nodes=moved(block.nodes)) for block in self.beams),
            springs=self.springs and replace(self.springs, nodes=moved(self.springs.nodes)),
            masses=self.masses and replace(self.masses, nodes=moved(self.masses.nodes)),
            averages=tuple(
                replace(one, node=int(moved(np.array([one.node]))[0]), nodes=moved(one.nodes)) for one in self.averages
            ),
            relations=tuple(
                replace(one, node=int(moved(np.array([one.node]))[0]), nodes=moved(one.nodes)) for one in self.relations
            ),
            ties=tuple(replace(tie, nodes=_there(moved(tie.nodes)), faces=moved(tie.faces)) for tie in self.ties),
            held_rotations=self.held_rotations[kept] if len(self.held_rotations) else self.held_rotations,
        )


def _there(nodes: IntArray) -> IntArray:
    return nodes[nodes >= 0]
