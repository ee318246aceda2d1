"""Hand-offs of sound: pressure in the field and on the surface, power, efficiency and directivity."""

from __future__ import annotations

from nvhchain.handoff.accuracy import SoundAccuracy
from nvhchain.handoff.base import ComplexArray, FloatArray, HandOff
from nvhchain.handoff.declared import Label, array, value
from nvhchain.handoff.surface import Surface


class FieldPressure(HandOff):
    """Sound pressure at field points."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    points: FloatArray = array("m", "point, axis", "field points")
    pressure: ComplexArray = array("Pa", "frequency, point", "sound pressure, peak")
    input_speed: float = value("rad/s", "speed of the input shaft, 0 if there is none", default=0.0)
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())
    point_names: tuple[Label, ...] | None = array("", "point", "names of the field points", default=None)


class PressureHistory(HandOff):
    """Sound pressure in time at field points."""

    time: FloatArray = array("s", "time", "time, uniform", fewest=2)
    points: FloatArray = array("m", "point, axis", "field points")
    pressure: FloatArray = array("Pa", "time, point", "sound pressure")
    input_speed: FloatArray = array("rad/s", "time", "speed of the input shaft", spread=True)
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())
    point_names: tuple[Label, ...] | None = array("", "point", "names of the field points", default=None)


class SurfacePressure(HandOff):
    """Sound pressure at the vertices of the radiating surface."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    pressure: ComplexArray = array("Pa", "frequency, vertex", "sound pressure at the vertices, peak")
    surface: Surface = value("", "radiating surface")
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())


class SoundPower(HandOff):
    """Time-averaged radiated sound power."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    power: FloatArray = array("W", "frequency", "radiated sound power, time average")
    input_speed: float = value("rad/s", "speed of the input shaft, 0 if there is none", default=0.0)
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())


class RadiationEfficiency(HandOff):
    """Radiation efficiency of a moving surface at the lines of its motion."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    efficiency: FloatArray = array("1", "frequency", "sound power over that of plane waves from every face, ρcS⟨v²⟩")
    input_speed: float = value("rad/s", "speed of the input shaft, 0 if there is none", default=0.0)
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())


class Directivity(HandOff):
    """Directivity of a source at the lines of its sound."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    points: FloatArray = array("m", "point, axis", "field points")
    index: FloatArray = array("dB", "frequency, point", "level at a point over that of the same power spread evenly")
    input_speed: float = value("rad/s", "speed of the input shaft, 0 if there is none", default=0.0)
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())
