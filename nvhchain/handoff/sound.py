"""Sound: pressure in the field and on the surface, and power."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.errors import require
from nvhchain.handoff.base import (
    ComplexArray,
    FloatArray,
    HandOff,
    array,
    frequencies,
    increasing,
    speed_history,
)
from nvhchain.handoff.surface import Surface


@dataclass(frozen=True, eq=False)
class FieldPressure(HandOff):
    """Sound pressure at field points.

    frequency: (n_f,) Hz.  points: (n_point, 3) m.  pressure: (n_f, n_point) complex Pa, peak.
    input_speed: rad/s of the input shaft at constant speed, 0 when there is none.
    """

    frequency: FloatArray
    points: FloatArray
    pressure: ComplexArray
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        points = array(self, "points", float, (None, 3))
        array(self, "pressure", complex, (len(frequency), len(points)))
        object.__setattr__(self, "input_speed", float(self.input_speed))


@dataclass(frozen=True, eq=False)
class PressureHistory(HandOff):
    """Sound pressure in time at field points.

    time: (n_t,) s, uniform.  points: (n_point, 3) m.  pressure: (n_t, n_point) Pa.
    input_speed: (n_t,) rad/s of the input shaft (a scalar is spread over the record).
    """

    time: FloatArray
    points: FloatArray
    pressure: FloatArray
    input_speed: FloatArray

    def __post_init__(self) -> None:
        time = array(self, "time", float, (None,))
        points = array(self, "points", float, (None, 3))
        increasing(self, "time")
        require(len(time) >= 2, f"PressureHistory.time has {len(time)} samples: at least 2 are needed")
        array(self, "pressure", float, (len(time), len(points)))
        speed_history(self, len(time))


@dataclass(frozen=True, eq=False)
class SurfacePressure(HandOff):
    """Sound pressure at the vertices of the radiating surface.

    frequency: (n_f,) Hz.  pressure: (n_f, n_v) complex Pa, peak.  surface: the radiating surface.
    """

    frequency: FloatArray
    pressure: ComplexArray
    surface: Surface

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        array(self, "pressure", complex, (len(frequency), len(self.surface.vertices)))


@dataclass(frozen=True, eq=False)
class SoundPower(HandOff):
    """Time-averaged radiated sound power.

    frequency: (n_f,) Hz.  power: (n_f,) W.  input_speed: rad/s of the input shaft, 0 when there is none.
    """

    frequency: FloatArray
    power: FloatArray
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        array(self, "power", float, (len(frequency),))
        object.__setattr__(self, "input_speed", float(self.input_speed))


@dataclass(frozen=True, eq=False)
class RadiationEfficiency(HandOff):
    """How well a moving surface radiates, at the lines at which it moves.

    frequency: (n_f,) Hz.  efficiency: (n_f,) sound power over that of plane waves from every face, ρcS⟨v²⟩.
    input_speed: rad/s of the input shaft, 0 when there is none.
    """

    frequency: FloatArray
    efficiency: FloatArray
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        array(self, "efficiency", float, (len(frequency),))
        object.__setattr__(self, "input_speed", float(self.input_speed))


@dataclass(frozen=True, eq=False)
class Directivity(HandOff):
    """Where to a source radiates, at the lines at which it does.

    frequency: (n_f,) Hz.  points: (n_point, 3) m.  index: (n_f, n_point) dB, level at a point over that of the same
    power spread evenly.  input_speed: rad/s of the input shaft, 0 when there is none.
    """

    frequency: FloatArray
    points: FloatArray
    index: FloatArray
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        points = array(self, "points", float, (None, 3))
        array(self, "index", float, (len(frequency), len(points)))
        object.__setattr__(self, "input_speed", float(self.input_speed))
