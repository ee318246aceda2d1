"""Writers of meshes as VTU and Abaqus input."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from nvhchain.fem.mesh_files.contents import MeshFile
from nvhchain.fem.mesh_files.vtk import CELL_TYPES
from nvhchain.files.atomic_write import write_atomic
from nvhchain.handoff import FloatArray

_NUMBERS = {kind: number for number, kind in CELL_TYPES.items()}
_INP = {"tetra10": "C3D10", "hexahedron20": "C3D20"}


def write_vtu(
    path: Path, mesh: MeshFile, *, points: Mapping[str, FloatArray], cells: Mapping[str, FloatArray] | None = None
) -> None:
    """Write points and cells with arrays for ParaView.

    points, cells mapping of str to (n, …) array: arrays on the points and on the cells, by name.
    """
    write_atomic(path, vtu_content(mesh, points=points, cells=cells))


def vtu_content(
    mesh: MeshFile, *, points: Mapping[str, FloatArray], cells: Mapping[str, FloatArray] | None = None
) -> bytes:
    """Return the bytes of a VTU file.

    points, cells mapping of str to (n, …) array: arrays on the points and on the cells, by name.
    """
    sizes = [(kind, len(nodes), nodes.shape[1]) for kind, nodes in mesh.cells]
    root = ElementTree.Element(
        "VTKFile", type="UnstructuredGrid", version="1.0", byte_order="LittleEndian", header_type="UInt64"
    )
    total = sum(many for _, many, _ in sizes)
    piece = ElementTree.SubElement(
        ElementTree.SubElement(root, "UnstructuredGrid"),
        "Piece",
        NumberOfPoints=str(len(mesh.points)),
        NumberOfCells=str(total),
    )
    ends = np.cumsum(np.concatenate([np.full(many, width, dtype=np.int64) for _, many, width in sizes]))
    types = np.concatenate([np.full(many, _NUMBERS[kind], dtype=np.uint8) for kind, many, _ in sizes])
    corners = np.concatenate([nodes.ravel() for _, nodes in mesh.cells])
    for group, arrays in (
        ("Points", {"Points": mesh.points}),
        ("Cells", {"connectivity": corners, "offsets": ends, "types": types}),
        ("PointData", points),
        ("CellData", cells or {}),
    ):
        parent = ElementTree.SubElement(piece, group)
        for name, values in arrays.items():
            _array(parent, name, np.asarray(values))
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _array(parent: ElementTree.Element, name: str, values: np.ndarray) -> None:
    """Add one array in base64."""
    letter = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind]
    data = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
    array = ElementTree.SubElement(
        parent, "DataArray", type=f"{letter}{8 * values.dtype.itemsize}", Name=name, format="binary"
    )
    if values.ndim > 1:
        array.set("NumberOfComponents", str(int(np.prod(values.shape[1:]))))
    array.text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode("ascii")


def write_inp(path: Path, mesh: MeshFile) -> None:
    """Write quadratic solids and node sets as Abaqus input; labels count from 1.

    mesh: points, cells and the node sets `tagged`.
    """
    lines = ["*NODE"]
    lines += [f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    labels = count(1)
    for kind, nodes in mesh.cells:
        lines.append(f"*ELEMENT, TYPE={_INP[kind]}")
        for row in (nodes + 1).tolist():
            lines += _wrapped([next(labels), *row], going_on=True)
    for name, numbers in mesh.tagged.items():
        lines.append(f"*NSET, NSET={name}")
        lines += _wrapped((numbers + 1).tolist(), going_on=False)
    write_atomic(path, ("\n".join(lines) + "\n").encode("utf-8"))


def _wrapped(numbers: list[int], *, going_on: bool) -> list[str]:
    """Return lines of at most 16 numbers; with `going_on` a comma ends all but the last."""
    lines = [", ".join(map(str, numbers[i : i + 16])) for i in range(0, len(numbers), 16)]
    return [line + "," for line in lines[:-1]] + lines[-1:] if going_on else lines
