"""Forces of a mesh that depend on its position but not on its deflection, as laws for the time loop."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw

SHORT = np.array([-3.0, -1.0, 1.0, 3.0])
"""m: grid of such a law; its middle cell holds every deflection."""
LEVEL = 1.0
"""N/m: slope that it is given, far below any mesh stiffness, since the time loop wants one."""


def check_table(table: Any, what: str, *names: str) -> None:
    """Check `table.angle`, rad of the wheel, increasing from 0 within `table.period`, and (n_angle,) arrays `names`."""
    for name in ("angle", *names):
        object.__setattr__(table, name, np.ascontiguousarray(getattr(table, name), dtype=float))
        value = getattr(table, name)
        require(
            value.shape == (len(table.angle),) and bool(np.isfinite(value).all()),
            f"mesh {what}: {name} must hold {len(table.angle)} finite numbers, one per angle",
        )
    require(
        0.0 < table.period <= 2.0 * pi * 1e3
        and bool((np.diff(table.angle) > 0).all())
        and table.angle[0] >= 0.0
        and table.angle[-1] < table.period,
        f"mesh {what}: angles must increase within 0…{table.period:g} rad, the period, which must be positive",
    )


def law_of_angle(
    law: MeshLaw, period: float, angle: FloatArray, values: FloatArray, force: float, what: str
) -> MeshLaw:
    """`values` (n_angle,) N at wheel angles `angle`, rad, of one `period` as a law like `law`.

    force: N, nominal, of the mesh. Raises InputError where the periods differ or the back flanks carry.
    """
    require(
        abs(period / law.period - 1.0) <= 1e-6,
        f"mesh {what} repeats after {period:g} rad, its mesh law with teeth {law.teeth} after {law.period:g} rad: "
        "tabulate both over the same period",
    )
    require(
        force >= 0.0,
        f"mesh {what} of the drive flanks is given, but the back flanks carry {-force:.4g} N: leave {what} out",
    )
    return law.replace(angle=angle, deflection=SHORT, force=values[:, None] + LEVEL * SHORT)
