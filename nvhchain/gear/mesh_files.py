"""Volume meshes of gears in files that meshio reads and writes."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from nvhchain.errors import FileFormatError, InputError
from nvhchain.gear.volume_mesh import VolumeMesh
from nvhchain.handoff import IntArray
from nvhchain.kinds import check_arguments

_KINDS = {"tetra10": "tet10", "hexahedron20": "hex20"}
_SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid")
TAGS = ("bore", "flanks")


def read_gear_mesh(path: str | Path, *, scale: float = 1.0, order: int = 1, tags: tuple[str, str] = TAGS) -> VolumeMesh:
    """Read a mesh of tetra10 or hexahedron20 cells whose bore and flanks are tagged.

    scale: m per unit of the file's coordinates.  order: of the rotational symmetry, 1 for none.
    tags: names of those of bore and flanks, in upper or lower case.
    A tag is a point set, a point array that is not zero on its nodes, or a cell set (physical group) of surface cells.

    Raises FileFormatError for what is not a mesh, InputError for missing tags, other elements, and what `VolumeMesh`
    says.
    """
    check_arguments(read_gear_mesh, locals())
    try:
        mesh = meshio.read(path)
    except (meshio.ReadError, SystemExit, OSError, ValueError, KeyError, IndexError) as error:
        raise FileFormatError(f"{path}: not a mesh that meshio reads ({error})") from None
    solids = [block for block in mesh.cells if block.type.startswith(_SOLIDS)]
    kinds = sorted({block.type for block in solids})
    if len(kinds) != 1 or kinds[0] not in _KINDS:
        raise InputError(
            f"{path}: solid cells are {', '.join(kinds) or 'missing'}, one kind of {' or '.join(_KINDS)} is needed: "
            "mesh the gear with quadratic elements of one kind"
        )
    bore, flanks = (_tagged(mesh, tag, str(path)) for tag in tags)
    elements = np.vstack([block.data for block in solids]).astype(np.int64)
    used, number = np.unique(elements, return_inverse=True)
    new = np.full(len(mesh.points), -1)
    new[used] = np.arange(len(used))
    try:
        return VolumeMesh(
            nodes=scale * np.asarray(mesh.points, float)[used],
            elements=number.reshape(elements.shape),
            kind=_KINDS[kinds[0]],
            bore=new[bore][new[bore] >= 0],
            flanks=new[flanks][new[flanks] >= 0],
            order=order,
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def write_gear_mesh(path: str | Path, mesh: VolumeMesh) -> None:
    """Write `mesh` in the format of the file's ending, its tags as point arrays and point sets; coordinates in m."""
    kind = {ours: theirs for theirs, ours in _KINDS.items()}[mesh.kind]
    arrays = {}
    for tag in TAGS:
        arrays[tag] = np.zeros(len(mesh.nodes), dtype=np.int32)
        arrays[tag][getattr(mesh, tag)] = 1
    sets = {tag: getattr(mesh, tag) for tag in TAGS} if Path(path).suffix == ".inp" else None
    meshio.Mesh(mesh.nodes, [(kind, mesh.elements)], point_data=arrays, point_sets=sets).write(path)


def _tagged(mesh: meshio.Mesh, tag: str, path: str) -> IntArray:
    """Numbers of the nodes tagged `tag`."""
    asked, tag = tag, tag.lower()
    sets = {name.lower(): numbers for name, numbers in mesh.point_sets.items()}
    arrays = {name.lower(): values for name, values in mesh.point_data.items()}
    cells = {name.lower(): numbers for name, numbers in mesh.cell_sets.items()}
    if tag in sets:
        return np.unique(np.asarray(sets[tag], dtype=np.int64))
    if tag in arrays:
        return np.flatnonzero(np.asarray(arrays[tag]).ravel() != 0)
    if tag in cells:
        found = [
            block.data[np.asarray(numbers, dtype=np.int64)].ravel()
            for block, numbers in zip(mesh.cells, cells[tag], strict=True)
            if numbers is not None and not block.type.startswith(_SOLIDS)
        ]
        if found:
            return np.unique(np.concatenate(found)).astype(np.int64)
    known = sorted({*sets, *arrays, *cells})
    raise InputError(
        f"{path}: no tag {asked!r} among {', '.join(known) or 'none'}: name the nodes of the bore `bore` and those "
        "of all flanks `flanks`, or say how they are named, as point sets, point arrays or groups of surface cells"
    )
