"""Modal assurance criterion (MAC): agreement of two sets of mode shapes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.handoff import FloatArray, ReducedHousing

LEAST_ASSURANCE = 0.8
"""Least MAC of paired modes, of their outer surfaces and of their bearing seats."""

LARGEST_SHIFT = 1.25
"""Largest ratio of the natural frequencies of paired modes."""


def paired_modes(first: ReducedHousing, second: ReducedHousing) -> list[tuple[int, int]]:
    """Return pairs of natural modes (number in the first, number in the second) that are one mode of two housings.

    Each is the other's best match: their MAC at the seats and on the outer surface is at least `LEAST_ASSURANCE`, and
    their frequencies are near. Seats are compared by bearing, without tilts. Housings of other bearings have no pairs.
    """
    if set(first.names) != set(second.names):
        return []
    counts = first.mode_count, second.mode_count
    rows = [second.names.index(name) for name in first.names]
    ours = first.seat_shapes[: counts[0], :, :3].reshape(counts[0], -1)
    theirs = second.seat_shapes[: counts[1], rows, :3].reshape(counts[1], -1)
    norms = np.outer((ours**2).sum(axis=1), (theirs**2).sum(axis=1))
    seats = (ours @ theirs.T) ** 2 / np.where(norms > 0, norms, 1.0)
    agreement = np.minimum(seats, modal_assurance(first, second)[: counts[0], : counts[1]])
    ratio = np.divide.outer(first.natural_frequency[: counts[0]], second.natural_frequency[: counts[1]])
    agreement[(ratio > LARGEST_SHIFT) | (ratio < 1.0 / LARGEST_SHIFT)] = 0.0
    if not agreement.size:
        return []
    best = agreement.argmax(axis=1).tolist()
    return [
        (row, column)
        for row, column in enumerate(best)
        if agreement[row, column] >= LEAST_ASSURANCE and int(agreement[:, column].argmax()) == row
    ]


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
