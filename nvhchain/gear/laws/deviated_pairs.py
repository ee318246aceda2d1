"""Tooth pairs in contact with the deviations of their own flanks, as coupled springs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np

from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.drawing.pair import BACK, GearPair
from nvhchain.gear.laws.tooth_pairs import solved_alone
from nvhchain.handoff import FloatArray, IntArray, ToothPairs

TILTS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Even tilts over the steepest one at which pairs are solved; their forces are interpolated."""
_EVEN = 1e-9
"""Largest variation of a shape over the face (m) that counts as even."""
_MOST = 20_000_000
"""Largest number of gaps of slices held at once (0.2 GB); more are computed twice, in parts."""


@dataclass(frozen=True, eq=False)
class DeviatedPairs:
    """Pairs of one flank with deviations.

    flank : DRIVE or BACK.
    start : (n_later, n_angle, n_pair) approaches at which the forces begin (m).
    tilt : (n_later, n_angle, n_pair) tilts of the pairs within ±1.
    force : (1 or n_tilt, n_angle, n_pair, n_approach) forces of the pairs alone (N), without tilt or at all `TILTS`.
    weight : (1 or n_tilt, n_angle, n_pair, n_slice) shares of the slices in the force of their pair, at the same tilts.
    """

    flank: int
    start: FloatArray
    tilt: FloatArray
    force: FloatArray
    weight: FloatArray


def deviated_pairs(
    pair: GearPair, pairs: ToothPairs, deviations: PairDeviations, flank: int, later: IntArray
) -> DeviatedPairs:
    """Return the pairs of one flank: the shape that all teeth share in full, the rest as mean and tilt of each pair.

    later: mesh periods.

    Shape and tilt bend the force of a pair where they open a part of the face. The force falls with the tilt's square
    at first, and in proportion to it once a part is open.
    """
    there = pairs.length[flank] > 0
    parts = np.array_split(later, ceil(len(later) * there.size / _MOST))
    # all gaps at once where they fit
    kept = slice_gaps(pair, pairs, deviations, flank, later) if len(parts) == 1 else None

    def gaps() -> Iterator[FloatArray]:
        for part in parts:
            yield slice_gaps(pair, pairs, deviations, flank, part) if kept is None else kept

    shape = np.asarray(sum(part.sum(axis=0) for part in gaps()) / len(later))
    first, force, weight = pairs.first_contact[flank], pairs.force[flank], pairs.weight[flank]
    mean = (shape * weight).sum(axis=-1)
    if np.abs(np.where(there, shape - mean[..., None], 0.0)).max(initial=0.0) > _EVEN:
        (first,), (force,), (weight,) = solved_alone(pair, pairs, flank, (pairs.gap[flank] + shape)[None])
    else:
        shape = np.where(there, mean[..., None], 0.0)
        first = first + mean
    lever = np.where(there, pairs.axial[flank] - (weight * pairs.axial[flank]).sum(axis=-1, keepdims=True), 0.0)
    lever = lever / np.maximum(np.abs(lever).max(axis=-1, keepdims=True), 1e-12)
    bent = (weight * lever**2).sum(axis=-1)
    slope = weight * lever / np.where(bent > 0, bent, 1.0)[..., None]
    own, tilt = (
        np.concatenate([np.einsum("mapi,api->map", part - shape, pattern) for part in gaps()])
        for pattern in (weight, slope)
    )
    steepest = float(np.abs(tilt).max(initial=0.0))
    if steepest <= _EVEN:
        return DeviatedPairs(flank, first + own, np.zeros_like(tilt), force[None], weight[None])
    tilted = pairs.gap[flank] + shape + steepest * np.multiply.outer(TILTS, lever)
    begin = np.where(there, tilted, np.inf).min(axis=(0, -1))
    begin = np.where(there.any(axis=-1), begin, 0.0)
    _, force, weight = solved_alone(pair, pairs, flank, tilted, begin)
    return DeviatedPairs(flank, begin + own, tilt / steepest, force, weight)


def slice_gaps(
    pair: GearPair, pairs: ToothPairs, deviations: PairDeviations, flank: int, later: IntArray
) -> FloatArray:
    """Return the gap that deviations open at every slice.

    later (n_later,) int array: mesh periods.
    Returns (n_later, n_angle, n_pair, n_slice): gap (m), 0 for absent slices.
    """
    there = pairs.length[flank] > 0
    shape = there.shape
    order = np.broadcast_to(pairs.order[flank][..., None], shape)[there]
    tooth_shift = np.array([[0], [1 if flank == BACK else 0]])
    gap = np.zeros((len(later), *shape))
    gap[:, there] = deviations.removed(
        pair,
        flank,
        order + tooth_shift,
        pairs.radius[:, flank][:, there],
        pairs.axial[flank][there],
        np.broadcast_to(pairs.angle[:, None, None], shape)[there],
        later,
    )
    return gap


def pairs_as_drawn(pairs: ToothPairs, flank: int) -> DeviatedPairs:
    """Return the pairs of one flank without deviations."""
    first = pairs.first_contact[flank][None]
    return DeviatedPairs(flank, first, np.zeros_like(first), pairs.force[flank][None], pairs.weight[flank][None])


def mesh_periods(pair: GearPair, deviations: PairDeviations) -> IntArray:
    """Return the mesh periods (n_later,) at which the body periods begin, until the same flanks meet again."""
    own = pair.meshes_per_body_period
    return np.arange(deviations.meshes(pair) // own) * own
