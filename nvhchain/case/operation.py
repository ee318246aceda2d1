"""Parts common to all cases: field points, band, operation and quantities."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi
from typing import Literal, get_args

import numpy as np

from nvhchain.case.fluctuation import SpeedHarmonics, SpeedRecord, TorqueHarmonics, TorqueRecord
from nvhchain.dimensions import AngularSpeed, Length
from nvhchain.errors import require, require_each, require_within
from nvhchain.handoff import RigidPlane
from nvhchain.kinds import check_fields
from nvhchain.names import check_name, check_names, folded

FEWEST_LINES = 4
"""Smallest number of lines in the band for a window of a run-up: the width of the main lobe of a Hann window."""

LONGEST_RAMP = 86400
"""Longest duration (s) of a ramp."""


@dataclass(frozen=True)
class Band:
    """Frequency band of a case.

    Parameters
    ----------
    low, high : float
        Limits of the computed lines (Hz).
    resolution : float
        Largest admissible line spacing (Hz).
    """

    low: float
    high: float
    resolution: float = 5.0

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            0 < self.low < self.high <= 20e3,
            f"band {self.low:g}…{self.high:g} Hz: needs 0 < low < high ≤ 20000 Hz",
        )
        require(
            not 0 < self.low < self.high < self.resolution or self.high >= 20.0,
            f"band {self.low:g}…{self.high:g} Hz holds no line, lines are {self.resolution:g} Hz apart (resolution): "
            f"give it in Hz; if it is in kHz, write low = {1e3 * self.low:g}, high = {1e3 * self.high:g}",
        )
        require_within("band resolution", self.resolution, 0, 20e3, "Hz", above=True)

    @property
    def shortest_record(self) -> float:
        """Shortest duration (s) of a record with changing speed: it has `FEWEST_LINES` in the band."""
        return FEWEST_LINES / (self.high - self.low)

    def check_record(self, duration: float) -> None:
        """Raise InputError where a record of changing speed with `duration` (s) is too short to resolve this band."""
        require(
            duration >= self.shortest_record * (1.0 - 1e-9),
            f"a record of {duration:.3g} s is too short to resolve {self.low:g}…{self.high:g} Hz at changing speed: "
            f"lengthen it to {self.shortest_record:.3g} s or widen the band",
        )


FARTHEST = 1e4
"""Upper limit (m) of coordinates; larger values are mistakes in the unit."""


@dataclass(frozen=True)
class FieldPoint:
    """Microphone.

    Parameters
    ----------
    name : str
        Name in tables and figures.
    position : tuple of float
        Position (x, y, z) in the frame of the case (m).
    """

    name: str
    position: tuple[Length, Length, Length]

    def __post_init__(self) -> None:
        check_fields(self)
        check_name(self.name, "field point: name")
        require(
            all(isfinite(x) and abs(x) <= FARTHEST for x in self.position),
            f"position = {self.position} m is beyond 10 km: give it in m, or in mm as position_mm",
        )


@dataclass(frozen=True)
class Ramp:
    """Run-up or run-down with a linear change of the input speed.

    Parameters
    ----------
    end_speed : float
        Input speed at the end (rad/s).
    duration : float
        Duration (s).
    """

    end_speed: AngularSpeed
    duration: float

    def __post_init__(self) -> None:
        check_fields(self)
        _check_end(self.end_speed)
        require_within("duration", self.duration, 0, LONGEST_RAMP, "s", above=True)

    def lasting(self, input_speed: float, inertia: float) -> float:
        """Duration (s)."""
        return self.duration


@dataclass(frozen=True)
class TorqueRamp:
    """Run-up or run-down by torques, which change the speed linearly.

    Parameters
    ----------
    end_speed : float
        Input speed at the end (rad/s).
    torque_unbalance : float
        Excess of the driving torque over the load of the output, seen from the input (N m); < 0 slows down.
    """

    end_speed: AngularSpeed
    torque_unbalance: float

    def __post_init__(self) -> None:
        check_fields(self)
        _check_end(self.end_speed)
        require(
            0 < abs(self.torque_unbalance) <= 1e7,
            f"torque_unbalance = {self.torque_unbalance:g} N m is 0 or outside -1e7…1e7 N m: give it in N m",
        )

    def lasting(self, input_speed: float, inertia: float) -> float:
        """Return the duration (s) from `input_speed` (rad/s) to end_speed.

        `inertia` is that of the train at the input (kg m²).
        """
        duration = (self.end_speed - input_speed) * inertia / self.torque_unbalance
        turning = f"torque_unbalance = {self.torque_unbalance:g} N m on a train of {inertia:.4g} kg m² at the input"
        require(
            duration > 0,
            f"{turning} does not lead from {30.0 / pi * input_speed:.5g} to {30.0 / pi * self.end_speed:.5g} rpm: "
            "change its sign or the end_speed",
        )
        require(
            duration <= LONGEST_RAMP,
            f"{turning} takes {duration:.3g} s to {30.0 / pi * self.end_speed:.5g} rpm, of {LONGEST_RAMP:g} s at most: "
            "raise it",
        )
        return duration


def _check_end(end_speed: float) -> None:
    require_within("end_speed", end_speed, 0, 2e4, "rad/s", "give it as end_speed_rpm")


@dataclass(frozen=True)
class Operation:
    """Speed and load of the input.

    Parameters
    ----------
    input_speed : float
        Mean speed of the input (rad/s), ≥ 0 in its own sense of rotation; the start speed of a ramp.
    input_torque : float
        Mean torque along the input's rotation (N m): > 0 drives, < 0 coasts on the back flanks, 0 lets idle gears
        rattle.
    ramp : Ramp or TorqueRamp, optional
        Run-up from input_speed, over a time or by torques; None at constant speed.
    mesh_torque : float, optional
        Input torque > 0 (N m), about that of the hardest impacts, for the range of the mesh laws of idle gears.
    fluctuation : SpeedHarmonics, TorqueHarmonics, SpeedRecord or TorqueRecord, optional
        Fluctuation of speed or torque of the input about its mean, as by an engine.
    """

    input_speed: AngularSpeed
    input_torque: float
    ramp: Ramp | TorqueRamp | None = None
    mesh_torque: float | None = None
    fluctuation: SpeedHarmonics | TorqueHarmonics | SpeedRecord | TorqueRecord | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        require_each(
            (
                0 <= self.input_speed <= 2e4,
                f"input_speed = {self.input_speed:g} rad/s is outside 0…20000 rad/s: give it as input_speed_rpm",
            ),
            (
                self.input_speed != 0 or self.ramp is not None,
                "input_speed = 0 rad/s: a gearbox at rest is silent; give a speed, or a ramp that starts from rest",
            ),
            (
                self.ramp is None or max(self.input_speed, self.ramp.end_speed) > 0,
                "a ramp from input_speed = 0 to end_speed = 0 rad/s never turns: give one of them",
            ),
            (
                abs(self.input_torque) <= 1e7,
                f"input_torque = {self.input_torque:g} N m is outside -1e7…1e7 N m: give it in N m",
            ),
            (
                self.input_torque != 0 or self.mesh_torque is not None,
                "input_torque = 0 N m does not state how far the mesh laws of rattling gears must reach: give "
                "mesh_torque, N m at the input, about that of the hardest impacts"
                if self.ramp is not None or self.fluctuation is not None
                else "input_torque = 0 N m at a constant speed: nothing moves the gears: give input_torque; for rattle "
                "give a ramp or a fluctuation, and mesh_torque",
            ),
            (
                self.mesh_torque is None or 0 < self.mesh_torque <= 1e7,
                f"mesh_torque = {self.mesh_torque} N m is outside 0…1e7 N m: give it in N m",
            ),
        )
        if self.ramp is None and self.fluctuation is not None:
            _ = self.fluctuation.drive.period


EngineName = Literal["fused", "bempp"]
"""Boundary element engine of a case: a name in `nvhchain.acoustics.ENGINES`."""

Quantity = Literal[
    "bearing_forces", "surface_velocity", "pressure", "sound_power", "radiation_efficiency", "directivity"
]
"""Quantity that a case can ask for; steps that none of its quantities needs are not computed."""

FIELD_POINT_QUANTITIES = frozenset({"pressure", "directivity"})
"""Quantities at field points."""

RADIATED = frozenset({"sound_power", "radiation_efficiency", "directivity"})
"""Quantities that need the sound power."""


def check_quantities(quantities: tuple[Quantity, ...], points: tuple[FieldPoint, ...]) -> None:
    """Refuse (InputError) no quantity, repeated quantities, and sound pressure without field points."""
    require(
        len(set(quantities)) == len(quantities) > 0 and set(quantities) <= set(get_args(Quantity)),
        f"quantities = {list(quantities)}: name at least one and none twice, of {', '.join(get_args(Quantity))}",
    )
    check_names([point.name for point in points], "field_points")
    require(
        not FIELD_POINT_QUANTITIES.intersection(quantities) or bool(points),
        "field_points: the sound pressure is asked for nowhere: give one, or leave `pressure` and `directivity` out of "
        "quantities",
    )


def check_case_name(name: str) -> None:
    """Refuse (InputError) a name that cannot be a folder beside that of the shared operators."""
    check_name(name, "name")
    require(folded(name) != "operators", f"name = {name!r} is that of a folder beside the case's: choose another name")


def check_plane(plane: RigidPlane | None, points: tuple[FieldPoint, ...]) -> None:
    """Refuse (InputError) field points behind the reflecting plane."""
    for point in points if plane is not None else ():
        height = float(plane.height(np.array([point.position]))[0])  # type: ignore[union-attr]
        require(
            height >= 0,
            f"field point {point.name!r} at {point.position} m lies {-1e3 * height:.4g} mm behind the reflecting "
            "plane: move it to the side the plane's normal points to",
        )
