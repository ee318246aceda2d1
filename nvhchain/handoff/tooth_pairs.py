"""Hand-off of the tooth pairs in contact, each as a spring coupled to the others."""

from __future__ import annotations

from nvhchain.errors import require
from nvhchain.handoff.base import FloatArray, HandOff, IntArray
from nvhchain.handoff.declared import array, value

_SLICES = "flank, angle, pair, slice"
_OF_GEARS = f"gear, {_SLICES}"


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
    radius: FloatArray = array("m", _OF_GEARS, "radius of the contact point")
    depth: FloatArray = array("m", _OF_GEARS, "depth from the contact point to the tooth's centre line")
    edge: FloatArray = array("m", _OF_GEARS, "distance from the contact point to the tip edge")
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
