"""Reuse of refined teeth under another misalignment or with flanks of another micro-geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.gear.reference.contact_cells import TouchingTeeth, symmetric
from benchmarks.gear.reference.flanks import opened
from nvhchain.errors import require
from nvhchain.gear.drawing.pair import GearPair


def realigned(touching: TouchingTeeth, pair: GearPair, other: GearPair) -> TouchingTeeth:
    """Return refined teeth with the gaps of another misalignment or micro-geometry of the same gears.

    Parameters
    ----------
    touching : TouchingTeeth
        Refined teeth, computed for `pair`.
    pair : GearPair
        Pair of `touching`.
    other : GearPair
        Same gears and centre distance; misalignment and micro-geometry may differ.

    Returns
    -------
    TouchingTeeth
        Teeth with changed gaps.

    Raises
    ------
    InputError
        If the gears differ, or the teeth were refined over one half of the width.

    Notes
    -----
    Gaps change by the difference of both pairs at the middle of every cell.  This is exact for a difference that is
    linear over a cell. The cells stay those that could touch before, so `largest_gap` must have been large enough.
    `reference_mesh` refuses pressure at their limit.
    """
    same = all(replace(a, micro=b.micro) == b for a, b in zip(pair.geometries, other.geometries, strict=True))
    require(
        same and other.centre_distance == pair.centre_distance,
        "gears or centre distance are not those that the teeth were refined for: refine them again",
    )
    require(
        not symmetric(pair),
        "the teeth were refined over one half of the width, as their pair is symmetric: refine them for a tilted pair",
    )
    cells = touching.cells
    travel = float(pair.base_radius[1]) * touching.angle - np.array(touching.pairs)[touching.pair] * pair.base_pitch
    crossing = pair.pitch_point + travel + np.tan(pair.base_helix_angle) * pair.sense * cells.axial
    at = (crossing, cells.transverse, cells.axial)
    gap = cells.gap + opened(other, *at) - opened(pair, *at)
    return replace(touching, cells=replace(cells, gap=gap))
