"""Solids, shells, beams, masses and springs of an archive."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.fem.structural.model import BeamSection
from nvhchain.fem.structural.sections import rectangle, round_tube, section
from nvhchain.handoff import FloatArray
from nvhchain.interop.ansys.database import Database, Element
from nvhchain.interop.solids._structure_parts import ShellSection

BRICKS, TETRAHEDRA, LINEAR_TETRAHEDRA = (45, 95, 185, 186), (92, 187), (285,)
SHELLS, BEAMS, TRUSSES, MASSES, SPRINGS = (63, 93, 181, 281), (188, 189), (8, 180), (21,), (14,)
_COLLAPSED: tuple[tuple[str, tuple[int, ...], tuple[int, ...]], ...] = (
    ("hex", (0, 1, 2, 3, 4, 5, 6, 7), (8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19)),
    ("wedge", (0, 1, 2, 4, 5, 6), (8, 9, 11, 12, 13, 15, 16, 17, 18)),
    ("tet", (0, 1, 2, 4), (8, 9, 11, 16, 17, 18)),
)
"""Shape of a brick by its number of distinct corners 8, 6, 4: places of its corners and mid-edge nodes."""

_BEAM_SHAPES: Mapping[str, tuple[str, tuple[int, ...]]] = {
    "I": ("I", (2, 0, 1, 5, 3, 4)),
    "T": ("T", (0, 1, 2, 3)),
}
"""Subtype → kind of our section and the places of its dimensions in SECDATA."""


def read_elements(base: Database) -> None:
    """Read all elements that are no couplings."""
    for element in base.elements_by_type((*BRICKS, *TETRAHEDRA, *LINEAR_TETRAHEDRA)):
        _solid(base, element)
    for element in base.elements_by_type(SHELLS):
        _shell(base, element)
    for element in base.elements_by_type((*BEAMS, *TRUSSES)):
        _beam(base, element)
    for element in base.elements_by_type(MASSES):
        _mass(base, element)
    for element in base.elements_by_type(SPRINGS):
        _spring(base, element)


def _solid(base: Database, element: Element) -> None:
    number, nodes = base.types[element.kind][0], element.nodes
    where = f"{base.source}: element {element.label} (SOLID{number})"
    if number in BRICKS:
        require(len(nodes) >= 8, f"{where} has {len(nodes)} nodes: 8 are needed")
        found = [one for one in _COLLAPSED if len(one[1]) == len(set(nodes[:8]))]
        require(bool(found), f"{where} is a pyramid or collapsed: mesh it with tetrahedra, wedges or bricks")
        shape, corners, middles = found[0]
        members = [nodes[i] for i in corners]
        edges = [nodes[i] if i < len(nodes) else 0 for i in middles]
    else:
        shape, edges = "tet", list(nodes[4:10])
        members = list(nodes[:4])
        require(len(set(members)) == 4, f"{where} has {len(nodes)} nodes: 4 different corners are needed")
    full = any(edges)
    require(
        not full or (all(edges) and len(edges) == {"tet": 6, "wedge": 9, "hex": 12}[shape]),
        f"{where} has mid-edge nodes on some edges only: give all or none",
    )
    group = f"material {element.material}"
    if group not in base.parts.materials:
        base.parts.materials[group] = base.material(element.material, f"SOLID{number} {element.label}")
    members += edges if full else []
    labels, rows = base.parts.elements[f"{shape}{len(members)}", group]
    labels.append(element.label)
    rows.append(members)


def _shell(base: Database, element: Element) -> None:
    number, length = base.types[element.kind][0], base.system.length
    where = f"{base.source}: element {element.label} (SHELL{number})"
    require(base.key(element, 1) == 0, f"{where} has membrane or bending alone (KEYOPT(1)): only shells with both")
    nodes = [n for n in element.nodes if n]
    corners, middles = nodes[:4], nodes[4:8]
    require(len(corners) == 4, f"{where} has {len(nodes)} nodes: 4 corners are needed")
    require(len(middles) in (0, 4), f"{where} has mid-edge nodes on some edges only: give all or none")
    if corners[2] == corners[3]:
        corners, middles = corners[:3], [middles[i] for i in (0, 1, 3)] if middles else []
    found = base.sections.get(element.section)
    if found is not None and found.kind == "SHEL":
        layers = [row for row in found.data if row and row[0]]
        require(len(layers) == 1, f"{where}: section {element.section} has {len(layers)} layers: one is read")
        thickness = length * float(layers[0][0])
        material = int(layers[0][1]) if len(layers[0]) > 1 and layers[0][1] else element.material
        shares = {"MID": 0.0, "TOP": -0.5, "BOT": 0.5}
        require(found.offset[0] in shares, f"{where}: SECOFFSET, {', '.join(found.offset)}: use MID, TOP or BOT")
        offset = shares[found.offset[0]] * thickness
    else:
        values = base.constants.get(element.constants, [])
        require(bool(values) and values[0] > 0, f"{where} has no section (SECTYPE) and no thickness (R)")
        _only_thickness(values, where, number)
        corner_thickness = [value or values[0] for value in [*values, 0.0, 0.0, 0.0][: len(corners)]]
        thickness = length * float(np.mean(corner_thickness))
        material, offset = element.material, 0.0
    group = f"section {element.section} R {element.constants} material {material}"
    if group not in base.parts.structure.shell_sections:
        law = base.material(material, f"SHELL{number} {element.label}")
        base.parts.structure.shell_sections[group] = ShellSection(law, thickness, offset=offset)
    base.parts.structure.shells[group].add(element.label, [*corners, *middles])


def _only_thickness(values: list[float], where: str, number: int) -> None:
    """Refuse real constants of a shell that change its stiffness or mass beside the thickness at its corners."""
    places = {4: "EFS", 17: "ADMSUA"} if number == 63 else {5: "ADMSUA"}
    given = [word for place, word in places.items() if place < len(values) and values[place]]
    if number == 63 and len(values) > 6 and values[6] not in (0.0, 1.0):
        given.append("RMI")
    require(
        not given, f"{where} has {', '.join(given)} among its real constants, not read: use COMBIN14, MASS21, density"
    )


def _beam(base: Database, element: Element) -> None:
    number, L = base.types[element.kind][0], base.system.length
    where = f"{base.source}: element {element.label} ({'BEAM' if number in BEAMS else 'LINK'}{number})"
    nodes = [n for n in element.nodes if n]
    count = 3 if number == 189 else 2
    require(len(nodes) >= count, f"{where} has {len(nodes)} nodes: {count} are needed")
    a, b = base.place(nodes[0]), base.place(nodes[1])
    axis = b - a
    size = float(np.linalg.norm(axis))
    require(size > 0, f"{where} has no length")
    if len(nodes) > count:
        direction = base.place(nodes[count]) - a
    else:  # y lies across global Z, or along global Y where the beam is along Z
        y = np.cross([0.0, 0.0, 1.0], axis)
        y = y if np.linalg.norm(y) > 1e-4 * size else np.array([0.0, 1.0, 0.0])
        direction = np.cross(axis, y)
    group = f"section {element.section} R {element.constants} material {element.material}"
    if group not in base.parts.structure.beam_sections:
        law = _beam_section(base, element, where)
        material = base.material(element.material, where.split(": ")[-1])
        base.parts.structure.beam_sections[group] = material, law
    for ends in ((nodes[0], nodes[1]),) if count == 2 else ((nodes[0], nodes[2]), (nodes[2], nodes[1])):
        base.parts.structure.beams[group].add(element.label, ends, L * direction)


def _beam_section(base: Database, element: Element, where: str) -> BeamSection:
    """Return a section whose y axis is Ansys's z, in the plane of the direction node."""
    L, found = base.system.length, base.sections.get(element.section)
    if base.types[element.kind][0] in TRUSSES:
        data = [float(x) for row in found.data for x in row if x] if found else base.constants.get(element.constants)
        data = data or [0.0]
        require(data[0] > 0, f"{where} has no area: write SECDATA or R")
        return BeamSection(data[0] * L**2, 0.0, 0.0, 0.0)
    require(found is not None and found.kind == "BEAM", f"{where} has no beam section {element.section} (SECTYPE)")
    assert found is not None
    cells = [float(x or 0) for row in found.data for x in row]
    round_one = found.subtype in ("RECT", "CSOL", "CSOLID", "CTUB", "CTUBE", "ASEC")
    require(
        found.offset[0] in ("MID", "CENT", "SHRC") or (round_one and found.offset[0].startswith("ORIG")),
        f"{where}: SECOFFSET, {', '.join(found.offset)}: move the nodes to the centroid (CENT)",
    )
    need = {"RECT": 2, "CSOL": 1, "CTUB": 2, "HREC": 6, "I": 6, "T": 4, "CHAN": 6, "ASEC": 6}
    kind = found.subtype[:4]
    if kind not in need:
        raise InputError(f"{where} has a section {found.subtype or 'without subtype'}: {', '.join(need)} are read")
    require(len(cells) >= need[kind], f"{where}: section {kind} has {len(cells)} numbers: {need[kind]} are needed")
    if kind == "ASEC":
        area, bending_z, product, bending_y, _, torsion = cells[:6]
        require(not any(cells[6:10]), f"{where}: ASEC has its centroid or shear centre off the nodes: move the nodes")
        return BeamSection(area * L**2, bending_z * L**4, bending_y * L**4, torsion * L**4, -product * L**4, 1.0, 1.0)
    sizes = [L * cell for cell in cells]
    if kind == "RECT":
        return rectangle(sizes[0], sizes[1])
    if kind == "CSOL":
        return round_tube(sizes[0])
    if kind == "CTUB":
        return round_tube(sizes[1], sizes[0])
    if kind == "HREC":
        require(len(set(sizes[2:6])) == 1, f"{where}: the four walls of HREC must be alike: state ASEC otherwise")
        return section("BOX", [sizes[0], sizes[1], sizes[4], sizes[2]])
    if kind == "CHAN":
        require(sizes[0] == sizes[1] and sizes[3] == sizes[4], f"{where}: both flanges of CHAN must be alike")
        return section("CHAN", [sizes[0], sizes[2], sizes[5], sizes[3]])
    ours, places = _BEAM_SHAPES[kind]
    return section(ours, [sizes[i] for i in places])


