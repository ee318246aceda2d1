"""Friction of the flanks in a mesh: forces on both gears against the position of the mesh.

At s from the pinion's base tangent point, the pinion's flank moves across the line of action at ω_P s. The wheel's
flank moves at ω_G (L − s). Both velocities point along e = ẑ × n for a pinion that turns about +z. Here n is the
transverse direction of the line of action from pinion to wheel. A contact that carries F is dragged by μ F σ, with σ
the sign of ω_P s − ω_G (L − s): along e on the wheel, against it on the pinion. With A = Σ μ σ F and S = Σ μ σ F s over
the contact, the pinion loses the torque S and the wheel gains L A − S. Each torque counts along the gear's own running
direction.

F is taken at its nominal value. Variations of the mesh force change the friction in second order only, times μ.
Friction therefore persists where flanks separate, although it should vanish there.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from nvhchain.dynamics.model.angle_laws import check_table, law_of_angle
from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.kinds import check_fields

LARGEST_COEFFICIENT = 1.0
"""Largest coefficient of friction; a larger one indicates a wrong unit."""


@dataclass(frozen=True, eq=False)
class MeshFriction:
    """Friction of the drive flanks under nominal load.

    Parameters
    ----------
    coefficient : float
        Coefficient of friction μ.
    period : float
        Period of the angles (rad of the wheel).
    angle : (n_angle,) array
        Wheel angles (rad), increasing from 0 within one period.
    sliding : (n_angle,) array
        Signed share of the force Σ σ F / Σ F, −1 … 1.
    arm : (n_angle,) array
        Lever arm Σ σ F s / Σ F (m).
    """

    coefficient: float
    period: float
    angle: FloatArray
    sliding: FloatArray
    arm: FloatArray

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            isfinite(self.coefficient) and 0.0 <= self.coefficient <= LARGEST_COEFFICIENT,
            f"mesh friction: coefficient = {self.coefficient} is outside 0…{LARGEST_COEFFICIENT:g}; usual is 0.05",
        )
        check_table(self, "friction", "sliding", "arm")
        require(
            bool((np.abs(self.sliding) <= 1.0 + 1e-9).all()),
            "mesh friction: sliding is the share of the force with its sense, −1…1",
        )


def friction_laws(law: MeshLaw, friction: MeshFriction, force: float) -> tuple[MeshLaw, MeshLaw]:
    """Return A and S / r_bP (N) as laws that do not depend on the deflection.

    force : nominal mesh force along the flank normal (N).

    Raises InputError if the back flanks carry, because their lines of action differ.
    """
    push = friction.coefficient * force
    return tuple(  # type: ignore[return-value]
        law_of_angle(law, friction.period, friction.angle, push * values, force, "friction")
        for values in (friction.sliding, friction.arm / law.base_radius[0])
    )
