"""Forces of a mesh that depend on its position but not on its deflection, as laws for the time loop."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.kinds import check_fields

CELL_DEFLECTIONS = np.array([-3.0, -1.0, 1.0, 3.0])
"""Deflections (m) of such a law; the middle cell holds every deflection that occurs."""
LEVEL = 1.0
"""Slope of such a law (N/m), far below any mesh stiffness; the time loop needs a slope."""


def check_table(table: Any, subject: str, *names: str) -> None:
    """Check the wheel angles and the arrays `names` of `table`; raise InputError.

    `table.angle` (rad) must increase from 0 within `table.period`. Each array must hold (n_angle,) finite numbers.
    """
    for name in ("angle", *names):
        object.__setattr__(table, name, np.ascontiguousarray(getattr(table, name), dtype=float))
        value = getattr(table, name)
        require(
            value.shape == (len(table.angle),) and bool(np.isfinite(value).all()),
            f"mesh {subject}: {name} must hold {len(table.angle)} finite numbers, one per angle",
        )
    require(
        0.0 < table.period <= 2.0 * pi * 1e3
        and bool((np.diff(table.angle) > 0).all())
        and table.angle[0] >= 0.0
        and table.angle[-1] < table.period,
        f"mesh {subject}: angles must increase within 0…{table.period:g} rad, the period, which must be positive",
    )


def law_of_angle(
    law: MeshLaw, period: float, angle: FloatArray, values: FloatArray, force: float, subject: str
) -> MeshLaw:
    """Return a law like `law` whose force `values` (n_angle,) (N) depends on the wheel angle `angle` (rad) only.

    period : period of the angles (rad).
    force : nominal force of the mesh (N).

    Raises InputError if the periods differ or the back flanks carry.
    """
    require(
        abs(period / law.period - 1.0) <= 1e-6,
        f"mesh {subject} repeats after {period:g} rad, its mesh law with teeth {law.teeth} after {law.period:g} rad: "
        "tabulate both over the same period",
    )
    require(
        force >= 0.0,
        f"mesh {subject} of the drive flanks is given, but the back flanks carry {-force:.4g} N: leave {subject} out",
    )
    return law.replace(angle=angle, deflection=CELL_DEFLECTIONS, force=values[:, None] + LEVEL * CELL_DEFLECTIONS)


LARGEST_COEFFICIENT = 1.0
"""Largest coefficient of friction; a larger one indicates a wrong unit."""


@dataclass(frozen=True, eq=False)
class MeshFriction:
    """Friction of the drive flanks under nominal load.

    coefficient: coefficient of friction μ.
    period: period of the angles (rad of the wheel).
    angle (n_angle,): wheel angles (rad), increasing from 0 within one period.
    sliding (n_angle,): signed share of the force Σ σ F / Σ F, −1 … 1.
    arm (n_angle,): lever arm Σ σ F s / Σ F (m).
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


FARTHEST = 1.0
"""Largest offset from mid-width (m); a larger one indicates a wrong unit."""


@dataclass(frozen=True, eq=False)
class LoadCentre:
    """Centre of the load of the drive flanks along the face, under nominal load.

    period: period of the angles (rad of the wheel).
    angle (n_angle,): wheel angles (rad), increasing from 0 within one period.
    offset (n_angle,): offset from mid-width along z (m).
    """

    period: float
    angle: FloatArray
    offset: FloatArray

    def __post_init__(self) -> None:
        check_fields(self)
        check_table(self, "load centre", "offset")
        require(
            bool((np.abs(self.offset) <= FARTHEST).all()),
            f"mesh load centre: offset of {np.abs(self.offset).max():g} m is off any face: give it in m",
        )


def centre_law(law: MeshLaw, centre: LoadCentre, force: float) -> MeshLaw:
    """Return F ζ / b (N) as a law that does not depend on the deflection.

    force : nominal mesh force along the flank normal (N).
    """
    return law_of_angle(law, centre.period, centre.angle, force * centre.offset / law.face_width, force, "load centre")
