"""Hand-offs of a gear body: flexibility of its teeth, and its modes. Torque, speed and mating gear leave both alone."""

from __future__ import annotations

from nvhchain.errors import require
from nvhchain.handoff.base import ComplexArray, FloatArray, HandOff, IntArray
from nvhchain.handoff.declared import array, value


class FlankFlexibility(HandOff):
    """Response of the teeth of one symmetric sector to the few patterns of force that they pass on, bore held.

    Notes
    -----
    Points of the flanks are ordered by flank, radius and axial position. A unit force on a point of a flank is the
    patterns times their shares. The compliance of two teeth is shareᵀ · response · share; on one tooth `own` is added.
    Its points lie at the same radii, and between every two places along the axis there may be further ones.
    """

    radius: FloatArray = array("m", "radius", "radii of the flank points", lower_limit=0.0)
    axial: FloatArray = array("m", "axial", "places of the flank points along the axis from mid-width")
    teeth: int = value("1", "number of teeth of the gear", lower_limit=1)
    response: FloatArray = array(
        "m/N", "tooth, distance, pattern, loaded_pattern=pattern", "response of a tooth to patterns on another one"
    )
    share: FloatArray = array("1", "pattern, point", "share of a pattern in a unit force on a point")
    tooth_axial: FloatArray = array("m", "tooth_axial", "places along the axis of the points of `own`")
    own: FloatArray = array(
        "m/N",
        "tooth_point, loaded_point=tooth_point",
        "compliance of a tooth itself, less that of one held on its centre line",
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
        own_points, parts = 2 * len(self.radius) * len(self.tooth_axial), self.parts
        require(
            len(self.own) == own_points and len(self.tooth_axial) == parts * (len(self.axial) - 1) + 1,
            f"FlankFlexibility.own has {len(self.own)} points at {len(self.tooth_axial)} places along the axis: "
            f"{own_points} points are needed, and as many places between every two of the {len(self.axial)} of `share`",
        )

    @property
    def parts(self) -> int:
        """Intervals of `tooth_axial` in each of `axial`."""
        return (len(self.tooth_axial) - 1) // max(len(self.axial) - 1, 1) or 1


class BodyModes(HandOff):
    """Modes of a gear's body with the bore held, as waves around its axis, of unit modal mass.

    Notes
    -----
    A wave is a complex coordinate P in the frame of the housing, real without nodal diameters. A force on the teeth
    along r, φ, z at the angle ψ drives it by the force times rim e^{inψ}. The motion there is Re(conj(rim e^{inψ}) P).
    Hub entries are the coupling of inertia. Without nodal diameters they are those along z and about z. With one
    they are those along x, about x, and the part of the latter by axial motion. Those of y are j times as large. The
    Coriolis factor is 1 for rigid motion in the plane and 0 for motion along the axis.
    """

    frequency: FloatArray = array("Hz", "wave", "natural frequency with the bore held", lower_limit=0.0)
    diameters: IntArray = array("1", "wave", "nodal diameters n", lower_limit=0.0)
    coriolis: FloatArray = array("1", "wave", "Coriolis factor")
    rim: ComplexArray = array("kg^-1/2", "wave, direction", "motion of the teeth along r, φ and z")
    hub: ComplexArray = array("kg^1/2", "wave, motion", "coupling of inertia to the hub; kg^1/2 m for rotations")

    def _check(self) -> None:
        require(
            self.rim.shape[1:] == (3,) and self.hub.shape[1:] == (3,),
            f"BodyModes.rim and hub have shapes {self.rim.shape} and {self.hub.shape}: (waves, 3) each is needed",
        )
