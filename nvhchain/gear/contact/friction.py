"""Coulomb friction on the flanks: its direction and what it does to the torque.

With parallel axes the flanks slide in the transverse plane, across the line of action: at s from the pinion's base
tangent point the pinion's flank moves with ω_P s, the wheel's with ω_G (L − s), L the distance of the tangent points.
The friction force μ F turns with the sliding, which changes its sign at the pitch point.
"""

from __future__ import annotations

from math import cos

import numpy as np

from nvhchain.errors import require
from nvhchain.gear.contact.contact_lines import ContactLines
from nvhchain.gear.drawing.pair import DRIVE, GearPair
from nvhchain.handoff import FloatArray

LARGEST_COEFFICIENT = 1.0
"""Of friction, beyond which a unit was mistaken."""


def check_coefficient(friction: float) -> None:
    """Refuse what is no coefficient of friction."""
    require(
        0 <= friction <= LARGEST_COEFFICIENT,
        f"friction = {friction:g} is outside 0…{LARGEST_COEFFICIENT:g}: give the coefficient, usual is 0.05",
    )


def sliding_sense(pair: GearPair, lines: ContactLines) -> FloatArray:
    """(n,) −1, 0 or 1: sign of ω_P s − ω_G (L − s); −1 where the pinion's root touches, 1 where its tip does."""
    return np.sign(lines.position - pair.pitch_point)


def lever_arms(pair: GearPair, lines: ContactLines, friction: float) -> FloatArray:
    """(2, n) m: torque that goes into the pinion and out of the wheel per normal force of each slice.

    T_P = Σ F (± r_bP cos β_b + μ σ s), T_G = Σ F (± r_bG cos β_b + μ σ (L − s)), + on the drive flanks, − on the back
    flanks, σ the sense of sliding: T_P ω_P − T_G ω_G = Σ μ F |ω_P s − ω_G (L − s)|, the friction's power.
    friction: coefficient μ, 0 … 1.
    """
    check_coefficient(friction)
    normal = pair.base_radius * cos(pair.base_helix_angle) * (1.0 if lines.flank == DRIVE else -1.0)
    distance = np.stack([lines.position, pair.line_length - lines.position])
    return np.asarray(normal[:, None] + friction * sliding_sense(pair, lines) * distance)
