"""Hand-off of the flexibility of a gear, which torque, speed, micro-geometry and mating gear leave unchanged."""

from __future__ import annotations

from nvhchain.errors import require
from nvhchain.handoff.base import FloatArray, HandOff
from nvhchain.handoff.declared import array, value


class FlankFlexibility(HandOff):
    """Response of the teeth of one symmetric sector to the few patterns of force that they pass on, bore held.

    Notes
    -----
    Points of the flanks are ordered by flank, radius and axial position. A unit force on a point of a flank is the
    patterns times their shares. The compliance of two teeth is shareᵀ · response · share; on one tooth `own` is added.
    """

    radius: FloatArray = array("m", "radius", "radii of the flank points", lower_limit=0.0)
    axial: FloatArray = array("m", "axial", "places of the flank points along the axis from mid-width")
    teeth: int = value("1", "number of teeth of the gear", lower_limit=1)
    response: FloatArray = array(
        "m/N", "tooth, distance, pattern, loaded_pattern=pattern", "response of a tooth to patterns on another one"
    )
    share: FloatArray = array("1", "pattern, point", "share of a pattern in a unit force on a point")
    own: FloatArray = array(
        "m/N", "point, loaded_point=point", "compliance of a tooth itself, less that of one held on its centre line"
    )

    def _check(self) -> None:
        require(
            self.teeth % len(self.response) == 0,
            f"FlankFlexibility.response has {len(self.response)} teeth, which must divide the {self.teeth} of the gear",
        )
        points = 2 * len(self.radius) * len(self.axial)
        require(
            self.share.shape[1] == points,
            f"FlankFlexibility.share has {self.share.shape[1]} points, but both flanks have {points}",
        )
