"""Contact of a tooth's tip edge with the mating flank beyond the ends of the path of contact.

Loaded teeth meet too early and part too late: before the path begins the wheel's tip edge touches the pinion's flank
off the line of action, after its end the pinion's the wheel's. Involutes of one base circle lie a constant distance
apart, the arc between them on that circle: the gap between an edge and a flank is the arc from the flank to the
involute through the edge, exact for any position.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np
from scipy.optimize import brentq

from nvhchain.handoff import FloatArray


def edge_gap(
    beyond: FloatArray, own_base: float, mating_base: float, edge: float, line_length: float, centre_distance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(gap, radius, angle): arc on the mating base circle by which the edge still misses the flank, and where and at
    what angle, rad, between the flanks it will meet it.

    beyond: (n,) m on the line of action from the end of the path, which the edge has gone past or not reached.
    own_base, mating_base: m, base radii of the gear with the edge and of the other.  edge: m, its tip radius.
    line_length: m, distance of the base tangent points.
    """
    # own centre at the origin, the other on the x axis; the angle of the edge from the line of centres
    pressure, end = np.arccos((own_base + mating_base) / centre_distance), sqrt(edge**2 - own_base**2)
    turned = np.arctan2(end, own_base) - pressure + np.asarray(beyond, float) / own_base
    across, along = centre_distance - edge * np.cos(turned), edge * np.sin(turned)
    radius = np.hypot(across, along)
    rolled = np.sqrt(np.maximum(radius**2 - mating_base**2, 0.0))
    # involute of the mating gear through the edge: where it crosses the line of action, from that tangent point
    crossing = rolled + mating_base * (pressure - np.arctan2(along, across) - np.arctan2(rolled, mating_base))
    # the normal of an involute turns by rolled length over base radius from the line of action
    angle = np.asarray(beyond, float) / own_base + (rolled - crossing) / mating_base
    return crossing - (line_length - end - np.asarray(beyond, float)), radius, angle


@lru_cache
def extension(gap: float, own_base: float, mating_base: float, edge: float, line: float, distance: float) -> float:
    """Length, m, beyond the end of the path at which the unloaded edge misses the flank by the arc `gap`, m."""
    if gap == 0:
        return 0.0

    def missing(beyond: float) -> float:
        return float(edge_gap(np.array(beyond), own_base, mating_base, edge, line, distance)[0]) - gap

    # the rolled length that is left on the mating gear bounds it
    left = line - sqrt(edge**2 - own_base**2)
    return float(brentq(missing, 0.0, 0.9 * left)) if missing(0.9 * left) > 0 else 0.9 * left
