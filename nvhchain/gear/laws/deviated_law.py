"""Mesh law of gears whose flanks deviate from the drawing, over whole turns of both gears."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from nvhchain.errors import require
from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair
from nvhchain.gear.laws.deviated_pairs import DeviatedPairs, deviated_pairs, mesh_periods, pairs_as_drawn
from nvhchain.gear.laws.mesh_law import tabulated
from nvhchain.handoff import FloatArray, MeshLaw, ToothPairs
from nvhchain.kinds import checked

FINER = 3
"""Deflections of the law over those of the law as drawn: flanks that enter the load early or late bend it at more
places."""
_GRADING = 1.25
"""Exponent of the spacing of deflections, densest at first contact."""
_EXTENSIONS = 20
"""Largest number of extensions of the deflections, by a quarter each."""
_TOLERANCE = 1e-7
"""Change of the force of a pair, relative to the mesh force, at which the rounds over the pairs end."""


@checked
def deviated_mesh_law(pair: GearPair, law: MeshLaw, pairs: ToothPairs, deviations: PairDeviations) -> MeshLaw:
    """Return the mesh law of a pair with deviations, until the same flanks meet again.

    Returns law over the least common period of both gears.

    Every tooth pair carries by its own gap. Deviations that all teeth share enter in full: each pair is solved with
    them. The rest is a mean over the load pattern and a tilt. All pairs are coupled through the bodies. The sum F' of
    their forces then enters the law as drawn at the deflection at which pairs without deviations carry F'. Without
    deviations the law is that as drawn.
    """
    deviations.check(pair)
    later = mesh_periods(pair, deviations)
    sides = [deviated_pairs(pair, pairs, deviations, flank, later) for flank in (DRIVE, BACK)]
    deflection = _grid(pair, law, pairs, sides)
    force = sum(_carried(pair, law, pairs, side, deflection) for side in sides)
    turns = np.arange(len(later))[:, None] * law.period + law.angle
    rows = np.reshape(force, (-1, len(deflection)))
    made = tabulated(pair, turns.ravel(), deflection, rows, meshes=deviations.meshes(pair))
    return made if law.tilt_ratio is None else made.replace(tilt_ratio=law.tilt_ratio)


def _carried(
    pair: GearPair, law: MeshLaw, pairs: ToothPairs, side: DeviatedPairs, deflection: FloatArray
) -> FloatArray:
    """Return the forces of one flank (n_later, n_angle, n_defl) in N, > 0 on the drive flank and < 0 on the back."""
    flank, first = side.flank, pairs.first_contact[side.flank]
    even = np.append(pairs.approach + first.min(), 2.0 * pairs.approach[-1])
    (model,) = _summed(pairs, pairs_as_drawn(pairs, flank), even)
    drawn, drive = _drawn_forces(pair, law, flank, even), flank == DRIVE
    total = _summed(pairs, side, deflection if drive else -(deflection + pair.backlash)[::-1])
    for row in range(len(model)):
        total[:, row] = np.interp(total[:, row], model[row], drawn[row])
    return total if drive else -total[..., ::-1]


def _summed(pairs: ToothPairs, side: DeviatedPairs, approach: FloatArray) -> FloatArray:
    """Return the sums (n_later, n_angle, n_approach) of the forces of all pairs of one flank (N)."""
    from nvhchain.gear.laws._pair_forces import mesh_forces  # compiled, or read from its cache, when first needed

    total = np.zeros((len(side.start), len(pairs.angle), len(approach)))
    coupling, count = np.array(pairs.coupling[side.flank]), np.array(pairs.count[side.flank])
    force, start, tilt, approaches = (
        np.array(part, order="C") for part in (side.force, side.start, side.tilt, approach)
    )
    mesh_forces(force, coupling, count, float(pairs.approach[1]), start, tilt, approaches, _TOLERANCE, total)
    return total


def _drawn_forces(pair: GearPair, law: MeshLaw, flank: int, approach: FloatArray) -> FloatArray:
    """Return the forces (n_angle, n_approach) in N, > 0, that one flank as drawn carries; end slopes continue."""
    drive = flank == DRIVE
    deflection = approach if drive else -(approach + pair.backlash)
    inside = np.clip(deflection, law.deflection[0], law.deflection[-1])
    curve = PchipInterpolator(law.deflection, law.force, axis=1)
    force = curve(inside) + curve(inside, 1) * (deflection - inside)
    return np.maximum(force if drive else -force, 0.0)


def _grid(pair: GearPair, law: MeshLaw, pairs: ToothPairs, sides: list[DeviatedPairs]) -> FloatArray:
    """Return deflections (m) from back to drive flanks, `FINER` times those of the law as drawn.

    They reach from the first contact of any pair until all positions carry the largest forces of the law as drawn.
    """
    parts, nearest = [], []
    for side in sides:
        flank, there = side.flank, np.arange(side.start.shape[-1]) < pairs.count[side.flank][:, None]
        touch = np.where(there, side.start, np.inf).min(axis=-1)
        first, wanted = float(touch.min()), float((law.force[:, -1] if flank == DRIVE else -law.force[:, 0]).min())
        reach = law.deflection[-1] if flank == DRIVE else -law.deflection[0] - pair.backlash
        for _ in range(_EXTENSIONS):
            carried = float(_summed(pairs, side, np.array([first + reach])).min())
            if carried >= wanted:
                break
            reach *= 1.25
        columns = (law.deflection > 0).sum() if flank == DRIVE else (law.deflection < -pair.backlash).sum()
        steps = np.arange(FINER * columns + 1) / (FINER * columns)
        parts.append(first + reach * steps**_GRADING)
        nearest.append(touch)
    play = float((nearest[0] + nearest[1]).min()) + pair.backlash
    require(
        play > -1e-9,
        f"deviations close the backlash by {-1e6 * play:.1f} µm too much, the flanks jam: increase centre_distance or "
        "thickness_allowance, or take a finer class",
    )
    both = np.sort(np.concatenate([-pair.backlash - parts[1], parts[0]]))
    return both[np.append(True, np.diff(both) > 1e-9)]
