"""Unit systems of files that do not state theirs: finite element codes accept any consistent system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from nvhchain.conventions import Material
from nvhchain.errors import InputError


@dataclass(frozen=True)
class UnitSystem:
    """Consistent unit system: length in m, mass in kg, time in s per unit of the file."""

    name: str
    length: float
    mass: float
    time: float

    @property
    def stress(self) -> float:
        """Stress in Pa per unit."""
        return self.mass / (self.length * self.time**2)

    @property
    def force(self) -> float:
        """Force in N per unit."""
        return self.mass * self.length / self.time**2

    @property
    def density(self) -> float:
        """Density in kg/m³ per unit."""
        return self.mass / self.length**3

    def material(self, young: float, poisson: float, density: float, place: str) -> Material:
        """Return a material in SI from numbers of the file; InputError names the unit system."""
        try:
            return Material(young * self.stress, poisson, density * self.density)
        except InputError as error:
            fault = str(error)
        stated = f"{place}: E = {young:g}, density {density:g} read in {self.name}"
        if density == 0:
            raise InputError(f"{stated}: without mass nothing vibrates: give the density")
        others = [
            other.name
            for other in UNIT_SYSTEMS.values()
            if other is not self and _plausible(young * other.stress, density * other.density)
        ]
        weight = density * self.density / (_GRAVITY / (self.length / self.time**2))
        if others:
            remedy = f"; the file may be in {', '.join(others)}"
        elif _plausible(young * self.stress, weight):
            remedy = (
                f"; as weight per volume it makes {weight:.4g} kg/m³: divide it by g = "
                f"{_GRAVITY / (self.length / self.time**2):g}, or in Nastran state PARAM, WTMASS"
            )
        else:
            remedy = "; no unit system makes sense of both: correct one"
        raise InputError(f"{stated}: {fault}{remedy}")


_GRAVITY = 9.80665
"""Standard gravity (m/s²)."""


def _plausible(young: float, density: float) -> bool:
    """Return True for values (Pa, kg/m³) of a solid that carries loads, from plastics to hard metal."""
    return 5e7 <= young <= 1e12 and 200.0 <= density <= 2.5e4


UNIT_SYSTEMS: Mapping[str, UnitSystem] = MappingProxyType(
    {
        system.name: system
        for system in (
            UnitSystem("m-kg-s", 1.0, 1.0, 1.0),
            UnitSystem("mm-t-s", 1e-3, 1e3, 1.0),
            UnitSystem("mm-kg-ms", 1e-3, 1.0, 1e-3),
            UnitSystem("mm-kg-s", 1e-3, 1.0, 1.0),
            UnitSystem("in-lbf-s", 0.0254, 4.4482216152605 / 0.0254, 1.0),
        )
    }
)
"""Systems by name.

SI; millimetre, tonne, second (N, MPa); millimetre, kilogram, millisecond (kN, GPa); millimetre, kilogram, second (mN,
kPa, of NX); inch, pound force, second.
"""


def unit_system(name: str) -> UnitSystem:
    """Return the system called `name`; InputError for another name."""
    if name not in UNIT_SYSTEMS:
        raise InputError(f"unit system {name!r} is not known: use {', '.join(UNIT_SYSTEMS)}")
    return UNIT_SYSTEMS[name]
