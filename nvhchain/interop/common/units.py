"""Unit systems of files that do not state theirs: finite element codes calculate with whatever is consistent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from nvhchain.conventions import Material
from nvhchain.errors import InputError


@dataclass(frozen=True)
class UnitSystem:
    """A consistent system.  length: m, mass: kg, time: s per unit of the file."""

    name: str
    length: float
    mass: float
    time: float

    @property
    def stress(self) -> float:
        """Pa per unit."""
        return self.mass / (self.length * self.time**2)

    @property
    def density(self) -> float:
        """kg/m³ per unit."""
        return self.mass / self.length**3

    def material(self, young: float, poisson: float, density: float, where: str) -> Material:
        """Material in SI from numbers of the file.  Raises InputError that names the unit system."""
        try:
            return Material(young * self.stress, poisson, density * self.density)
        except InputError as error:
            others = ", ".join(name for name in UNIT_SYSTEMS if name != self.name)
            raise InputError(
                f"{where}: E = {young:g}, density {density:g} read in {self.name}: {error}; the file may be in {others}"
            ) from None


UNIT_SYSTEMS: Mapping[str, UnitSystem] = MappingProxyType(
    {
        system.name: system
        for system in (
            UnitSystem("m-kg-s", 1.0, 1.0, 1.0),
            UnitSystem("mm-t-s", 1e-3, 1e3, 1.0),
            UnitSystem("mm-kg-ms", 1e-3, 1.0, 1e-3),
            UnitSystem("in-lbf-s", 0.0254, 4.4482216152605 / 0.0254, 1.0),
        )
    }
)
"""SI; millimetre, tonne, second (N, MPa); millimetre, kilogram, millisecond (kN, GPa); inch, pound force, second."""


def unit_system(name: str) -> UnitSystem:
    """The system called `name`.  Raises InputError for another name."""
    if name not in UNIT_SYSTEMS:
        raise InputError(f"unit system {name!r} is not known: use {', '.join(UNIT_SYSTEMS)}")
    return UNIT_SYSTEMS[name]
