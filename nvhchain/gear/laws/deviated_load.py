"""Load distribution of gears whose flanks deviate from the drawing, over whole turns of both gears."""

from __future__ import annotations

import numpy as np

from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.drawing.pair import DRIVE, GearPair
from nvhchain.gear.laws.deviated_pairs import DeviatedPairs, deviated_pairs, mesh_periods, pairs_as_drawn
from nvhchain.gear.laws.load_distribution import mean_sliding
from nvhchain.handoff import FloatArray, LoadDistribution, ToothPairs
from nvhchain.kinds import checked

_TOLERANCE = 1e-5
"""Error of the sum of the forces, relative to the load."""


@checked
def deviated_load_distribution(
    pair: GearPair,
    drawn: LoadDistribution,
    pairs: ToothPairs,
    deviations: PairDeviations,
    *,
    shared: LoadDistribution | None = None,
) -> LoadDistribution:
    """Return the load distribution of a pair with deviations, until the same flanks meet again.

    drawn: that of the pair without them.
    shared: that with the deviations that all teeth share, by the contact problem; by default that of the pair as drawn
    stands for it, and springs make the whole of the change.
    Returns distribution over the least common period of both gears; its resistance to tilt is that as drawn.

    All pairs together carry the nominal load: a pair whose flanks lie ahead carries more, and a tilted pair carries at
    one end of its face. What deviations beyond the shared ones change of sliding, arm and centre of the load is added
    to those with these. Without deviations the distribution is that as drawn.
    """
    deviations.check(pair)
    later, begin, base = mesh_periods(pair, deviations), pairs_as_drawn(pairs, DRIVE), drawn
    common = deviations.shared() if shared is not None else None
    if shared is not None and common is not None:
        begin, base = deviated_pairs(pair, pairs, common, DRIVE, later[:1]), shared
    made = _means(pair, pairs, deviated_pairs(pair, pairs, deviations, DRIVE, later), drawn.force)
    changed = made - _means(pair, pairs, begin, drawn.force)
    turns = np.arange(len(later))[:, None] * drawn.period + drawn.angle
    sliding, arm, offset = (
        (values + change).ravel() for values, change in zip((base.sliding, base.arm, base.offset), changed, strict=True)
    )
    half = 0.5 * pair.face_width
    return drawn.replace(
        angle=turns.ravel(),
        period=len(later) * drawn.period,
        sliding=np.clip(sliding, -1.0, 1.0),
        arm=arm,
        offset=np.clip(offset, -half, half),
    )


def _means(pair: GearPair, pairs: ToothPairs, made: DeviatedPairs, load: float) -> FloatArray:
    """Return sliding (1), arm (m) and centre (m) of the load (3, n_later, n_angle) under a nominal load (N)."""
    share = pair_forces(pairs, made, load) / load
    position = np.sqrt(np.maximum(pairs.radius[0, DRIVE] ** 2 - pair.base_radius[0] ** 2, 0.0))
    places = (*mean_sliding(pair, position, pairs.length[DRIVE]), pairs.axial[DRIVE])
    return np.array([(share * tilted(made, (made.weight * place).sum(axis=-1))).sum(axis=-1) for place in places])


def tilted(made: DeviatedPairs, table: FloatArray) -> FloatArray:
    """Return the value (n_later, n_angle, n_pair) of every pair at its tilt, linear in a table at all `TILTS`.

    table: (1 or n_tilt, n_angle, n_pair)
    """
    if len(table) == 1:
        return np.broadcast_to(table, made.tilt.shape)
    place = 0.5 * (made.tilt + 1.0) * (len(table) - 1)
    first = np.clip(place.astype(int), 0, len(table) - 2)
    angle, number = np.indices(made.tilt.shape[1:])
    low, high = table[first, angle, number], table[first + 1, angle, number]
    return np.asarray(low + (place - first) * (high - low))


def pair_forces(pairs: ToothPairs, made: DeviatedPairs, load: float) -> FloatArray:
    """Return the forces (n_later, n_angle, n_pair) in N of all pairs, which together carry the load (N)."""
    from nvhchain.gear.laws._pair_forces import shared_load  # compiled, or read from its cache, when first needed

    carried = np.zeros(made.start.shape)
    coupling, count = np.array(pairs.coupling[made.flank]), np.array(pairs.count[made.flank])
    force, start, tilt = (np.array(part, order="C") for part in (made.force, made.start, made.tilt))
    shared_load(force, coupling, count, float(pairs.approach[1]), start, tilt, load, _TOLERANCE, carried)
    return carried
