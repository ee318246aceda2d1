"""Modal assurance criterion (MAC): agreement of two sets of mode shapes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import FloatArray, ReducedHousing


def modal_assurance(first: ReducedHousing, second: ReducedHousing) -> FloatArray:
    """Return the MAC |φᵀWψ|² / (φᵀWφ · ψᵀWψ), (n_mode_one, n_mode_other), of the area-weighted (W) normal shapes.

    Only the outer surface counts, without its mass. Modes that differ inside or along the surface may agree here. On
    another radiating surface ψ is read at the face with the nearest centroid (Allemang & Brown, IMAC 1982).
    """
    weight = first.surface.areas
    shapes = second.normal_shapes
    if first.surface.content_hash != second.surface.content_hash:
        shapes = shapes[:, cKDTree(second.surface.centroids).query(first.surface.centroids)[1]]
    cross = (first.normal_shapes * weight) @ shapes.T
    norms = np.outer((first.normal_shapes**2) @ weight, (shapes**2) @ weight)
    return np.asarray(cross**2 / np.where(norms > 0, norms, 1.0))
