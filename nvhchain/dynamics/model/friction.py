"""Friction of the flanks in a mesh: what it adds to the forces on both gears, by the position of the mesh.

At s from the pinion's base tangent point the pinion's flank moves across the line of action with ω_P s, the wheel's
with ω_G (L − s), both along e = ẑ × n for a pinion that turns with +z, n the transverse direction of the line of action
from pinion to wheel. A contact that carries F is dragged by μ F σ, σ the sign of ω_P s − ω_G (L − s): along e on the
wheel, against it on the pinion. With A = Σ μ σ F and S = Σ μ σ F s over the contact, the pinion loses the torque S and
the wheel gains L A − S, each along its own running direction.

F is taken at its nominal value: what the mesh force moves about it changes the friction in second order only (of μ
times that), and friction stays where flanks part, which it should not.
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
"""Of friction, beyond which a unit was mistaken."""


@dataclass(frozen=True, eq=False)
class MeshFriction:
    """Friction of the drive flanks under nominal load.

    coefficient: μ.  angle: (n_angle,) rad of the wheel, increasing from 0 within one `period`, rad.
    sliding: (n_angle,) Σ σ F / Σ F, −1 … 1.  arm: (n_angle,) m, Σ σ F s / Σ F.
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
    """A and S / r_bP in N as laws that do not depend on the deflection.  force: nominal, N along the flank normal.

    Raises InputError when the back flanks carry: their lines of action are others.
    """
    push = friction.coefficient * force
    return tuple(  # type: ignore[return-value]
        law_of_angle(law, friction.period, friction.angle, push * values, force, "friction")
        for values in (friction.sliding, friction.arm / law.base_radius[0])
    )
