"""Unstructured grids and polygons in legacy VTK files (versions 1 to 5), as text or binary."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from nvhchain.fem.mesh_files.contents import (
    NODES,
    Cursor,
    Damaged,
    MeshFile,
    checked_count,
    clip,
    polygon,
    polygons_by_size,
    whole_numbers,
)
from nvhchain.handoff import IntArray

CELL_TYPES = {
    1: "vertex", 3: "line", 21: "line3", 5: "triangle", 22: "triangle6", 34: "triangle7", 9: "quad", 23: "quad8",
    28: "quad9", 10: "tetra", 24: "tetra10", 12: "hexahedron", 25: "hexahedron20", 29: "hexahedron27", 13: "wedge",
    26: "wedge15", 32: "wedge18", 14: "pyramid", 27: "pyramid13", 37: "pyramid14",
}  # fmt: skip
_POLYGON, _POLY_VERTEX, _POLY_LINE = 7, 2, 4

_TYPES = {
    b"char": "i1", b"signed_char": "i1", b"unsigned_char": "u1", b"short": "i2", b"unsigned_short": "u2", b"int": "i4",
    b"unsigned_int": "u4", b"long": "i8", b"unsigned_long": "u8", b"float": "f4", b"double": "f8", b"vtkidtype": "i8",
    b"vtktypeint64": "i8", b"vtktypeint32": "i4", b"vtktypeuint8": "u1",
}  # fmt: skip
_COMPONENTS = {b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9, b"TENSORS6": 6, b"GLOBAL_IDS": 1, b"PEDIGREE_IDS": 1}
_LISTS = {b"CELLS": "cells", b"POLYGONS": "polygons", b"LINES": "lines", b"VERTICES": "vertices"}
_KEYWORD = re.compile(rb"^[ \t]*[A-Za-z]", re.MULTILINE)


def read_vtk(data: bytes) -> MeshFile:
    """Read points, cells and point arrays."""
    return _Legacy(data).mesh()


def sorted_cells(corners: IntArray, ends: IntArray, types: IntArray) -> list[tuple[str, IntArray]]:
    """Return cells by kind.

    corners : corners of all cells.
    ends : end of each cell in `corners`.
    types : types of VTK.
    """
    if len(ends) != len(types):
        raise Damaged(f"there are {len(types)} cell types for {len(ends)} cells")
    size = np.diff(ends, prepend=0)
    if len(ends) and (size.min() < 0 or ends[-1] != len(corners)):
        raise Damaged(f"its cells need {ends[-1]} corners in increasing order, {len(corners)} are there")
    found: list[tuple[str, IntArray]] = []
    for number in np.unique(types).tolist():
        members = np.flatnonzero(types == number)
        if number in (_POLY_VERTEX, _POLY_LINE):
            continue
        if number != _POLYGON and number not in CELL_TYPES:
            raise Damaged(f"cells of type {number} (first cell {members[0] + 1}) are not read")
        for count in np.unique(size[members]).tolist():
            kind = polygon(count) if number == _POLYGON else CELL_TYPES[number]
            cells = members[size[members] == count]
            if count < 3 if number == _POLYGON else NODES[kind] != count:
                raise Damaged(f"cell {cells[0] + 1} of kind {kind} has {count} corners")
            found.append((kind, corners[(ends - size)[cells][:, None] + np.arange(count)]))
    return found


def tagged_points(arrays: dict[str, Any], count: int) -> dict[str, IntArray]:
    """Return the points where an array with one value per point is not zero."""
    return {name: np.flatnonzero(values) for name, values in arrays.items() if np.size(values) == count}


class _Legacy:
    def __init__(self, data: bytes) -> None:
        self.cursor = Cursor(data)
        head = self.cursor.words(5)
        found = re.fullmatch(rb"([1-5])\.\d+", head[-1])
        if head[:4] != [b"#", b"vtk", b"DataFile", b"Version"] or not found:
            raise self.cursor.fail("it does not begin with '# vtk DataFile Version' 1 to 5")
        self.version = int(found[1])
        end = data.find(b"\n", self.cursor.position)  # end of the title, which may be blank
        self.cursor.position = end + 1 if end >= 0 else len(data)
        form = self.cursor.words()[0].upper()
        if form not in (b"ASCII", b"BINARY"):
            raise self.cursor.fail(f"the form is {clip(form)}, ASCII or BINARY is needed")
        self.binary = form == b"BINARY"
        self.points: Any = None
        self.lists: dict[str, tuple[IntArray, IntArray]] = {}
        self.types: IntArray | None = None
        self.arrays: dict[str, Any] = {}
        self.owner, self.rows = "", 0

    def mesh(self) -> MeshFile:
        while (line := self.cursor.line()) is not None:
            words = line.split()
            self._section(words[0].upper(), words)
        if self.points is None:
            raise Damaged("it has no POINTS")
        if "cells" in self.lists:
            if self.types is None:
                raise Damaged("it has no CELL_TYPES: it is cut off")
            cells = sorted_cells(*self.lists["cells"], self.types)
        else:
            cells = polygons_by_size(*self.lists["polygons"]) if "polygons" in self.lists else []
        return MeshFile(self.points, cells, tagged_points(self.arrays, len(self.points)))

    def _section(self, word: bytes, words: list[bytes]) -> None:
        cursor = self.cursor
        if word == b"DATASET" and words[-1].upper() in (b"UNSTRUCTURED_GRID", b"POLYDATA"):
            return
        if word == b"METADATA":
            while cursor.position < len(cursor.data):  # up to a blank line
                end = cursor.data.find(b"\n", cursor.position)
                end = len(cursor.data) if end < 0 else end
                text, cursor.position = cursor.data[cursor.position : end].strip(), end + 1
                if not text:
                    return
            return
        if word == b"POINTS" and len(words) == 3:
            self.points = self._numbers(3 * checked_count(words[1], "points", cursor.place), words[2]).reshape(-1, 3)
        elif word in _LISTS and len(words) == 3:
            sizes = [checked_count(w, "cells", cursor.place) for w in words[1:]]
            self.lists[_LISTS[word]] = self._offsets(*sizes) if self.version == 5 else self._counted(*sizes)
        elif word == b"CELL_TYPES" and len(words) == 2:
            self.types = self._numbers(checked_count(words[1], "cells", cursor.place), b"int")
        elif word in (b"POINT_DATA", b"CELL_DATA") and len(words) == 2:
            self.owner, self.rows = word.decode(), checked_count(words[1], "values", cursor.place)
        elif word == b"FIELD" and len(words) == 3:
            for _ in range(checked_count(words[2], "arrays", cursor.place)):
                self._field()
        elif self.owner:
            self._array(word, words)
        else:
            raise cursor.fail(f"{clip(b' '.join(words))} is not read")

    def _field(self) -> None:
        words = self.cursor.words()
        if words[0].upper() == b"METADATA":
            self._section(b"METADATA", words)
            words = self.cursor.words()
        if len(words) != 4:
            raise self.cursor.fail(f"an array is announced by {clip(b' '.join(words))}, not by 4 words")
        count = checked_count(words[1], "components") * checked_count(words[2], "values")
        self._keep(words[0], self._numbers(checked_count(count, "values", self.cursor.place), words[3]))

    def _array(self, word: bytes, words: list[bytes]) -> None:
        cursor = self.cursor
        if word == b"SCALARS" and len(words) in (3, 4):
            width = checked_count(words[3], "components", cursor.place) if len(words) == 4 else 1
            before = cursor.position
            if (cursor.line() or b"")[:12].upper() != b"LOOKUP_TABLE":
                cursor.position = before
            self._keep(words[1], self._numbers(self.rows * width, words[2]))
        elif word == b"LOOKUP_TABLE" and len(words) == 3:
            self._numbers(
                4 * checked_count(words[2], "colours", cursor.place), b"unsigned_char" if self.binary else b"float"
            )
        elif word == b"COLOR_SCALARS" and len(words) == 3:
            width = checked_count(words[2], "components", cursor.place)
            self._numbers(self.rows * width, b"unsigned_char" if self.binary else b"float")
        elif word in _COMPONENTS and len(words) == 3:
            self._keep(words[1], self._numbers(self.rows * _COMPONENTS[word], words[2]))
        elif word == b"TEXTURE_COORDINATES" and len(words) == 4:
            self._numbers(self.rows * checked_count(words[2], "components", cursor.place), words[3])
        else:
            raise cursor.fail(f"{clip(b' '.join(words))} is not read")

    def _keep(self, name: bytes, values: Any) -> None:
        if self.owner == "POINT_DATA":
            self.arrays[name.decode("latin-1")] = values

    def _numbers(self, count: int, kind: bytes) -> Any:
        """Return numbers (count,): big-endian bytes, or text up to the next line that begins with a letter."""
        cursor = self.cursor
        if kind.lower() not in _TYPES:
            raise cursor.fail(f"numbers of type {clip(kind)} are not read")
        code = _TYPES[kind.lower()]
        if self.binary:
            return cursor.binary(count, ">" + code)
        end = _KEYWORD.search(cursor.data, cursor.position)
        stop = end.start() if end else len(cursor.data)
        words = cursor.data[cursor.position : stop].split()
        if len(words) != count:
            raise cursor.fail(f"{count} numbers are announced, {len(words)} follow")
        try:
            numbers = np.array(words, dtype="S32").astype(np.int64 if code[0] in "iu" else float)
        except (ValueError, OverflowError) as error:
            raise cursor.fail(f"the numbers that follow are damaged ({clip(error)})") from None
        cursor.position = stop
        return numbers

    def _counted(self, cells: int, size: int) -> tuple[IntArray, IntArray]:
        """Return corners and ends of cells that are written as their count of corners and these corners."""
        numbers = self._numbers(size, b"int").astype(np.int64)
        ends, position = np.zeros(cells, dtype=np.int64) if cells <= size else None, 0
        if ends is None:
            raise self.cursor.fail(f"{cells} cells do not fit into {size} numbers")
        heads = np.zeros(len(numbers), dtype=bool)
        for cell in range(cells):
            if position >= len(numbers) or not 0 <= numbers[position] < len(numbers) - position:
                raise Damaged(f"cell {cell + 1} of {cells} reaches beyond the {size} numbers of all cells")
            heads[position] = True
            position += int(numbers[position]) + 1
            ends[cell] = position - cell - 1
        if position != len(numbers):
            raise Damaged(f"its {cells} cells have {position} numbers, {size} are announced")
        return numbers[~heads], ends

    def _offsets(self, offsets: int, corners: int) -> tuple[IntArray, IntArray]:
        """Return corners and ends of cells in a file of version 5."""
        parts = []
        for word, count in ((b"OFFSETS", offsets), (b"CONNECTIVITY", corners)):
            words = self.cursor.words(2)
            if words[0].upper() != word:
                raise self.cursor.fail(f"{clip(word)} is needed, not {clip(words[0])}")
            parts.append(whole_numbers(self._numbers(count, words[1]), "cells"))
        if offsets and parts[0][0] != 0:
            raise Damaged(f"the first offset is {parts[0][0]}, not 0")
        return parts[1], parts[0][1:]
