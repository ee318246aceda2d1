"""Forces of a mesh that depend on its position but not on its deflection, as laws for the time loop."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw

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
