"""Coulomb friction on the flanks: its direction and its effect on the torque.

With parallel axes the flanks slide in the transverse plane, across the line of action.  At s from the pinion's base
tangent point the pinion's flank moves with ω_P s and the wheel's with ω_G (L − s). L is the distance of the tangent
points.  The friction force μ F reverses with the sliding velocity at the pitch point.
"""

from __future__ import annotations

from math import cos

import numpy as np

from nvhchain.errors import require_within
from nvhchain.gear.contact.contact_lines import ContactLines
from nvhchain.gear.drawing.pair import DRIVE, GearPair
from nvhchain.handoff import FloatArray

LARGEST_COEFFICIENT = 1.0
"""Largest coefficient of friction; a larger value has a wrong unit."""


def check_coefficient(friction: float) -> None:
    """Refuse a coefficient of friction outside its range."""
    require_within("friction", friction, 0, LARGEST_COEFFICIENT, "", "give the coefficient, usual is 0.05")


def sliding_sense(pair: GearPair, lines: ContactLines) -> FloatArray:
    """Return the sign (n,) of the sliding velocity ω_P s − ω_G (L − s): −1, 0 or 1.

    Returns (n,): −1 where the pinion's root touches, 1 where its tip does.
    """
    return np.sign(lines.position - pair.pitch_point)


def lever_arms(pair: GearPair, lines: ContactLines, friction: float) -> FloatArray:
    """Return the torque into the pinion and out of the wheel per normal force of each slice.

    friction: coefficient μ, 0 … 1.
    Returns (2, n): lever arms of pinion and wheel (m).

    T_P = Σ F (± r_bP cos β_b + μ σ s), T_G = Σ F (± r_bG cos β_b + μ σ (L − s)), with + on the drive flanks, − on the
    back flanks, and σ the sense of sliding.

    The friction power is T_P ω_P − T_G ω_G = Σ μ F |ω_P s − ω_G (L − s)|.
    """
    check_coefficient(friction)
    normal = pair.base_radius * cos(pair.base_helix_angle) * (1.0 if lines.flank == DRIVE else -1.0)
    distance = np.stack([lines.position, pair.line_length - lines.position])
    return np.asarray(normal[:, None] + friction * sliding_sense(pair, lines) * distance)
