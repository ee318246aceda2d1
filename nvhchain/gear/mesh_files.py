"""Volume meshes of gears in files that meshio reads and writes."""

from __future__ import annotations

import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import meshio
import numpy as np

from nvhchain.errors import FileFormatError, InputError, WriteError
from nvhchain.files.whole import write_whole
from nvhchain.gear.volume_mesh import ELEMENT_NODES, VolumeMesh
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.kinds import check_arguments

_WRITTEN = {"tet10": "tetra10", "hex20": "hexahedron20"}
_READ = {theirs: ours for ours, theirs in _WRITTEN.items()} | {"hexahedron27": "hex20"}
"""The middles of faces and bricks, which come last, are left out."""

_MIRRORED = {
    "tet10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
    "hex20": [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17],
}
"""Order of the nodes seen from the other side, which MED counts from."""

_SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid")
TAGS = ("bore", "flanks")


def read_gear_mesh(path: str | Path, *, scale: float = 1.0, order: int = 1, tags: tuple[str, str] = TAGS) -> VolumeMesh:
    """Read a mesh of quadratic tetrahedra or bricks whose bore and flanks are tagged.

    scale: m per unit of the file's coordinates.  order: of the rotational symmetry, 1 for none.
    tags: names of those of bore and flanks, in upper or lower case.
    A tag is a point set, a point array that is not zero on its nodes, or a cell set (group) of surface cells.

    Raises FileFormatError for what is not a mesh, InputError for missing tags, other elements, and what `VolumeMesh`
    says.
    """
    check_arguments(read_gear_mesh, locals())
    said = StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # its readers fail on a damaged file in every way that there is
        why = " ".join((said.getvalue() or str(error)).split())
        raise FileFormatError(f"{path}: not a mesh that meshio reads ({why})") from None
    solids = [block for block in mesh.cells if block.type.startswith(_SOLIDS)]
    kinds = sorted({block.type for block in solids})
    if len(kinds) != 1 or kinds[0] not in _READ:
        raise InputError(
            f"{path}: solid cells are {', '.join(kinds) or 'missing'}, one kind of {' or '.join(_READ)} is needed: "
            "mesh the gear with quadratic elements of one kind"
        )
    kind = _READ[kinds[0]]
    bore, flanks = (_tagged(mesh, tag, str(path)) for tag in tags)
    elements = np.vstack([block.data[:, : ELEMENT_NODES[kind]] for block in solids]).astype(np.int64)
    if elements.min() < 0 or elements.max() >= len(mesh.points):
        raise FileFormatError(
            f"{path}: cells refer to nodes {elements.min()}…{elements.max()}, but there are {len(mesh.points)}"
        )
    if _mirrored(mesh.points, elements, kind):
        elements = elements[:, _MIRRORED[kind]]
    used, number = np.unique(elements, return_inverse=True)
    new = np.full(len(mesh.points), -1)
    new[used] = np.arange(len(used))
    try:
        return VolumeMesh(
            nodes=scale * np.asarray(mesh.points, float)[used],
            elements=number.reshape(elements.shape),
            kind=kind,
            bore=new[bore][new[bore] >= 0],
            flanks=new[flanks][new[flanks] >= 0],
            order=order,
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def write_gear_mesh(path: str | Path, mesh: VolumeMesh) -> None:
    """Write `mesh` in the format of the file's ending, its tags as point arrays and point sets; coordinates in m.

    meshio writes into a folder beside `path`, from which the files are read back before they are taken.  Raises
    WriteError where that is not what was written.
    """
    path = Path(path)
    arrays = {}
    for tag in TAGS:
        arrays[tag] = np.zeros(len(mesh.nodes), dtype=np.int32)
        arrays[tag][getattr(mesh, tag)] = 1
    sets = {tag: getattr(mesh, tag) for tag in TAGS} if path.suffix == ".inp" else None
    asked = meshio.Mesh(mesh.nodes, [(_WRITTEN[mesh.kind], mesh.elements)], point_data=arrays, point_sets=sets)
    with tempfile.TemporaryDirectory(prefix=".nvhchain-", dir=path.parent) as folder:
        part = Path(folder) / path.name
        try:
            asked.write(part)
            with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
                _check_written(meshio.read(part), asked)
        except (OSError, meshio.ReadError, SystemExit) as error:
            raise WriteError(f"{path}: cannot be written ({error}): make room there or name another folder") from error
        for file in sorted(Path(folder).iterdir()):  # some formats have their arrays in a second one
            write_whole(path.parent / file.name, file.read_bytes())


def _check_written(found: meshio.Mesh, asked: meshio.Mesh) -> None:
    """Raise OSError unless a mesh on the disk is the one that was written, to the digits of its format."""
    if not (
        found.points.shape == asked.points.shape
        and np.allclose(found.points, asked.points, rtol=1e-5, atol=1e-6 * float(np.abs(asked.points).max()))
        and [block.data.tolist() for block in found.cells] == [block.data.tolist() for block in asked.cells]
    ):
        raise OSError("the file on the disk holds something else")


def _mirrored(points: FloatArray, elements: IntArray, kind: str) -> bool:
    """Whether the corners of all elements go round the other way."""
    ends = [1, 2, 3] if kind == "tet10" else [1, 3, 4]
    edges = points[elements[:, ends]] - points[elements[:, :1]]
    return bool((np.linalg.det(edges) < 0).all())


def _tagged(mesh: meshio.Mesh, tag: str, path: str) -> IntArray:
    """Numbers of the nodes tagged `tag`."""
    points, cells, name = _points(mesh), _cells(mesh), tag.lower()
    if name in points:
        return np.unique(np.asarray(points[name], dtype=np.int64))
    if name not in cells:
        raise InputError(
            f"{path}: no tag {tag!r} among {', '.join(sorted({*points, *cells})) or 'none'}: name the nodes of the "
            "bore `bore` and those of all flanks `flanks`, or say how they are named, as point sets, point arrays or "
            "groups of surface cells"
        )
    # sets of an Abaqus file end with the blocks that stand before them
    found = [
        block.data[np.asarray(numbers, dtype=np.int64)].ravel()
        for block, numbers in zip(mesh.cells, cells[name], strict=False)
        if numbers is not None and not block.type.startswith(_SOLIDS)
    ]
    nodes = np.unique(np.concatenate(found)) if found else np.empty(0)
    if not len(nodes):
        raise InputError(
            f"{path}: the group {tag!r} has no surface cells: put those of the surface into it, not solids"
        )
    return nodes.astype(np.int64)


def _points(mesh: meshio.Mesh) -> dict[str, IntArray]:
    """Nodes by the lower-case name of their set, of the array that is not zero on them, or of their group (MED)."""
    arrays = {name: values for name, values in mesh.point_data.items() if np.size(values) == len(mesh.points)}
    found = {name: np.flatnonzero(values) for name, values in arrays.items()}
    for family, names in getattr(mesh, "point_tags", {}).items():
        at = np.flatnonzero(mesh.point_data["point_tags"] == family)
        found |= {name: np.append(found.get(name, at[:0]), at) for name in names}
    return {name.lower(): numbers for name, numbers in (found | mesh.point_sets).items()}


def _cells(mesh: meshio.Mesh) -> dict[str, list[IntArray | None]]:
    """Cells of each block by the lower-case name of their set, physical group (Gmsh 2.2) or group (MED)."""
    found: dict[str, list[IntArray | None]] = {}
    for name, (number, dimension) in _physical(mesh).items():
        tags = zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True)
        found[name] = [np.flatnonzero(tag == number) if block.dim == dimension else None for block, tag in tags]
    for name in {n for names in getattr(mesh, "cell_tags", {}).values() for n in names}:
        families = [family for family, names in mesh.cell_tags.items() if name in names]
        found[name] = [np.flatnonzero(np.isin(tag, families)) for tag in mesh.cell_data["cell_tags"]]
    return {name.lower(): numbers for name, numbers in (found | mesh.cell_sets).items()}


def _physical(mesh: meshio.Mesh) -> dict[str, IntArray]:
    """Number and dimension by name, of files that hold no sets of cells beside."""
    return mesh.field_data if "gmsh:physical" in mesh.cell_data and not mesh.cell_sets else {}
