"""Shells, beams, trusses, masses, springs, transforms and equations of an Abaqus file."""

from __future__ import annotations

import re

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import InputError, require, required
from nvhchain.fem.structural.model import BeamSection
from nvhchain.fem.structural.sections import rectangle, round_tube, section
from nvhchain.handoff import FloatArray
from nvhchain.interop.solids._model_parts import Rigid
from nvhchain.interop.solids._structure_parts import ShellSection, node_weights
from nvhchain.interop.solids.abaqus_keywords import Block, real
from nvhchain.interop.solids.abaqus_sets import AbaqusFile
from nvhchain.interop.solids.nastran_structure import normal_to, point_mass

OTHER_ELEMENTS = (
    (re.compile(r"(S3R?S?|STRI3|DS3)$"), "shell3", 3),
    (re.compile(r"(S4R?S?W?|S4R5|DS4)$"), "shell4", 4),
    (re.compile(r"(S6|STRI65|DS6)$"), "shell6", 6),
    (re.compile(r"(S8R5?|S8|DS8)$"), "shell8", 8),
    (re.compile(r"(B31|B33)(OS)?H?$"), "beam2", 2),
    (re.compile(r"B32(OS)?R?H?$"), "beam3", 3),
    (re.compile(r"T3D2H?$"), "truss2", 2),
    (re.compile(r"MASS$"), "mass1", 1),
    (re.compile(r"ROTARYI$"), "rotary1", 1),
    (re.compile(r"SPRING1$"), "spring1", 1),
    (re.compile(r"SPRING2$"), "spring2", 2),
    (re.compile(r"SPRINGA$"), "springa2", 2),
    (re.compile(r"CONN3D2$"), "connector2", 2),
    (re.compile(r"DASHPOT1$"), "dashpot1", 1),
    (re.compile(r"DASHPOT[2A]$"), "dashpot2", 2),
    (re.compile(r"(CPS|CPE|M3D|SFM3D)3R?$"), "face3", 3),
    (re.compile(r"(CPS|CPE|M3D|SFM3D)4R?$"), "face4", 4),
    (re.compile(r"(CPS|CPE|M3D|SFM3D)6M?$"), "face6", 6),
    (re.compile(r"(CPS|CPE|M3D|SFM3D)8R?$"), "face8", 8),
    (re.compile(r"T3D3$"), "edge3", 3),
)
"""Pattern of the type, kind, and number of nodes of elements that are no solids.

Faces and edges are those that meshers leave on solids; they are read where they have no section.
"""

SECTIONS = frozenset(
    {
        "SHELL SECTION", "SHELL GENERAL SECTION", "BEAM SECTION", "BEAM GENERAL SECTION", "MASS", "ROTARY INERTIA",
        "SPRING", "DASHPOT", "SURFACE SECTION", "CONNECTOR SECTION",
    }
)  # fmt: skip
"""Keywords that give elements their section."""


def keep_section(file: AbaqusFile, block: Block) -> None:
    """Keep a section until all elements are known."""
    file.laws.append((file.owner, block))


def read_transform(file: AbaqusFile, block: Block) -> None:
    """Read the axes of the motions of a node set."""
    kind = block.get("TYPE", "R").upper()
    where = f"{file.parts.source}: *TRANSFORM, NSET={block.get('NSET')}"
    require(kind == "R", f"{where} is cylindrical or spherical: write one for each node, or hold all directions")
    cells = [real(c) for row in block.data for c in row if c]
    require(len(cells) == 6, f"{where}: two points are needed")
    axes = _two_points(np.array(cells[:3]), np.array(cells[3:]), where)
    for label in file.named(file.nsets, block.get("NSET")):
        file.transforms[label] = axes


