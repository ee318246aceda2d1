"""The unloaded gap between the drawn flanks of a misaligned pair, beyond that of aligned pure involutes."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from nvhchain.dimensions import Angle
from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

LARGEST_ANGLE = 0.02
"""rad; tilts are taken to first order."""


@dataclass(frozen=True)
class Misalignment:
    """Angles of the wheel's axis against the pinion's, rad; the pair keeps its place at the pitch point at mid-width.

    in_plane: in the plane of action of the drive flanks; > 0 closes them towards +z.
    normal: across it; > 0 takes the wheel away from the pinion towards +z. To first order the drive flanks do not
        notice it, the back flanks do.
    A parallel error is part of `GearPair.centre_distance`, which is the actual one.
    """

    in_plane: Angle = 0.0
    normal: Angle = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("in_plane", "normal"):
            value = getattr(self, name)
            require(
                abs(value) <= LARGEST_ANGLE,
                f"misalignment {name} = {1e3 * value:g} mrad is beyond ±{1e3 * LARGEST_ANGLE:g} mrad: give it in rad",
            )

    def separation(
        self, along: FloatArray, axial: FloatArray, *, drive: bool, sense: int, pressure_angle: float, tilt: float
    ) -> FloatArray:
        """Gap, m, that opens at contact points: the wheel's flank turned in the plane of action about the pitch point.

        along: m, from the pitch point in the direction of the line of action, from pinion to wheel.  axial: m.
        pressure_angle: α_wt.  tilt: β_b, > 0 where the pinion is right-handed.  Both rad.
        """
        turn = -self.in_plane
        if not drive:  # the two lines of action enclose 180° − 2 α_wt
            turn = self.in_plane * cos(2 * pressure_angle) + self.normal * sin(2 * pressure_angle)
        slope = sense if drive else -sense
        return np.asarray(turn * (cos(tilt) * axial + slope * sin(tilt) * along))
