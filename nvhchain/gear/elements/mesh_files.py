"""Imported and exported volume meshes of gears in files of other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.fem.mesh_files import MeshFile, read_mesh, write_inp, write_vtu
from nvhchain.gear.drawing.volume_mesh import ELEMENT_NODES, VolumeMesh
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.kinds import checked

_WRITTEN = {"tet10": "tetra10", "hex20": "hexahedron20"}
_READ = {theirs: ours for ours, theirs in _WRITTEN.items()} | {"hexahedron27": "hex20"}
"""Kinds of cells in files and here. The middles of faces and bricks of 27 nodes, which come last, are dropped."""

_MIRRORED = {
    "tet10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
    "hex20": [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17],
}
"""Node order of mirrored elements, such as those of MED files."""

_SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid")
TAGS = ("bore", "flanks")


@checked
def read_gear_mesh(path: str | Path, *, scale: float = 1.0, order: int = 1, tags: tuple[str, str] = TAGS) -> VolumeMesh:
    """Read a mesh of quadratic tetrahedra or bricks whose bore and flanks are tagged.

    scale: metres per unit of the file's coordinates.
    order: order of the rotational symmetry, 1 for none.
    tags: names of the tags of bore and flanks, in upper or lower case.

    A tag is a point set, a point array that is not zero on its nodes, or a cell set (group) of surface cells.
    """
    mesh = read_mesh(path)
    solids = [(kind, nodes) for kind, nodes in mesh.cells if kind.startswith(_SOLIDS)]
    kinds = sorted({kind for kind, _ in solids})
    if len(kinds) != 1 or kinds[0] not in _READ:
        raise InputError(
            f"{path}: solid cells are {', '.join(kinds) or 'missing'}, one kind of {' or '.join(_READ)} is needed: "
            "mesh the gear with quadratic elements of one kind"
        )
    kind = _READ[kinds[0]]
    bore, flanks = (_tagged(mesh, tag, str(path)) for tag in tags)
    elements = np.vstack([nodes[:, : ELEMENT_NODES[kind]] for _, nodes in solids])
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
    """Write a mesh as VTU with its tags as point arrays, or as Abaqus input (`.inp`) with sets; coordinates in m.

    Parameters
    ----------
    path : str or Path
        File, ending in .vtu or .inp.
    mesh : VolumeMesh
        Mesh.

    Raises
    ------
    InputError
        If the file has another ending.
    """
    path = Path(path)
    tagged = {tag: getattr(mesh, tag) for tag in TAGS}
    contents = MeshFile(mesh.nodes, [(_WRITTEN[mesh.kind], mesh.elements)], tagged)
    ending = path.suffix.lower()
    require(ending in (".vtu", ".inp"), f"{path}: gear meshes are written as .vtu or .inp: choose one of the two")
    if ending == ".inp":
        write_inp(path, contents)
        return
    everywhere = np.arange(len(mesh.nodes))
    write_vtu(
        path, contents, points={tag: np.isin(everywhere, nodes).astype(np.int32) for tag, nodes in tagged.items()}
    )


def _mirrored(points: FloatArray, elements: IntArray, kind: str) -> bool:
    """Return True if the corners of all elements are in the opposite order."""
    ends = [1, 2, 3] if kind == "tet10" else [1, 3, 4]
    edges = points[elements[:, ends]] - points[elements[:, :1]]
    return bool((np.linalg.det(edges) < 0).all())


def _tagged(mesh: MeshFile, tag: str, path: str) -> IntArray:
    """Return the nodes tagged `tag`."""
    points, cells = ({name.lower(): nodes for name, nodes in found.items()} for found in (mesh.tagged, mesh.groups))
    name = tag.lower()
    if name in points:
        return np.unique(points[name])
    if name not in cells:
        raise InputError(
            f"{path}: no tag {tag!r} among {_listed({*points, *cells})}: name the nodes of the "
            "bore `bore` and those of all flanks `flanks`, or state their names, as point sets, point arrays or "
            "groups of surface cells"
        )
    if not len(cells[name]):
        raise InputError(
            f"{path}: the group {tag!r} has no surface cells: put those of the surface into it, not solids"
        )
    return cells[name]


def _listed(names: set[str]) -> str:
    """Return names of a file in a form fit for a message."""
    first = [name if name.isprintable() else ascii(name) for name in sorted(names)[:20]]
    return (", ".join(name[:60] for name in first) or "none") + (", …" if len(names) > 20 else "")