def read_orientation(file: AbaqusFile, block: Block) -> None:
    """Read a rectangular coordinate system by points; others are kept without axes."""
    cells = [real(c) for c in (block.data[0] if block.data else []) if _is_number(c)]
    points_given = block.get("DEFINITION", "COORDINATES").upper() == "COORDINATES" and len(cells) >= 6
    if points_given and block.get("SYSTEM", "RECTANGULAR").upper().startswith("R"):
        origin = np.array(cells[6:9]) if len(cells) >= 9 else np.zeros(3)
        axes = _two_points(
            np.array(cells[:3]) - origin, np.array(cells[3:6]) - origin, f"*ORIENTATION {block.get('NAME')}"
        )
        turn = [real(c) for row in block.data[1:2] for c in row if c]
        if not (len(turn) > 1 and turn[1] != 0.0):
            file.orientations[block.get("NAME").upper()] = axes


def _is_number(cell: str) -> bool:
    try:
        real(cell)
    except ValueError:
        return False
    return True


def _two_points(first: FloatArray, second: FloatArray, where: str) -> FloatArray:
    """Return axes (3, 3) as columns: x towards the first point, y in the plane of both."""
    z = np.cross(first, second)
    require(bool(z.any()), f"{where}: its points lie on a line with the origin")
    x, z = first / np.linalg.norm(first), z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def start_behavior(file: AbaqusFile, block: Block) -> None:
    """Begin the behaviour of connectors."""
    file.behavior = block.get("NAME").upper()
    file.behaviors[file.behavior] = {}


def read_connector_elasticity(file: AbaqusFile, block: Block) -> None:
    """Read the stiffness of a component of connectors."""
    where = f"{file.parts.source}: *CONNECTOR ELASTICITY of {file.behavior}"
    require("NONLINEAR" not in block.parameters, f"{where} is nonlinear: write its stiffness at the working point")
    require(block.get("COMPONENT").isdigit() and len(block.data) == 1, f"{where} needs one COMPONENT and one stiffness")
    file.behaviors[file.behavior][int(block.get("COMPONENT")) - 1] = real(block.data[0][0])


def read_equation(file: AbaqusFile, block: Block) -> None:
    """Read linear equations: the first motion follows the others."""
    rows = iter(block.data)
    for head in rows:
        count, cells = int(head[0]), list[str]()
        while len(cells) < 3 * count:
            cells += [c for c in next(rows, ["?"]) if c]
            require("?" not in cells, f"{file.parts.source}: *EQUATION ends within an equation")
        sets = [file.labels(cells[i], file.nsets) for i in range(0, 3 * count, 3)]
        longest = max(len(one) for one in sets)
        require(
            all(len(one) in (1, longest) for one in sets),
            f"{file.parts.source}: *EQUATION relates sets of different size",
        )
        for k in range(longest):
            terms = []
            for one, component, value in zip(sets, cells[1::3], cells[2::3], strict=True):
                node = one[k] if len(one) > 1 else one[0]
                require(node not in file.transforms, f"{file.parts.source}: *EQUATION of node {node} with *TRANSFORM")
                c = int(component) - 1
                terms.append((node, c, real(value) * (file.system.length if c > 2 else 1.0)))
            (node, own, first), *others = terms
            name = f"equation of node {node}"
            file.parts.structure.relations.append((name, node, own, [(n, c, -a / first) for n, c, a in others]))


def read_distributing(file: AbaqusFile, block: Block) -> None:
    """Read a distributing coupling as a weighted mean: by area on faces of elements, else uniformly."""
    coupling = required(file.coupling, f"{file.parts.source}: *DISTRIBUTING without *COUPLING before it")
    name = coupling.get("CONSTRAINT NAME") or coupling.get("SURFACE")
    method = block.get("WEIGHTING METHOD", "UNIFORM").upper()
    require(method == "UNIFORM", f"{file.parts.source}: coupling {name} has weights by {method}: only UNIFORM is read")
    components = np.zeros(6, dtype=bool)
    for row in block.data:
        first = int(row[0])
        components[first - 1 : int(row[1]) if len(row) > 1 and row[1] else first] = True
    components = components if components.any() else ~components
    components[:3] = True  # only rotations can be released
    nodes, shares = file.surface_nodes(coupling.get("SURFACE")), file.face_areas(coupling.get("SURFACE"))
    reference = file.labels(coupling.get("REF NODE"), file.nsets)
    require(len(reference) == 1, f"{file.parts.source}: coupling {name} has {len(reference)} reference nodes")
    file.parts.structure.averages.append((name, reference[0], components, nodes, node_weights(nodes, shares)))


