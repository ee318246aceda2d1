"""Surfaces in STL, OBJ and OFF files."""

from __future__ import annotations

import numpy as np

from nvhchain.fem.mesh_files.contents import Cursor, Damaged, MeshFile, checked_count, clip, polygons_by_size
from nvhchain.handoff import IntArray

_HEAD, _FACET = 80, 50
"""Bytes of a binary STL file before the number of triangles, and of each triangle."""

_SPARE = 80
"""Largest number of bytes after the last triangle of a binary STL file, which some writers add."""

_MARK = b"\xef\xbb\xbf"
"""Byte order mark before text in UTF-8."""

_STL_WORDS = {"solid", "facet", "outer", "endloop", "endfacet", "endsolid", "color"}

_OBJ_WORDS = {
    b"vt", b"vn", b"vp", b"g", b"o", b"s", b"mg", b"usemtl", b"mtllib", b"usemap", b"maplib", b"l", b"p", b"bevel",
    b"c_interp", b"d_interp", b"lod", b"shadow_obj", b"trace_obj",
}  # fmt: skip
"""Lines that change neither corners nor faces."""


def read_stl(data: bytes) -> MeshFile:
    """Read the triangles of a binary or text file, each with corners of its own."""
    count = int.from_bytes(data[_HEAD : _HEAD + 4], "little")
    needed = _HEAD + 4 + _FACET * count
    binary = count > 0 and needed <= len(data) <= needed + _SPARE
    if not binary and data[:512].removeprefix(_MARK).lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        corners = _text_corners(data.removeprefix(_MARK))
    elif binary:
        facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
        corners = np.frombuffer(data, facet, count, _HEAD + 4)["corners"].reshape(-1, 3)
    else:
        raise Damaged(
            f"it does not begin with 'solid', and has {len(data)} bytes; a binary file of {count} triangles, which it "
            f"announces, has {needed} and at most {_SPARE} more: it is cut off or damaged"
        )
    with np.errstate(invalid="ignore"):  # numbers that are none are refused with their place
        points = corners.astype(float)
    return MeshFile(points, [("triangle", np.arange(len(corners)).reshape(-1, 3))])


def _text_corners(data: bytes) -> np.ndarray:
    """Return the corners (3 m, 3) of a text file; keywords in upper or lower case."""
    corners: list[list[str]] = []
    places: list[int] = []
    word, loop = "", 0
    for number, line in enumerate(data.decode("latin-1").splitlines(), 1):
        words = line.split()
        if not words:
            continue
        word = words[0].lower()
        if word == "vertex":
            if len(words) != 4:
                raise Damaged(f"line {number}: a vertex has {len(words) - 1} coordinates, 3 are needed")
            corners.append(words[1:])
            places.append(number)
        elif word in ("outer", "endloop"):
            if len(corners) - loop != (3 if word == "endloop" else 0):
                raise Damaged(f"line {number}: a facet has {len(corners) - loop} vertices, 3 are needed")
            loop = len(corners)
        elif word not in _STL_WORDS:
            raise Damaged(f"line {number}: begins with {clip(words[0])}, which is no word of STL")
    if word != "endsolid" or loop != len(corners):
        raise Damaged("it does not end with 'endsolid': it is cut off")
    return _floats(corners, places)


def _floats(rows: list[list[str]] | list[list[bytes]], places: list[int]) -> np.ndarray:
    """Return the numbers (n, 3) of words.

    places : line of each row.
    """
    try:
        return np.array(rows, dtype=float).reshape(-1, 3)
    except ValueError:
        for row, number in zip(rows, places, strict=True):
            try:
                np.array(row, dtype=float)
            except ValueError:
                raise Damaged(f"line {number}: coordinates are {clip(row)}, 3 numbers are needed") from None
        raise


def read_obj(data: bytes) -> MeshFile:
    """Read the faces of an OBJ file; texture and normals are ignored."""
    points: list[list[bytes]] = []
    places: list[int] = []
    corners: list[int] = []
    ends: list[int] = []
    for number, line in _joined(data.removeprefix(_MARK)):
        words = line.split(b"#", 1)[0].split()
        if not words:
            continue
        if words[0] == b"v":
            if len(words) < 4:
                raise Damaged(f"line {number}: a vertex has {len(words) - 1} coordinates, 3 are needed")
            points.append(words[1:4])
            places.append(number)
        elif words[0] == b"f":
            if len(words) < 4:
                raise Damaged(f"line {number}: a face has {len(words) - 1} corners, 3 or more are needed")
            corners += [_corner(word, len(points), number) for word in words[1:]]
            ends.append(len(corners))
        elif words[0] not in _OBJ_WORDS:
            raise Damaged(f"line {number}: begins with {clip(words[0])}, which is not read")
    cells = polygons_by_size(np.array(corners, dtype=np.int64), np.array(ends, dtype=np.int64))
    return MeshFile(_floats(points, places), cells)


def _joined(data: bytes) -> list[tuple[int, bytes]]:
    """Return lines with their number; a backslash at the end of a line joins the next one to it."""
    lines: list[tuple[int, bytes]] = []
    open_line = False
    for number, line in enumerate(data.splitlines(), 1):
        if open_line:
            first, before = lines.pop()
            lines.append((first, before[:-1] + b" " + line))
        else:
            lines.append((number, line))
        open_line = line.endswith(b"\\")
    return lines


def _corner(word: bytes, count: int, line: int) -> int:
    """Return the index of the vertex in a corner such as `7`, `7/1/3` or `-1`, which counts backwards."""
    try:
        number = int(word.split(b"/", 1)[0])
    except ValueError:
        raise Damaged(f"line {line}: corner {clip(word)} of a face is not a number") from None
    if number == 0 or number < -count or number >= 2**31:
        raise Damaged(f"line {line}: a face refers to vertex {number}, {count} stand before it")
    return number - 1 if number > 0 else count + number


def read_off(data: bytes) -> MeshFile:
    """Read the faces of an OFF text file."""
    text = b"\n".join(line.split(b"#", 1)[0] for line in data.removeprefix(_MARK).splitlines())
    cursor = Cursor(text)
    words = cursor.words()
    if words[0] != b"OFF":
        raise cursor.fail(f"it begins with {clip(words[0])}, not with 'OFF'")
    words = words[1:] or cursor.words(2)
    n_points, n_faces = (checked_count(word, thing, cursor.place) for word, thing in zip(words, ("points", "faces")))  # noqa: B905
    points = cursor.table(n_points, 3, float)
    corners: list[int] = []
    ends: IntArray = np.zeros(n_faces, dtype=np.int64) if 2 * n_faces <= len(data) else cursor.binary(n_faces, "<i8")
    for face in range(n_faces):
        words = cursor.words(4)
        size = checked_count(words[0], "corners", cursor.place)
        if size < 3 or len(words) < size + 1:
            raise cursor.fail(f"a face of {size} corners has {len(words) - 1}")
        corners += [checked_count(word, "a corner", cursor.place) for word in words[1 : size + 1]]
        ends[face] = len(corners)
    return MeshFile(points, polygons_by_size(np.array(corners, dtype=np.int64), ends))
