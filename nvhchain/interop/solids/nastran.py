"""Import of Nastran bulk data as `SolidModel`: nodes, solids, materials, RBE2, constraints, sets, and structure.

Cards that are read: GRID, CORD1, CORD2, CTETRA, CPENTA, CHEXA, PSOLID, MAT1, RBE2, SPC, SPC1, SPCADD, SET1, and those
of `nastran_structure`. Other cards are refused unless they have no effect. Loads and requests for output are ignored.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem.solid_model import SolidModel
from nvhchain.interop.notation._names import marks, restored
from nvhchain.interop.notation._texts import damaged, named
from nvhchain.interop.notation.units import UnitSystem, unit_system
from nvhchain.interop.solids._model_parts import TRANSLATIONS, Parts, Rigid
from nvhchain.interop.solids.nastran_cards import cards, numbers, real, split_deck
from nvhchain.interop.solids.nastran_frames import BASIC, Deck, Frame, basic_components, frames_and_grids
from nvhchain.interop.solids.nastran_structure import (
    BEAMS,
    OTHERS,
    SECTIONS,
    SHELLS,
    read_structure,
    rigid_members,
)

SOLIDS: dict[str, tuple[str, str, tuple[int, ...]]] = {
    "CTETRA": ("tet4", "tet10", tuple(range(10))),
    "CPENTA": ("wedge6", "wedge15", (*range(9), 12, 13, 14, 9, 10, 11)),
    "CHEXA": ("hex8", "hex20", (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)),
}
"""Card → linear and quadratic kind, and the place in the card of every node of the quadratic kind."""

_PASSED_OVER = re.compile(
    r"(GRID|GRDSET|CORD[12][RCS]|CTETRA|CPENTA|CHEXA|PSOLID|MAT1|RBE2|SPC|SPC1|SPCADD|SPCD|SET1|SET3|PARAM|MDLPRM|ENDDATA|ECHO\w*)$"
    r"|(EIG\w*|FORCE\d?|MOMENT\d?|PLOAD\w*|GRAV|ACCEL\d?|RFORCE|TEMP\w*|LOAD|LSEQ|DLOAD|[RT]LOAD[12]|DAREA|DELAY|DPHASE"
    r"|PLOTEL\d?|FREQ\d?|TSTEP\w*|TABLE\w*|TABD\w*|TABRND\w*|RANDPS|RANDT\d|NL\w*|QVOL|QHBDY|RLOAD\w*|DTI|CSET1?|BSET1?|ASET1?|OMIT1?|SPOINT)$"
)
"""Cards that are read, and those of loads, frequencies, tables and output, which change neither stiffness nor mass."""

_NO_EFFECT = re.compile(
    r"(DESVAR|DRESP\w*|DCONSTR|DCONADD|DVPREL\w*|DVCREL\w*|DVMREL\w*|DVTREL\w*|DVGRID|DLINK|DOPTPRM|DSCREEN|DTPL|DTPG|DSHAPE"
    r"|DSIZE|DOBJREF|DREPADD|DREPORT|DEQATN|DTABLE|DGLOBAL|DMNCON|DMRLAW|TOPVAR|BSURF\w*|BCPROP\w*|BCRPARA|BCTPARM|BCTPARA"
    r"|BCPARA|BGPARM|BCTSET|BCTADD|BLSEG|BCONP|BFRIC|GROUP|HM\w*|CDAMP\d|PDAMP|CVISC|PVISC|MAT[TS]\d|MAT(2|3|4|5|8|9|10)"
    r"|USET\d?|SUPORT1?|MONPNT\d)$"
)
"""Cards of optimisation, contact without glue, damping and further laws of materials, without effect on a linear model.

