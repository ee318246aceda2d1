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
    "in": ("m", 25.4e-3),
    "deg": ("rad", pi / 180),
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "1/min": ("rad/s", 2 * pi / 60),
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
    "N/rad": ("N", 1.0),
    "Nmm/rad": ("N m/rad", 1e-3),
    "Nm/rad": ("N m/rad", 1.0),
    "N/mm2": ("Pa", 1e6),
    "MPa": ("Pa", 1e6),
    "GPa": ("Pa", 1e9),
    "Pa": ("Pa", 1.0),
    "kg/dm3": ("kg/m³", 1e3),
    "kg/m3": ("kg/m³", 1.0),
    "g/cm3": ("kg/m³", 1e3),
    "kg": ("kg", 1.0),
    "g": ("kg", 1e-3),
    "mg": ("kg", 1e-6),
    "kgm2": ("kg m²", 1.0),
    "mm2/s": ("m²/s", 1e-6),
    "C": ("°C", 1.0),
    "s": ("s", 1.0),
    "h": ("s", 3600.0),
}
"""Unit as `plain` returns it → unit in SI, factor."""

_SIGNS = str.maketrans({"²": "2", "³": "3", "μ": "µ", **dict.fromkeys("^·*⋅")})

_SPELLINGS = {
    **dict.fromkeys(("rpm", "min-1", "rev/min", "r/min", "u/min"), "1/min"),
    **dict.fromkeys(("degree", "degrees", "°"), "deg"),
    **dict.fromkeys(("µm", "um", "micron", "microns"), "mum"),
    **dict.fromkeys(("inch", "inches"), "in"),
    **dict.fromkeys(("°c", "degc"), "C"),
    "s-1": "1/s",
    **dict.fromkeys(("n/µm", "n/um"), "N/mum"),
}
"""Other spellings, in small letters, of units of REXS."""


def plain(unit: str) -> str:
    """Return a unit in the spelling of `UNITS`, without blanks and signs of products and powers."""
    short = "".join(unit.split()).translate(_SIGNS)
    small = short.lower()
    mega = short[:1] == "M" and short[1:].islower()  # Mg and Mm are no mg and mm
    return _SPELLINGS.get(small) or (small if short not in UNITS and small in UNITS and not mega else short)
