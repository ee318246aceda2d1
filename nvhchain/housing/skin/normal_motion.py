"""Motion of the finite element skin as normal velocity of the radiating faces, preserving the volume velocity.

A face moves as the skin nearest to its points does, along the face's own normal. This is smooth where wall and envelope
are smooth. It misses a little volume where the envelope rounds edges, bosses and ribs. The missing volume of every face
is spread over the faces around it. The volume velocity of the whole skin is preserved to rounding. A face that consists
of facets of the skin has exactly their mean motion.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.fem.triangles import Planes, equal_pieces, nearest_coordinates, planes, squared_distance_to
from nvhchain.handoff import FloatArray, IntArray, Surface

_CANDIDATES = 16
"""Number of faces with the nearest centroids that are examined first; more if the nearest may be another one."""

_EQUAL = 1e-9
"""Relative difference below which squared distances are equal."""

_WHOLE = 1e-6
"""Largest difference of areas, relative to a face, of the facets of which it consists."""

_CHUNK = 100_000
"""Number of points whose candidates are held at once."""

_COVERED = 0.5
"""Largest distance along the wall between a point of a face and the skin, over the face's size; beyond it is a hole."""

_SPREADS = 8
"""Number of steps that spread the missing volume, each to the three faces beside; about one face far in all."""


def normal_motion(
    nodes: FloatArray, skin: IntArray, surface: Surface, silent: IntArray, samples_per_face: float
) -> sp.csr_matrix:
    """Return the operator (n_face, 3 n) from nodal displacements (m) to mean outward normal ones (m) of the faces.

    nodes : (n, 3) nodes (m).
    skin : (k, 6) outward facets.
    silent : (n_face,) bool, faces that stay at rest.
    samples_per_face : pieces per edge length of a typical radiating face.
    """
    received, whole = _received_volume(nodes, skin, surface, silent, samples_per_face)
    followed = sp.diags(1.0 - whole) @ _followed_motion(nodes, skin, surface, silent, samples_per_face)
    followed = followed + sp.diags(whole / surface.areas) @ received
    missing = received - sp.diags(surface.areas) @ followed
    spread = _spreading(surface, silent)
    for _ in range(_SPREADS):
        missing = spread @ missing
    return sp.csr_matrix(followed + sp.diags(1 / surface.areas) @ missing)


def _received_volume(
    nodes: FloatArray, skin: IntArray, surface: Surface, silent: IntArray, samples_per_face: float
) -> tuple[sp.csr_matrix, FloatArray]:
    """Return the operator (n_face, 3 n) from nodal displacements (m) to the volumes (m³) received by the faces.

    Every facet of the skin is cut into small pieces. Each gives its flux u·n dA to the nearest face. The second value
    (n_face,) is 1 for faces that consist of whole facets, else 0.
    """
    listening = np.flatnonzero(~silent)
    piece = float(np.sqrt(np.median(surface.areas[listening]))) / samples_per_face
    corners = nodes[skin[:, :3]]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    cuts = np.maximum(1, np.ceil(edges / piece)).astype(int)
    rows, columns, values = [], [], []
    for count in np.unique(cuts):
        chosen = np.flatnonzero(cuts == count)
        shape, place = _pieces(int(count))
        points = np.einsum("pc,kca->kpa", place, corners[chosen])
        face = listening[_nearest(surface.vertices[surface.triangles[listening]], points.reshape(-1, 3))].reshape(
            points.shape[:2]
        )
        size = (*face.shape, shape.shape[1])
        rows.append(np.broadcast_to(face[:, :, None], size).ravel())
        columns.append(np.broadcast_to(6 * chosen[:, None, None] + np.arange(6), size).ravel())
        values.append(np.broadcast_to(shape / len(place), size).ravel())
    # share of each face in a facet's shape functions, then the flux of these: straight facets have one normal
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    share = sp.coo_matrix(entries, shape=(len(surface.areas), skin.size)).tocsr()
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    unknowns = (3 * skin[:, :, None] + np.arange(3)).reshape(skin.size, 3)
    flux = sp.csr_matrix(
        (np.repeat(area, 6, axis=0).ravel(), unknowns.ravel(), 3 * np.arange(skin.size + 1)),
        shape=(skin.size, nodes.size),
    )
    part = share @ sp.kron(sp.identity(len(skin)), np.ones((6, 1)), format="csr")
    given = part.multiply(part > 1.0 - _EQUAL) @ np.linalg.norm(area, axis=1)
    whole = (np.abs(given / surface.areas - 1.0) < _WHOLE) & (
        (part > 0).sum(axis=1) == (part > 1.0 - _EQUAL).sum(axis=1)
    ).A1
    return sp.csr_matrix(share @ flux), whole.astype(float)


