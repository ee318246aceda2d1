"""Misalignment of a pair, and the unloaded gap between its flanks beyond that of aligned pure involutes."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from nvhchain.dimensions import Angle
from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

LARGEST_ANGLE = 0.02
"""Largest angle (rad); tilts are taken to first order."""


@dataclass(frozen=True)
class Misalignment:
    """Angles of the wheel's axis against the pinion's; the pair keeps its place at the pitch point at mid-width.

    Parameters
    ----------
    in_plane : float
        Angle in the plane of action of the drive flanks (rad); > 0 closes them towards +z.
    normal : float
        Angle across that plane (rad); > 0 takes the wheel away from the pinion towards +z.

    Notes
    -----
    To first order `normal` has no effect on the drive flanks, but it has on the back flanks. A parallel error is part
    of `GearPair.centre_distance`, which is the actual one.
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
        self, path_length: FloatArray, axial: FloatArray, *, drive: bool, sense: int, pressure_angle: float, tilt: float
    ) -> FloatArray:
        """Return the gap (m) that misalignment opens at contact points.

        path_length: distance from the pitch point along the line of action, from pinion to wheel (m).
        axial: axial position (m).
        drive: True for the drive flanks.
        pressure_angle: working pressure angle α_wt (rad).
        tilt: base helix angle β_b (rad), > 0 where the pinion is right-handed.
        Returns gap along the normal (m).

        The wheel's flank turns in the plane of action about the pitch point.
        """
        turn = -self.in_plane
        if not drive:  # the two lines of action enclose 180° − 2 α_wt
            turn = self.in_plane * cos(2 * pressure_angle) + self.normal * sin(2 * pressure_angle)
        slope = sense if drive else -sense
        return np.asarray(turn * (cos(tilt) * axial + slope * sin(tilt) * path_length))
