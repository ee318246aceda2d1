"""Dimensions of quantities in case files, declared with each field, and the unit suffixes of their keys.

A number without a dimension here (a ratio, a force, a frequency) is in SI units, and its key has no unit suffix.
"""

from __future__ import annotations

import types
import typing
from math import pi
from typing import Annotated, Any

Length = Annotated[float, "m"]
Angle = Annotated[float, "rad"]
AngularSpeed = Annotated[float, "rad/s"]
Inertia = Annotated[float, "kg m²"]
Modulus = Annotated[float, "Pa"]


class Unstated(float):
    """Default of a field that other fields of its table may give; a number like any other."""

    __slots__ = ()


UNITS: dict[str, tuple[str, float]] = {
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "deg": ("rad", pi / 180),
    "mrad": ("rad", 1e-3),
    "rpm": ("rad/s", 2 * pi / 60),
    "kg_cm2": ("kg m²", 1e-4),
    "GPa": ("Pa", 1e9),
}
"""Suffix of a key → SI unit of the fields that accept it, factor to that unit."""


def strip_unit(key: str) -> str:
    """Return a key without the suffix of its unit."""
    suffix = next((f"_{unit}" for unit in UNITS if key.endswith(f"_{unit}")), "")
    return key.removesuffix(suffix)


def si_unit(hint: Any) -> str | None:
    """Return the SI unit in a field's annotation (with extras); None if its keys have no unit suffix."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        return str(inner[1])
    if origin in (tuple, typing.Union, types.UnionType):
        return next(filter(None, map(si_unit, inner)), None)
    return None