A section that refers to one of these materials is refused.
"""

_READ = frozenset((*SHELLS, *BEAMS, *SECTIONS, *OTHERS))

_UNITSYS = {
    "MN-MM": "mm-kg-s", "MN_MM": "mm-kg-s", "N-MM": "mm-t-s", "N_MM": "mm-t-s", "M-N": "m-kg-s", "N-M": "m-kg-s",
    "N_M": "m-kg-s", "METRIC": "m-kg-s", "SI": "m-kg-s", "MKS": "m-kg-s", "LBF-IN": "in-lbf-s", "IN-LBF": "in-lbf-s",
}  # fmt: skip
"""Value of PARAM UNITSYS → unit system."""


def read_nastran(path: str | Path, *, units: str, spc: int | None = None) -> SolidModel:
    """Read a Nastran bulk data file.

    spc: set of constraints; by default the one that case control selects for all subcases, or the only one.
    Returns model in SI units.
    """
    path, system = Path(path), unit_system(units)
    control, bulk = split_deck(path)
    named_cards: dict[str, list[list[str]]] = {}
    for card in cards(bulk):
        named_cards.setdefault(card[0], []).append(card)
    direct = [line.strip() for line in control if re.match(r"\s*[KMB]2(GG|PP)", line, re.IGNORECASE)]
    if direct:
        raise InputError(f"{path}: case control adds matrices, {direct[0]}, which are not read: remove them")
    idle = {name: len(found) for name, found in sorted(named_cards.items()) if _NO_EFFECT.match(name)}
    nonstructural = [name for name in sorted(named_cards) if re.match(r"NSM(L?1?|ADD)$", name)]
    if _selected(control, path, "NSM") is not None:
        nonstructural = []
    known = _READ | idle.keys() | set(nonstructural)
    refused = [name for name in sorted(named_cards) if name not in known and not _PASSED_OVER.match(name)]
    if refused:
        listed = ", ".join(f"{len(named_cards[name])} {name}" for name in refused)
        example = ", ".join(field for field in named_cards[refused[0]][0][:9] if field)
        raise InputError(
            f"{path}: carries {listed}, which are not read (the first is {example}): replace them by solids, shells, "
            "beams, springs or rigid sets, or remove them"
        )
    parts, found = Parts(str(path)), dict(marks(bulk))
    if idle:
        listed = ", ".join(f"{count} {name}" for name, count in idle.items())
        parts.notes.append(f"{listed} excluded: they change neither stiffness nor mass")
    if nonstructural:
        listed = ", ".join(f"{len(named_cards[name])} {name}" for name in nonstructural)
        parts.notes.append(f"{listed} excluded: case control selects none")
    with damaged(path, lambda error: f"not Nastran bulk data: {named(error)}"):
        scale = _parameters(named_cards, parts, system)
        frames = read_grids(named_cards, parts)
        read_solids(named_cards, parts)
        material = _material_reader(named_cards, parts, system, scale)
        _solid_sections(named_cards, parts, material)
        _rigid_sets(named_cards, parts)
        deck = Deck(named_cards, parts, system, frames, material, scale)
        read_structure(deck, _selected(control, path, "MPC"))
        _constraints(deck, _selected(control, path, "SPC") if spc is None else spc)
        _groups(named_cards, parts, found.pop("group", {}))
    return restored(parts.model(system.length), found)


def read_grids(named_cards: dict[str, list[list[str]]], parts: Parts) -> dict[int, Frame]:
    """Read grid points with what holds them; return the coordinate systems."""
    frames, grids = frames_and_grids(named_cards, parts.source)
    parts.nodes.update(grids)  # type: ignore[arg-type]
    defaults = (named_cards.get("GRDSET", [[]])[0] + [""] * 9)[1:9]
    for card in named_cards.get("GRID", []):
        field = card[1:] + [""] * (8 - len(card[1:]))
        label, held = int(field[0]), field[6] or defaults[6]
        rotated = int(field[5] or defaults[5] or 0)
        if rotated > 0:
            if rotated not in frames:
                raise InputError(f"{parts.source}: GRID {label} moves in coordinate system {rotated}, not defined")
            parts.rotated[label] = rotated
        if held:
            parts.held[label] |= _held(label, held, parts, frames)
    return frames


def _held(label: int, components: str, parts: Parts, frames: Mapping[int, Frame]) -> set[str]:
    """Return held components of a node in the basic system, as far as its own axes lie along that."""
    frame = frames.get(parts.rotated.get(label, 0), BASIC)
    if frame is BASIC:
        return set(components)
    found = basic_components(components, frame.axes_at(np.array(parts.nodes[label])))
    if found is None:
        parts.oblique[label] = parts.rotated[label]
    return set(components) if found is None else found


def read_solids(named_cards: dict[str, list[list[str]]], parts: Parts) -> None:
    """Read solids; FileFormatError for an element that is there twice or lacks nodes."""
    for names in ((*SOLIDS, *SHELLS, *BEAMS), ("RBE2", "RBE3", "RBAR")):
        _check_once([card[1] for name in names for card in named_cards.get(name, [])], "element", parts)
    for name, (linear, quadratic, place) in SOLIDS.items():
        corners = int(linear.lstrip("tehxwdg"))
        for card in named_cards.get(name, []):
            members = [int(x) if x else 0 for x in card[3:]]
            while len(members) > corners and not members[-1]:
                members.pop()
            kind = linear if len(members) == corners else quadratic
            if kind == quadratic:
                members = [members[i] if i < len(members) else 0 for i in place]
                if 0 in members:
                    raise InputError(
                        f"{parts.source}: {name} {card[1]} has mid-edge nodes on some edges only: give all or none"
                    )
            if len(members) < corners or 0 in members:
                raise FileFormatError(f"{parts.source}: {name} {card[1]} has {len(members)} nodes")
            labels, rows = parts.elements[kind, card[2] or card[1]]
            labels.append(int(card[1]))
            rows.append(members)


def _material_reader(
    named_cards: dict[str, list[list[str]]], parts: Parts, system: UnitSystem, scale: float
) -> Callable[[str, str], Material]:
    """Return a function from the number of a MAT1 and the section that names it to the material."""
    known = {card[1]: card[2:] + [""] * 4 for card in named_cards.get("MAT1", [])}

    def material(number: str, section: str) -> Material:
        where = f"{parts.source}: MAT1 {number} of {section}"
        if number not in known:
            raise InputError(f"{where} is not defined")
        young, shear, poisson = (real(x) if x else None for x in known[number][:3])
        if young is None and shear is not None and poisson is not None:
            young = 2 * shear * (1 + poisson)
        if poisson is None and young is not None and shear is not None:
            poisson = young / (2 * shear) - 1
        density = known[number][3]
        if young is None or poisson is None or not density:
            raise InputError(f"{where} must state two of E, G, NU, and RHO")
        return system.material(young, poisson, real(density) * scale, where)

    return material


def _solid_sections(
    named_cards: dict[str, list[list[str]]], parts: Parts, material: Callable[[str, str], Material]
) -> None:
    for name in ("MAT1", "PSOLID"):
        _check_once([card[1] for card in named_cards.get(name, [])], name, parts)
    for card in named_cards.get("PSOLID", []):
        kind = (card[7:8] or [""])[0].upper()
        if kind not in ("", "SMECH"):
            raise InputError(
                f"{parts.source}: PSOLID {card[1]} is {kind}, not structure: leave out its elements, or FCTN"
            )
        parts.materials[card[1]] = material(card[2], f"PSOLID {card[1]}")


def _check_once(numbers: list[str], subject: str, parts: Parts) -> None:
    """Raise FileFormatError if one of the numbers is given twice."""
    twice = [number for number, count in Counter(numbers).items() if count > 1]
    if twice:
        raise FileFormatError(f"{parts.source}: {subject} {twice[0]} is defined twice")


def _parameters(named_cards: dict[str, list[list[str]]], parts: Parts, system: UnitSystem) -> float:
    """Return PARAM WTMASS; InputError where PARAM UNITSYS states other units, a note where it is unknown."""
    scale = 1.0
    for card in named_cards.get("PARAM", []):
        name = card[1].upper()
        if name == "WTMASS":
            scale = real(card[2])
        elif name == "UNITSYS" and len(card) > 2:
            stated = _UNITSYS.get(card[2].upper())
            if stated is None:
                parts.notes.append(f"PARAM UNITSYS {card[2]} is unknown: read in {system.name}, as units says")
            elif stated != system.name:
                raise InputError(
                    f"{parts.source}: PARAM UNITSYS {card[2]} states {stated}, read in {system.name}: set units"
                )
    return scale


def _rigid_sets(named_cards: dict[str, list[list[str]]], parts: Parts) -> None:
    for card in named_cards.get("RBE2", []):
        if set(card[3]) >= TRANSLATIONS:
            parts.rigid.append(Rigid(card[1], int(card[2]), rigid_members(card), set(card[3]) >= set("456")))


def _selected(control: list[str], path: Path, name: str) -> int | None:
    """Return the set of constraints (SPC, MPC) in case control; InputError if subcases select different ones."""
    found = [re.match(rf"\s*{name}\s*=\s*(\d+)", line, re.I) for line in control]
    chosen = sorted({int(one[1]) for one in found if one})
    if len(chosen) > 1:
        remedy = "choose one by spc" if name == "SPC" else "select one"
        raise InputError(
            f"{path}: case control selects {name.replace('SPC', 'constraint')} sets {', '.join(map(str, chosen))} in "
            f"turn: {remedy}"
        )
    return chosen[0] if chosen else None


def _constraints(deck: Deck, chosen: int | None) -> None:
    named_cards, parts = deck.cards, deck.parts
    sets: dict[int, list[tuple[int, str]]] = {}
    for card in named_cards.get("SPC1", []):
        sets.setdefault(int(card[1]), []).extend((node, card[2]) for node in numbers(card[3:], parts.nodes))
    for card in named_cards.get("SPC", []):
        for i in range(2, len(card), 3):
            if card[i]:
                if i + 2 < len(card) and card[i + 2] and real(card[i + 2]) != 0.0:
                    raise InputError(f"{parts.source}: SPC {card[1]} enforces a motion: only 0 can be held")
                sets.setdefault(int(card[1]), []).append((int(card[i]), card[i + 1]))
    for card in named_cards.get("SPCADD", []):
        sets[int(card[1])] = [entry for number in numbers(card[2:]) for entry in sets.get(number, [])]
    if not sets:
        return
    if chosen is None:
        if len(sets) > 1:
            listed = ", ".join(map(str, sorted(sets)))
            raise InputError(f"{parts.source}: constraint sets {listed} are present: choose one by spc")
        chosen = next(iter(sets))
    if chosen not in sets:
        raise InputError(f"{parts.source}: constraint set {chosen} is not there; known: {sorted(sets)}")
    if not sets[chosen]:
        raise InputError(f"{parts.source}: constraint set {chosen} holds no node that is defined")
    for node, components in sets[chosen]:
        parts.held[node] |= _held(node, components, parts, deck.frames) if node in parts.nodes else set(components)


def _groups(named_cards: dict[str, list[list[str]]], parts: Parts, names: Mapping[str, str]) -> None:
    for card in named_cards.get("SET1", []):
        parts.groups[names.get(card[1], f"SET1 {card[1]}")] = numbers(card[2:], parts.nodes)
