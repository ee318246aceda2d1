"""Units of REXS and their factors to SI."""

from __future__ import annotations

from math import pi

UNITS: dict[str, tuple[str, float]] = {
    "": ("", 1.0),
    "none": ("", 1.0),
    "-": ("", 1.0),
    "%": ("", 0.01),
    "mm": ("m", 1e-3),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mum": ("m", 1e-6),
    "µm": ("m", 1e-6),
    "μm": ("m", 1e-6),
    "um": ("m", 1e-6),
    "deg": ("rad", pi / 180),
    "°": ("rad", pi / 180),
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "1/min": ("rad/s", 2 * pi / 60),
    "rpm": ("rad/s", 2 * pi / 60),
    "min^-1": ("rad/s", 2 * pi / 60),
    "1/s": ("rad/s", 2 * pi),
    "Hz": ("Hz", 1.0),
    "rad/s": ("rad/s", 1.0),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "Nm": ("N m", 1.0),
    "kNm": ("N m", 1e3),
    "Nmm": ("N m", 1e-3),
    "W": ("W", 1.0),
    "kW": ("W", 1e3),
    "MW": ("W", 1e6),
    "N/m": ("N/m", 1.0),
    "N/mm": ("N/m", 1e3),
    "N/mum": ("N/m", 1e6),
    "N/µm": ("N/m", 1e6),
    "Nmm/rad": ("N m/rad", 1e-3),
    "Nm/rad": ("N m/rad", 1.0),
    "N/mm^2": ("Pa", 1e6),
    "MPa": ("Pa", 1e6),
    "GPa": ("Pa", 1e9),
    "Pa": ("Pa", 1.0),
    "kg/dm^3": ("kg/m³", 1e3),
    "kg/m^3": ("kg/m³", 1.0),
    "g/cm^3": ("kg/m³", 1e3),
    "kg": ("kg", 1.0),
    "g": ("kg", 1e-3),
    "mg": ("kg", 1e-6),
    "kgm^2": ("kg m²", 1.0),
    "mm^2/s": ("m²/s", 1e-6),
    "C": ("°C", 1.0),
    "°C": ("°C", 1.0),
    "s": ("s", 1.0),
    "h": ("s", 3600.0),
}
"""Unit without blanks → unit in SI, factor."""


def plain(unit: str) -> str:
    """Return a unit without blanks, and with one sign for powers."""
    return "".join(unit.split()).replace("²", "^2").replace("³", "^3").replace("·", "").replace("*", "")