def _followed_motion(
    nodes: FloatArray, skin: IntArray, surface: Surface, silent: IntArray, samples_per_face: float
) -> sp.csr_matrix:
    """Return the operator (n_face, 3 n) to the mean normal displacement of the skin nearest to every face.

    Points of a face over a hole, further along the wall from the skin than half a face, stay at rest.
    """
    listening = np.flatnonzero(~silent)
    place = equal_pieces(int(np.ceil(samples_per_face / 2))).mean(axis=1)
    points = np.einsum("pc,kca->kpa", place, surface.vertices[surface.triangles[listening]]).reshape(-1, 3)
    corners = nodes[skin[:, :3]]
    facet = _nearest(corners, points)
    L = nearest_coordinates(planes(corners), facet, points)
    gap = points - np.einsum("pc,pca->pa", L, corners[facet])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangential_gap = np.linalg.norm(gap - np.einsum("pa,pa->p", gap, normal[facet])[:, None] * normal[facet], axis=1)
    face = np.repeat(listening, len(place))
    covered = tangential_gap < _COVERED * np.sqrt(surface.areas[face])
    shape = np.hstack([L * (2 * L - 1), 4 * L * np.roll(L, -1, axis=1)]) / len(place)
    shape = np.where(covered[:, None], shape, 0.0)
    values = shape[:, :, None] * surface.normals[face][:, None, :]
    columns = 3 * skin[facet][:, :, None] + np.arange(3)
    rows = np.broadcast_to(face[:, None, None], values.shape)
    return sp.coo_matrix(
        (values.ravel(), (rows.ravel(), columns.ravel())), shape=(len(surface.areas), nodes.size)
    ).tocsr()


def _spreading(surface: Surface, silent: IntArray) -> sp.csr_matrix:
    """Return the operator (n_face, n_face) that passes volumes on to neighbours; equal normal motions stay equal."""
    triangles, count = surface.triangles, len(surface.areas)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    first, second = (order.reshape(-1, 2) // 3).T  # a closed surface has two faces at every edge
    listening = ~(silent[first] | silent[second])
    first, second = first[listening], second[listening]
    a, b = surface.areas[first], surface.areas[second]
    share = a * b / (a + b) / 3
    rows, columns = np.concatenate([second, first]), np.concatenate([first, second])
    passed = sp.coo_matrix((np.concatenate([share / a, share / b]), (rows, columns)), shape=(count, count)).tocsr()
    kept = 1 - np.asarray(passed.sum(axis=0)).ravel()
    return sp.csr_matrix(passed + sp.diags(kept))


def _pieces(count: int) -> tuple[FloatArray, FloatArray]:
    """Return mean quadratic shape functions (p, 6) and centroids in area coordinates (p, 3) of count² equal pieces."""
    L = equal_pieces(count)
    # three mid-edge points integrate quadratics exactly
    middle = (L + np.roll(L, 1, axis=1)) / 2
    value = np.concatenate(
        [middle * (2 * middle - 1), 4 * middle * np.roll(middle, -1, axis=2)], axis=2
    )  # edges 01, 12, 20
    return value.mean(axis=1), L.mean(axis=1)


def _nearest(corners: FloatArray, points: FloatArray) -> IntArray:
    """Return the index of the triangle (k, 3, 3) nearest to each point (p, 3)."""
    centroids = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    tree, triangles = cKDTree(centroids), planes(corners)
    parts = [points[start : start + _CHUNK] for start in range(0, len(points), _CHUNK)]
    return np.concatenate([_nearest_of(triangles, reach, tree, part) for part in parts])


def _nearest_of(triangles: Planes, reach: FloatArray, tree: cKDTree, points: FloatArray) -> IntArray:
    """Return the nearest triangle by a tree of their centroids and the reach (k,) m from these to the corners."""
    result, unsure, count = np.empty(len(points), dtype=np.int64), np.arange(len(points)), _CANDIDATES
    while len(unsure):
        part, count = points[unsure], min(count, len(reach))
        apart, candidates = (found.reshape(len(part), count) for found in tree.query(part, k=count))
        first = np.sqrt(squared_distance_to(triangles, candidates[:, 0], part))
        row, column = np.nonzero(apart - reach[candidates] <= first[:, None])
        distance = np.full(apart.shape, np.inf)
        distance[row, column] = squared_distance_to(triangles, candidates[row, column], part[row])
        least = distance.min(axis=1)
        # faces that meet in the nearest point are equally near to rounding: take the one with the nearest centroid
        best = (distance <= ((1 + _EQUAL) * least + (_EQUAL * reach.max()) ** 2)[:, None]).argmax(axis=1)[:, None]
        result[unsure] = np.take_along_axis(candidates, best, axis=1)[:, 0]
        nearest = np.sqrt(least)
        # a face not examined is no nearer than its centroid less its reach
        unsure = unsure[(apart[:, -1] - reach.max() < nearest) & (count < len(reach))]
        count *= 2
    return result
