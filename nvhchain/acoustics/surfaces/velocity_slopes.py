"""Variation of a velocity within faces, reconstructed from adjacent faces."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array

from nvhchain.acoustics.surfaces.surface import SHARP_ANGLE, edge_table
from nvhchain.handoff import FloatArray, Surface

_LARGEST_SLOPE = 0.2
"""Largest contribution of the slopes of one face to any motion; it is 0.08 for equal triangles. Adjacent needles would
contribute many times their differences."""

_SPREAD_RATIO = 1e-6
"""Ratio of the spread of adjacent faces across a line to that along it, below which they define no slope across it."""


@lru_cache(maxsize=8)
def velocity_within_faces(surface: Surface) -> csr_array:
    """Return the factor (n_face, n_face) from piecewise constant velocities to those that a wave transmits.

    A velocity v that is constant on a face loses M : ∇p ∇v of its product with a pressure p. M holds the second moments
    of the face about its centroid. The factor restores this part: v + S⁻¹ Gᵀ S M G v. S holds the areas, G the slopes
    along the walls. The slopes are fitted to adjacent faces that no edge of the body separates (`SHARP_ANGLE`).

    The factor preserves the volume velocity and any motion that is constant on a wall. It is symmetric under S, so that
    reciprocity holds, and it reduces no motion. Motion that is rough from face to face, and no wave that the mesh
    carries, grows by up to nine tenths (docs/decisions/0013).
    """
    corners = surface.vertices[surface.triangles] - surface.centroids[:, None]
    principal, axes = np.linalg.eigh(np.einsum("fki,fkj->fij", corners, corners) / 12.0)
    major_axis, most = axes[:, :, 2], principal[:, 2]
    axes = np.stack([major_axis, np.cross(surface.normals, major_axis)], axis=2)
    moments = np.stack([most, surface.areas**2 / (108.0 * most)], axis=1)  # their product is that of every triangle
    slopes = _slopes(surface, axes, np.sqrt(moments))
    part = np.max([surface.areas * (slope.power(2) @ (1.0 / surface.areas)) for slope in slopes], axis=0)
    share = surface.areas * _LARGEST_SLOPE / np.maximum(part, _LARGEST_SLOPE)
    lost = sum(slope.T @ diags_array(share) @ slope for slope in slopes)
    return csr_array(eye_array(len(surface.triangles)) + diags_array(1.0 / surface.areas) @ lost)


def _slopes(surface: Surface, axes: FloatArray, lengths: FloatArray) -> list[csr_array]:
    """Return the difference (n_face, n_face) of a velocity over `lengths` (n_face, 2) m for both axes (n_face, 3, 2).

    The differences are fitted to the faces adjacent to each one.
    """
    faces = len(surface.triangles)
    _, sides, angle = edge_table(surface)
    flat = sides[angle < SHARP_ANGLE]
    own, neighbour = np.concatenate([flat, flat[:, ::-1]]).T
    offset = np.einsum("ni,nik->nk", surface.centroids[neighbour] - surface.centroids[own], axes[own]) / lengths[own]
    spread = np.zeros((faces, 2, 2))
    np.add.at(spread, own, offset[:, :, None] * offset[:, None, :])
    fit = np.linalg.pinv(spread, rcond=_SPREAD_RATIO, hermitian=True)
    weights = np.einsum("nik,nk->ni", fit[own], offset)
    rows, columns = np.concatenate([own, own]), np.concatenate([neighbour, own])
    return [csr_array((np.concatenate([w, -w]), (rows, columns)), shape=(faces, faces)) for w in weights.T]
