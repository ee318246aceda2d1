"""Meshes with groups in MED files, opened in a process of its own: HDF5 may crash or hang on a damaged file."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from nvhchain.fem.mesh_files import _med
from nvhchain.fem.mesh_files.contents import NODES, Damaged, MeshFile, clip, surface_nodes
from nvhchain.handoff import IntArray
from nvhchain.runtime import processes

_TYPES = {
    "PO1": "vertex", "SE2": "line", "SE3": "line3", "TR3": "triangle", "TR6": "triangle6", "TR7": "triangle7",
    "QU4": "quad", "QU8": "quad8", "QU9": "quad9", "TE4": "tetra", "T10": "tetra10", "HE8": "hexahedron",
    "H20": "hexahedron20", "H27": "hexahedron27", "PE6": "wedge", "P15": "wedge15", "P18": "wedge18", "PY5": "pyramid",
    "P13": "pyramid13",
}  # fmt: skip

_TIME_LIMIT, _BYTES_PER_SECOND = 30.0, 5e6
"""Longest duration of reading (s), and bytes per further second."""


def read_med(path: Path) -> MeshFile:
    """Read points, cells and groups of nodes and cells."""
    limit = _TIME_LIMIT + path.stat().st_size / _BYTES_PER_SECOND
    done = processes.exchange(_med.__file__, str(path.absolute()), content=b"", seconds=limit)
    if done is None:
        raise Damaged(f"reading it did not end within {limit:.0f} s")
    if done.returncode != 0 or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise Damaged(clip(said[-1], 200)[1:-1] if said and done.returncode == 1 else "the HDF5 library fails on it")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    names = json.loads(str(arrays["names"]))
    cells: list[tuple[str, IntArray]] = []
    groups: dict[str, list[tuple[str, IntArray]]] = {name: [] for found in names["cells"].values() for name in found}
    for kind in sorted(name[6:] for name in arrays if name.startswith("nodes ")):
        if kind not in _TYPES:
            raise Damaged(f"cells of type {clip(kind)} are not read")
        flat, count = arrays[f"nodes {kind}"].ravel(), NODES[_TYPES[kind]]
        if len(flat) % count:
            raise Damaged(f"cells of type {kind} have {len(flat)} corners, a multiple of {count} is needed")
        nodes = flat.reshape(count, -1).T - 1
        cells.append((_TYPES[kind], nodes))
        for name, numbers in _members(arrays, f"family {kind}", len(nodes), names["cells"]).items():
            groups[name].append((_TYPES[kind], nodes[numbers]))
    points = arrays["points"]
    if points.size % 3:
        raise Damaged(f"it has {points.size} coordinates, a multiple of 3 is needed")
    points = points.reshape(3, -1).T
    tagged = _members(arrays, "family", len(points), names["points"])
    return MeshFile(points, cells, tagged, {name: surface_nodes(parts) for name, parts in groups.items()})


def _members(arrays: dict[str, np.ndarray], key: str, count: int, names: dict[str, list[str]]) -> dict[str, IntArray]:
    """Return the numbers of points or cells by the names of their families."""
    family = arrays.get(key, np.zeros(count, dtype=np.int64)).ravel()
    if len(family) != count:
        raise Damaged(f"{len(family)} families are given for {count} points or cells")
    found: dict[str, IntArray] = {}
    for number, groups in names.items():
        members = np.flatnonzero(family == int(number))
        found |= {name: np.append(found.get(name, members[:0]), members) for name in groups}
    return found
