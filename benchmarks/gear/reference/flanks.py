"""Two involute flanks along the line of action of one transverse section: their positions and the gap between them.

Axes of a section: s along the line of action from the pinion's base tangent point to the wheel's, and t across it, away
from the pinion's centre.  The pinion's tooth points to +t, the wheel's to −t.

A flank that crosses the line at s has at rolled length ρ the point (r_b sin α + ρ cos α, r_b cos α − r_b − ρ sin α),
with α = (s − ρ)/r_b.  Turned by 180° about the middle between the tangent points, the same holds for the wheel's flank.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.handoff import FloatArray

_NEWTON = 12
"""Newton steps for the rolled length of a point; three suffice."""

_LEFT = 0.9
"""Part of the involute between the contact and its end that keeps its rows."""


@dataclass(frozen=True, eq=False)
class Section:
    """One pair of teeth in one transverse section.

    Parameters
    ----------
    crossing : float
        s where the pinion's flank crosses the line of action (m), clipped to the limits.
    separation : float
        Distance of the true crossing from the limits (m); 0 where the teeth can touch.
    low, high : float
        t of the wheel's and of the pinion's tip (m); rows of elements lie between them.
    ends : tuple of 2 float
        t where the involutes of pinion and wheel begin (m).
    """

    crossing: float
    separation: float
    low: float
    high: float
    ends: tuple[float, float]

    @property
    def nearest(self) -> float:
        """Position t of the least gap (m): 0, or the tip edge where the path has ended."""
        return min(max(0.0, self.low), self.high)


def section(pair: GearPair, angle: float, tooth: int, axial: float, limits: tuple[float, float]) -> Section:
    """Return tooth pair `tooth` at wheel `angle` (rad) and `axial` (m).

    limits: m, range of s to which the crossing is clipped.
    """
    true = pair.pitch_point + pair.base_radius[1] * angle - tooth * pair.base_pitch
    true += axial * np.tan(pair.base_helix_angle) * pair.sense
    crossing = min(max(true, limits[0]), limits[1])
    usable = [body.geometry.usable_flank for body in (pair.pinion, pair.wheel)]
    (start, high), (end, low) = (
        [float(transverse_position(pair, gear, crossing, r)) for r in usable[gear]] for gear in (0, 1)
    )
    require(
        low < high,
        f"tooth pair {tooth} is out of reach at s = {1e3 * crossing:.4g} mm: narrow the limits",
    )
    return Section(crossing, abs(true - crossing), low, high, (start, end))


def move_onto_flank(s: Section, gear: int, t: FloatArray, reach: float) -> FloatArray:
    """Return the ends of rows `t` (n,) in m, moved onto the flank of `gear`.

    Where the mating tip stands beside the fillet, rows are squeezed into the remaining involute. These are the rows
    farther from the contact than `reach` (m), or than most of the remaining involute.
    """
    sign = 1.0 if gear == 0 else -1.0  # sign of t towards the tip
    rows, end = sign * t, sign * s.ends[gear]
    lowest = rows.min()
    if lowest >= end:
        return t
    kept = sign * s.nearest - min(reach, _LEFT * (sign * s.nearest - end))
    squeezed = end + (rows - lowest) * (kept - end) / (kept - lowest)
    return np.asarray(sign * np.where(rows < kept, squeezed, rows))


def _crossing_length(pair: GearPair, gear: int, crossing: FloatArray | float) -> FloatArray | float:
    """Return the rolled length at which the flank of `gear` crosses the line of action (m)."""
    return crossing if gear == 0 else pair.line_length - crossing


def transverse_position(pair: GearPair, gear: int, crossing: float, rolled: FloatArray | float) -> FloatArray:
    """Return t (m) of the points of the flank of `gear` (0 pinion, 1 wheel) at rolled lengths (m)."""
    base, rho = float(pair.base_radius[gear]), np.asarray(rolled, float)
    alpha = (_crossing_length(pair, gear, crossing) - rho) / base
    t = base * (np.cos(alpha) - 1) - rho * np.sin(alpha)
    return np.asarray(t if gear == 0 else -t)


def rolled_length(pair: GearPair, gear: int, crossing: FloatArray | float, t: FloatArray) -> FloatArray:
    """Return the rolled lengths (m) of the points of the flank of `gear` at `t` (m)."""
    base, own = float(pair.base_radius[gear]), _crossing_length(pair, gear, crossing)
    wanted = np.asarray(t if gear == 0 else -np.asarray(t), float)
    rho = np.sqrt(np.maximum(own**2 + 2 * base * wanted, 1e-4 * own**2))
    for _ in range(_NEWTON):
        alpha = (own - rho) / base
        found = base * (np.cos(alpha) - 1) - rho * np.sin(alpha)
        rho = rho - (found - wanted) * base / (rho * np.cos(alpha))
    return np.asarray(rho)


def gap(pair: GearPair, crossing: float, t: FloatArray) -> FloatArray:
    """Return the distance (m) of the two pure involutes along the line of action at `t` (m)."""
    along = []
    for gear in (0, 1):
        rho, base, own = (
            rolled_length(pair, gear, crossing, t),
            float(pair.base_radius[gear]),
            _crossing_length(pair, gear, crossing),
        )
        alpha = (own - rho) / base
        along.append(base * np.sin(alpha) + rho * np.cos(alpha))
    return np.asarray(pair.line_length - along[1] - along[0])


def opened(pair: GearPair, crossing: FloatArray | float, t: FloatArray, axial: FloatArray) -> FloatArray:
    """Return the contribution (m) of micro-geometry and misalignment to the normal gap at `t` and `axial` (n,), m."""
    total = pair.misalignment.separation(
        np.broadcast_to(np.asarray(crossing) - pair.pitch_point, t.shape),
        axial,
        drive=True,
        sense=pair.sense,
        pressure_angle=pair.working_pressure_angle,
        tilt=pair.base_helix_angle,
    )
    for gear, geometry in enumerate(pair.geometries):
        radius = np.hypot(pair.base_radius[gear], rolled_length(pair, gear, crossing, t))
        total = total + geometry.removed(radius, axial, drive=True)
    return total
