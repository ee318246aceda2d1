"""Values of a component's attributes in SI units."""

from __future__ import annotations

import base64
import binascii
import struct
from collections.abc import Mapping
from math import isfinite, pi
from typing import Any

from nvhchain.interop.rexs.contents.document import Attribute, Component
from nvhchain.interop.rexs.contents.findings import Findings
from nvhchain.interop.rexs.contents.names import VALUES
from nvhchain.interop.rexs.contents.units import UNITS, plain

_USUAL = {"m": 1e-3, "rad": pi / 180, "rad/s": 2 * pi / 60, "Pa": 1e6, "kg/m³": 1e3, "W": 1e3, "N m/rad": 1e-3}
"""Factor to SI of the unit that the specification gives, for attributes without unit."""

_SMALL = ("clearance", "preload_distance", "misalignment_in", "allowance_referenced_to_span")
"""Parts of the names of lengths that the specification gives in micrometres."""

_CODES = {"float32": "f", "float64": "d", "int32": "i"}


class Values:
    """Reader of one component's attributes.

    findings: record that takes mistakes.
    attributes: attributes in place of the component's own, such as those of a load case.
    """

    def __init__(
        self, component: Component, findings: Findings, attributes: Mapping[str, Attribute] | None = None
    ) -> None:
        self.component = component
        self._findings = findings
        self._attributes = component.attributes if attributes is None else attributes

    def __contains__(self, name: str) -> bool:
        return name in self._attributes and self._attributes[name].value not in ("", None)

    def number(self, name: str, unit: str = "", *, low: float = -1e30, high: float = 1e30) -> float | None:
        """Return a number in SI units, or None where it is missing or wrong.

        unit: SI unit that it must have.
        low, high: limits (SI); a value outside is a mistake.
        """
        if name not in self:
            return None
        attribute = self._attributes[name]
        factor = self._factor(name, attribute, unit)
        value = _read_number(attribute.value)
        if factor is None:
            return None
        if value is None:
            self._findings.refuse(
                f"{self.component.label}: {name} = {str(attribute.value)[:40]!r} is no finite number: correct it"
            )
            return None
        value *= factor
        if not low <= value <= high:
            self._findings.refuse(
                f"{self.component.label}: {name} = {value:.6g} {unit} is outside {low:g}…{high:g} {unit}: correct it"
            )
            return None
        return value

    def vector(self, name: str, unit: str = "") -> list[float] | None:
        """Return an array of numbers in SI units, or None where it is missing or wrong.

        unit: SI unit.
        """
        if name not in self:
            return None
        attribute = self._attributes[name]
        factor, raw = self._factor(name, attribute, unit), attribute.value
        if isinstance(raw, tuple):
            raw = _decoded(*raw)
        values = [_read_number(entry) for entry in raw] if isinstance(raw, list) else []
        if factor is None:
            return None
        if not values or any(value is None for value in values):
            self._findings.refuse(f"{self.component.label}: {name} is no array of finite numbers: correct it")
            return None
        return [factor * value for value in values if value is not None]

    def text(self, name: str) -> str:
        """Return a text or choice; empty where it is missing."""
        value = str(self._attributes[name].value) if name in self else ""
        return VALUES.get(value, value)

    def flag(self, name: str) -> bool | None:
        """Return a flag, or None where it is missing."""
        value = self.text(name).strip().lower()
        return {"true": True, "1": True, "false": False, "0": False}.get(value)

    def _factor(self, name: str, attribute: Attribute, unit: str) -> float | None:
        """Return the factor to SI, or None, with a mistake, for a unit that does not fit."""
        given = plain(attribute.unit)
        if given in ("", "none"):
            if unit == "m" and any(part in name for part in _SMALL):
                return 1e-6
            named = {"load_rating": 1e3, "time_fraction": 0.01}
            return next((scale for end, scale in named.items() if name.endswith(end)), _USUAL.get(unit, 1.0))
        if given not in UNITS:
            text = f"the unit {attribute.unit!r} is none of REXS: correct it, first at"
            if not any(mistake.startswith(text) for mistake in self._findings.mistakes):
                self._findings.refuse(f"{text} {name} of {self.component.label}")
            return None
        given_unit, factor = UNITS[given]
        if given_unit != unit:
            self._findings.refuse(
                f"{self.component.label}: {name} is in {attribute.unit!r}, which is no unit for {unit or 'a ratio'}: "
                "correct it"
            )
            return None
        return factor


def _read_number(value: Any) -> float | None:
    if isinstance(value, bool):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if isfinite(number) else None


def _decoded(code: Any, text: Any) -> list[float]:
    """Return the numbers of a coded array (Base64, little endian); empty where it is damaged."""
    try:
        data = base64.b64decode(str(text), validate=True)
        letter = _CODES[str(code)]
        return [float(x) for x in struct.unpack(f"<{len(data) // struct.calcsize(letter)}{letter}", data)]
    except (KeyError, binascii.Error, struct.error, ValueError):
        return []