def assign_sections(file: AbaqusFile) -> None:
    """Give all elements that are no solids their section, and take them out of `file.elements`."""
    for owner, block in file.laws:
        elset = block.get("ELSET")
        where = f"{file.parts.source}: *{block.name} of set {elset}"
        require((owner, elset.upper()) in file.elsets, f"{where}, which is not defined")
        labels = [label for label in dict.fromkeys(file.elsets[owner, elset.upper()]) if label in file.elements]
        kinds = {file.elements[label][0].rstrip("0123456789") for label in labels}
        alone = sum(b.get("ELSET").upper() == elset.upper() for _, b in file.laws) == 1
        group = elset if alone or not owner else f"{owner}.{elset}"
        if "SHELL" in block.name:
            _assign_shells(file, block, group, where, [n for n in labels if file.elements[n][0].startswith("shell")])
        elif "BEAM" in block.name:
            _assign_beams(file, block, group, where, [n for n in labels if file.elements[n][0].startswith("beam")])
        elif block.name == "MASS":
            mass = point_mass(real(block.data[0][0]) * file.system.mass, np.zeros(3), np.zeros((3, 3)))
            file.parts.structure.masses += [(label, file.elements.pop(label)[1][0], mass) for label in labels]
        elif block.name == "ROTARY INERTIA":
            cells = [real(c) if c else 0.0 for c in block.data[0]]
            require(not any(cells[3:6]), f"{where} has products of inertia: write the principal ones")
            inertia = np.diag(cells[:3]) * file.system.mass * file.system.length**2
            mass = point_mass(0, np.zeros(3), inertia)
            file.parts.structure.masses += [(label, file.elements.pop(label)[1][0], mass) for label in labels]
        elif block.name == "SPRING":
            for label in labels:
                _assign_spring(file, block, where, label)
        elif block.name == "CONNECTOR SECTION":
            for label in labels:
                _assign_connector(file, block, where, label)
        elif block.name in ("DASHPOT", "SURFACE SECTION") and kinds:
            for label in labels:
                del file.elements[label]
            file.parts.notes.append(f"{len(labels)} elements of *{block.name} excluded: they have no stiffness")


def leftovers(file: AbaqusFile, solid: set[int]) -> None:
    """Leave out faces and edges without a section on nodes of solids, and note their number."""
    idle = [
        label
        for label, (kind, nodes) in file.elements.items()
        if kind.startswith(("shell", "beam", "truss", "face", "edge")) and solid.issuperset(nodes)
    ]
    for label in idle:
        del file.elements[label]
    if idle:
        file.parts.notes.append(f"{len(idle)} faces or edges on solids excluded, first {idle[0]}: they have no section")


def _material(file: AbaqusFile, name: str, where: str) -> Material:
    found = file.materials.get(name.upper(), {})
    require({"young", "poisson", "density"} <= found.keys(), f"{where}: material {name} needs *ELASTIC and *DENSITY")
    return file.system.material(**found, place=f"{where}: material {name}")


