"""Hand-offs of a gear mesh to the gearbox: its force, the place of the load on the flanks, and its tooth pairs."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require, require_within
from nvhchain.handoff.base import FloatArray, HandOff, IntArray
from nvhchain.handoff.declared import array, value


class MeshLaw(HandOff):
    """Force of a gear mesh against position and deflection: F(θ, δ), periodic in θ.

    Notes
    -----
    Angles cover one body period from 0 without its end point. The deflection δ = (r_bP φ_P − r_bG φ_G) cos β_b is > 0
    where it closes the drive flank. Its steps need not be uniform. The force is > 0 on the drive flank, 0 in the
    backlash gap, < 0 on the back flank, and never falls with δ. Beyond the table the end slope continues. Resistance to
    tilt is that in the plane of action, over slices of the same stiffness; absent where unknown.
    """

    angle: FloatArray = array("rad", "angle", "wheel angle", lower_limit=0.0)
    deflection: FloatArray = array("m", "deflection", "mesh deflection, > 0 closes the drive flank", fewest=2)
    force: FloatArray = array("N", "angle, deflection", "mesh force along the flank normal")
    period: float = value("rad", "wheel angle after which the law repeats")
    teeth: tuple[int, int] = array("1", "gear", "numbers of teeth, pinion and wheel")
    base_radius: FloatArray = array("m", "gear", "base radii, pinion and wheel")
    base_helix_angle: float = value("rad", "base helix angle, > 0 where the pinion is right-handed")
    working_pressure_angle: float = value("rad", "transverse working pressure angle")
    centre_distance: float = value("m", "centre distance")
    face_width: float = value("m", "common face width")
    tilt_ratio: float | None = value("1", "resistance to tilt over that of slices side by side", default=None)

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
        if self.tilt_ratio is not None:
            require_within("MeshLaw.tilt_ratio", self.tilt_ratio, 0, 10, "", "slices side by side have 1")


class LoadDistribution(HandOff):
    """Place of the nominal load on the drive flanks against the position of the mesh.

    Notes
    -----
    Angles cover one body period from 0 without its end point. Means are weighted with the force. Distances are measured
    along the line of action.
    """

    angle: FloatArray = array("rad", "angle", "wheel angle", lower_limit=0.0)
    period: float = value("rad", "wheel angle after which the distribution repeats")
    sliding: FloatArray = array("1", "angle", "mean sense of sliding: 1 where the pinion slides ahead, else −1")
    arm: FloatArray = array("m", "angle", "mean distance from the pinion's base tangent point")
    offset: FloatArray = array("m", "angle", "centre of the load from mid-width, along z")
    force: float = value("N", "nominal mesh force along the flank normal")
    tilt_ratio: float = value("1", "resistance to tilt over that of slices side by side, mean over the period")

    def _check(self) -> None:
        require(
            self.angle[-1] < self.period,
            f"LoadDistribution.period = {self.period:g} rad must lie beyond the last angle {self.angle[-1]:g}",
        )
        require(self.force > 0, f"LoadDistribution.force = {self.force:g} N must be positive")

    def repeated(self, times: int) -> LoadDistribution:
        """Return the distribution over several periods, for a mesh law that repeats less often."""
        if times <= 1:
            return self
        angle = (np.arange(times)[:, None] * self.period + self.angle).ravel()
        sliding, arm, offset = (np.tile(values, times) for values in (self.sliding, self.arm, self.offset))
        return self.replace(angle=angle, period=times * self.period, sliding=sliding, arm=arm, offset=offset)


class MeshPeriod(HandOff):
    """Gear pair under its nominal load over one mesh period, for a first look at what excites a gearbox."""

    distribution: LoadDistribution = value("", "place of the load on the flanks over the mesh period")
    deflection: FloatArray = array("m", "angle", "mesh deflection at the angles of the distribution")
    stiffness: float = value("N/m", "mean tangent stiffness along the flank normal", lower_limit=0.0)


_SLICES = "flank, angle, pair, slice"
_GEAR_SLICES = f"gear, {_SLICES}"


class ToothPairs(HandOff):
    """Springs of all tooth pairs in contact over a body period, to give each pair its own deviations.

    Notes
    -----
    Flanks are the drive flanks, then the back flanks. Entries of absent pairs and slices are 0. A slice's weight is its
    share in the force of its pair at the nominal deflection.
    """

    angle: FloatArray = array("rad", "angle", "wheel angle", lower_limit=0.0)
    period: float = value("rad", "wheel angle after which the pairs repeat")
    loaded: float = value("m", "mean deflection under the nominal force")
    approach: FloatArray = array("m", "approach", "approach beyond first contact, even steps from 0", fewest=2)
    count: IntArray = array("1", "flank, angle", "number of pairs")
    order: IntArray = array("1", "flank, angle, pair", "tooth of the pinion in the order of mesh")
    first_contact: FloatArray = array("m", "flank, angle, pair", "approach at first contact of a pair as drawn")
    force: FloatArray = array("N", "flank, angle, pair, approach", "force of a pair as drawn that carries alone")
    coupling: FloatArray = array("m/N", "flank, angle, pair, other_pair", "approach of a pair under another's force")
    weight: FloatArray = array("1", _SLICES, "share of a slice in the force of its pair")
    gap: FloatArray = array("m", _SLICES, "unloaded gap as drawn")
    length: FloatArray = array("m", _SLICES, "length of the contact line")
    axial: FloatArray = array("m", _SLICES, "place along the axis from mid-width")
    radius: FloatArray = array("m", _GEAR_SLICES, "radius of the contact point")
    depth: FloatArray = array("m", _GEAR_SLICES, "depth from the contact point to the tooth's centre line")
    edge: FloatArray = array("m", _GEAR_SLICES, "distance from the contact point to the tip edge")
    edge_angle: FloatArray = array("rad", _SLICES, "angle of a tip edge in contact")
    curvature: FloatArray = array("m", _SLICES, "radius of relative curvature")
    compliance: FloatArray = array("m/N", f"{_SLICES}, other_slice", "approach of a slice under another's force")

    held: IntArray = array(
        "1", "gear", "1 where the compliance is less that of a tooth held on its centre line, else 0"
    )

    def _check(self) -> None:
        require(
            self.angle[-1] < self.period,
            f"ToothPairs.period = {self.period:g} rad must lie beyond the last angle {self.angle[-1]:g}",
        )
        require(
            bool((self.count <= self.order.shape[2]).all() and (self.count >= 0).all()),
            f"ToothPairs.count must lie within 0…{self.order.shape[2]}, the pairs",
        )
