"""Import of Nastran bulk data as `SolidModel`: nodes, solid elements, materials, RBE2, constraints and sets.

Cards that are read: GRID, CTETRA, CPENTA, CHEXA, PSOLID, MAT1, RBE2, SPC, SPC1, SPCADD, SET1. Other cards are refused
unless they have no effect. Loads, parameters and requests for output are ignored.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem.solid_model import SolidModel
from nvhchain.handoff import FloatArray
from nvhchain.interop.notation._names import marks, restored
from nvhchain.interop.notation.units import UnitSystem, unit_system
from nvhchain.interop.solids._model_parts import TRANSLATIONS, Parts, Rigid
from nvhchain.interop.solids.nastran_cards import cards, numbers, real, split_deck

SOLIDS: dict[str, tuple[str, str, tuple[int, ...]]] = {
    "CTETRA": ("tet4", "tet10", tuple(range(10))),
    "CPENTA": ("wedge6", "wedge15", (*range(9), 12, 13, 14, 9, 10, 11)),
    "CHEXA": ("hex8", "hex20", (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)),
}
"""Card → linear and quadratic kind, and the place in the card of every node of the quadratic kind."""

_PASSED_OVER = re.compile(
    r"(GRID|GRDSET|CORD2[RCS]|CTETRA|CPENTA|CHEXA|PSOLID|MAT1|RBE2|SPC|SPC1|SPCADD|SPCD|SET1|SET3|PARAM|MDLPRM|ENDDATA|ECHO\w*)$"
    r"|(EIG\w*|FORCE\d?|MOMENT\d?|PLOAD\w*|GRAV|ACCEL\d?|RFORCE|TEMP\w*|LOAD|LSEQ|DLOAD|[RT]LOAD[12]|DAREA|DELAY|DPHASE"
    r"|PLOTEL\d?|FREQ\d?|TSTEP\w*|TABLE\w*|TABD\w*|RANDPS|NLPARM|DESVAR|DRESP\w*|DCONSTR|DVPREL\w*|BSURF\w*)$"
)
"""Cards that are read, and those of loads, frequencies, tables and output, which change neither stiffness nor mass."""


def read_nastran(path: str | Path, *, units: str, spc: int | None = None) -> SolidModel:
    """Read a Nastran bulk data file.

    Parameters
    ----------
    path : str or Path
        Bulk data file.
    units : str
        Units of the file, a key of `UNIT_SYSTEMS`.
    spc : int, optional
        Set of constraints; by default the one that case control selects for all subcases, or the only one.

    Returns
    -------
    SolidModel
        Model in SI units.

    Raises
    ------
    FileFormatError
        For a damaged file.
    InputError
        For cards that cannot be imported.
    """
    path, system = Path(path), unit_system(units)
    control, bulk = split_deck(path)
    named_cards: dict[str, list[list[str]]] = {}
    for card in cards(bulk):
        named_cards.setdefault(card[0], []).append(card)
    direct = [line.strip() for line in control if re.match(r"\s*[KMB]2(GG|PP)", line, re.IGNORECASE)]
    if direct:
        raise InputError(f"{path}: case control adds matrices, {direct[0]}, which are not read: remove them")
    refused = Counter({name: len(found) for name, found in named_cards.items() if not _PASSED_OVER.match(name)})
    if refused:
        listed = ", ".join(f"{count} {name}" for name, count in sorted(refused.items()))
        raise InputError(
            f"{path}: carries {listed}, which are not read: replace them by solid elements and RBE2, or remove them"
        )
    parts, found = Parts(str(path)), dict(marks(bulk))
    try:
        _grids(named_cards, parts)
        _elements(named_cards, parts)
        _materials(named_cards, parts, system)
        _rigid_sets(named_cards, parts)
        _constraints(named_cards, parts, _selected(control, path) if spc is None else spc)
        _groups(named_cards, parts, found.pop("group", {}))
    except (ValueError, IndexError, KeyError) as error:
        if isinstance(error, InputError):
            raise
        raise FileFormatError(f"{path}: not Nastran bulk data: {type(error).__name__} {error}") from None
    return restored(parts.model(system.length), found)


def _grids(named_cards: dict[str, list[list[str]]], parts: Parts) -> None:
    frames = _frames(named_cards)
    defaults = (named_cards.get("GRDSET", [[]])[0] + [""] * 9)[1:9]
    for card in named_cards.get("GRID", []):
        field = card[1:] + [""] * (8 - len(card[1:]))
        point = tuple(real(x) if x else 0.0 for x in field[2:5])
        system = int(field[1] or defaults[1] or 0)
        if system not in frames:
            raise InputError(f"{parts.source}: GRID {field[0]} is in coordinate system {system}, which is not defined")
        if system:
            point = tuple(frames[system](np.array(point)))
        label = int(field[0])
        if label in parts.nodes:
            raise FileFormatError(f"{parts.source}: GRID {label} is defined twice")
        parts.nodes[label] = point  # type: ignore[assignment]
        held = field[6] or defaults[6]
        if held:
            parts.held[label] |= set(held)
        rotated = int(field[5] or defaults[5] or 0)
        if rotated > 0:
            parts.rotated[label] = rotated


def _frames(named_cards: dict[str, list[list[str]]]) -> dict[int, Callable[[FloatArray], FloatArray]]:
    """Return coordinate systems CORD2R, CORD2C and CORD2S: number → map of coordinates to the basic system."""
    frames: dict[int, Callable[[FloatArray], FloatArray]] = {0: lambda point: point}
    waiting = [card for name in ("CORD2R", "CORD2C", "CORD2S") for card in named_cards.get(name, [])]
    while waiting:
        ready = [card for card in waiting if int(card[2] or 0) in frames]
        if not ready:
            raise InputError(f"coordinate system {waiting[0][1]} rests on system {waiting[0][2]}, which is not defined")
        for card in ready:
            at = [real(x) if x else 0.0 for x in [*card[3:], *[""] * 9][:9]]  # blank is zero
            a, b, c = (frames[int(card[2] or 0)](np.array(at[i : i + 3])) for i in (0, 3, 6))
            z = (b - a) / np.linalg.norm(b - a)
            x = (c - a) - z * (z @ (c - a))
            x /= np.linalg.norm(x)
            axes = np.column_stack([x, np.cross(z, x), z])
            frames[int(card[1])] = _placed(card[0], a, axes)
            waiting.remove(card)
    return frames


def _placed(kind: str, origin: FloatArray, axes: FloatArray) -> Callable[[FloatArray], FloatArray]:
    def place(point: FloatArray) -> FloatArray:
        if kind == "CORD2C":  # r, θ in degrees, z
            r, angle, z = point[0], np.radians(point[1]), point[2]
            point = np.array([r * np.cos(angle), r * np.sin(angle), z])
        elif kind == "CORD2S":  # r, θ from z, φ about z
            r, polar, angle = point[0], np.radians(point[1]), np.radians(point[2])
            point = r * np.array([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)])
        return np.asarray(origin + axes @ point)

    return place


def _elements(named_cards: dict[str, list[list[str]]], parts: Parts) -> None:
    for names in (tuple(SOLIDS), ("RBE2",)):
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


def _materials(named_cards: dict[str, list[list[str]]], parts: Parts, system: UnitSystem) -> None:
    scale = 1.0
    for card in named_cards.get("PARAM", []):
        if card[1].upper() == "WTMASS":
            scale = real(card[2])
    for name in ("MAT1", "PSOLID"):
        _check_once([card[1] for card in named_cards.get(name, [])], name, parts)
    known = {card[1]: card[2:] + [""] * 4 for card in named_cards.get("MAT1", [])}
    for card in named_cards.get("PSOLID", []):
        kind = (card[7:8] or [""])[0].upper()
        if kind not in ("", "SMECH"):
            raise InputError(
                f"{parts.source}: PSOLID {card[1]} is {kind}, not structure: leave out its elements, or FCTN"
            )
        where = f"{parts.source}: MAT1 {card[2]} of PSOLID {card[1]}"
        if card[2] not in known:
            raise InputError(f"{where} is not defined")
        young, shear, poisson = (real(x) if x else None for x in known[card[2]][:3])
        if young is None and shear is not None and poisson is not None:
            young = 2 * shear * (1 + poisson)
        if poisson is None and young is not None and shear is not None:
            poisson = young / (2 * shear) - 1
        density = known[card[2]][3]
        if young is None or poisson is None or not density:
            raise InputError(f"{where} must state two of E, G, NU, and RHO")
        parts.materials[card[1]] = system.material(young, poisson, real(density) * scale, where)


def _check_once(numbers: list[str], subject: str, parts: Parts) -> None:
    """Raise FileFormatError if one of the numbers is given twice."""
    twice = [number for number, count in Counter(numbers).items() if count > 1]
    if twice:
        raise FileFormatError(f"{parts.source}: {subject} {twice[0]} is defined twice")


def _rigid_sets(named_cards: dict[str, list[list[str]]], parts: Parts) -> None:
    for card in named_cards.get("RBE2", []):
        members = [x for x in card[4:] if x and "." not in x]  # the last field may be a thermal expansion
        if not set(card[3]) >= TRANSLATIONS:
            raise InputError(
                f"{parts.source}: RBE2 {card[1]} couples components {card[3]} only: 123 (or 123456) are needed"
            )
        parts.rigid.append(Rigid(card[1], int(card[2]), numbers(members)))


def _selected(control: list[str], path: Path) -> int | None:
    """Return the set of constraints in case control; InputError if subcases select different ones."""
    found = [re.match(r"\s*SPC\s*=\s*(\d+)", line, re.I) for line in control]
    chosen = sorted({int(one[1]) for one in found if one})
    if len(chosen) > 1:
        raise InputError(
            f"{path}: case control selects constraint sets {', '.join(map(str, chosen))} in turn: say which by spc"
        )
    return chosen[0] if chosen else None


def _constraints(named_cards: dict[str, list[list[str]]], parts: Parts, chosen: int | None) -> None:
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
            raise InputError(f"{parts.source}: constraint sets {listed} are there: say which by spc")
        chosen = next(iter(sets))
    if chosen not in sets:
        raise InputError(f"{parts.source}: constraint set {chosen} is not there; known: {sorted(sets)}")
    if not sets[chosen]:
        raise InputError(f"{parts.source}: constraint set {chosen} holds no node that is defined")
    for node, components in sets[chosen]:
        parts.held[node] |= set(components)


def _groups(named_cards: dict[str, list[list[str]]], parts: Parts, names: Mapping[str, str]) -> None:
    for card in named_cards.get("SET1", []):
        parts.groups[names.get(card[1], f"SET1 {card[1]}")] = numbers(card[2:], parts.nodes)
