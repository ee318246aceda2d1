"""Units of recorded channels, and their names in files."""

from __future__ import annotations

import re
from math import pi

_KGF, _LBF, _PDL = 9.80665, 4.4482216152605, 0.138254954376
_FOOT, _INCH = 0.3048, 0.0254

FORCE_UNITS = {
    "N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "cN": 1e-2, "kgf": _KGF, "lbf": _LBF, "pdl": _PDL,
}  # fmt: skip
"""Newtons in one unit; kgf, lbf and the poundal by their definitions (BIPM, NIST SP 811)."""

MOMENT_UNITS = {
    "N m": 1.0, "kN m": 1e3, "MN m": 1e6, "N mm": 1e-3, "mN m": 1e-3, "mN mm": 1e-6, "cN cm": 1e-4, "kgf m": _KGF,
    "kgf mm": _KGF * 1e-3, "lbf ft": _LBF * _FOOT, "lbf in": _LBF * _INCH, "pdl ft": _PDL * _FOOT,
}  # fmt: skip
"""Newton metres in one unit."""

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
"""Seconds in one unit."""

SPEED_UNITS = {"rad/s": 1.0, "rpm": 2.0 * pi / 60.0, "Hz": 2.0 * pi}
"""Radians per second in one unit; Hz counts turns per second."""

LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
"""Metres in one unit."""

ANGLE_UNITS = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": pi / 180.0}
"""Radians in one unit."""

OTHER_NAMES = {
    "N": ("newton", "newtons"),
    "kN": ("kilonewton", "kilonewtons"),
    "MN": ("meganewton", "meganewtons"),
    "mN": ("millinewton", "millinewtons"),
    "cN": ("centinewton", "centinewtons"),
    "kgf": ("kp",),
    "pdl": ("poundal", "poundals"),
    **{unit: tuple(unit.replace(" ", mark) for mark in ("", *"*·⋅-.")) for unit in MOMENT_UNITS},
    "N m": ("Nm", "N*m", "N·m", "N⋅m", "N-m", "N.m", "newton metre", "newton metres", "newton meter", "newton meters"),
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "us": ("µs", "usec", "microsecond", "microseconds"),
    "rad/s": ("rad/sec", "radian/s", "radians/s"),
    "rpm": ("1/min", "r/min", "rev/min", "min-1", "min^-1"),
    "Hz": ("hertz",),
    "m": ("meter", "meters", "metre", "metres"),
    "mm": ("millimeter", "millimeters", "millimetre", "millimetres"),
    "um": ("µm", "micrometer", "micrometers", "micrometre", "micrometres"),
    "rad": ("radian", "radians"),
    "urad": ("µrad",),
    "deg": ("°", "degree", "degrees"),
}
"""Names of a unit in files, beside its symbol."""

_QUANTITIES = (FORCE_UNITS | MOMENT_UNITS, TIME_UNITS, SPEED_UNITS, LENGTH_UNITS, ANGLE_UNITS)
_NAMES = {
    name: symbol for quantity in _QUANTITIES for symbol in quantity for name in (symbol, *OTHER_NAMES.get(symbol, ()))
}
_ANY_CASE = {
    name.casefold(): symbol
    for name, symbol in _NAMES.items()
    if not name.casefold().startswith("mn")  # MN and mN need their case
}
_LAST_BRACKETS = re.compile(r"\[([^][]*)\](?:\[[\d,]+\])?$")


def unit_called(text: str) -> str | None:
    """Return the symbol of the unit called `text`, in brackets or not, in any case that is unambiguous."""
    name = text.strip()
    if name[:1] + name[-1:] in ("[]", "()"):
        name = name[1:-1].strip()
    return _NAMES.get(name) or _ANY_CASE.get(name.casefold())


def unit_in_name(channel: str, expected: str) -> str | None:
    """Return the unit at the end of a channel's name, if it measures the quantity of `expected`.

    Examples are kN in `Fx [kN]` or its column `Fx [kN][0]`. Forces and moments count as one quantity: they must not be
    mistaken for each other.
    """
    brackets = _LAST_BRACKETS.search(channel)
    unit = unit_called(brackets.group(1)) if brackets else None
    return unit if any(unit in quantity and expected in quantity for quantity in _QUANTITIES) else None
