"""Nodes, elements and sets in Abaqus input files (also of CalculiX), as other meshers write them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from nvhchain.fem.mesh_files.contents import FARTHEST, NODES, Damaged, MeshFile, Numbering, clip, surface_nodes
from nvhchain.handoff import FloatArray, IntArray

_KINDS = (
    (r"C3D(4|6|8|10|15|20|27)", {4: "tetra", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15",
                                 20: "hexahedron20", 27: "hexahedron27"}),
    (r"(?:S|SFM3D|R3D|M3D|CPS|CPE|CPEG|CAX|STRI|DS|ASI)(3|4|6|65|8|9)", {3: "triangle", 4: "quad", 6: "triangle6",
                                                                      65: "triangle6", 8: "quad8", 9: "quad9"}),
)  # fmt: skip
_FACELESS = re.compile(
    r"(MASS|ROTARYI|SPRING|DASHPOT|CONN|T[23]D|B[23][123]|PIPE|DCOUP|GAP|ITS|JOINT|R[2AB]|HEATCAP|F3D)"
)
_MADE = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYMMETRIC MODEL GENERATION")
"""Keywords that make or move nodes and elements."""

_FILLED = ("NODE", "ELEMENT", "NSET", "ELSET")
"""Keywords that are read."""

_DEEPEST = 20
"""Largest depth of files that include each other."""

_Row = tuple[int, list[str]]
"""Line and its fields."""

_Motion = Callable[[FloatArray], FloatArray]
"""Function from points (n, 3) of a part to their places in the assembly."""


class _Block(NamedTuple):
    """Keyword and its line, options in upper case, and lines of data."""

    name: str
    line: int
    options: dict[str, str]
    rows: list[_Row]


def read_inp(path: Path) -> MeshFile:
    """Read nodes, elements and sets of a flat file, of parts, or of the instances of an assembly."""
    model = _Model()
    for block in _blocks(_lines(path, ())):
        model.take(block)
    return model.mesh()


class _Model:
    """Flat data, parts and instances, each with labels of its own."""

    def __init__(self) -> None:
        self.flat = _Deck()
        self.parts: dict[str, _Deck] = {}
        self.instances: dict[str, _Deck] = {}
        self.current: _Deck | None = self.flat
        """Owner of the data that follow; None for the assembly."""

    def take(self, block: _Block) -> None:
        """Read a keyword for its owner."""
        name, line, options, rows = block
        if name in _MADE:
            raise Damaged(f"line {line}: *{name} is not read: write all nodes and elements themselves")
        if name in _FILLED and "INPUT" in options:
            raise Damaged(
                f"line {line}: *{name}, INPUT={clip(options['INPUT'])} is not read: put its lines in this file, or "
                f"below *{name} the line *INCLUDE, INPUT=..."
            )
        if name == "SYSTEM" and rows:
            raise Damaged(f"line {rows[0][0]}: coordinates in a *SYSTEM are not read: write them in the global one")
        if name == "PART":
            self.current = _named(self.parts, block, _Deck())
        elif name == "INSTANCE":
            part = options.get("PART", "")
            if part.upper() not in self.parts:
                raise Damaged(
                    f"line {line}: instance {clip(options.get('NAME', ''))} is of part {clip(part)}, which is not "
                    "before it in the file: export a flat file, without parts and assemblies"
                )
            self.current = _named(self.instances, block, self.parts[part.upper()].copy(_motion(block)))
        elif name == "END PART":
            self.current = self.flat
        elif name in ("ASSEMBLY", "END INSTANCE", "END ASSEMBLY"):
            self.current = None
        elif name in _FILLED and self.current is None:
            self._take_assembly(block)
        elif name in _FILLED and self.current is not None:
            self.current.take(block)

    def _take_assembly(self, block: _Block) -> None:
        """Read a set of the assembly on its instances; nodes of the assembly itself are reference points."""
        name, line, options, rows = block
        if name == "ELEMENT" and any(re.match(pattern, options.get("TYPE", "").upper()) for pattern, _ in _KINDS):
            raise Damaged(f"line {line}: elements of type {clip(options['TYPE'])} in the assembly: put them in a part")
        if name in ("NODE", "ELEMENT"):
            return
        if "INSTANCE" in options:
            self._instance(options["INSTANCE"], line).take(block)
        elif all("." in field for _, row in rows for field in row if field):
            for number, row in rows:
                for field in filter(None, row):
                    owner, _, member = field.strip('"').rpartition(".")
                    self._instance(owner, number).take(block._replace(rows=[(number, [member])]))

    def _instance(self, name: str, line: int) -> _Deck:
        key = name.strip('"').rpartition(".")[2].upper()
        if key not in self.instances:
            raise Damaged(f"line {line}: instance {clip(name)} is not in the file")
        return self.instances[key]

    def mesh(self) -> MeshFile:
        """Return the mesh of all instances; without any, that of the parts. Sets of one name are joined."""
        decks = [deck for deck in (self.flat, *(self.instances or self.parts).values()) if deck.blocks]
        if not decks:
            raise Damaged("it has no *NODE or no *ELEMENT that is read")
        meshes = [deck.mesh() for deck in decks]
        starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes[:-1])])
        placed = list(zip(starts.tolist(), meshes, strict=True))
        return MeshFile(
            np.vstack([mesh.points for mesh in meshes]),
            [(kind, nodes + start) for start, mesh in placed for kind, nodes in mesh.cells],
            _joined([(start, mesh.tagged) for start, mesh in placed]),
            _joined([(start, mesh.groups) for start, mesh in placed]),
        )


def _named(owners: dict[str, _Deck], block: _Block, deck: _Deck) -> _Deck:
    """Return `deck` as the owner with the name in a *PART or *INSTANCE."""
    name = block.options.get("NAME", "")
    if name.upper() in owners:
        raise Damaged(f"line {block.line}: *{block.name} {clip(name)} is in the file twice: rename one")
    owners[name.upper()] = deck
    return deck


def _joined(sets: list[tuple[int, dict[str, IntArray]]]) -> dict[str, IntArray]:
    """Return the indices of points by name, from those of each deck and the index of its first point."""
    names = dict.fromkeys(name for _, own in sets for name in own)
    return {name: np.concatenate([own[name] + start for start, own in sets if name in own]) for name in names}


def _motion(block: _Block) -> _Motion | None:
    """Return the motion of an *INSTANCE: a translation, then a rotation by degrees about the axis of two points."""
    shift, turn = np.zeros(3), np.zeros(0)
    for number, row in block.rows:
        while row and not row[-1]:
            row = row[:-1]
        values = np.array([_real(field, number) for field in row])
        if not (np.abs(values) <= FARTHEST).all():
            raise Damaged(f"line {number}: the motion of an instance has numbers beyond {FARTHEST:g}")
        if len(values) == 7 and not len(turn):
            turn = values
        elif len(values) <= 3 and number == block.rows[0][0]:
            shift[: len(values)] = values
        else:
            raise Damaged(
                f"line {number}: the motion of an instance has {len(values)} numbers there, 3 of a translation and "
                "then 7 of a rotation are needed"
            )
    if not len(turn):
        return (lambda points: points + shift) if shift.any() else None
    foot, axis = turn[:3], turn[3:6] - turn[:3]
    length = float(np.linalg.norm(axis))
    if not length:
        raise Damaged(f"line {block.line}: the axis of an instance is between one point and itself: give two points")
    turned = Rotation.from_rotvec(turn[6] * axis / length, degrees=True).as_matrix()
    return lambda points: np.asarray((points + shift - foot) @ turned.T + foot)


def _lines(path: Path, including: tuple[Path, ...]) -> Iterator[tuple[int, str]]:
    """Yield lines with their number; lines of included files stand in the place of *INCLUDE."""
    if len(including) >= _DEEPEST or path in including:
        raise Damaged(f"{clip(path.name)} includes itself, or more than {_DEEPEST} files deep")
    for number, line in enumerate(path.read_bytes().decode("utf-8-sig", "replace").splitlines(), 1):
        text = line.strip()
        if text.startswith("**") or not text:
            continue
        include = re.match(r"\*\s*include\s*,\s*input\s*=\s*(.+)", text, re.IGNORECASE)
        if include:
            other = path.parent / include[1].strip().strip("\"'")
            if "\0" in other.name or not other.is_file():
                raise Damaged(f"line {number}: the file {clip(include[1])} is not there")
            yield from _lines(other, (*including, path))
        else:
            yield number, text


def _blocks(lines: Iterator[tuple[int, str]]) -> Iterator[_Block]:
    """Yield keywords with their data; a comma at the end continues a keyword's line."""
    name, line, options, rows, going_on, started = "", 0, "", list[_Row](), False, False
    for number, text in lines:
        if text.startswith("*") or going_on:
            if not going_on:
                if started:
                    yield _Block(name, line, _options(options), rows)
                name, _, options = text[1:].partition(",")
                name, line, rows, started = " ".join(name.upper().split()), number, [], True
            else:
                options += "," + text
            going_on = text.endswith(",")
        elif not started:
            raise Damaged(f"line {number}: begins with {clip(text)}, a keyword (*NODE) is needed")
        else:
            rows.append((number, [field.strip() for field in text.split(",")]))
    if started:
        yield _Block(name, line, _options(options), rows)


