"""What a gear mesh hands to the gearbox: its force, and where along the flanks it is carried."""

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
    tilt_ratio: how much more the teeth resist tilt in the plane of action than slices side by side of the same
        stiffness would; None where it is not known.
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
    tilt_ratio: float | None = None

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
        require(
            self.tilt_ratio is None or 0.0 <= self.tilt_ratio <= 10.0,
            f"MeshLaw.tilt_ratio = {self.tilt_ratio} is outside 0…10: slices side by side have 1",
        )


@dataclass(frozen=True, eq=False)
class LoadDistribution(HandOff):
    """Where the drive flanks carry their nominal load, by the position of the mesh.

    angle: (n_angle,) rad, wheel angle from 0, one body period, end point left out.  period: rad.
    sliding: (n_angle,) Σ σ F / Σ F, σ = 1 where the pinion's flank slides ahead of the wheel's (towards its tip), else
        −1.
    arm: (n_angle,) m, Σ σ F s / Σ F, s from the pinion's base tangent point along the line of action.
    offset: (n_angle,) m along z, centre of the load from mid-width.
    force: N along the flank normal, nominal.  tilt_ratio: as in `MeshLaw`, mean over the period.
    """

    angle: FloatArray
    period: float
    sliding: FloatArray
    arm: FloatArray
    offset: FloatArray
    force: float
    tilt_ratio: float

    def __post_init__(self) -> None:
        angle = array(self, "angle", float, (None,))
        increasing(self, "angle", 0.0)
        for name in ("sliding", "arm", "offset"):
            array(self, name, float, (len(angle),))
        for name in ("period", "force", "tilt_ratio"):
            object.__setattr__(self, name, float(getattr(self, name)))
        require(
            angle[-1] < self.period,
            f"LoadDistribution.period = {self.period:g} rad must lie beyond the last angle {angle[-1]:g}",
        )
        require(self.force > 0, f"LoadDistribution.force = {self.force:g} N must be positive")
