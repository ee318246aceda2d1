"""Fluctuating drive of a case: harmonics of torque or speed at the input, or a record from a file."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import pi
from pathlib import Path
from typing import Any, Literal

from nvhchain.dimensions import Angle, AngularSpeed
from nvhchain.dynamics import Fluctuation, Harmonic
from nvhchain.errors import InputError, require
from nvhchain.interop import Record, read_record
from nvhchain.kinds import check_fields


class _Drive:
    """Part of a drive, which is checked in the form that the dynamics takes."""

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.drive

    @property
    @abstractmethod
    def drive(self) -> Any:
        """Form of the dynamics."""


class _Harmonic(_Drive):
    order: float
    amplitude: float
    phase: float

    @property
    def drive(self) -> Harmonic:
        """Harmonic in the form of the dynamics."""
        return Harmonic(self.order, self.amplitude, self.phase)


@dataclass(frozen=True)
class TorqueHarmonic(_Harmonic):
    """Harmonic of the input torque: amplitude × cos(order × angle of the input + phase).

    Parameters
    ----------
    order : float
        Cycles per turn of the input, such as 2 of a four-cylinder engine.
    amplitude : float
        Amplitude (N m).
    phase : float
        Phase (rad).
    """

    order: float
    amplitude: float
    phase: Angle = 0.0


@dataclass(frozen=True)
class SpeedHarmonic(_Harmonic):
    """Harmonic of the input speed: amplitude × cos(order × angle of the input + phase).

    Parameters
    ----------
    order : float
        Cycles per turn of the input, such as 2 of a four-cylinder engine.
    amplitude : float
        Amplitude (rad/s).
    phase : float
        Phase (rad).
    """

    order: float
    amplitude: AngularSpeed
    phase: Angle = 0.0


@dataclass(frozen=True)
class SpeedHarmonics(_Drive):
    """Prescribed speed of the input about its mean, by orders of the input.

    Parameters
    ----------
    harmonics : tuple of SpeedHarmonic
        One or more harmonics.
    """

    harmonics: tuple[SpeedHarmonic, ...]

    @property
    def drive(self) -> Fluctuation:
        """Fluctuation in the form of the dynamics."""
        return Fluctuation("speed", tuple(one.drive for one in self.harmonics))


@dataclass(frozen=True)
class TorqueHarmonics(_Drive):
    """Torque of the input about its mean, by orders of the input; all other torques stay constant.

    Parameters
    ----------
    harmonics : tuple of TorqueHarmonic
        One or more harmonics.
    """

    harmonics: tuple[TorqueHarmonic, ...]

    @property
    def drive(self) -> Fluctuation:
        """Fluctuation in the form of the dynamics."""
        return Fluctuation("torque", tuple(one.drive for one in self.harmonics))


@dataclass(frozen=True)
class SpeedRecord(_Drive):
    """Prescribed speed of the input about its mean, from a record in time, along a ramp.

    Parameters
    ----------
    file : str
        Path of a CSV, MAT, HDF5 or UFF 58 file, relative to the case, at least as long as the ramp; its mean is
        removed.
    channel : str
        Channel of the file.
    unit : str
        Unit of the channel.
    time_channel : str
        Channel of the time (s); not used where the file has a time axis.
    """

    file: str
    channel: str = "speed"
    unit: Literal["rpm", "rad/s"] = "rpm"
    time_channel: str = "time"

    @cached_property
    def drive(self) -> Fluctuation:
        """Fluctuation in the form of the dynamics."""
        record = read_record(Path(self.file))
        record.check_unit(self.channel, self.unit)
        return _record_drive(self, "speed", record, pi / 30.0 if self.unit == "rpm" else 1.0)


@dataclass(frozen=True)
class TorqueRecord(_Drive):
    """Torque of the input about its mean, from a record in time, along a ramp.

    Parameters
    ----------
    file : str
        Path of a CSV, MAT, HDF5 or UFF 58 file, relative to the case, at least as long as the ramp; its mean is
        removed.
    channel : str
        Channel of the file (N m).
    time_channel : str
        Channel of the time (s); not used where the file has a time axis.
    """

    file: str
    channel: str = "torque"
    time_channel: str = "time"

    @cached_property
    def drive(self) -> Fluctuation:
        """Fluctuation in the form of the dynamics."""
        record = read_record(Path(self.file))
        stated = record.units.get(self.channel, "N m")
        require(
            stated.replace(" ", "").replace("*", "").replace("·", "") == "Nm",
            f"{self.file}: channel {self.channel!r} is in {stated!r} by the file: convert it to N m",
        )
        return _record_drive(self, "torque", record, 1.0)


def _record_drive(
    given: SpeedRecord | TorqueRecord, quantity: Literal["torque", "speed"], record: Record, factor: float
) -> Fluctuation:
    values, time = factor * record.values(given.channel), record.time_of([given.channel])
    try:
        return Fluctuation(quantity, time=record.values(given.time_channel) if time is None else time, values=values)
    except InputError as error:
        raise InputError(f"{given.file}: {error}") from None
