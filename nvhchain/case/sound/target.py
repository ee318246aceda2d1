"""Targets of a case: limits of levels that a design passes or fails."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi
from typing import Literal

from nvhchain.dimensions import AngularSpeed
from nvhchain.errors import require, require_each
from nvhchain.kinds import check_fields
from nvhchain.names import check_name

LOUDEST = 300.0
"""Largest magnitude (dB) of a level; larger ones are mistakes in the unit."""


@dataclass(frozen=True)
class Target:
    """Largest level of a sound: one overall level, a curve over speed, or a spectrum.

    Parameters
    ----------
    name : str
        Name in tables.
    level : tuple of float
        Largest level (dB): one value, or one for each speed or frequency.
    input_speed : tuple of float
        Speeds of a curve (rad/s), rising; straight lines join its points, and other speeds are not judged.
    frequency : tuple of float
        Frequencies of a spectrum (Hz), rising: middles of third octaves, or points of a curve for single lines.
    bands : str
        Levels that a spectrum limits: `third_octaves`, or `lines` of the result.
    quantity : str
        `pressure` (dB re 20 µPa) or `sound_power` (dB re 1 pW).
    weighted : bool
        True for A-weighted levels.
    field_point : str
        Name of the microphone; by default the first one.
    confidence : float
        Least probability that the level keeps to the target; 0.5 compares the level itself.
    """

    name: str
    level: tuple[float, ...]
    input_speed: tuple[AngularSpeed, ...] = ()
    frequency: tuple[float, ...] = ()
    bands: Literal["third_octaves", "lines"] = "third_octaves"
    quantity: Literal["pressure", "sound_power"] = "pressure"
    weighted: bool = True
    field_point: str = ""
    confidence: float = 0.5

    def __post_init__(self) -> None:
        check_fields(self)
        check_name(self.name, "target: name")
        axis = self.input_speed or self.frequency
        require_each(
            (
                not (self.input_speed and self.frequency),
                f"target {self.name}: input_speed and frequency are both given: make two targets of it",
            ),
            (
                len(self.level) == max(1, len(axis)),
                f"target {self.name}: {len(self.level)} levels for {len(axis)} speeds or frequencies: give one each, "
                "or one level alone",
            ),
            (
                all(abs(level) <= LOUDEST for level in self.level),
                f"target {self.name}: level = {list(self.level)} dB is outside ±{LOUDEST:g} dB: give it in dB",
            ),
            (
                all(value > 0 for value in axis) and all(low < high for low, high in pairwise(axis)),
                f"target {self.name}: speeds or frequencies {list(axis)} must be positive and rise",
            ),
            (
                self.bands != "lines" or len(self.frequency) != 1,
                f"target {self.name}: one frequency limits no lines: give both ends of a range",
            ),
            (
                self.bands in ("third_octaves", "lines"),
                f"target {self.name}: bands = {self.bands!r}: choose third_octaves or lines",
            ),
            (
                self.quantity in ("pressure", "sound_power"),
                f"target {self.name}: quantity = {self.quantity!r}: choose pressure or sound_power",
            ),
            (
                0 < self.confidence < 1,
                f"target {self.name}: confidence = {self.confidence:g} is outside 0…1: 0.9 stands for 90 %",
            ),
            (
                not (self.quantity == "sound_power" and self.field_point),
                f"target {self.name}: the sound power has no field_point: leave it out",
            ),
        )

    def missing_octaves(self, low: float, high: float) -> tuple[float, ...]:
        """Return the third octaves (Hz) that do not lie inside a computed band `low` to `high` (Hz)."""
        if self.bands != "third_octaves":
            return ()
        edge = 10**0.05 * (1 - 1e-6)
        return tuple(middle for middle in self.frequency if middle / edge < low or middle * edge > high)

    @property
    def unit(self) -> str:
        """Unit of the level."""
        return "dB(A)" if self.weighted else "dB"


def check_targets(
    targets: tuple[Target, ...],
    quantities: tuple[str, ...],
    points: tuple[str, ...],
    speeds: tuple[float, float] | None,
    band: tuple[float, float] | None = None,
) -> None:
    """Refuse (InputError) targets whose level the case does not have.

    speeds (float, float): lowest and highest input speed (rad/s); None for a radiator.
    band (float, float): lowest and highest computed frequency (Hz); None without a band.
    """
    running_up = speeds is not None and speeds[0] < speeds[1]
    for target in targets:
        require(
            target.quantity in quantities,
            f"target {target.name}: quantities = {list(quantities)} leave out {target.quantity}: add it",
        )
        require(
            not target.field_point or target.field_point in points,
            f"target {target.name}: field_point = {target.field_point!r} is not among {', '.join(points) or 'none'}",
        )
        require(
            not (running_up and target.frequency),
            f"target {target.name}: a spectrum judges a constant speed: give a curve over input_speed for a run-up",
        )
        require(
            speeds is not None or not target.input_speed,
            f"target {target.name}: a radiator has no input_speed: give one level or a spectrum",
        )
        reached = target.input_speed or (0.0, inf)
        low, high = speeds or (0.0, 0.0)
        require(
            reached[0] <= high and low <= reached[-1],
            f"target {target.name}: its curve over {_rpm(reached)} rpm does not reach the {_rpm((low, high))} rpm of "
            "the case: extend it",
        )
        require(
            not running_up or target.weighted,
            f"target {target.name}: levels of a run-up are A-weighted: leave `weighted` out",
        )
        if band is not None:
            missing = ", ".join(f"{middle:g}" for middle in target.missing_octaves(*band))
            require(
                not missing,
                f"target {target.name}: third octaves at {missing} Hz do not lie inside the computed band "
                f"{band[0]:g}…{band[1]:g} Hz: widen `band` or leave them out",
            )
            ends = target.frequency or band
            require(
                ends[0] <= band[1] and band[0] <= ends[-1],
                f"target {target.name}: {ends[0]:g}…{ends[-1]:g} Hz lie outside the computed band "
                f"{band[0]:g}…{band[1]:g} Hz: widen `band`",
            )


def _rpm(speeds: tuple[float, ...]) -> str:
    """Return a range of speeds (rad/s) as text in rpm."""
    low, high = 30 / pi * speeds[0], 30 / pi * speeds[-1]
    return f"{low:.5g}" if low == high else f"{low:.5g}…{high:.5g}"
