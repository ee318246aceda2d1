"""What a velocity does within faces, told from those beside them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array

from nvhchain.acoustics.surfaces.surface import SHARP_ANGLE, edges_between
from nvhchain.handoff import FloatArray, Surface

_MOST = 0.2
"""Largest part of any motion that the slopes of one face may give: 0.08 of equal triangles.  Those of needles beside
each other would give many times their differences."""

_ONE_WAY = 1e-6
"""Spread of the faces beside one across a line, over that along it, below which they tell no slope across it."""


@lru_cache(maxsize=8)
def within_faces(surface: Surface) -> csr_array:
    """Factor (n_face, n_face) from velocities that are constant on every face to those that a wave passes on.

    A velocity v that is constant on a face loses M : ∇p ∇v of its product with a pressure p, with M the second moments
    of the face about its centroid.  It is given back: v + S⁻¹ Gᵀ S M G v, with S the areas and G the slopes along the
    walls, fitted to the faces beside that no edge of the body parts (`SHARP_ANGLE`).  Keeps the volume velocity and
    all that is constant on a wall; symmetric under S, so that reciprocity holds; takes from no motion.  What is rough
    from face to face, and no wave that the mesh carries, grows by up to nine tenths (docs/decisions/0013).
    """
    corners = surface.vertices[surface.triangles] - surface.centroids[:, None]
    principal, axes = np.linalg.eigh(np.einsum("fki,fkj->fij", corners, corners) / 12.0)
    along, most = axes[:, :, 2], principal[:, 2]
    axes = np.stack([along, np.cross(surface.normals, along)], axis=2)
    moments = np.stack([most, surface.areas**2 / (108.0 * most)], axis=1)  # whose product is that of every triangle
    slopes = _slopes(surface, axes, np.sqrt(moments))
    part = np.max([surface.areas * (slope.power(2) @ (1.0 / surface.areas)) for slope in slopes], axis=0)
    share = surface.areas * _MOST / np.maximum(part, _MOST)
    lost = sum(slope.T @ diags_array(share) @ slope for slope in slopes)
    return csr_array(eye_array(len(surface.triangles)) + diags_array(1.0 / surface.areas) @ lost)


def _slopes(surface: Surface, axes: FloatArray, lengths: FloatArray) -> list[csr_array]:
    """Of both axes (n_face, 3, 2) the difference (n_face, n_face) of a velocity over their `lengths` (n_face, 2) m,
    fitted to the faces beside every one."""
    faces = len(surface.triangles)
    _, sides, angle = edges_between(surface)
    flat = sides[angle < SHARP_ANGLE]
    at, by = np.concatenate([flat, flat[:, ::-1]]).T
    offset = np.einsum("ni,nik->nk", surface.centroids[by] - surface.centroids[at], axes[at]) / lengths[at]
    spread = np.zeros((faces, 2, 2))
    np.add.at(spread, at, offset[:, :, None] * offset[:, None, :])
    fit = np.linalg.pinv(spread, rcond=_ONE_WAY, hermitian=True)
    weights = np.einsum("nik,nk->ni", fit[at], offset)
    rows, columns = np.concatenate([at, at]), np.concatenate([by, at])
    return [csr_array((np.concatenate([w, -w]), (rows, columns)), shape=(faces, faces)) for w in weights.T]
