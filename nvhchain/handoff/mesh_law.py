"""What a gear mesh hands to the gearbox."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff.base import (
    FloatArray,
    HandOff,
    array,
    increasing,
)


@dataclass(frozen=True, eq=False)
class MeshLaw(HandOff):
    """Force of a gear mesh against position and deflection: F(θ, δ), periodic in θ.

    angle: (n_angle,) rad, wheel angle from 0, one body period, end point left out.
    deflection: (n_defl,) m, δ = (r_bP φ_P − r_bG φ_G) cos β_b, > 0 closes the drive flank; need not be uniform.
    force: (n_angle, n_defl) N along the flank normal, never falling with δ, > 0 on the drive flank, 0 in the
        backlash gap, < 0 on the back flank; outside the tabulated range the end slope continues.
    period: rad of wheel angle after which the law repeats.  teeth: (z_pinion, z_wheel).
    base_radius: (2,) m, pinion and wheel.  base_helix_angle: rad, > 0 where the pinion is right-handed.
    working_pressure_angle: rad, transverse.  centre_distance, face_width: m.
    """

    angle: FloatArray
    deflection: FloatArray
    force: FloatArray
    period: float
    teeth: tuple[int, int]
    base_radius: FloatArray
    base_helix_angle: float
    working_pressure_angle: float
    centre_distance: float
    face_width: float

    def __post_init__(self) -> None:
        angle = array(self, "angle", float, (None,))
        deflection = array(self, "deflection", float, (None,))
        force = array(self, "force", float, (len(angle), len(deflection)))
        array(self, "base_radius", float, (2,))
        increasing(self, "angle", 0.0)
        increasing(self, "deflection")
        object.__setattr__(self, "teeth", tuple(int(z) for z in self.teeth))
        for name in ("period", "base_helix_angle", "working_pressure_angle", "centre_distance", "face_width"):
            object.__setattr__(self, name, float(getattr(self, name)))
        require(len(self.teeth) == 2 and min(self.teeth) > 0, f"MeshLaw.teeth = {self.teeth}: two positive counts")
        require(bool((self.base_radius > 0).all()), "MeshLaw.base_radius must be positive")
        require(len(deflection) >= 2, "MeshLaw.deflection needs at least two values")
        require(
            0 < self.period <= 2 * np.pi * self.teeth[0] * (1 + 1e-9) and angle[-1] < self.period,
            f"MeshLaw.period = {self.period:g} rad must be positive and beyond the last angle {angle[-1]:g}",
        )
        fall = np.diff(force, axis=1)
        worst = float(fall.min(initial=0.0))
        require(
            worst >= -1e-9 * float(np.abs(force).max(initial=0.0)),
            f"MeshLaw.force falls by {-worst:g} N between neighbouring deflections: it must never fall with deflection",
        )
