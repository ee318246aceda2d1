"""Import of Abaqus and CalculiX input as `SolidModel`: solids, shells, beams, sets, surfaces, couplings, ties.

Boundary conditions are read, too. Parts may be in instances, moved or not, or in a flat file. Keywords of the model are
refused unless they are read or have no effect. Steps, loads and requests for output are ignored.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.fem.solid_model import KINDS, SolidModel
from nvhchain.interop.notation._names import marks, restored
from nvhchain.interop.notation._texts import damaged
from nvhchain.interop.notation.units import unit_system
from nvhchain.interop.solids._model_parts import Parts
from nvhchain.interop.solids.abaqus_keywords import Block, all_lines, blocks, real
from nvhchain.interop.solids.abaqus_rigid import (
    read_boundary,
    read_coupling,
    read_kinematic,
    read_kinematic_coupling,
    read_mpc,
    read_rigid_body,
    read_surface,
    read_tie,
)
from nvhchain.interop.solids.abaqus_sets import ASSEMBLY, AbaqusFile, members_of, motion
from nvhchain.interop.solids.abaqus_structure import (
    OTHER_ELEMENTS,
    SECTIONS,
    assign_sections,
    assign_truss,
    keep_section,
    leftovers,
    read_connector_elasticity,
    read_distributing,
    read_equation,
    read_orientation,
    read_transform,
    start_behavior,
)

_SOLID = re.compile(r"C3D(4|6|8|10|15|20)(?=$|[RIHMTS])")
_KIND = {"4": "tet4", "10": "tet10", "6": "wedge6", "15": "wedge15", "8": "hex8", "20": "hex20"}

_FORM = "labels must be whole numbers, coordinates numbers"

_PASSED_OVER = {
    "HEADING", "PREPRINT", "AMPLITUDE", "RESTART", "FILE FORMAT",
    "PHYSICAL CONSTANTS", "DAMPING", "PLASTIC", "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT", "INITIAL CONDITIONS",
    "DISTRIBUTION", "DISTRIBUTION TABLE", "SECTION CONTROLS", "HOURGLASS STIFFNESS", "SURFACE INTERACTION", "FRICTION",
    "SURFACE BEHAVIOR", "TIME POINTS", "FILTER", "CONTACT PAIR", "CONTACT", "CONTACT INCLUSIONS", "CONTACT EXCLUSIONS",
    "CONTACT PROPERTY ASSIGNMENT", "SURFACE PROPERTY ASSIGNMENT", "CONTACT CONTROLS", "CONTACT INITIALIZATION DATA",
    "CONTACT INITIALIZATION ASSIGNMENT", "CONTACT FORMULATION", "GAP CONDUCTANCE",
    "CONNECTOR DAMPING", "DESIGN VARIABLES", "OBJECTIVE",
    "CONSTRAINT", "CLEARANCE", "VISCOELASTIC", "CREEP", "LATENT HEAT",
}  # fmt: skip
"""Keywords of the model that change neither stiffness nor mass; those of steps are all ignored.

