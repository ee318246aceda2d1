"""Motion of the finite element skin as normal velocity of the radiating faces, preserving the volume velocity.

Every skin facet is cut into small pieces. The flux u·n dA of each piece goes to the nearest radiating face. A face's
normal motion is its received flux over its area. The flux of the whole skin is preserved to rounding.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.fem.triangles import Planes, equal_pieces, planes, squared_distance_to
from nvhchain.handoff import FloatArray, IntArray, Surface

_CANDIDATES = 16
"""Number of faces with the nearest centroids that are examined first; more if the nearest may be another one."""

_EQUAL = 1e-9
"""Relative difference below which squared distances are equal."""

_CHUNK = 100_000
"""Number of points whose candidates are held at once."""


def normal_motion(
    nodes: FloatArray, skin: IntArray, surface: Surface, silent: IntArray, samples_per_face: float
) -> sp.csr_matrix:
    """Return the operator (n_face, 3 n) from nodal displacements (m) to mean outward normal ones (m) of the faces.

    nodes : (n, 3) nodes (m).
    skin : (k, 6) outward facets.
    silent : (n_face,) bool, faces that stay at rest.
    samples_per_face : pieces per edge length of a typical radiating face.
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
        face = listening[_nearest(surface, listening, points.reshape(-1, 3))].reshape(points.shape[:2])
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
    return sp.csr_matrix(sp.diags(1 / surface.areas) @ share @ flux)


def _pieces(count: int) -> tuple[FloatArray, FloatArray]:
    """Return mean quadratic shape functions (p, 6) and centroids in area coordinates (p, 3) of count² equal pieces."""
    L = equal_pieces(count)
    # three mid-edge points integrate quadratics exactly
    middle = (L + np.roll(L, 1, axis=1)) / 2
    value = np.concatenate(
        [middle * (2 * middle - 1), 4 * middle * np.roll(middle, -1, axis=2)], axis=2
    )  # edges 01, 12, 20
    return value.mean(axis=1), L.mean(axis=1)


def _nearest(surface: Surface, faces: IntArray, points: FloatArray) -> IntArray:
    """Return the index into `faces` of the triangle nearest to each point (p, 3)."""
    centroids, corners = surface.centroids[faces], surface.vertices[surface.triangles[faces]]
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
