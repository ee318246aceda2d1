"""Modal assurance criterion (MAC): agreement of two sets of mode shapes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import FloatArray, ReducedHousing


def modal_assurance(one: ReducedHousing, other: ReducedHousing) -> FloatArray:
    """Return the MAC |φᵀWψ|² / (φᵀWφ · ψᵀWψ), (n_mode_one, n_mode_other), of the area-weighted (W) normal shapes.

    Only the outer surface counts, without its mass. Modes that differ inside or along the surface may agree here. On
    another radiating surface ψ is read at the face with the nearest centroid (Allemang & Brown, IMAC 1982).
    """
    weight = one.surface.areas
    shapes = other.normal_shapes
    if one.surface.content_hash != other.surface.content_hash:
        shapes = shapes[:, cKDTree(other.surface.centroids).query(one.surface.centroids)[1]]
    cross = (one.normal_shapes * weight) @ shapes.T
    norms = np.outer((one.normal_shapes**2) @ weight, (shapes**2) @ weight)
    return np.asarray(cross**2 / np.where(norms > 0, norms, 1.0))