def _mass(base: Database, element: Element) -> None:
    where, mass = f"{base.source}: element {element.label} (MASS21)", base.system.mass
    values = base.constants.get(element.constants, [])
    option = base.key(element, 3)
    require(bool(values), f"{where} has no real constants R {element.constants}")
    require(option in (0, 2), f"{where} is in the plane (KEYOPT(3) = {option}): only 0 and 2 are read")
    require(base.key(element, 1) == 0, f"{where} takes its mass from a volume (KEYOPT(1)): write the mass")
    table = np.zeros((6, 6))
    if option == 2:
        table[:3, :3] = mass * values[0] * np.eye(3)
    else:
        own = ([*values, 0.0, 0.0, 0.0, 0.0, 0.0])[:6]
        table += np.diag(own) * mass * np.repeat([1.0, base.system.length**2], 3)
    node = element.nodes[0]
    own_axes = base.axes.get(node, np.eye(3)) if base.key(element, 2) else np.eye(3)
    turn = np.kron(np.eye(2), own_axes)
    base.parts.structure.masses.append((element.label, node, turn @ table @ turn.T))


def _spring(base: Database, element: Element) -> None:
    where, L = f"{base.source}: element {element.label} (COMBIN14)", base.system.length
    values, nodes = base.constants.get(element.constants, []), element.nodes[:2]
    require(bool(values), f"{where} has no stiffness R {element.constants}")
    require(len(nodes) == 2 and all(nodes), f"{where} has {len(nodes)} nodes: 2 are needed")
    axis, option = base.key(element, 2), base.key(element, 3)
    require(0 <= axis <= 6 and option in (0, 1), f"{where}: KEYOPT(2) = {axis}, KEYOPT(3) = {option} is not read")
    unit = base.system.force / L
    row = np.zeros(12)
    if axis:
        axes = base.axes.get(nodes[0], np.eye(3))
        row[3 * ((axis - 1) // 3) :][:3] = axes[:, (axis - 1) % 3]
        turning = axis > 3
    else:
        direction: FloatArray = base.place(nodes[1]) - base.place(nodes[0])
        require(bool(direction.any()), f"{where} joins nodes at one place: set KEYOPT(2) to its direction")
        turning = option == 1
        row[3 * turning :][:3] = direction / np.linalg.norm(direction)
    row[6:] = -row[:6]
    stiffness = values[0] * unit * (L**2 if turning else 1.0) * np.outer(row, row)
    base.parts.structure.springs.append((element.label, nodes[0], nodes[1], stiffness))
