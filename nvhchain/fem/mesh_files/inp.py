"""Nodes, elements and sets in Abaqus input files (also of CalculiX), as other meshers write them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from nvhchain.fem.mesh_files.contents import NODES, Damaged, MeshFile, Numbering, clip, surface_nodes
from nvhchain.handoff import IntArray

_KINDS = (
    (r"C3D(4|6|8|10|15|20|27)", {4: "tetra", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15",
                                 20: "hexahedron20", 27: "hexahedron27"}),
    (r"(?:S|SFM3D|R3D|M3D|CPS|CPE|CPEG|CAX|STRI|DS|ASI)(3|4|6|65|8|9)", {3: "triangle", 4: "quad", 6: "triangle6",
                                                                      65: "triangle6", 8: "quad8", 9: "quad9"}),
)  # fmt: skip
_FACELESS = re.compile(
    r"(MASS|ROTARYI|SPRING|DASHPOT|CONN|T[23]D|B[23][123]|PIPE|DCOUP|GAP|ITS|JOINT|R[2AB]|HEATCAP|F3D)"
)
_DEEPEST = 20
"""Largest depth of files that include each other."""


def read_inp(path: Path) -> MeshFile:
    """Read nodes, elements and sets of a flat file or of one part."""
    deck, levels = _Deck(), {"ASSEMBLY": False, "INSTANCE": False}
    for name, options, rows in _blocks(_lines(path, ())):
        if name.removeprefix("END ") in levels:
            levels[name.removeprefix("END ")] = not name.startswith("END ")
        elif levels["ASSEMBLY"] and not levels["INSTANCE"] and _is_assembly_data(name, options, rows):
            continue
        elif name == "NODE":
            deck.node(options, rows)
        elif name == "ELEMENT":
            deck.element(options, rows)
        elif name in ("NSET", "ELSET"):
            deck.member(name, options, rows)
        elif name == "SYSTEM" and rows:
            raise Damaged(f"line {rows[0][0]}: coordinates in a *SYSTEM are not read: write them in the global one")
    return deck.mesh()


_Row = tuple[int, list[str]]
"""Line and its fields."""


def _is_assembly_data(name: str, options: dict[str, str], rows: list[_Row]) -> bool:
    """Return True for data on points of the assembly itself (reference points); their labels belong to no part."""
    qualified = "INSTANCE" in options or all("." in field for _, row in rows for field in row if field)
    return name in ("NODE", "ELEMENT") or (name in ("NSET", "ELSET") and not qualified)


def _lines(path: Path, including: tuple[Path, ...]) -> Iterator[tuple[int, str]]:
    """Yield lines with their number; lines of included files stand in the place of *INCLUDE."""
    if len(including) >= _DEEPEST or path in including:
        raise Damaged(f"{clip(path.name)} includes itself, or more than {_DEEPEST} files deep")
    for number, line in enumerate(path.read_bytes().decode("utf-8", "replace").splitlines(), 1):
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


def _blocks(lines: Iterator[tuple[int, str]]) -> Iterator[tuple[str, dict[str, str], list[_Row]]]:
    """Yield keyword, options in upper case, and lines of data; a comma at the end continues a keyword's line."""
    name, options, rows, going_on, started = "", "", list[_Row](), False, False
    for number, text in lines:
        if text.startswith("*") or going_on:
            if not going_on:
                if started:
                    yield name, _options(options), rows
                elif name:
                    raise Damaged(f"line {number}: a keyword is needed")
                name, _, options = text[1:].partition(",")
                name, rows, started = " ".join(name.upper().split()), [], True
            else:
                options += "," + text
            going_on = text.endswith(",")
        elif not started:
            raise Damaged(f"line {number}: begins with {clip(text)}, a keyword (*NODE) is needed")
        else:
            rows.append((number, [field.strip() for field in text.split(",")]))
    if started:
        yield name, _options(options), rows


def _options(text: str) -> dict[str, str]:
    parts = (part.partition("=") for part in text.split(","))
    return {key.strip().upper(): value.strip().strip('"').strip() for key, _, value in parts if key.strip()}


class _Deck:
    def __init__(self) -> None:
        self.labels: list[IntArray] = []
        self.points: list[np.ndarray] = []
        self.blocks: list[tuple[str, IntArray, IntArray]] = []
        self.sets: dict[str, dict[str, list[IntArray]]] = {"NSET": {}, "ELSET": {}}
        self.skipped: set[int] = set()

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
        if not self.labels or not self.blocks:
            raise Damaged("it has no *NODE or no *ELEMENT that is read")
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
        return MeshFile(np.vstack(self.points), cells, tagged, groups)


def _kind(name: str, rows: list[_Row]) -> str:
    """Return the kind of the elements of a type; empty for those without faces."""
    for pattern, kinds in _KINDS:
        found = re.match(pattern + r"(?!\d)", name.upper())
        if found:
            return kinds[int(found[1])]
    if _FACELESS.match(name.upper()):
        return ""
    at = f"line {rows[0][0]}: " if rows else ""
    raise Damaged(f"{at}elements of type {clip(name)} are not read")


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
