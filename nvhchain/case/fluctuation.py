"""Fluctuating drive of a case: harmonics of torque or speed at the input, or a record from a file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from pathlib import Path
from typing import Literal

from nvhchain.dimensions import Angle, AngularSpeed
from nvhchain.dynamics import Fluctuation, Harmonic
from nvhchain.errors import InputError, require
from nvhchain.interop import Record, read_record
from nvhchain.kinds import check_fields


@dataclass(frozen=True)
class TorqueHarmonic:
    """amplitude × cos(order × angle of the input + phase).

    order: cycles per turn of the input, such as 2 of a four-cylinder engine.  amplitude: N m.  phase: rad.
    """

    order: float
    amplitude: float
    phase: Angle = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.as_drive

    @property
    def as_drive(self) -> Harmonic:
        """The same as the dynamics takes it."""
        return Harmonic(self.order, self.amplitude, self.phase)


@dataclass(frozen=True)
class SpeedHarmonic:
    """amplitude × cos(order × angle of the input + phase).

    order: cycles per turn of the input, such as 2 of a four-cylinder engine.  amplitude: rad/s.  phase: rad.
    """

    order: float
    amplitude: AngularSpeed
    phase: Angle = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.as_drive

    @property
    def as_drive(self) -> Harmonic:
        """The same as the dynamics takes it."""
        return Harmonic(self.order, self.amplitude, self.phase)


@dataclass(frozen=True)
class SpeedHarmonics:
    """Speed of the input about its mean, whatever the gears do, by orders of the input.

    harmonics: one or more.
    """

    harmonics: tuple[SpeedHarmonic, ...]

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.as_drive

    @property
    def as_drive(self) -> Fluctuation:
        """The same as the dynamics takes it."""
        return Fluctuation("speed", tuple(one.as_drive for one in self.harmonics))


@dataclass(frozen=True)
class TorqueHarmonics:
    """Torque of the input about its mean, by orders of the input; all other torques stay constant.

    harmonics: one or more.
    """

    harmonics: tuple[TorqueHarmonic, ...]

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.as_drive

    @property
    def as_drive(self) -> Fluctuation:
        """The same as the dynamics takes it."""
        return Fluctuation("torque", tuple(one.as_drive for one in self.harmonics))


@dataclass(frozen=True)
class SpeedRecord:
    """Speed of the input about its mean, whatever the gears do, from a record; followed in time, by a ramp.

    file: beside the case: CSV, MAT, HDF5 or UFF 58, at least as long as the ramp; its mean is taken off.
    channel: of the file.
    unit: of the channel.
    time_channel: of the file, in s; not read where the file gives a time axis.
    """

    file: str
    channel: str = "speed"
    unit: Literal["rpm", "rad/s"] = "rpm"
    time_channel: str = "time"

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.as_drive

    @cached_property
    def as_drive(self) -> Fluctuation:
        """The same as the dynamics takes it."""
        record = read_record(Path(self.file))
        record.check_unit(self.channel, self.unit)
        return _of_record(self, "speed", record, pi / 30.0 if self.unit == "rpm" else 1.0)


@dataclass(frozen=True)
class TorqueRecord:
    """Torque of the input about its mean, from a record; followed in time, by a ramp.

    file: beside the case: CSV, MAT, HDF5 or UFF 58, at least as long as the ramp; its mean is taken off.
    channel: of the file, N m.
    time_channel: of the file, in s; not read where the file gives a time axis.
    """

    file: str
    channel: str = "torque"
    time_channel: str = "time"

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.as_drive

    @cached_property
    def as_drive(self) -> Fluctuation:
        """The same as the dynamics takes it."""
        record = read_record(Path(self.file))
        stated = record.units.get(self.channel, "N m")
        require(
            stated.replace(" ", "").replace("*", "").replace("·", "") == "Nm",
            f"{self.file}: channel {self.channel!r} is in {stated!r} by the file: convert it to N m",
        )
        return _of_record(self, "torque", record, 1.0)


def _of_record(
    given: SpeedRecord | TorqueRecord, quantity: Literal["torque", "speed"], record: Record, factor: float
) -> Fluctuation:
    values, time = factor * record.values(given.channel), record.time_of([given.channel])
    try:
        return Fluctuation(quantity, time=record.values(given.time_channel) if time is None else time, values=values)
    except InputError as error:
        raise InputError(f"{given.file}: {error}") from None
