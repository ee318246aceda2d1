"""Triangles of the faces of a mesh file, with joined corners."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from nvhchain.errors import require
from nvhchain.fem.mesh_files.contents import MeshFile
from nvhchain.handoff import FloatArray, IntArray

JOINED = 1e-6
"""Distance within which corners are one, relative to the largest extent. Single precision has 1e-7 of the largest
coordinate."""

_PAIRS = 30
"""Largest number of pairs of corners within that distance, per corner; a file with more is no surface."""

_COLLAPSED = 0.25
"""Largest share of triangles with two corners in one place. A higher share comes from the precision or a point far
away."""

_STARTS = 32
"""Corners of a large face that are tried as the centre of its triangles."""

_HALVES = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
_REFINED = {
    "triangle6": [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    "triangle7": [[0, 3, 6], [3, 1, 6], [1, 4, 6], [4, 2, 6], [2, 5, 6], [5, 0, 6]],
    "quad8": [[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 6], [4, 6, 7]],
    "quad9": [[0, 4, 8], [4, 1, 8], [1, 5, 8], [5, 2, 8], [2, 6, 8], [6, 3, 8], [3, 7, 8], [7, 0, 8]],
}
"""Triangles of faces of second order, over all of their nodes."""


def triangulated(mesh: MeshFile, tolerance: float = JOINED) -> tuple[FloatArray, IntArray, int]:
    """Return the triangles of the faces of a mesh file, with joined corners.

    tolerance: distance within which corners are one, relative to the largest extent.
    Returns vertices (n, 3): vertices in units of the file. triangles (m, 3): indices of vertices. excluded: number of
    excluded triangles, with two corners in one place.

    Quads are divided along the diagonal between the flatter halves. Larger faces are divided about a corner, faces of
    second order over their nodes.
    """
    parts = [_divided(mesh.points, kind, cells) for kind, cells in mesh.cells]
    corners = np.vstack([np.empty((0, 3), dtype=np.int64), *parts])
    require(len(corners) > 0, "holds no triangles: export a triangulated surface")
    used, index = np.unique(corners, return_inverse=True)
    vertices, joined = _joined(mesh.points[used], tolerance)
    triangles = joined[index.reshape(corners.shape)]
    flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    require(
        flat.mean() < _COLLAPSED,
        f"{int(flat.sum())} of {len(flat)} triangles have two corners within {tolerance:g} of its extent: export it "
        "in double precision, without points far away",
    )
    kept, numbers = np.unique(triangles[~flat], return_inverse=True)
    return vertices[kept], numbers.reshape(-1, 3), int(flat.sum())


def _joined(points: FloatArray, tolerance: float) -> tuple[FloatArray, IntArray]:
    """Return one point for all within `tolerance` of the extent, and its number for each."""
    points, same = np.unique(points, axis=0, return_inverse=True)
    same = same.ravel()
    near = max(tolerance * float(np.ptp(points, axis=0).max()), float(np.spacing(np.float32(np.abs(points).max()))))
    tree = KDTree(points)
    count = (int(tree.count_neighbors(tree, near)) - len(points)) // 2
    require(
        count <= _PAIRS * len(points),
        f"{len(points)} corners lie closer to each other than {near:.3g}, the precision of its coordinates: export it "
        "about its own origin, or in double precision",
    )
    if not count:
        return points, same
    pairs = tree.query_pairs(near, output_type="ndarray").T
    link = sp.coo_matrix((np.ones(pairs.shape[1], dtype=bool), pairs), shape=(len(points),) * 2)
    number = connected_components(link, directed=False)[1]
    first = np.unique(number, return_index=True)[1]
    return points[first], number[same]


def _divided(points: FloatArray, kind: str, cells: IntArray) -> IntArray:
    """Return the triangles (m, 3) of faces of one kind, none of other cells."""
    if kind == "triangle":
        return cells
    if kind in _REFINED:
        return cells[:, np.array(_REFINED[kind])].reshape(-1, 3)
    if kind == "quad":
        halves = cells[:, _HALVES]
        flatness = _flatness(points, halves)
        return halves[np.arange(len(cells)), flatness.argmax(axis=1)].reshape(-1, 3)
    if not kind.startswith("polygon"):
        return np.empty((0, 3), dtype=np.int64)
    size = cells.shape[1]
    require(
        size <= 1000, f"a face has {size} corners, at most 1000 are read: triangulate the surface when exporting it"
    )
    best, least = np.empty((0, 3), dtype=np.int64), np.full(len(cells), -np.inf)
    fan = np.stack([np.zeros(size - 2, dtype=int), np.arange(1, size - 1), np.arange(2, size)], axis=1)
    found = np.empty((len(cells), size - 2, 3), dtype=np.int64)
    for start in range(0, size, -(-size // _STARTS)):
        best = cells[:, (fan + start) % size]
        flatness = _flatness(points, best[:, None])[:, 0]
        better = flatness > least + 1e-9
        found[better], least[better] = best[better], flatness[better]
        if (least > 0.5).all():
            break
    bad = int((least <= 0).sum())
    require(
        bad == 0,
        f"{bad} faces of {size} corners cannot be divided about a corner: triangulate the surface when exporting it",
    )
    return found.reshape(-1, 3)


def _flatness(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the smallest cosine (n, ways) between the normal of a triangle and that of its face.

    triangles : (n, ways, k, 3) indices of points.
    """
    a, b, c = (points[triangles[..., i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    whole = normal.sum(axis=2, keepdims=True)
    size = np.linalg.norm(normal, axis=-1) * np.linalg.norm(whole, axis=-1)
    cosine = np.einsum("...i,...i->...", normal, whole) / np.where(size > 0, size, 1.0)
    return np.asarray(np.where(size > 0, cosine, 0.0).min(axis=2))
