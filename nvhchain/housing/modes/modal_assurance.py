"""Modal assurance criterion: how far two sets of mode shapes point the same way."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import FloatArray, ReducedHousing


def modal_assurance(one: ReducedHousing, other: ReducedHousing) -> FloatArray:
    """MAC (n_mode_one, n_mode_other), |φᵀWψ|² / (φᵀWφ · ψᵀWψ), 0 … 1, of the normal shapes, weighted by area (W).

    Only the outer surface counts, without its mass: modes that differ inside or along the surface may look alike here.
    On another radiating surface ψ is read at the face whose centroid is nearest (Allemang & Brown, IMAC 1982).
    """
    weight = one.surface.areas
    shapes = other.normal_shapes
    if one.surface.content_hash != other.surface.content_hash:
        shapes = shapes[:, cKDTree(other.surface.centroids).query(one.surface.centroids)[1]]
    cross = (one.normal_shapes * weight) @ shapes.T
    norms = np.outer((one.normal_shapes**2) @ weight, (shapes**2) @ weight)
    return np.asarray(cross**2 / np.where(norms > 0, norms, 1.0))