Materials are isotropic, and couplings hold all translations.
"""


def read_abaqus(path: str | Path, *, units: str) -> SolidModel:
    """Read an Abaqus input file.

    Returns model in SI units.
    """
    path = Path(path)
    file = AbaqusFile(Parts(str(path)), unit_system(units))
    step_open, steps, holding = False, 0, set()
    with damaged(path, lambda error: f"not an Abaqus input file at {file.reading}: {_FORM}: {error}"):
        for block in blocks(path):
            file.reading = f"*{block.name}"
            step_open = (step_open or block.name == "STEP") and block.name != "END STEP"
            steps += block.name == "STEP"
            if block.name == "BOUNDARY" and step_open:
                holding.add(steps)
                require(
                    len(holding) == 1,
                    f"{path}: *BOUNDARY in steps {', '.join(map(str, sorted(holding)))}: which of them holds the "
                    "housing is not known: keep it in one step, or before the steps",
                )
            require(
                block.name != "MODEL CHANGE",
                f"{path}: *MODEL CHANGE takes elements out or brings them back, which is not read: leave out "
                "those that are not there",
            )
            known = block.name in _READERS or block.name in _LATE or block.name in _PASSED_OVER
            if not known and not step_open and block.name != "END STEP":
                example = ", ".join(block.data[0]) if block.data else "no data"
                raise InputError(
                    f"{path}: *{block.name} is not read (its first line is {example}): replace it by solids, shells, "
                    "beams, springs or couplings"
                )
            if file.part and block.name != "END PART":
                file.contents[file.part].append(block)
            else:
                _take(file, block)
        require(not file.part, f"{path}: part {file.part} does not end: the file is cut off, export it again")
        require(
            not file.contents or bool(file.instance),
            f"{path}: part {', '.join(file.contents)} has no *INSTANCE: without one it is not in the model",
        )
        for name, apply in _LATE.items():
            for level, instance, block in file.late:
                if block.name == name:
                    file.level, file.instance, file.reading = level, instance, f"*{name}"
                    apply(file, block)
        _assign(file)
    file.parts.groups = file.group_names()
    return restored(file.parts.model(file.system.length), marks(all_lines(path)))


def _take(file: AbaqusFile, block: Block) -> None:
    """Read a keyword for its owner, or put it off until all names are known."""
    file.reading = f"*{block.name}"
    _READERS.get(block.name, _ignored)(file, block)
    if block.name in _LATE:
        file.late.append((file.level, file.instance, block))


def _ignored(file: AbaqusFile, block: Block) -> None:
    pass


def _node(file: AbaqusFile, block: Block) -> None:
    require(
        block.get("SYSTEM", "R").upper() == "R",
        f"{file.parts.source}: *NODE in a cylindrical or spherical system: write it in the rectangular one",
    )
    labels = [int(row[0]) + file.offset for row in block.data]
    points = np.array([[*(real(c) if c else 0.0 for c in row[1:4]), 0.0, 0.0, 0.0][:3] for row in block.data])
    if file.owner in file.motions and len(points):
        points = file.motions[file.owner](points)
    for row, label, (x, y, z) in zip(block.data, labels, points.tolist(), strict=True):
        require(
            file.parts.nodes.get(label, (x, y, z)) == (x, y, z),
            f"{file.parts.source}: node {row[0]} is defined twice, at different places",
        )
        file.parts.nodes[label] = (x, y, z)
    if block.get("NSET"):
        file.add(file.nsets, block.get("NSET"), labels)


def _element(file: AbaqusFile, block: Block) -> None:
    kind = block.get("TYPE").upper()
    found = _SOLID.match(kind)
    other = next(((own, count) for pattern, own, count in OTHER_ELEMENTS if pattern.match(kind)), None)
    require(
        found is not None or other is not None,
        f"{file.parts.source}: {len(block.data)} elements of type {kind} are not read (the first is "
        f"{', '.join(block.data[0]) if block.data else 'missing'}): use C3D4/10, C3D6/15 or C3D8/20, S3/S4/S8R, B31",
    )
    own, count = other or (_KIND[found[1]], int(found[1]))  # type: ignore[index]
    require(
        file.owner != ASSEMBLY or count == 1 or own.startswith(("spring", "dashpot", "connector")),
        f"{file.parts.source}: *ELEMENT, TYPE={kind} in the assembly: write it into the part",
    )
    if file.owner == ASSEMBLY:  # nodes may be of instances: `instance.number`
        _assembly_elements(file, block, own)
        return
    cells = [int(c) + file.offset for row in block.data for c in row if c]
    require(len(cells) % (count + 1) == 0, f"{file.parts.source}: {kind} elements have {len(cells)} numbers in all")
    labels = cells[:: count + 1]
    for i, label in enumerate(labels):
        start = i * (count + 1) + 1
        made = (own, cells[start : start + count])
        require(
            file.elements.get(label, made) == made,
            f"{file.parts.source}: element {label} is defined twice, on different nodes",
        )
        file.elements[label] = made
    if block.get("ELSET"):
        file.add(file.elsets, block.get("ELSET"), labels)


def _assembly_elements(file: AbaqusFile, block: Block, kind: str) -> None:
    """Read masses and springs of the assembly, whose nodes are `number` or `instance.number`."""
    labels = []
    for row in block.data:
        label = int(row[0]) + file.offset
        file.elements[label] = (kind, [file.labels(cell, file.nsets)[0] for cell in row[1:] if cell])
        labels.append(label)
    if block.get("ELSET"):
        file.add(file.elsets, block.get("ELSET"), labels)


def _nset(file: AbaqusFile, block: Block) -> None:
    if block.get("ELSET"):
        elements = file.named(file.elsets, block.get("ELSET"))
        labels = sorted({n for e in elements for n in file.elements[e][1]})
    else:
        labels = members_of(file, block, file.nsets)
    file.add(file.nsets, block.get("NSET"), labels)


def _elset(file: AbaqusFile, block: Block) -> None:
    file.add(file.elsets, block.get("ELSET"), members_of(file, block, file.elsets))


def _start_material(file: AbaqusFile, block: Block) -> None:
    file.material = block.get("NAME").upper()
    require(file.material not in file.materials, f"{file.parts.source}: material {block.get('NAME')} is defined twice")
    file.materials[file.material] = {}


def _elastic(file: AbaqusFile, block: Block) -> None:
    kind = block.get("TYPE", "ISOTROPIC").upper()
    require(kind.startswith("ISO"), f"{file.parts.source}: *ELASTIC of type {kind}: only isotropic is read")
    require(
        len(block.data) == 1,
        f"{file.parts.source}: *ELASTIC has {len(block.data)} rows: write the one of the temperature wanted",
    )
    _state(file, block, {"young": real(block.data[0][0]), "poisson": real(block.data[0][1])})


def _density(file: AbaqusFile, block: Block) -> None:
    require(
        len(block.data) == 1,
        f"{file.parts.source}: *DENSITY has {len(block.data)} rows: write the one of the temperature wanted",
    )
    _state(file, block, {"density": real(block.data[0][0])})


def _state(file: AbaqusFile, block: Block, constants: dict[str, float]) -> None:
    """Add constants to the current material, which must not have them yet."""
    known = file.materials[file.material]
    require(
        not known.keys() & constants.keys(),
        f"{file.parts.source}: material {file.material} has *{block.name} twice: keep one",
    )
    known |= constants


def _section(file: AbaqusFile, block: Block) -> None:
    area = real(block.data[0][0]) if block.data and block.data[0][0] else 1.0
    file.sections.append((file.owner, block.get("ELSET"), block.get("MATERIAL").upper(), area))


def _assembly(file: AbaqusFile, block: Block) -> None:
    file.level, file.assembly = "assembly", block.get("NAME").upper()


def _part(file: AbaqusFile, block: Block) -> None:
    file.part = block.get("NAME").upper()
    require(
        file.part not in file.contents and not file.parts.nodes,
        f"{file.parts.source}: part {block.get('NAME')} is there twice, or beside nodes of no part: write all as parts",
    )
    file.contents[file.part] = []


def _end_part(file: AbaqusFile, block: Block) -> None:
    file.part, file.level = "", "assembly"  # later keywords, materials apart, belong to no part


def _instance(file: AbaqusFile, block: Block) -> None:
    name, part = block.get("NAME"), block.get("PART").upper()
    require(name.upper() not in file.offsets, f"{file.parts.source}: instance {name} is there twice: rename one")
    require(
        part in file.contents,
        f"{file.parts.source}: instance {name} is of part {part or 'no name'}, there is "
        f"{', '.join(file.contents) or 'none'}: write the part before the assembly",
    )
    file.begin(name.upper(), motion(block))
    for own in file.contents[part]:
        _take(file, own)
    file.end_part()


def _end_instance(file: AbaqusFile, block: Block) -> None:
    file.level = "assembly"


def _assign(file: AbaqusFile) -> None:
    """Assign every element the material of its set's section."""
    given: dict[int, str] = {}
    instances = Counter(elset for _, elset in {(owner, elset.upper()) for owner, elset, *_ in file.sections})
    for owner, elset, name, area in file.sections:
        found = file.materials.get(name, {})
        where = f"{file.parts.source}: material {name} of section {elset}"
        require({"young", "poisson", "density"} <= found.keys(), f"{where} needs *ELASTIC and *DENSITY")
        key = owner, elset.upper()
        require(key in file.elsets, f"{file.parts.source}: section for set {elset}, which is not defined")
        group = elset if instances[elset.upper()] == 1 else f"{owner}.{elset}"
        file.parts.materials[group] = file.system.material(**found, place=where)
        for label in dict.fromkeys(file.elsets[key]):
            require(
                label not in given,
                f"{file.parts.source}: element {label} has two sections, of sets {given.get(label)} and {elset}: "
                "keep one",
            )
            if label in file.elements and file.elements[label][0] == "truss2":
                assign_truss(file, group, label, file.parts.materials[group], area * file.system.length**2)
            elif label in file.elements and file.elements[label][0] in KINDS:
                given[label] = elset
                kind, members = file.elements.pop(label)
                labels, rows = file.parts.elements[kind, group]
                labels.append(label)
                rows.append(members)
    assign_sections(file)
    leftovers(file, {n for _, rows in file.parts.elements.values() for row in rows for n in row})
    require(
        not file.elements,
        f"{file.parts.source}: {len(file.elements)} elements, first {next(iter(file.elements), 0)}, have no section",
    )


