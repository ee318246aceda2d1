"""Closed surfaces from mesh files: corners joined as far as needed, flat triangles removed, normals turned outward."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from nvhchain.errors import counted
from nvhchain.fem.mesh_files.contents import MeshFile
from nvhchain.fem.mesh_files.triangulation import JOINED, triangulated
from nvhchain.handoff import FloatArray, IntArray

_TOLERANCES = (JOINED, 1e-5, 1e-4)
"""Distances within which corners are one, relative to the largest extent; a larger one only where a smaller one leaves
the surface open."""

_FLAT = 2e-12
"""Area of a triangle without area, over the mean of all; a surface takes those above half of it."""


def closed_surface(mesh: MeshFile) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Return the triangles of a surface in a mesh file, repaired.

    Returns vertices (n, 3): vertices in units of the file. triangles (m, 3): indices of vertices; outward where the
    surface is closed.

    An open surface is returned open, with the smallest tolerance.
    """
    tried = [_joined_within(mesh, tolerance) for tolerance in _TOLERANCES[:1]]
    for tolerance in _TOLERANCES[1:]:
        if _is_closed(tried[-1][1]):
            break
        tried.append(_joined_within(mesh, tolerance))
    closed = _is_closed(tried[-1][1])
    tolerance = _TOLERANCES[len(tried) - 1] if closed else JOINED
    vertices, triangles, (dropped, repeated, flat) = tried[-1] if closed else tried[0]
    repairs = []
    if tolerance > JOINED:
        repairs.append(f"corners within {tolerance:g} of its extent joined, without which it is open")
    if dropped:
        whole = dropped + repeated + flat + len(triangles)
        repairs.append(f"{dropped} of {whole} triangles have two corners in one place and are excluded")
    if repeated:
        repairs.append(f"{counted(repeated, 'triangle')} on the corners of others excluded")
    if flat:
        repairs.append(f"{flat} triangles without area are excluded, and their neighbours divided")
    if closed:
        triangles, turned = _outward(vertices, triangles)
        if turned:
            repairs.append(f"{turned} of {len(triangles)} triangles turned over, so that all normals point outward")
    return vertices, triangles, tuple(repairs)


def _joined_within(mesh: MeshFile, tolerance: float) -> tuple[FloatArray, IntArray, tuple[int, int, int]]:
    """Return the surface with corners joined within `tolerance`, and the numbers of removed triangles.

    These have two corners in one place, the corners of another triangle, or no area.
    """
    vertices, triangles, dropped = triangulated(mesh, tolerance)
    first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1]
    repeated = len(triangles) - len(first)
    vertices, triangles, flat = _drop_flat(vertices, triangles[np.sort(first)])
    return vertices, triangles, (dropped, repeated, flat)


def _is_closed(triangles: IntArray) -> bool:
    """Return True if every edge belongs to two triangles."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def _areas(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _drop_flat(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray, int]:
    """Return the surface without triangles whose corners lie on a line, and their number.

    The neighbour at the longest side of such a triangle is divided at the third corner, so that the surface stays
    closed.
    """
    removed = 0
    while True:
        area = _areas(vertices, triangles)
        flat = np.flatnonzero(area <= _FLAT * area.mean())
        if not len(flat) or removed > len(triangles):
            break
        number = int(flat[0])
        corners = triangles[number]
        sides = np.linalg.norm(vertices[corners] - vertices[np.roll(corners, -1)], axis=1)
        start = int(sides.argmax())
        a, b, c = (int(corners[(start + k) % 3]) for k in range(3))
        has_side = (triangles == a).any(axis=1) & (triangles == b).any(axis=1)
        has_side[number] = False
        others = np.flatnonzero(has_side)
        kept = np.delete(triangles, [number, *others], axis=0)
        halves = [np.where(triangles[other] == end, c, triangles[other]) for other in others for end in (a, b)]
        halves = [half for half in halves if len(set(half.tolist())) == 3]
        triangles = np.vstack([kept, *halves]) if halves else kept
        removed += 1
    used, index = np.unique(triangles, return_inverse=True)
    return vertices[used], index.reshape(-1, 3), removed


def _outward(vertices: FloatArray, triangles: IntArray) -> tuple[IntArray, int]:
    """Return triangles (m, 3) of closed bodies with outward normals, and the number of those turned over.

    A body within another one, which may be the wall of a cavity, keeps its orientation as a whole.
    """
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    rising = edges[:, 0] < edges[:, 1]
    order = np.lexsort(np.sort(edges, axis=1).T)
    one, other = order[::2], order[1::2]
    faces = len(triangles)
    alike = rising[one] == rising[other]  # both run the same way: one of them is the wrong way round
    parity = {(int(i), int(j)): bool(k) for i, j, k in zip(one // 3, other // 3, alike, strict=True)}
    link = sp.coo_matrix((np.ones(len(one)), (one // 3, other // 3)), shape=(faces, faces)).tocsr()
    body = connected_components(link, directed=False)[1]
    turned = np.zeros(faces, dtype=bool)
    for root in np.unique(body, return_index=True)[1]:
        sequence, parent = breadth_first_order(link, int(root), directed=False)
        for face in sequence[1:].tolist():
            before = int(parent[face])
            same = parity.get((before, face), parity.get((face, before), False))
            turned[face] = turned[before] ^ same
    made = np.where(turned[:, None], triangles[:, ::-1], triangles)
    a, b, c = (vertices[made[:, i]] - vertices.mean(axis=0) for i in range(3))
    volume = np.bincount(body, np.einsum("ka,ka->k", a, np.cross(b, c)))
    low = np.array([vertices[made[body == k]].min(axis=(0, 1)) for k in range(len(volume))])
    high = np.array([vertices[made[body == k]].max(axis=(0, 1)) for k in range(len(volume))])
    for number in range(len(volume)):
        inside = ((low < low[number]) & (high > high[number])).all(axis=1).any()
        most = turned[body == number].mean() > 0.5
        flip = most if inside else volume[number] < 0
        if flip:
            turned[body == number] = ~turned[body == number]
    made = np.where(turned[:, None], triangles[:, ::-1], triangles)
    return made, int(turned.sum())