def _assign_shells(file: AbaqusFile, block: Block, group: str, where: str, labels: list[int]) -> None:
    for parameter in ("COMPOSITE", "LAYUP", "NODAL THICKNESS", "SHELL THICKNESS", "STACK DIRECTION"):
        require(parameter not in block.parameters, f"{where} has {parameter}: only one thickness and material are read")
    require(bool(block.get("MATERIAL")) and len(block.data) > 0, f"{where} has no material or no thickness")
    thickness = file.system.length * real(block.data[0][0])
    stated = block.get("OFFSET", "0").upper()
    share = {"SPOS": 0.5, "SNEG": -0.5, "MIDDLE": 0.0}.get(stated)
    if share is None:
        require(_is_number(stated), f"{where} has offset {stated}: a number, SPOS or SNEG is needed")
        share = real(stated)
    extra = real(block.get("DENSITY", "0")) * file.system.mass / file.system.length**2
    material = _material(file, block.get("MATERIAL"), where)
    file.parts.structure.shell_sections[group] = ShellSection(
        material, thickness, extra_mass=extra, offset=-share * thickness
    )
    own = file.parts.structure.shells[group]
    for label in labels:
        own.add(label, file.elements.pop(label)[1])


def _assign_beams(file: AbaqusFile, block: Block, group: str, where: str, labels: list[int]) -> None:
    L, kind = file.system.length, block.get("SECTION", "GENERAL" if "GENERAL" in block.name else "").upper()
    require(len(block.data) > 0, f"{where} has no dimensions")
    cells = [real(c) for c in block.data[0] if c]
    normal = np.array([real(c) if c else 0.0 for c in block.data[1][:3]]) if len(block.data) > 1 else np.zeros(3)
    if not normal.any():
        normal = np.array([0.0, 0.0, -1.0])
    sizes, upright = [L * c for c in cells], False
    if kind == "GENERAL":
        area, bending_z, product, bending_y, torsion = cells[:5]
        law = BeamSection(area * L**2, bending_y * L**4, bending_z * L**4, torsion * L**4, product * L**4)
    elif kind == "RECT":
        law = rectangle(sizes[1], sizes[0])
    elif kind == "CIRC":
        law = round_tube(sizes[0])
    elif kind == "PIPE":
        law = round_tube(sizes[0], sizes[0] - sizes[1])
    elif kind == "BOX":
        require(sizes[2] == sizes[4] and sizes[3] == sizes[5], f"{where}: opposite walls of the box must be alike")
        law, upright = section("BOX", [sizes[0], sizes[1], sizes[3], sizes[2]]), True
    elif kind == "I":
        require(abs(sizes[0] - sizes[1] / 2) < 1e-6 * sizes[1] and sizes[2] == sizes[3] and sizes[4] == sizes[5],
                f"{where}: only I sections that are alike above and below, about their middle, are read")  # fmt: skip
        law, upright = section("I", [sizes[1], sizes[2], sizes[3], sizes[6], sizes[4], sizes[5]]), True
    else:
        raise InputError(f"{where} is of type {kind or 'none'}: RECT, CIRC, PIPE, BOX, I and GENERAL are read")
    if "GENERAL" in block.name:
        require(len(block.data) > 2, f"{where} has no moduli in its third line")
        young, shear = (real(c) for c in block.data[2][:2])
        density = real(block.get("DENSITY", "0"))
        material = file.system.material(young, young / (2 * shear) - 1, density, where)
    else:
        material = _material(file, block.get("MATERIAL"), where)
    file.parts.structure.beam_sections[group] = material, law
    own = file.parts.structure.beams[group]
    for label in labels:
        nodes = file.elements.pop(label)[1]
        for a, b in ((nodes[0], nodes[1]),) if len(nodes) == 2 else ((nodes[0], nodes[1]), (nodes[1], nodes[2])):
            axis = np.subtract(file.parts.nodes[b], file.parts.nodes[a])
            # heights of I and BOX are along the second axis, t × n₁
            own.add(label, (a, b), np.cross(axis, normal) if upright else normal)


