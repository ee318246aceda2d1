"""Unstructured grids (VTU) and polygons (VTP) in XML files of VTK: text, base64 or raw bytes, compressed or not."""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np

from nvhchain.fem.mesh_files.contents import Damaged, MeshFile, checked_count, clip, polygons_by_size, whole_numbers
from nvhchain.fem.mesh_files.vtk import sorted_cells, tagged_points
from nvhchain.handoff import IntArray

_TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
    "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_LARGEST_RATIO = 4
"""Largest number of points, cells or corners per byte of the file; compressed data may announce any number."""

_APPENDED = re.compile(rb"<AppendedData[^>]*>\s*_")


def _inflate(data: bytes, size: int) -> bytes:
    return zlib.decompressobj().decompress(data, size + 1)


def _unpack(data: bytes, size: int) -> bytes:
    return lzma.LZMADecompressor(memlimit=1 << 28).decompress(data, size + 1)


_COMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": _inflate,
    "vtkLZMADataCompressor": _unpack,
}


def read_vtk_xml(data: bytes) -> MeshFile:
    """Read points, cells and point arrays of all pieces."""
    return _Document(data).mesh()


class _Document:
    def __init__(self, data: bytes) -> None:
        self.most = _LARGEST_RATIO * len(data)
        begin = _APPENDED.search(data)
        self.appended = b""
        if begin:
            end = data.rfind(b"</AppendedData")
            if end < begin.end():
                raise Damaged("its appended data do not end: it is cut off")
            self.appended, data = data[begin.end() : end], data[: begin.end() - 1] + data[end:]
        if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
            raise Damaged("it declares entities, which no VTK file does")
        self.root = ElementTree.fromstring(data)
        if self.root.tag != "VTKFile":
            raise Damaged(f"its root is {clip(self.root.tag)}, VTKFile is needed")
        self.kind = self.root.get("type", "")
        if self.kind not in ("UnstructuredGrid", "PolyData"):
            raise Damaged(f"it holds {clip(self.kind)}, UnstructuredGrid or PolyData is needed")
        order, header = self.root.get("byte_order", "LittleEndian"), self.root.get("header_type", "UInt32")
        if order not in ("LittleEndian", "BigEndian") or header not in ("UInt32", "UInt64"):
            raise Damaged(f"byte order {clip(order)} or header type {clip(header)} is not read")
        self.order = "<" if order == "LittleEndian" else ">"
        self.header = np.dtype(self.order + _TYPES[header])
        compressor = self.root.get("compressor")
        if compressor is not None and compressor not in _COMPRESSORS:
            raise Damaged(f"compression {clip(compressor)} is not read: save it with ZLib or without")
        self.expand = _COMPRESSORS[compressor] if compressor else None
        encoding = self.root.find("AppendedData")
        self.raw = encoding is not None and encoding.get("encoding", "raw") == "raw"

    def mesh(self) -> MeshFile:
        grid = self.root.find(self.kind)
        pieces = [] if grid is None else grid.findall("Piece")
        parts = [self._piece(piece) for piece in pieces]
        if not parts:
            raise Damaged("it has no Piece")
        starts = np.cumsum([0] + [len(part.points) for part in parts])
        cells = [
            (kind, nodes + start) for part, start in zip(parts, starts, strict=False) for kind, nodes in part.cells
        ]
        tagged: dict[str, list[IntArray]] = {}
        for part, start in zip(parts, starts, strict=False):
            for name, numbers in part.tagged.items():
                tagged.setdefault(name, []).append(numbers + start)
        joined = {name: np.concatenate(numbers) for name, numbers in tagged.items()}
        return MeshFile(np.vstack([part.points for part in parts]), cells, joined)

    def _piece(self, piece: Any) -> MeshFile:
        n_points = self._count(piece, "NumberOfPoints")
        array = piece.find("Points/DataArray")
        if array is None:
            raise Damaged("it has no Points")
        points = self._values(array, 3 * n_points).reshape(-1, 3)
        if self.kind == "PolyData":
            if checked_count(piece.get("NumberOfStrips", "0"), "strips"):
                raise Damaged("it holds triangle strips: save it as triangles")
            cells = polygons_by_size(*self._lists(piece, "Polys", self._count(piece, "NumberOfPolys")))
        else:
            count = self._count(piece, "NumberOfCells")
            types = (
                whole_numbers(self._values(self._named(piece, "Cells", "types"), count), "types")
                if count
                else np.empty(0, int)
            )
            cells = sorted_cells(*self._lists(piece, "Cells", count), types)
        arrays = {}
        for array in piece.iterfind("PointData/DataArray"):
            width = checked_count(array.get("NumberOfComponents", "1") or "1", "components")
            if width == 1 and array.get("type") in _TYPES:
                arrays[array.get("Name", "")] = self._values(array, n_points)
        for kind, nodes in cells:
            if len(nodes) and (nodes.min() < 0 or nodes.max() >= n_points):
                raise Damaged(f"cells of kind {kind} refer to points {nodes.min()}…{nodes.max()} of {n_points}")
        return MeshFile(points, cells, tagged_points(arrays, n_points))

    def _count(self, piece: Any, name: str) -> int:
        count = checked_count(piece.get(name, "missing"), "points or cells")
        if count > self.most:
            raise Damaged(f"{name} is {count} in a file of {self.most // _LARGEST_RATIO} bytes")
        return count

    def _named(self, piece: Any, group: str, name: str) -> Any:
        for array in piece.iterfind(f"{group}/DataArray"):
            if array.get("Name") == name:
                return array
        raise Damaged(f"its {group} have no array {name!r}")

    def _lists(self, piece: Any, group: str, count: int) -> tuple[IntArray, IntArray]:
        """Return corners and ends of `count` cells."""
        if not count:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        ends = whole_numbers(self._values(self._named(piece, group, "offsets"), count), "offsets")
        size = checked_count(ends[-1], "corners")
        if size > self.most:
            raise Damaged(f"{size} corners are announced in a file of {self.most // _LARGEST_RATIO} bytes")
        return whole_numbers(self._values(self._named(piece, group, "connectivity"), size), "corners"), ends

    def _values(self, array: Any, count: int) -> Any:
        """Return the numbers (count,) of a DataArray."""
        name, kind, form = array.get("Name", "Points"), array.get("type"), array.get("format", "ascii")
        if kind not in _TYPES or form not in ("ascii", "binary", "appended"):
            raise Damaged(f"array {clip(name)} of type {clip(kind)}, format {clip(form)} is not read")
        code = _TYPES[kind]
        try:
            if form == "ascii":
                words = (array.text or "").split()
                if len(words) != count:
                    raise Damaged(f"{count} numbers are needed, {len(words)} are there")
                return np.array(words, dtype=str).astype(np.int64 if code[0] in "iu" else float)
            size = count * np.dtype(code).itemsize
            if form == "binary":
                data = self._decoded("".join((array.text or "").split()).encode("ascii"), size)
            else:
                start = checked_count(array.get("offset", "missing"), "bytes before it")
                part = self.appended[start:]
                data = self._bytes(part, size) if self.raw else self._decoded(part, size)
        except (ValueError, OverflowError, zlib.error, lzma.LZMAError, EOFError, binascii.Error) as error:
            raise Damaged(f"array {clip(name)}: {error}") from None
        return np.frombuffer(data, self.order + code, count)

    def _decoded(self, text: bytes, size: int) -> bytes:
        """Return `size` bytes from base64; the header of compressed data is encoded apart."""
        width = self.header.itemsize
        if not self.expand:
            return self._bytes(_base64(text, width + size), size)
        blocks = int(np.frombuffer(_base64(text, width), self.header, 1)[0])
        head = width * (3 + min(blocks, size))
        encoded = 4 * -(-head // 3)
        sizes = _base64(text[:encoded], head)
        return self._bytes(sizes[:head] + base64.b64decode(_unpadded(text[encoded:]), validate=True), size)

    def _bytes(self, data: bytes, size: int) -> bytes:
        """Return the `size` bytes behind their header."""
        width = self.header.itemsize
        if len(data) < width:
            raise Damaged("it ends before its data")
        first = int(np.frombuffer(data, self.header, 1)[0])
        if not self.expand:
            if first != size or len(data) < width + size:
                raise Damaged(f"{size} bytes are needed, {first} announced and {len(data) - width} there")
            return data[width : width + size]
        if first > max(size, 1) or len(data) < width * (3 + first):
            raise Damaged(f"{first} compressed blocks are announced, {len(data)} bytes are there")
        _, full, last, *packed = np.frombuffer(data, self.header, 3 + first).tolist()
        found, position = [], width * (3 + first)
        for number, length in enumerate(packed, 1):
            expected = last if number == first and last else full
            if expected > size or position + length > len(data):
                raise Damaged(f"compressed block {number} of {first} reaches beyond the data")
            block = self.expand(data[position : position + length], expected)
            if len(block) != expected:
                raise Damaged(f"compressed block {number} of {first} has {len(block)} bytes, {expected} are announced")
            found.append(block)
            position += length
        whole = b"".join(found)
        if len(whole) != size:
            raise Damaged(f"{size} bytes are needed, {len(whole)} are there")
        return whole


def _base64(text: bytes, size: int) -> bytes:
    """Return the first `size` bytes, or more."""
    return base64.b64decode(_unpadded(text[: 4 * -(-size // 3)]), validate=True)


def _unpadded(text: bytes) -> bytes:
    """Return base64 up to its padding; further data may follow."""
    text = text.lstrip()
    found = re.match(rb"[A-Za-z0-9+/]*={0,2}", text)
    return found[0] if found else b""
