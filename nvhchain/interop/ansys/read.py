"""Import of an archive of Ansys MAPDL (CDWRITE) as `SolidModel`."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from nvhchain.errors import InputError, require
from nvhchain.fem.solid_model import SolidModel
from nvhchain.interop.ansys import couplings, elements
from nvhchain.interop.ansys.archive import Command, commands
from nvhchain.interop.ansys.database import TABLES, Database, read_tables
from nvhchain.interop.notation._texts import damaged, named
from nvhchain.interop.notation.units import UnitSystem, unit_system
from nvhchain.interop.solids._model_parts import Parts

_READ = frozenset(
    (
        *elements.BRICKS, *elements.TETRAHEDRA, *elements.LINEAR_TETRAHEDRA, *elements.SHELLS, *elements.BEAMS,
        *elements.TRUSSES, *elements.MASSES, *elements.SPRINGS, *couplings.RIGID_BEAMS, *couplings.TARGETS,
        *couplings.CONTACTS,
    )
)  # fmt: skip
_IDLE_ELEMENTS = frozenset((39, 37, 151, 152, 153, 154, 155, 156, 159, 200, 201))
"""Faces, followers and mesh facets, without stiffness and mass of their own."""

_SURFACES = frozenset((153, 154, 156))
"""Elements of faces that may have stiffness or mass by real constants."""

_PASSED_OVER = re.compile(
    r"(/|\*|_|C\*\*\*)"
    r"|(NUMOFF|DOF|N|ET|TYPE|REAL|MAT|SECNUM|ESYS|EXTOPT|TREF|BFUNIF|ACEL|OMEGA|DOMEGA|CG\w+|IRLF|FINISH|ANTYPE|MODOPT"
    r"|MXPAND|MODCONTROL|QRDOPT|MPTEMP|MPT\w*|UIMP|TIME|ERESX|KUSE|NEQIT|NCNV|CRPLIM|DMP\w*|ALPHAD|BETAD|DCG\w+|F|SF|SFE"
    r"|SFBEAM|BF|BFE\w*|BFBLOCK|SFEBLOCK|FBLOCK|CMSEL|CMGRP|SECCONTROLS?|SECNAME|TOFFST|EN|TBLIST|LUMPM|OUTRES"
    r"|OUTPR|KBC|AUTOTS|NSUBST|DELTIM|CNVTOL|RESCONTROL|SOLCONTROL|NLGEOM|PRED|EQSLV|TUNIF|STITLE|SHPP|CHECK|LOCAL|CS\w*"
    r"|CLOCAL|DSYS|RSYS|NROTAT|FREQ\w*|HARFRQ|HROPT|HROUT|EXPASS|TINTP|TRNOPT|RATE|CUTCONTROL|SSTIF|PSTRES|D|CP|CE"
    r"|CM|CMEDIT|KEYW|ASSIGN|PARSAV|PARRES|LSEL|NSEL|ESEL|ALLSEL|GRP\w*|NUMCMP|GST|SAVE|SOLVE|RESUME|EXIT|STAOPT"
    r"|TBFIELD|TBTEMP|TBDATA|TBPT|TBFT)$"
)
"""Commands that are read elsewhere, and those that change neither stiffness nor mass."""

_UNITS = {"SI": "m-kg-s", "MKS": "m-kg-s", "MPA": "mm-t-s", "BIN": "in-lbf-s"}
"""Label of /UNITS → unit system; other labels are refused, USER is not judged."""


def read_cdb(path: str | Path, *, units: str) -> SolidModel:
    """Read an archive of Ansys MAPDL.

    Raises FileFormatError for a damaged file, InputError for elements and commands that cannot be imported.
    """
    path, system = Path(path), unit_system(units)
    found = commands(path)
    base = Database(Parts(str(path)), system)
    with damaged(path, lambda error: f"no archive of Ansys: {named(error)}"):
        _check_commands(base, found)
        read_tables(base, found)
        require(
            bool(base.parts.nodes),
            f"{path}: holds no NBLOCK: write an archive by CDWRITE, DB in the blocked form",
        )
        _check_elements(base)
        elements.read_elements(base)
        couplings.read_couplings(base, found)
    return base.parts.model(system.length)


def _check_commands(base: Database, found: list[Command]) -> None:
    """Refuse commands that change the model and are not read, and note those excluded."""
    counts = Counter(one.name for one in found if one.name not in TABLES and not _PASSED_OVER.match(one.name))
    laws = [one for one in found if one.name == "TB"]
    elastic = [one for one in laws if one.get(0).upper()[:4] in ("ELAS", "ANEL", "HYPE", "BH", "PERF")]
    del counts["TB"]
    for one in found:
        if one.name == "/UNITS" and one.get(0).upper() not in ("", "USER"):
            _check_units(base.source, one.get(0).upper(), base.system)
    require(
        not elastic,
        f"{base.source}: carries {len(elastic)} TB of elasticity, the first is TB, "
        f"{', '.join(elastic[0].fields[:2] if elastic else [])}: state EX, PRXY and DENS by MP",
    )
    held = [one for one in found if one.name == "DBLOCK"]
    require(not held, f"{base.source}: carries constraints as DBLOCK: write them as D commands, by CDWRITE, DB")
    heavy = [one for one in found if re.fullmatch("SECCONTROLS?", one.name) and _stated(one.get(3))]
    require(
        not heavy,
        f"{base.source}: line {heavy[0].line if heavy else 0}: SECCONTROLS states added mass, which is not read: write "
        "it into the density, or as MASS21",
    )
    unblocked = [one for one in found if one.name in ("N", "EN") and "-1" not in one.fields]
    points = [one for one in unblocked if one.name == "N"]
    require(
        not points,
        f"{base.source}: carries {len(points)} N commands: write the archive in the blocked form, CDWRITE, DB",
    )
    if laws:
        counts["TB"] = len(laws)
    if counts:
        listed = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
        base.parts.notes.append(f"{listed} excluded: they are not read")


def _stated(cell: str) -> bool:
    """Return True for a number other than 0."""
    return bool(cell) and float(cell) != 0.0


def _check_units(source: str, label: str, system: UnitSystem) -> None:
    require(label in _UNITS, f"{source}: /UNITS, {label} is not read: {', '.join(_UNITS)} are")
    require(_UNITS[label] == system.name, f"{source}: /UNITS, {label} is {_UNITS[label]}, read in {system.name}")


def _check_elements(base: Database) -> None:
    """Refuse elements of types that are not read; note those without stiffness and mass."""
    counts: Counter[int] = Counter()
    first: dict[int, int] = {}
    for element in base.elements:
        require(
            element.kind in base.types,
            f"{base.source}: element {element.label} is of type {element.kind}, which no ET defines",
        )
        number = base.types[element.kind][0]
        counts[number] += 1
        first.setdefault(number, element.label)
        if number in _SURFACES:
            values = base.constants.get(element.constants, [])
            given = [
                word
                for place, word in ((3, "foundation stiffness (EFS)"), (5, "added mass (ADMSUA)"))
                if place < len(values) and values[place]
            ]
            require(
                not given,
                f"{base.source}: element {element.label} (SURF{number}) has {' and '.join(given)}, not read: use "
                "COMBIN14 or MASS21",
            )
    refused = {number: count for number, count in counts.items() if number not in _READ | _IDLE_ELEMENTS}
    if refused:
        listed = ", ".join(f"{count} of type {number}" for number, count in sorted(refused.items()))
        raise InputError(
            f"{base.source}: carries elements {listed}, which are not read (the first is element "
            f"{first[min(refused)]}): use SOLID185/186/187/285, SHELL181/281, BEAM188/189, MASS21 or COMBIN14"
        )
    idle = {number: count for number, count in counts.items() if number in _IDLE_ELEMENTS}
    if idle:
        listed = ", ".join(f"{count} of type {number}" for number, count in sorted(idle.items()))
        base.parts.notes.append(f"elements {listed} excluded: they have no stiffness and no mass of their own")
