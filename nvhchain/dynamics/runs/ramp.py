"""What a run-up is asked for: how the speed of the input changes, load, band and fidelity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, pi
from typing import NotRequired, TypedDict

import numpy as np

from nvhchain.dynamics.time_loop.mesh_levels import ContactForce
from nvhchain.errors import require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class Ramp:
    """Speed of the input against time.  start_speed, end_speed: rad/s, not negative.  duration: s.

    Before the start and after the end the speed is constant.
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
        """rad/s²."""
        return (self.end_speed - self.start_speed) / self.duration

    def speed(self, time: FloatArray) -> FloatArray:
        """rad/s at `time` (s)."""
        return np.asarray(self.start_speed + self.acceleration * np.clip(time, 0.0, self.duration))

    def turns(self, time: FloatArray) -> FloatArray:
        """Turns of the input since time 0."""
        inside = np.clip(time, 0.0, self.duration)
        angle = self.start_speed * time + self.acceleration * inside * (time - 0.5 * inside)
        return np.asarray(angle / (2.0 * pi))


class Operation(TypedDict):
    """What a run-up takes by name.

    start_speed, end_speed: rad/s of the input, not negative; equal for a long record at constant speed.  duration: s.
    input_torque: N m along the input's rotation, constant; the output torque balances it but for what speeds up the
    train.  f_max: Hz, upper end of the band of interest.  fidelity: of the dynamics.
    contact_forces: one per mesh, for `fidelity.mesh_level` "contact".
    """

    start_speed: float
    end_speed: float
    duration: float
    input_torque: float
    f_max: float
    fidelity: DynamicsFidelity
    contact_forces: NotRequired[Sequence[ContactForce] | None]