def _options(text: str) -> dict[str, str]:
    parts = (part.partition("=") for part in text.split(","))
    return {key.strip().upper(): value.strip().strip('"').strip() for key, _, value in parts if key.strip()}


class _Deck:
    """Nodes, elements and sets with labels of their own: those of a flat file, a part or an instance."""

    def __init__(self) -> None:
        self.motion: _Motion | None = None
        self.labels: list[IntArray] = []
        self.points: list[np.ndarray] = []
        self.blocks: list[tuple[str, IntArray, IntArray]] = []
        self.sets: dict[str, dict[str, list[IntArray]]] = {"NSET": {}, "ELSET": {}}

    def copy(self, motion: _Motion | None) -> _Deck:
        """Return an instance of this part."""
        made = _Deck()
        made.motion, made.labels, made.points, made.blocks = motion, [*self.labels], [*self.points], [*self.blocks]
        made.sets = {kind: {name: [*parts] for name, parts in sets.items()} for kind, sets in self.sets.items()}
        return made

    def take(self, block: _Block) -> None:
        """Read the data of *NODE, *ELEMENT, *NSET or *ELSET."""
        name, _, options, rows = block
        if name == "NODE":
            self.node(options, rows)
        elif name == "ELEMENT":
            self.element(options, rows)
        else:
            self.member(name, options, rows)

    def node(self, options: dict[str, str], rows: list[_Row]) -> None:
        if options.get("SYSTEM", "R").upper() != "R":
            raise Damaged("*NODE in a cylindrical or spherical system: write it in the rectangular one")
        for number, row in rows:
            if len(row) < 3:
                raise Damaged(f"line {number}: a node has a label and {len(row) - 1} coordinates, 3 are needed")
        labels = np.array([_whole_number(row[0], number) for number, row in rows], dtype=np.int64)
        points = [[_real(field, number) for field in (*row[1:4], "0")[:3]] for number, row in rows]
        self.labels.append(labels)
        self.points.append(np.array(points, dtype=float).reshape(-1, 3))
        if "NSET" in options:
            self._add("NSET", options["NSET"], labels)

    def element(self, options: dict[str, str], rows: list[_Row]) -> None:
        kind = _kind(options.get("TYPE", ""), rows)
        flat = [_whole_number(field, number) for number, row in rows for field in row if field]
        if not kind:
            return
        count = NODES[kind] + 1
        if len(flat) % count:
            raise Damaged(
                f"line {rows[0][0]}: elements of type {clip(options['TYPE'])} have {len(flat)} numbers in all, a "
                f"multiple of {count} is needed"
            )
        table = np.array(flat, dtype=np.int64).reshape(-1, count)
        self.blocks.append((kind, table[:, 0], table[:, 1:]))
        if "ELSET" in options:
            self._add("ELSET", options["ELSET"], table[:, 0])

    def member(self, kind: str, options: dict[str, str], rows: list[_Row]) -> None:
        name = options.get(kind, "")
        if not name:
            raise Damaged(f"*{kind} without a name" + (f" (line {rows[0][0]})" if rows else ""))
        self._add(kind, name, np.empty(0, dtype=np.int64))
        for number, row in rows:
            fields = [field for field in row if field]
            if "GENERATE" in options:
                span = [_whole_number(field, number) for field in fields]
                if len(span) not in (2, 3) or (len(span) == 3 and span[2] <= 0):
                    raise Damaged(f"line {number}: first, last and step are needed, not {clip(fields)}")
                members = range(span[0], span[1] + 1, *span[2:])
                if len(members) > 10_000_000:
                    raise Damaged(f"line {number}: a set of {len(members)} members is not read")
                self._add(kind, name, np.array(members, dtype=np.int64))
                continue
            labels = []
            for field in fields:
                if field.strip('"').upper() in self.sets[kind]:
                    self._add(kind, name, *self.sets[kind][field.strip('"').upper()])
                else:
                    labels.append(_whole_number(field.rpartition(".")[2], number))
            self._add(kind, name, np.array(labels, dtype=np.int64))

    def _add(self, kind: str, name: str, *labels: IntArray) -> None:
        self.sets[kind].setdefault(name.upper(), []).extend(list(labels))

    def mesh(self) -> MeshFile:
        if not self.labels:
            raise Damaged("its elements have no *NODE that is read")
        index = Numbering(np.concatenate(self.labels))
        cells = [(kind, index(nodes, f"elements of kind {kind}")) for kind, _, nodes in self.blocks]
        elements = np.concatenate([labels for _, labels, _ in self.blocks])
        Numbering(elements)
        groups = {}
        for name, parts in self.sets["ELSET"].items():
            members = np.unique(np.concatenate(parts))
            inside = [
                (kind, nodes[np.isin(labels, members)])
                for (kind, nodes), (_, labels, _) in zip(cells, self.blocks, strict=True)
            ]
            groups[name] = surface_nodes(inside)
        tagged = {
            name: np.unique(index(np.concatenate(parts), f"set {clip(name)}"))
            for name, parts in self.sets["NSET"].items()
        }
        points = np.vstack(self.points)
        return MeshFile(points if self.motion is None else self.motion(points), cells, tagged, groups)


def _kind(name: str, rows: list[_Row]) -> str:
    """Return the kind of the elements of a type; empty for those without faces."""
    for pattern, kinds in _KINDS:
        found = re.match(pattern + r"(?!\d)", name.upper())
        if found:
            return kinds[int(found[1])]
    if _FACELESS.match(name.upper()):
        return ""
    prefix = f"line {rows[0][0]}: " if rows else ""
    raise Damaged(f"{prefix}elements of type {clip(name)} are not read")


def _whole_number(text: str, line: int) -> int:
    try:
        number = int(text)
    except ValueError:
        raise Damaged(f"line {line}: {clip(text)} is not a label, a whole number") from None
    if not 0 <= number < 2**62:
        raise Damaged(f"line {line}: {number} cannot be a label")
    return number


def _real(text: str, line: int) -> float:
    try:
        return float(text.upper().replace("D", "E")) if text else 0.0
    except ValueError:
        raise Damaged(f"line {line}: {clip(text)} is not a coordinate") from None
