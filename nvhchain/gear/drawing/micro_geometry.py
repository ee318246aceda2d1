"""Micro-geometry: material removed from the flanks of a gear, some 10 µm, for smooth meshing of loaded teeth.

All amounts are along the flank's normal, into the tooth.  0 leaves the involute, and none is negative. Profile lengths
are rolled lengths √(r² − r_b²), the distances that contact travels on the path of contact.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from nvhchain.dimensions import Length
from nvhchain.errors import require, require_within
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

LARGEST_AMOUNT = 1e-3
"""Largest amount of one modification (m); a larger value has a wrong unit."""


@dataclass(frozen=True)
class Relief:
    """Material removed towards one end of the profile.

    Parameters
    ----------
    amount : float
        Amount at the end (m).
    length : float
        Rolled length from the end to the start of the relief (m).
    shape : {'linear', 'parabolic'}
        Growth from the start; parabolic has no kink.
    """

    amount: Length
    length: Length
    shape: Literal["linear", "parabolic"] = "parabolic"

    def __post_init__(self) -> None:
        check_fields(self)
        require_within("relief amount", self.amount, 0, LARGEST_AMOUNT, "m")
        require(self.length > 0, f"relief length = {self.length:g} m must be positive")
        require(self.shape in ("linear", "parabolic"), f"relief shape = {self.shape!r}: choose linear or parabolic")

    def removed(self, excess: FloatArray) -> FloatArray:
        """Return the amount (m) at rolled length `excess` (m) past the start."""
        share = np.clip(excess / self.length, 0.0, None)
        return self.amount * (share if self.shape == "linear" else share**2)


@dataclass(frozen=True)
class Flank:
    """Modifications of one flank.

    Parameters
    ----------
    profile_crowning : float
        Amount at both ends of the usable flank, form to tip form circle (m); 0 half-way in rolled length.
    lead_crowning : float
        Amount at both ends of the face width (m); 0 in its middle.
    lead_slope : float
        Amount at one end of the face width (m), 0 at the other: > 0 at +z; < 0 removes its amount at −z.
    tip_relief : Relief, optional
        Relief from the tip form circle inwards.
    root_relief : Relief, optional
        Relief from the form circle outwards.
    """

    profile_crowning: Length = 0.0
    lead_crowning: Length = 0.0
    lead_slope: Length = 0.0
    tip_relief: Relief | None = None
    root_relief: Relief | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        for name, low in (("profile_crowning", 0.0), ("lead_crowning", 0.0), ("lead_slope", -LARGEST_AMOUNT)):
            require_within(name, getattr(self, name), low, LARGEST_AMOUNT, "m")

    @property
    def bends_profile(self) -> bool:
        """True if the removed material changes along the profile."""
        return bool(self.profile_crowning or self.tip_relief or self.root_relief)

    def removed(
        self, rolled: FloatArray, usable: tuple[float, float], axial: FloatArray, face_width: float
    ) -> FloatArray:
        """Return the material removed (m) at rolled length `rolled` and axial position `axial` (m).

        usable: m, rolled length of form and tip form circle.
        """
        low, high = usable
        profile = (2 * rolled - low - high) / (high - low)
        face = 2 * axial / face_width
        total = self.profile_crowning * profile**2 + self.lead_crowning * face**2
        total = total + 0.5 * abs(self.lead_slope) * (1 + np.sign(self.lead_slope) * face)
        if self.tip_relief is not None:
            total = total + self.tip_relief.removed(rolled - (high - self.tip_relief.length))
        if self.root_relief is not None:
            total = total + self.root_relief.removed(low + self.root_relief.length - rolled)
        return np.asarray(total)


@dataclass(frozen=True)
class MicroGeometry:
    """Both flanks of all teeth of a gear.

    Parameters
    ----------
    drive : Flank
        Flank that transmits while the pinion drives.
    coast : Flank
        Back of the tooth.

    Notes
    -----
    A gear that one stage drives and that drives another (an idler) is loaded on both: the first stage loads `drive`,
    the other one `coast`.
    """

    drive: Flank = Flank()
    coast: Flank = Flank()

    def __post_init__(self) -> None:
        check_fields(self)

    def check(self, rolled_length: float, largest: float) -> None:
        """Refuse reliefs longer than the usable flank's `rolled_length` (m), and amounts beyond `largest` (m)."""
        for side in ("drive", "coast"):
            flank: Flank = getattr(self, side)
            for f in fields(flank):
                value = getattr(flank, f.name)
                amount = value.amount if isinstance(value, Relief) else abs(value or 0.0)
                require(
                    amount <= largest,
                    f"{side} flank: {f.name} takes {1e6 * amount:g} µm off, more than {1e6 * largest:.4g} µm "
                    "(a twentieth of a module): lower it",
                )
                if isinstance(value, Relief):
                    require(
                        value.length <= rolled_length * (1 + 1e-9),
                        f"{side} flank: {f.name} is {1e3 * value.length:.4g} mm long, the usable flank only "
                        f"{1e3 * rolled_length:.4g} mm of rolled length: shorten it",
                    )
