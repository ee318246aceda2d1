"""Surfaces in PLY files, as text or binary."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.fem.mesh_files.contents import (
    Cursor,
    Damaged,
    MeshFile,
    checked_count,
    clip,
    polygons_by_size,
    whole_numbers,
)

_TYPES = {
    b"char": "i1", b"uchar": "u1", b"short": "i2", b"ushort": "u2", b"int": "i4", b"uint": "u4", b"float": "f4",
    b"double": "f8", b"int8": "i1", b"uint8": "u1", b"int16": "i2", b"uint16": "u2", b"int32": "i4", b"uint32": "u4",
    b"float32": "f4", b"float64": "f8", b"int64": "i8", b"uint64": "u8",
}  # fmt: skip
_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}

_Property = tuple[str, str, str]
"""Name, type of the length of a list (empty for single values), type."""


def read_ply(data: bytes) -> MeshFile:
    """Read vertices and faces; other elements and properties are ignored."""
    cursor = Cursor(data)
    if cursor.line() != b"ply":
        raise Damaged("it does not begin with 'ply'")
    order, elements = _header(cursor)
    columns: dict[str, dict[str, Any]] = {}
    for name, count, properties in elements:
        if name in columns:
            raise Damaged(f"element {clip(name)} is announced twice")
        if order and not any(length for _, length, _ in properties):
            values = cursor.binary(count, [(field, order + kind) for field, _, kind in properties])
            columns[name] = {field: values[field] for field, _, _ in properties}
        elif order:
            columns[name] = _binary_lists(cursor, count, properties, order)
        else:
            columns[name] = _text(cursor, count, properties)
    vertex, face = columns.get("vertex", {}), columns.get("face", {})
    found = face.get("vertex_indices", face.get("vertex_index"))
    if not {"x", "y", "z"} <= set(vertex) or not isinstance(found, tuple):
        raise Damaged("it has no vertices with x, y and z, or no faces with a list vertex_indices")
    points = np.stack([np.asarray(vertex[axis], dtype=float) for axis in "xyz"], axis=1)
    corners, ends = (whole_numbers(values, "corners of faces") for values in found)
    return MeshFile(points, polygons_by_size(corners, ends))


def _header(cursor: Cursor) -> tuple[str, list[tuple[str, int, list[_Property]]]]:
    """Return the byte order (empty for text), and name, count and properties of each element."""
    order: str | None = None
    elements: list[tuple[str, int, list[_Property]]] = []
    while True:
        words = cursor.words()
        if words[0] in (b"comment", b"obj_info"):
            continue
        if words == [b"end_header"]:
            break
        if words[0] == b"format" and len(words) == 3 and words[1] in _ORDERS:
            order = _ORDERS[words[1]]
        elif words[0] == b"element" and len(words) == 3:
            elements.append((words[1].decode("latin-1"), checked_count(words[2], "elements", cursor.place), []))
        elif words[0] == b"property" and elements and len(words) == 3 and words[1] in _TYPES:
            elements[-1][2].append((words[2].decode("latin-1"), "", _TYPES[words[1]]))
        elif words[0] == b"property" and elements and len(words) == 5 and {words[2], words[3]} <= set(_TYPES):
            elements[-1][2].append((words[4].decode("latin-1"), _TYPES[words[2]], _TYPES[words[3]]))
        else:
            raise cursor.fail(f"the header has a line that is not read: {clip(b' '.join(words))}")
    if order is None:
        raise Damaged("its header does not give the format")
    for name, _, properties in elements:
        names = [field for field, _, _ in properties]
        if not names or len(set(names)) < len(names):
            raise Damaged(f"element {clip(name)} has no property, or one twice")
    return order, elements


def _text(cursor: Cursor, count: int, properties: list[_Property]) -> dict[str, Any]:
    """Return the values by property of a text file; a list as its entries and the end of each list."""
    if not any(length for _, length, _ in properties):
        table = cursor.table(count, len(properties), float)
        return {name: table[:, i] for i, (name, _, _) in enumerate(properties)}
    flat: dict[str, tuple[list[bytes], list[int]]] = {name: ([], []) for name, _, _ in properties}
    for _ in range(count):
        words, position = cursor.words(), 0
        for name, length, _ in properties:
            size = checked_count(words[position], "entries", cursor.place) if length and position < len(words) else 1
            position += bool(length)
            if position + size > len(words):
                raise cursor.fail(f"{position + size} numbers are needed, {len(words)} are there")
            flat[name][0].extend(words[position : position + size])
            flat[name][1].append(len(flat[name][0]))
            position += size
    columns: dict[str, Any] = {}
    for name, length, kind in properties:
        values = np.array(flat[name][0], dtype="S32").astype(np.int64 if kind[0] in "iu" else float)
        columns[name] = (values, np.array(flat[name][1], dtype=np.int64)) if length else values
    return columns


def _binary_lists(cursor: Cursor, count: int, properties: list[_Property], order: str) -> dict[str, Any]:
    """Return the values by property of a binary file.

    They are read at once if all lists are as long as the first, one by one otherwise.
    """
    start, sizes = cursor.position, []
    for _, length, kind in properties if count else []:
        sizes.append(_length(cursor, order + length) if length else 1)
        cursor.binary(sizes[-1], order + kind)
    record = [
        part
        for (name, length, kind), size in zip(properties, sizes, strict=False)
        for part in ([("#" + name, order + length)] if length else []) + [(name, order + kind, (size,))]
    ]
    cursor.position = start
    if count * np.dtype(record).itemsize <= len(cursor.data) - start:
        values = cursor.binary(count, record)
        lists = [(name, size) for (name, length, _), size in zip(properties, sizes, strict=False) if length]
        if all((values["#" + name] == size).all() for name, size in lists):
            entries = {name: values[name].ravel() for name, _, _ in properties} if count else {}
            ends = {name: size * np.arange(1, count + 1) for name, size in lists}
            return {name: (flat, ends[name]) if name in ends else flat for name, flat in entries.items()}
    cursor.position = start
    flat: dict[str, list[Any]] = {name: [] for name, _, _ in properties}
    for _ in range(count):
        for name, length, kind in properties:
            flat[name].append(cursor.binary(_length(cursor, order + length) if length else 1, order + kind))
    columns: dict[str, Any] = {}
    for name, length, _ in properties:
        joined = np.concatenate(flat[name])
        columns[name] = (joined, np.cumsum([len(part) for part in flat[name]])) if length else joined
    return columns


def _length(cursor: Cursor, kind: str) -> int:
    """Return the number of entries of the list that follows."""
    place = f"byte {cursor.position}"
    value = cursor.binary(1, kind)[0]
    if not np.isfinite(value) or value != int(value):
        raise Damaged(f"{place}: a list has {value} entries")
    return checked_count(int(value), "entries", place)