def assign_truss(file: AbaqusFile, group: str, label: int, material: Material, area: float) -> None:
    """Move a truss with its area (m²) into the beams; it carries no bending."""
    a, b = file.elements.pop(label)[1]
    file.parts.structure.beam_sections[group] = material, BeamSection(area, 0.0, 0.0, 0.0)
    direction = normal_to(np.subtract(file.parts.nodes[b], file.parts.nodes[a]))
    file.parts.structure.beams[group].add(label, (a, b), direction)


def _assign_connector(file: AbaqusFile, block: Block, where: str, label: int) -> None:
    """Read a connector as a bush at its first node, without length, or as a rigid link."""
    _, (a, b) = file.elements.pop(label)
    kinds = {cell.upper() for cell in block.data[0] if cell} if block.data else set()
    if kinds & {"BEAM", "WELD"}:
        file.parts.rigid.append(Rigid(f"connector {label}", a, [b]))
        return
    known = {"BUSHING", "CARTESIAN", "CARDAN", "ROTATION", "PROJECTION CARTESIAN", "PROJECTION FLEXION-TORSION"}
    require(bool(kinds) and kinds <= known, f"{where} is of type {', '.join(sorted(kinds))}: use BUSHING or BEAM")
    behavior = block.get("BEHAVIOR").upper()
    require(behavior in file.behaviors, f"{where}: *CONNECTOR BEHAVIOR {behavior or 'without a name'} is not defined")
    names = [cell.strip("\"'").upper() for row in block.data[1:2] for cell in row if cell]
    require(
        all(name in file.orientations for name in names),
        f"{where}: an *ORIENTATION of {', '.join(names)} is not a rectangular system by points without a turn",
    )
    axes = file.orientations[names[0]] if names else np.eye(3)
    law = [file.behaviors[behavior].get(i, 0.0) for i in range(6)]
    units = file.system.force / file.system.length * np.repeat([1.0, file.system.length**2], 3)
    turn = np.kron(np.eye(2), axes)
    own = turn @ np.diag(np.array(law) * units) @ turn.T
    reach = np.hstack([np.eye(6), -np.eye(6)])
    file.parts.structure.springs.append((label, a, b, reach.T @ own @ reach))


def _assign_spring(file: AbaqusFile, block: Block, where: str, label: int) -> None:
    kind, nodes = file.elements.pop(label)
    require("NONLINEAR" not in block.parameters, f"{where} is nonlinear: write its stiffness at the working point")
    require(len(block.data) > 0, f"{where} has no stiffness")
    orientation = block.get("ORIENTATION")
    require(
        not orientation or orientation.upper() in file.orientations,
        f"{where}: *ORIENTATION {orientation} is not a rectangular system by points without a turn",
    )
    axes = file.orientations.get(orientation.upper(), np.eye(3))
    row = np.zeros((2, 2, 3))
    if kind == "springa2":
        direction = np.subtract(file.parts.nodes[nodes[1]], file.parts.nodes[nodes[0]])
        require(bool(direction.any()), f"{where}: element {label} joins nodes at one place: its direction is not known")
        row[0, 0] = direction / np.linalg.norm(direction)
        row[1, 0] = -row[0, 0]
        powers = [0, 0]
    else:
        freedoms = [int(c) for c in block.data[0] if c] if len(block.data) > 1 else []
        require(len(freedoms) == len(nodes), f"{where}: degrees of freedom of {len(nodes)} nodes are needed")
        for end, freedom in enumerate(freedoms):
            require(nodes[end] not in file.transforms, f"{where}: node {nodes[end]} has a *TRANSFORM")
            row[end, (freedom - 1) // 3] = (1.0, -1.0)[end] * axes[:, (freedom - 1) % 3]
        powers = [(freedom - 1) // 3 for freedom in (*freedoms, freedoms[0])[:2]]
    value = real(block.data[-1][0]) * file.system.force / file.system.length
    scale = np.repeat([file.system.length**power for power in powers], 6)
    flat = scale * row.ravel()
    a, b = (*nodes, None)[:2]
    file.parts.structure.springs.append((label, a, b, value * np.outer(flat, flat)))
