"""Rigid sets and constraints of an Abaqus file: surfaces, kinematic couplings, rigid bodies, MPCs, ties, boundary."""

from __future__ import annotations

import re

from nvhchain.errors import require, required
from nvhchain.fem.solid_model import CORNERS, EDGES, KINDS
from nvhchain.interop.solids._model_parts import Rigid
from nvhchain.interop.solids._structure_parts import padded
from nvhchain.interop.solids.abaqus_keywords import Block, real
from nvhchain.interop.solids.abaqus_sets import AbaqusFile
from nvhchain.interop.solids.nastran_frames import basic_components

SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tet": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "hex": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
"""Corners of the faces S1, S2, …"""

_NAMED_SUPPORTS = {
    "ENCASTRE": "123456",
    "PINNED": "123",
    "XSYMM": "156",
    "YSYMM": "246",
    "ZSYMM": "345",
    "XASYMM": "234",
    "YASYMM": "135",
    "ZASYMM": "126",
}


def read_surface(file: AbaqusFile, block: Block) -> None:
    """Read a surface of nodes or of element faces as a set of nodes."""
    nodes: list[int] = []
    faces: list[tuple[int, ...]] = []
    node_based = block.get("TYPE", "ELEMENT").upper() == "NODE"
    for row in block.data:
        if node_based:
            nodes += file.labels(row[0], file.nsets)
            continue
        side = row[1].upper() if len(row) > 1 else ""
        for label in file.labels(row[0], file.elsets):
            kind, members = file.elements[label]
            if kind.startswith("shell") and side in ("", "SPOS", "SNEG"):
                faces.append(tuple(members))
                continue
            require(
                kind in KINDS and re.fullmatch(r"S[1-6]", side) is not None,
                f"{file.parts.source}: *SURFACE {block.get('NAME')}: faces {row[1:]} are not read: name them S1 … S6",
            )
            corners = SIDES[KINDS[kind]][int(side[1]) - 1]
            place = [*corners]
            if len(members) > CORNERS[KINDS[kind]]:
                face_edges = [frozenset((a, corners[i - len(corners) + 1])) for i, a in enumerate(corners)]
                edges = [frozenset(edge) for edge in EDGES[KINDS[kind]]]
                place += [CORNERS[KINDS[kind]] + edges.index(pair) for pair in face_edges]
            faces.append(tuple(members[i] for i in place))
    nodes += [node for face in faces for node in face]
    file.add(file.surfaces, block.get("NAME"), sorted(set(nodes)))
    file.faces.setdefault((file.owner, block.get("NAME").upper()), []).extend(faces)


def read_coupling(file: AbaqusFile, block: Block) -> None:
    """Keep a coupling for its *KINEMATIC."""
    require(
        "INFLUENCE RADIUS" not in block.parameters,
        f"{file.parts.source}: *COUPLING with an influence radius is not read: leave the radius out",
    )
    file.coupling = block


def read_kinematic(file: AbaqusFile, block: Block) -> None:
    """Read the coupled components of a coupling as a rigid set."""
    coupling = required(file.coupling, f"{file.parts.source}: *KINEMATIC without *COUPLING before it")
    components = {c for row in block.data for c in _range(row)} or set("123456")
    require(
        components >= set("123"),
        f"{file.parts.source}: coupling {coupling.get('CONSTRAINT NAME')} couples {sorted(components)}: 1 … 3 needed",
    )
    surface = coupling.get("SURFACE")
    nodes = file.surface_nodes(surface)
    name = coupling.get("CONSTRAINT NAME") or surface
    _add_rigid(file, name, coupling.get("REF NODE"), nodes, turned=components >= set("456"))


def read_rigid_body(file: AbaqusFile, block: Block) -> None:
    """Read a rigid body of node or element sets."""
    nodes: list[int] = []
    for parameter in ("TIE NSET", "NSET", "PIN NSET"):
        if block.get(parameter):
            nodes += file.named(file.nsets, block.get(parameter))
    if block.get("ELSET"):
        nodes += sorted({n for e in file.named(file.elsets, block.get("ELSET")) for n in file.elements[e][1]})
    name = next((block.get(p) for p in ("TIE NSET", "NSET", "PIN NSET", "ELSET") if block.get(p)), "rigid body")
    _add_rigid(file, name, block.get("REF NODE"), nodes, rotation=block.get("ROT NODE"))


def read_kinematic_coupling(file: AbaqusFile, block: Block) -> None:
    """Read `nodes, first component, last component`, the older form of a coupling; all components without them."""
    nodes: list[int] = []
    for row in block.data:
        components = _range(row[1:]) if len(row) > 1 and row[1] else set("123456")
        require(
            components >= set("123"),
            f"{file.parts.source}: *KINEMATIC COUPLING of {row[0]} couples {sorted(components)}: 1 … 3 needed",
        )
        nodes += file.labels(row[0], file.nsets)
    _add_rigid(file, f"coupling {block.get('REF NODE')}", block.get("REF NODE"), nodes)


