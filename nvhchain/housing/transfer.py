"""Motion of the finite element skin as normal velocity of the radiating faces, preserving the volume velocity.

Every skin facet is cut into small pieces; the flux u·n dA of each piece goes to the radiating face that is nearest, and
a face's normal motion is the flux it received over its area. The flux of the whole skin arrives to rounding.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.fem.triangles import equal_pieces, squared_distance
from nvhchain.handoff import FloatArray, IntArray, Surface

_CANDIDATES = 16
"""Faces with the nearest centroids that are looked at first; more wherever the nearest may be another."""


def normal_motion(
    nodes: FloatArray, skin: IntArray, surface: Surface, silent: IntArray, samples_per_face: float
) -> sp.csr_matrix:
    """Operator (n_face, 3 n) from nodal displacements (m) to the mean outward normal displacement (m) of the faces.

    nodes: (n, 3) m.  skin: (k, 6) outward facets.  silent: (n_face,) bool, faces that stay at rest.
    samples_per_face: pieces per edge length of a typical radiating face.
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
        # straight facets: one normal and equal pieces
        area = np.cross(corners[chosen, 1] - corners[chosen, 0], corners[chosen, 2] - corners[chosen, 0]) / 2
        face = listening[_nearest(surface, listening, points.reshape(-1, 3))].reshape(points.shape[:2])
        weight = np.einsum("pi,ka->kpia", shape / len(place), area)
        rows.append(np.broadcast_to(face[:, :, None, None], weight.shape).ravel())
        dofs = 3 * skin[chosen][:, None, :, None] + np.arange(3)
        columns.append(np.broadcast_to(dofs, weight.shape).ravel())
        values.append(weight.ravel())
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    flux = sp.coo_matrix(entries, shape=(len(surface.areas), nodes.size)).tocsr()
    return sp.csr_matrix(sp.diags(1 / surface.areas) @ flux)


def _pieces(count: int) -> tuple[FloatArray, FloatArray]:
    """Mean quadratic shape functions (p, 6) and centroids in area coordinates (p, 3) of count² equal pieces."""
    L = equal_pieces(count)
    # three mid-edge points integrate quadratics exactly
    middle = (L + np.roll(L, 1, axis=1)) / 2
    value = np.concatenate(
        [middle * (2 * middle - 1), 4 * middle * np.roll(middle, -1, axis=2)], axis=2
    )  # edges 01, 12, 20
    return value.mean(axis=1), L.mean(axis=1)


def _nearest(surface: Surface, faces: IntArray, points: FloatArray) -> IntArray:
    """Index into `faces` of the triangle nearest to each point (p, 3)."""
    centroids, corners = surface.centroids[faces], surface.vertices[surface.triangles[faces]]
    reach = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    tree, count = cKDTree(centroids), _CANDIDATES
    result, unsure = np.empty(len(points), dtype=np.int64), np.arange(len(points))
    while len(unsure):
        part, count = points[unsure], min(count, len(faces))
        apart, candidates = (found.reshape(len(part), count) for found in tree.query(part, k=count))
        first = np.sqrt(squared_distance(part, corners[candidates[:, 0]]))
        row, column = np.nonzero(apart - reach[candidates] <= first[:, None])
        distance = np.full(apart.shape, np.inf)
        distance[row, column] = squared_distance(part[row], corners[candidates[row, column]])
        best = distance.argmin(axis=1)[:, None]
        result[unsure] = np.take_along_axis(candidates, best, axis=1)[:, 0]
        nearest = np.sqrt(np.take_along_axis(distance, best, axis=1)[:, 0])
        # a face not looked at is no nearer than its centroid less its reach
        unsure = unsure[(apart[:, -1] - reach.max() < nearest) & (count < len(faces))]
        count *= 2
    return result
