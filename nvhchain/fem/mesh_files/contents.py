"""Points, cells and tags of a mesh file, and the checks that hold for every format."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nvhchain.errors import FileFormatError, counted
from nvhchain.handoff import FloatArray, IntArray

NODES = {
    "vertex": 1, "line": 2, "line3": 3,
    "triangle": 3, "triangle6": 6, "triangle7": 7, "quad": 4, "quad8": 8, "quad9": 9,
    "tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27,
    "wedge": 6, "wedge15": 15, "wedge18": 18, "pyramid": 5, "pyramid13": 13, "pyramid14": 14,
}  # fmt: skip
"""Number of nodes of every kind of cell. Polygons may have any; their kind holds it, `polygon5`."""

SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid")

LARGEST_COUNT = 30_000_000
"""Largest number of points or cells in a mesh, and of values in an announced array per point: far above what can be
computed."""

FARTHEST = 1e9
"""Largest coordinate in units of the file; beyond it, areas and volumes lose their digits or overflow."""


class Damaged(FileFormatError):
    """Damaged file; the message gives the place, and `read_mesh` adds the path and the remedy."""


@dataclass
class MeshFile:
    """Points, cells and tags of a mesh file.

    points (n, 3): points in units of the file.
    cells: kind and indices (m, k) of points, in the order of VTK.
    tagged: indices of points by the name of a point set, or of a point array that is not zero there.
    groups: indices of points by the name of a group of cells, for its cells that are not solids.
    """

    points: FloatArray
    cells: list[tuple[str, IntArray]]
    tagged: dict[str, IntArray] = field(default_factory=dict)
    groups: dict[str, IntArray] = field(default_factory=dict)

    def checked(self) -> MeshFile:
        """Check coordinates and indices, and return the mesh; raises Damaged."""
        self.points = np.asarray(self.points, dtype=np.float64)
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not len(self.points):
            raise Damaged(f"its points have the shape {self.points.shape}, (n, 3) is needed")
        for row, bad in (
            ("not finite", ~np.isfinite(self.points).all(axis=1)),
            (f"beyond {FARTHEST:g} units of length", ~(np.abs(self.points) <= FARTHEST).all(axis=1)),
        ):
            if bad.any():
                first = int(np.argmax(bad))
                raise Damaged(
                    f"{counted(int(bad.sum()), 'point')} {row}, first point {first + 1}: {self.points[first]}"
                )
        self.cells = [(kind, np.asarray(nodes)) for kind, nodes in self.cells if len(nodes)]
        for kind, nodes in self.cells:
            check_indices(nodes, len(self.points), f"cells of kind {kind}")
        self.cells = [(kind, nodes.astype(np.int64)) for kind, nodes in self.cells]
        for name, tags in (self.tagged | self.groups).items():
            check_indices(tags, len(self.points), f"tag {name!r}")
        return self


def check_indices(numbers: IntArray, count: int, owner: str) -> None:
    """Raise Damaged unless all `numbers` are indices below `count`."""
    if len(numbers) and (numbers.min() < 0 or numbers.max() >= count):
        raise Damaged(f"{owner} refer to points {numbers.min()}…{numbers.max()}, but there are {count} (0…{count - 1})")


def whole_numbers(values: Any, subject: str) -> IntArray:
    """Return `values` as whole numbers; raises Damaged for any other numbers."""
    values = np.asarray(values)
    if values.dtype.kind == "f" and (np.abs(values) < 2**53).all() and (values == np.floor(values)).all():
        return values.astype(np.int64)
    if values.dtype.kind not in "iu":
        raise Damaged(f"{subject} are not whole numbers")
    return values.astype(np.int64)


def checked_count(count: Any, subject: str, place: str = "") -> int:
    """Return `count` as a whole number of points, cells or values; raises Damaged if it is none or out of range."""
    prefix = f"{place}: " if place else ""
    try:
        number = int(count)
    except ValueError:
        raise Damaged(f"{prefix}the number of {subject} is {clip(count)}") from None
    if not 0 <= number <= LARGEST_COUNT:
        raise Damaged(f"{prefix}the number of {subject} is {number}, 0…{LARGEST_COUNT} are read")
    return number


def clip(text: Any, length: int = 40) -> str:
    """Return text of a file in a form fit for a message: printable and short."""
    text = text.decode("latin-1") if isinstance(text, bytes) else str(text)
    return ascii(text if len(text) <= length else text[:length] + "...")


class Numbering:
    """Indices of points by their number in the file."""

    def __init__(self, numbers: IntArray) -> None:
        self._order = np.argsort(numbers, kind="stable")
        self._sorted = numbers[self._order]
        twice = np.flatnonzero(self._sorted[1:] == self._sorted[:-1])
        if len(twice):
            raise Damaged(f"{len(twice)} node numbers are given twice, first {self._sorted[twice[0]]}")

    def __call__(self, numbers: Any, owner: str) -> IntArray:
        """Return the indices of nodes with these numbers, in the same shape; raises Damaged for a missing node."""
        numbers = np.asarray(numbers, dtype=np.int64)
        if not numbers.size:
            return numbers
        if not len(self._sorted):
            raise Damaged(f"{owner} refer to node {numbers.flat[0]}, but the file has no nodes")
        slot = np.searchsorted(self._sorted, numbers)
        missing = (slot >= len(self._sorted)) | (self._sorted[np.minimum(slot, len(self._sorted) - 1)] != numbers)
        if missing.any():
            raise Damaged(f"{owner} refer to node {numbers[missing].flat[0]}, which is not in the file")
        return np.asarray(self._order[slot], dtype=np.int64)


def surface_nodes(parts: Iterable[tuple[str, IntArray]]) -> IntArray:
    """Return the indices of the points of all cells that are not solids."""
    flat = [nodes.ravel() for kind, nodes in parts if not kind.startswith(SOLIDS)]
    return np.unique(np.concatenate(flat)).astype(np.int64) if flat else np.empty(0, dtype=np.int64)


def polygons_by_size(corners: IntArray, ends: IntArray) -> list[tuple[str, IntArray]]:
    """Return polygons by their number of corners.

    ends : end of each polygon in `corners`, increasing.
    """
    starts = np.concatenate([[0], ends[:-1]]) if len(ends) else ends
    size = ends - starts
    if len(ends) and (size.min() < 3 or ends[-1] > len(corners)):
        bad = int(np.argmin(size))
        raise Damaged(f"face {bad + 1} has {size[bad]} corners, or the faces need {ends[-1]} and have {len(corners)}")
    return [(polygon(int(k)), corners[starts[size == k][:, None] + np.arange(k)]) for k in np.unique(size)]


def polygon(corners: int) -> str:
    """Return the kind of a flat face with this many corners."""
    return {3: "triangle", 4: "quad"}.get(corners, f"polygon{corners}")


class Cursor:
    """Position in the bytes of a file of lines, which may have binary blocks in between."""

    def __init__(self, data: bytes) -> None:
        self.data, self.position, self.last = data, 0, 0

    @property
    def place(self) -> str:
        """Line that was read last, for a message."""
        return "line " + str(self.data.count(b"\n", 0, self.last) + 1)

    def fail(self, why: str) -> Damaged:
        """Return an error at the present position."""
        return Damaged(f"{self.place}: {why}")

    def line(self) -> bytes | None:
        """Return the next line that is not blank, stripped, or None at the end; the cursor moves behind it."""
        while self.position < len(self.data):
            end = self.data.find(b"\n", self.position)
            end = len(self.data) if end < 0 else end
            text, self.position, self.last = self.data[self.position : end].strip(), end + 1, self.position
            if text:
                return text
        return None

    def words(self, least: int = 1) -> list[bytes]:
        """Return the words of the next line, at least `least`."""
        before = self.position
        words = (self.line() or b"").split()
        if len(words) < least:
            self.position = before
            raise self.fail(f"{least} words are needed, the file has {len(words)} there: it is cut off or damaged")
        return words

    def binary(self, count: int, kind: Any) -> Any:
        """Return an array (count,) of a NumPy type from the bytes that follow."""
        dtype = np.dtype(kind)
        if count * dtype.itemsize > len(self.data) - self.position:
            raise self.fail(
                f"{count * dtype.itemsize} bytes are announced, {max(len(self.data) - self.position, 0)} are there"
            )
        values = np.frombuffer(self.data, dtype, count, self.position)
        self.position += count * dtype.itemsize
        return values

    def table(self, count: int, columns: int, kind: Any) -> Any:
        """Return numbers (count, columns) from the next `count` lines that are not blank."""
        rows: list[list[bytes]] = []
        if 2 * count * max(columns, 1) > len(self.data) - self.position + 1:
            raise self.fail(f"{count} lines of {columns} numbers are announced, the file is too short: it is cut off")
        start = self.position
        for _ in range(count):
            rows.append(self.words(columns)[:columns])
        try:
            return np.array(rows, dtype="S32").astype(kind).reshape(count, columns)
        except (ValueError, OverflowError):
            self.position = start
            for row in rows:
                before = self.position
                self.line()
                try:
                    np.array(row, dtype="S32").astype(kind)
                except (ValueError, OverflowError):
                    self.position = before
                    raise self.fail(f"numbers are needed: {clip(b' '.join(row))}") from None
            raise