def read_mpc(file: AbaqusFile, block: Block) -> None:
    """Read `BEAM, dependent, reference`: nodes follow rigidly; by `TIE` or `PIN` their motions are equal."""
    followers: dict[int, list[int]] = {}
    for kind, dependent, reference in (row[:3] for row in block.data):
        require(
            kind.upper() in ("BEAM", "TIE", "PIN"),
            f"{file.parts.source}: *MPC of type {kind} is not read: use BEAM, TIE or PIN",
        )
        if kind.upper() == "BEAM":
            followers.setdefault(_reference(file, reference), []).extend(file.labels(dependent, file.nsets))
            continue
        leaders = file.labels(reference, file.nsets)
        for i, node in enumerate(file.labels(dependent, file.nsets)):
            leader = leaders[i if len(leaders) > 1 else 0]
            for component in range(6 if kind.upper() == "TIE" else 3):
                file.parts.structure.relations.append(
                    (f"MPC of node {node}", node, component, [(leader, component, 1.0)])
                )
    for label, nodes in followers.items():
        file.parts.rigid.append(Rigid(f"MPC {label}", label, nodes))


def read_tie(file: AbaqusFile, block: Block) -> None:
    """Read pairs of slave and master; InputError for a master without faces."""
    name = block.get("NAME") or "of two surfaces"
    stated = block.get("POSITION TOLERANCE")
    tolerance = file.system.length * real(stated) if stated else None
    adjust = block.get("ADJUST", "YES").upper() == "YES"
    for slave, master in (row[:2] for row in block.data):
        nodes = file.surface_nodes(slave)
        faces = file.faces_of(master)
        require(len(faces) > 0, f"{file.parts.source}: *TIE {name}: master {master} must be a surface of element faces")
        rotations = "NO ROTATION" not in block.parameters
        file.parts.structure.ties.append((name, nodes, [padded(face) for face in faces], tolerance, adjust, rotations))


def _add_rigid(
    file: AbaqusFile, name: str, reference: str, nodes: list[int], rotation: str = "", *, turned: bool = True
) -> None:
    label = _reference(file, reference)
    if rotation:  # CalculiX: translations of this node are the rotations of the body
        turning = _reference(file, rotation)
        rotations = {str(int(c) + 3) for c in file.parts.held.pop(turning, set()) & set("123")}
        file.parts.held[label] = (file.parts.held[label] & set("123")) | rotations
    twice = any(rigid.name == name and rigid.reference != label for rigid in file.parts.rigid)
    file.parts.rigid.append(Rigid(f"{file.instance}.{name}" if twice else name, label, nodes, turned))


def _reference(file: AbaqusFile, cell: str) -> int:
    labels = file.labels(cell, file.nsets)
    require(len(labels) == 1, f"{file.parts.source}: reference {cell} stands for {len(labels)} nodes: one is needed")
    return labels[0]


_LAST_MOTION = 31
"""Highest number of a degree of freedom in Abaqus: temperatures of shells."""


def _range(row: list[str]) -> set[str]:
    first = int(row[0])
    last = int(row[1]) if len(row) > 1 and row[1] else first
    if not 1 <= first <= last <= _LAST_MOTION:
        raise ValueError(f"degrees of freedom {first} to {last} do not rise from 1 to {_LAST_MOTION} at most")
    return {str(c) for c in range(first, last + 1)}


def read_boundary(file: AbaqusFile, block: Block) -> None:
    """Read held components of nodes."""
    require(
        block.get("OP", "MOD").upper() == "MOD",
        f"{file.parts.source}: *BOUNDARY, OP={block.get('OP')} releases earlier supports, which is not read: "
        "write all supports once",
    )
    for row in block.data:
        labels = file.labels(row[0], file.nsets)
        kind = row[1].upper()
        if kind in _NAMED_SUPPORTS:
            components = set(_NAMED_SUPPORTS[kind])
        else:
            require(
                len(row) < 4 or not row[3] or real(row[3]) == 0.0,
                f"{file.parts.source}: *BOUNDARY moves {row[0]} by {row[3:4]}: only 0 can be held",
            )
            components = _range(row[1:3])
        for label in labels:
            file.parts.held[label] |= _basic_components(file, label, components & set("123456"))


def _basic_components(file: AbaqusFile, label: int, components: set[str]) -> set[str]:
    """Return held components of a node with *TRANSFORM in the basic axes, as far as its own lie along them."""
    axes = file.transforms.get(label)
    if axes is None:
        return components
    found = basic_components(components, axes)
    if found is None:
        file.parts.oblique[label] = label
    return components if found is None else found
