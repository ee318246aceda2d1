"""Meshes with physical groups in MSH files of Gmsh, versions 2.2 and 4.1, as text or binary."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from nvhchain.fem.mesh_files.contents import (
    NODES,
    Cursor,
    Damaged,
    MeshFile,
    Numbering,
    checked_count,
    clip,
    surface_nodes,
    whole_numbers,
)
from nvhchain.handoff import IntArray

_TYPES = {
    1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron", 6: "wedge", 7: "pyramid", 8: "line3",
    9: "triangle6", 10: "quad9", 11: "tetra10", 12: "hexahedron27", 13: "wedge18", 14: "pyramid14", 15: "vertex",
    16: "quad8", 17: "hexahedron20", 18: "wedge15", 19: "pyramid13",
}  # fmt: skip
_DIMENSION = {"vertex": 0, "line": 1, "line3": 1} | dict.fromkeys(
    ("triangle", "triangle6", "quad", "quad8", "quad9"), 2
)
_BRICK = [*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]
_ORDER = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hexahedron20": _BRICK,
    "hexahedron27": [*_BRICK, 22, 23, 21, 24, 20, 25, 26],
}
"""Place of VTK's nodes among Gmsh's; other solids do not need it."""

_NAME = re.compile(rb'(\d+)\s+(-?\d+)\s+"(.*)"')
_Block = tuple[str, int, IntArray]
"""Kind, physical group (2.2) or entity (4.1), node numbers."""


def read_msh(data: bytes) -> MeshFile:
    """Read points, cells and physical groups."""
    return _Msh(data).mesh()


class _Msh:
    def __init__(self, data: bytes) -> None:
        self.cursor = cursor = Cursor(data)
        self.names: dict[tuple[int, int], str] = {}
        self.physical: dict[tuple[int, int], list[int]] = {}
        self.numbers: IntArray | None = None
        self.points: Any = None
        self.blocks: list[_Block] | None = None
        if cursor.line() != b"$MeshFormat":
            raise Damaged("it does not begin with $MeshFormat")
        version, binary, size = cursor.words(3)[:3]
        if version not in (b"2.2", b"2.1", b"2", b"4.1") or binary not in (b"0", b"1") or size != b"8":
            raise cursor.fail(
                f"version {clip(version)}, binary {clip(binary)}, size {clip(size)} is not read: save it as 4.1 or 2.2"
            )
        self.new, self.binary, self.order = version == b"4.1", binary == b"1", "<"
        if self.binary and int(cursor.binary(1, "<i4")[0]) != 1:
            cursor.position -= 4
            self.order = ">"
            if int(cursor.binary(1, ">i4")[0]) != 1:
                raise cursor.fail("the order of its bytes is unknown")
        self._end(b"$MeshFormat")

    def mesh(self) -> MeshFile:
        sections = {
            b"$PhysicalNames": self._names,
            b"$Nodes": self._nodes4 if self.new else self._nodes2,
            b"$Elements": self._elements4 if self.new else self._elements2,
        } | ({b"$Entities": self._entities} if self.new else {})
        done = set()
        while (line := self.cursor.line()) is not None:
            if not line.startswith(b"$") or line in done:
                raise self.cursor.fail(f"a section is needed once, not {clip(line)}")
            if line not in sections:
                end = self.cursor.data.find(b"\n$End" + line[1:], self.cursor.position - 1)
                if end < 0:
                    raise self.cursor.fail(f"section {clip(line)} does not end")
                self.cursor.position = end + 1
            else:
                done.add(line)
                sections[line]()
            self._end(line)
        if self.numbers is None or self.blocks is None:
            raise Damaged("it has no $Nodes or no $Elements: it is cut off")
        return self._assembled(Numbering(self.numbers), self.blocks)

    def _assembled(self, index: Numbering, blocks: list[_Block]) -> MeshFile:
        cells: list[tuple[str, IntArray]] = []
        groups: dict[str, list[tuple[str, IntArray]]] = {name: [] for name in self.names.values()}
        for kind, owner, numbers in blocks:
            nodes = index(numbers, f"cells of kind {kind}")
            cells.append((kind, nodes[:, _ORDER[kind]] if kind in _ORDER else nodes))
            dimension = _DIMENSION.get(kind, 3)
            for group in self.physical.get((dimension, owner), []) if self.new else [owner]:
                if (dimension, group) in self.names:
                    groups[self.names[dimension, group]].append((kind, nodes))
        return MeshFile(self.points, cells, {}, {name: surface_nodes(parts) for name, parts in groups.items()})

    def _end(self, section: bytes) -> None:
        line = self.cursor.line()
        if line != b"$End" + section[1:]:
            raise self.cursor.fail(f"$End{section[1:].decode('latin-1')} is needed, not {clip(line or b'')}")

    def _names(self) -> None:
        for _ in range(checked_count(self.cursor.words()[0], "groups", self.cursor.place)):
            line = self.cursor.line() or b""
            found = _NAME.fullmatch(line)
            if not found:
                raise self.cursor.fail(f"dimension, number and name of a group are needed, not {clip(line)}")
            self.names[int(found[1]), int(found[2])] = found[3].decode("utf-8", "replace")

    def _nodes2(self) -> None:
        cursor = self.cursor
        count = checked_count(cursor.words()[0], "nodes", cursor.place)
        if self.binary:
            rows = cursor.binary(count, [("number", self.order + "i4"), ("point", self.order + "f8", 3)])
            self.numbers, self.points = rows["number"].astype(np.int64), rows["point"]
        else:
            table = cursor.table(count, 4, float)
            self.numbers, self.points = whole_numbers(table[:, 0], "node numbers"), table[:, 1:]

    def _elements2(self) -> None:
        cursor, found = self.cursor, dict[tuple[int, int], list[Any]]()
        count = checked_count(cursor.words()[0], "elements", cursor.place)
        done = 0
        while done < count:
            if self.binary:
                number, block, tags = (int(n) for n in cursor.binary(3, self.order + "i4"))
                if not 0 < block <= count - done or not 0 <= tags <= 1000:
                    raise cursor.fail(f"a block of {block} elements with {tags} tags cannot be")
                width = 1 + tags + NODES[self._kind(number)]
                rows: Any = cursor.binary(block * width, self.order + "i4").reshape(block, width)
            else:
                words = self._whole_numbers(cursor.words(3))
                number, tags, block = words[1], words[2], 1
                width = 1 + tags + NODES[self._kind(number)]
                if tags < 0 or len(words) != width + 2:
                    raise cursor.fail(f"element {words[0]} has {len(words)} numbers, {width + 2} are needed")
                rows = [[words[0], *words[3:]]]
            found.setdefault((number, tags), []).extend(rows)
            done += block
        self.blocks = []
        for (number, tags), rows in found.items():
            table, kind = np.asarray(rows, dtype=np.int64), _TYPES[number]
            owner = table[:, 1] if tags else np.zeros(len(table), dtype=np.int64)
            self.blocks += [(kind, int(group), table[owner == group, 1 + tags :]) for group in np.unique(owner)]

    def _entities(self) -> None:
        cursor = self.cursor
        counts = [checked_count(n, "entities", cursor.place) for n in self._integers(4)]
        for dimension, count in enumerate(counts):
            for _ in range(count):
                if self.binary:
                    tag = int(cursor.binary(1, self.order + "i4")[0])
                    cursor.binary(6 if dimension else 3, self.order + "f8")
                    groups = self._list()
                    if dimension:
                        self._list()
                else:
                    words, position = cursor.words(5 if dimension == 0 else 8), 4 if dimension == 0 else 7
                    size = checked_count(words[position], "groups", cursor.place)
                    if len(words) < position + 1 + size:
                        raise cursor.fail(
                            f"an entity announces {size} groups, {len(words) - position - 1} numbers follow"
                        )
                    tag, *groups = self._whole_numbers([words[0], *words[position + 1 : position + 1 + size]])
                self.physical[dimension, tag] = [abs(group) for group in groups]

    def _list(self) -> list[int]:
        cursor = self.cursor
        size = checked_count(int(cursor.binary(1, self.order + "u8")[0]), "groups", cursor.place)
        return [int(n) for n in cursor.binary(size, self.order + "i4")]

    def _nodes4(self) -> None:
        cursor = self.cursor
        blocks, total = (checked_count(n, "nodes", cursor.place) for n in self._integers(4)[:2])
        numbers, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
        for _ in range(blocks):
            dimension, _, parametric, count = self._block()
            width = 3 + (dimension if parametric else 0)
            if not 0 <= dimension <= 3 or parametric not in (0, 1):
                raise cursor.fail(f"dimension {dimension}, parametric {parametric} of nodes cannot be")
            if self.binary:
                numbers.append(cursor.binary(count, self.order + "u8").astype(np.int64))
                points.append(cursor.binary(count * width, self.order + "f8").reshape(count, width)[:, :3])
            else:
                numbers.append(cursor.table(count, 1, np.int64)[:, 0])
                points.append(cursor.table(count, width, float)[:, :3])
        self.numbers, self.points = np.concatenate(numbers), np.vstack(points)
        if len(self.numbers) != total:
            raise Damaged(f"{total} nodes are announced, {len(self.numbers)} are there")

    def _elements4(self) -> None:
        cursor = self.cursor
        blocks, total = (checked_count(n, "elements", cursor.place) for n in self._integers(4)[:2])
        self.blocks = []
        for _ in range(blocks):
            _, entity, number, count = self._block()
            kind = self._kind(number)
            width = 1 + NODES[kind]
            if self.binary:
                rows = cursor.binary(count * width, self.order + "u8").reshape(count, width).astype(np.int64)
            else:
                rows = cursor.table(count, width, np.int64)
            self.blocks.append((kind, entity, rows[:, 1:]))
        found = sum(len(nodes) for _, _, nodes in self.blocks)
        if found != total:
            raise Damaged(f"{total} elements are announced, {found} are there")

    def _integers(self, count: int) -> list[int]:
        if self.binary:
            return [int(n) for n in self.cursor.binary(count, self.order + "u8")]
        return self._whole_numbers(self.cursor.words(count)[:count])

    def _block(self) -> tuple[int, int, int, int]:
        """Return the head of a block: three numbers and its count."""
        cursor = self.cursor
        if self.binary:
            first = [int(n) for n in cursor.binary(3, self.order + "i4")]
            count = int(cursor.binary(1, self.order + "u8")[0])
        else:
            *first, count = self._whole_numbers(cursor.words(4)[:4])
        return first[0], first[1], first[2], checked_count(count, "entries of a block", cursor.place)

    def _kind(self, number: int) -> str:
        if number not in _TYPES:
            raise self.cursor.fail(f"elements of type {number} are not read")
        return _TYPES[number]

    def _whole_numbers(self, words: list[bytes]) -> list[int]:
        try:
            return [int(word) for word in words]
        except ValueError:
            raise self.cursor.fail(f"whole numbers are needed: {clip(b' '.join(words))}") from None
