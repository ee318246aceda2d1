"""Contact of a tooth's tip edge with the mating flank beyond the ends of the path of contact.

Loaded teeth meet too early and part too late.  Before the path begins, the wheel's tip edge touches the pinion's flank
off the line of action.  After its end the pinion's edge touches the wheel's flank.

Involutes of one base circle lie a constant distance apart, the arc between them on that circle.  The gap between an
edge and a flank is therefore the arc from the flank to the involute through the edge.  It is exact for any position.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np
from scipy.optimize import brentq

from nvhchain.handoff import FloatArray


def edge_gap(
    excess: FloatArray, own_base: float, mating_base: float, edge: float, line_length: float, centre_distance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the gap between an edge and the mating flank, and the place and angle at which they will meet.

    excess : (n,) distance on the line of action from the end of the path, which the edge has passed or not reached
        (m).
    own_base, mating_base : base radii of the gear with the edge and of the other (m).
    edge : tip radius of the gear with the edge (m).
    line_length : distance of the base tangent points (m).

    gap : (n,) arc on the mating base circle by which the edge misses the flank (m).
    radius : (n,) radius on the mating gear at which they will meet (m).
    angle : (n,) angle between the flanks there (rad).
    """
    # own centre at the origin, the other on the x axis; angle of the edge from the line of centres
    pressure, end = np.arccos((own_base + mating_base) / centre_distance), sqrt(edge**2 - own_base**2)
    turned = np.arctan2(end, own_base) - pressure + np.asarray(excess, float) / own_base
    across, along = centre_distance - edge * np.cos(turned), edge * np.sin(turned)
    radius = np.hypot(across, along)
    rolled = np.sqrt(np.maximum(radius**2 - mating_base**2, 0.0))
    # mating involute through the edge: its crossing of the line of action, from that gear's tangent point
    crossing = rolled + mating_base * (pressure - np.arctan2(along, across) - np.arctan2(rolled, mating_base))
    # the normal of an involute turns from the line of action by rolled length over base radius
    angle = np.asarray(excess, float) / own_base + (rolled - crossing) / mating_base
    return crossing - (line_length - end - np.asarray(excess, float)), radius, angle


@lru_cache
def extension(gap: float, own_base: float, mating_base: float, edge: float, line: float, distance: float) -> float:
    """Return the length (m) beyond the end of the path at which the unloaded edge misses the flank by `gap` (m).

    The gap is an arc on the mating base circle, as in `edge_gap`.
    """
    if gap == 0:
        return 0.0

    def missing(excess: float) -> float:
        return float(edge_gap(np.array(excess), own_base, mating_base, edge, line, distance)[0]) - gap

    # bounded by the remaining rolled length on the mating gear
    left = line - sqrt(edge**2 - own_base**2)
    return float(brentq(missing, 0.0, 0.9 * left)) if missing(0.9 * left) > 0 else 0.9 * left
