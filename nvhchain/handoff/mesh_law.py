"""What a gear mesh hands to the gearbox: its force, and where along the flanks it is carried."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff.base import FloatArray, HandOff
from nvhchain.handoff.declared import array, value


class MeshLaw(HandOff):
    """Force of a gear mesh against position and deflection: F(θ, δ), periodic in θ.

    Notes
    -----
    Angles cover one body period from 0 without its end point.  The deflection δ = (r_bP φ_P − r_bG φ_G) cos β_b is > 0
    where it closes the drive flank, and need not be uniform.  The force is > 0 on the drive flank, 0 in the backlash
    gap, < 0 on the back flank, and never falls with δ; beyond the table the end slope continues.
    """

    angle: FloatArray = array("rad", axes="angle", meaning="wheel angle", at_least=0.0)
    deflection: FloatArray = array(
        "m", axes="deflection", meaning="mesh deflection along the flank normal, > 0 closes the drive flank", fewest=2
    )
    force: FloatArray = array("N", axes="angle, deflection", meaning="mesh force along the flank normal")
    period: float = value("rad", meaning="wheel angle after which the law repeats")
    teeth: tuple[int, int] = array("1", axes="gear", meaning="numbers of teeth, pinion and wheel")
    base_radius: FloatArray = array("m", axes="gear", meaning="base radii, pinion and wheel")
    base_helix_angle: float = value("rad", meaning="base helix angle, > 0 where the pinion is right-handed")
    working_pressure_angle: float = value("rad", meaning="transverse working pressure angle")
    centre_distance: float = value("m", meaning="centre distance")
    face_width: float = value("m", meaning="common face width")
    tilt_ratio: float | None = value(
        "1",
        meaning="resistance of the teeth to tilt in the plane of action over that of slices side by side of the same "
        "stiffness; absent where unknown",
        default=None,
    )

    def _check(self) -> None:
        require(min(self.teeth) > 0, f"MeshLaw.teeth = {self.teeth}: two positive counts")
        require(bool((self.base_radius > 0).all()), "MeshLaw.base_radius must be positive")
        require(
            0 < self.period <= 2 * np.pi * self.teeth[0] * (1 + 1e-9) and self.angle[-1] < self.period,
            f"MeshLaw.period = {self.period:g} rad must be positive and beyond the last angle {self.angle[-1]:g}",
        )
        fall = np.diff(self.force, axis=1)
        worst = float(fall.min(initial=0.0))
        require(
            worst >= -1e-9 * float(np.abs(self.force).max(initial=0.0)),
            f"MeshLaw.force falls by {-worst:g} N between neighbouring deflections: it must never fall with deflection",
        )
        require(
            self.tilt_ratio is None or 0.0 <= self.tilt_ratio <= 10.0,
            f"MeshLaw.tilt_ratio = {self.tilt_ratio} is outside 0…10: slices side by side have 1",
        )


class LoadDistribution(HandOff):
    """Place of the nominal load on the drive flanks against the position of the mesh.

    Notes
    -----
    Angles cover one body period from 0 without its end point.  Means are weighted with the force.
    """

    angle: FloatArray = array("rad", axes="angle", meaning="wheel angle", at_least=0.0)
    period: float = value("rad", meaning="wheel angle after which the distribution repeats")
    sliding: FloatArray = array(
        "1",
        axes="angle",
        meaning="mean sense of sliding: 1 where the pinion's flank slides ahead of the wheel's, else −1",
    )
    arm: FloatArray = array(
        "m", axes="angle", meaning="mean distance from the pinion's base tangent point along the line of action"
    )
    offset: FloatArray = array("m", axes="angle", meaning="centre of the load from mid-width, along z")
    force: float = value("N", meaning="nominal mesh force along the flank normal")
    tilt_ratio: float = value("1", meaning="resistance to tilt over that of slices side by side, mean over the period")

    def _check(self) -> None:
        require(
            self.angle[-1] < self.period,
            f"LoadDistribution.period = {self.period:g} rad must lie beyond the last angle {self.angle[-1]:g}",
        )
        require(self.force > 0, f"LoadDistribution.force = {self.force:g} N must be positive")