_READERS: dict[str, Callable[[AbaqusFile, Block], None]] = {
    "NODE": _node,
    "ELEMENT": _element,
    "NSET": _nset,
    "ELSET": _elset,
    "SURFACE": read_surface,
    "COUPLING": read_coupling,
    "KINEMATIC": read_kinematic,
    "DISTRIBUTING": read_distributing,
    "TRANSFORM": read_transform,
    "CONNECTOR BEHAVIOR": start_behavior,
    "CONNECTOR ELASTICITY": read_connector_elasticity,
    "ORIENTATION": read_orientation,
    **dict.fromkeys(SECTIONS, keep_section),
    "MATERIAL": _start_material,
    "ELASTIC": _elastic,
    "DENSITY": _density,
    "SOLID SECTION": _section,
    "ASSEMBLY": _assembly,
    "END ASSEMBLY": _ignored,
    "PART": _part,
    "END PART": _end_part,
    "INSTANCE": _instance,
    "END INSTANCE": _end_instance,
}
_LATE: dict[str, Callable[[AbaqusFile, Block], None]] = {
    "BOUNDARY": read_boundary,
    "RIGID BODY": read_rigid_body,
    "KINEMATIC COUPLING": read_kinematic_coupling,
    "MPC": read_mpc,
    "EQUATION": read_equation,
    "TIE": read_tie,
}
