"""Arguments of a run-up: input speed against time, load, band and fidelity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, pi
from typing import NotRequired, TypedDict

import numpy as np

from nvhchain.dynamics.model.fluctuation import Fluctuation
from nvhchain.dynamics.time_loop.mesh_levels import ContactForce
from nvhchain.errors import require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class Ramp:
    """Speed of the input against time, constant before the start and after the end.

    start_speed, end_speed : speeds (rad/s), not negative.
    duration : time of the change (s).
    """

    start_speed: float
    end_speed: float
    duration: float

    def __post_init__(self) -> None:
        for name in ("start_speed", "end_speed"):
            value = getattr(self, name)
            require(
                isfinite(value) and value >= 0.0,
                f"{name} = {value} rad/s must not be negative: give the sense of rotation as gearbox.input_rotation",
            )
        require(isfinite(self.duration) and self.duration > 0, f"duration = {self.duration} s must be positive")

    @property
    def acceleration(self) -> float:
        """Acceleration of the input (rad/s²)."""
        return (self.end_speed - self.start_speed) / self.duration

    def speed(self, time: FloatArray) -> FloatArray:
        """Return the speed (rad/s) at `time` (s)."""
        return np.asarray(self.start_speed + self.acceleration * np.clip(time, 0.0, self.duration))

    def motion(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return speed (rad/s) and angle (rad) at `time` (s)."""
        return self.speed(time), 2.0 * pi * self.input_turns(time)

    def input_turns(self, time: FloatArray) -> FloatArray:
        """Return the turns of the input since time 0."""
        inside = np.clip(time, 0.0, self.duration)
        angle = self.start_speed * time + self.acceleration * inside * (time - 0.5 * inside)
        return np.asarray(angle / (2.0 * pi))


class Load(TypedDict):
    """Keyword arguments of every run.

    input_torque: constant torque along the input's rotation (N m). The output torque balances all of it that does not
        accelerate the train.
    f_max: upper end of the band of interest (Hz).
    fidelity: fidelity of the dynamics.
    contact_forces: one solver per mesh, for `fidelity.mesh_level` "contact".
    """

    input_torque: float
    f_max: float
    fidelity: DynamicsFidelity
    contact_forces: NotRequired[Sequence[ContactForce] | None]


class Operation(Load):
    """Keyword arguments of a run-up.

    start_speed, end_speed: speeds of the input (rad/s), not negative; equal for a long record at constant speed.
    duration: duration of the run-up (s).
    fluctuation: fluctuation of torque or speed at the input, about the values above.
    """

    start_speed: float
    end_speed: float
    duration: float
    fluctuation: NotRequired[Fluctuation | None]
