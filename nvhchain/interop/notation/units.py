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
            fault = str(error).rpartition(": ")[0]
        stated = f"{place}: E = {young:g}, density {density:g} read in {self.name}"
        if density == 0:
            raise InputError(f"{stated}: without mass nothing vibrates: give the density")
        own, gravity = (young * self.stress, density * self.density), _GRAVITY / (self.length / self.time**2)
        others = {
            name: (young * system.stress, density * system.density)
            for name, system in UNIT_SYSTEMS.items()
            if system != self
        }
        heavy = [name for name, system in UNIT_SYSTEMS.items() if _metal(own[0], density * system.density)]
        remedy = "; no unit system makes sense of both: correct one"
        if metals := [name for name, values in others.items() if _metal(*values)]:
            remedy = f"; the file may be in {', '.join(metals)}"
        elif _metal(own[0], own[1] / gravity):
            remedy = (
                f"; as weight per volume it makes {own[1] / gravity:.4g} kg/m³: divide it by g = {gravity:g}, or in "
                "Nastran state PARAM, WTMASS"
            )
        elif heavy:
            remedy = f"; E fits {self.name}, the density is that of {' or '.join(heavy)}: correct it"
        elif plastics := [name for name, values in others.items() if _plastic(*values)]:
            remedy = f"; the file may be in {', '.join(plastics)}"
        raise InputError(f"{stated}: {fault}{remedy}")


_GRAVITY = 9.80665
"""Standard gravity (m/s²)."""

_METALS = (
    *((210e9, 7850.0), (110e9, 7200.0), (170e9, 7100.0), (70e9, 2700.0), (45e9, 1800.0)),
    *((85e9, 6600.0), (110e9, 4500.0), (110e9, 8700.0)),
)
"""E (Pa) and density (kg/m³) of steel, grey and ductile iron, aluminium, magnesium, zinc, titanium and brass."""


def _metal(young: float, density: float) -> bool:
    """Return True for values (Pa, kg/m³) near those of a metal of castings."""
    return any(abs(young / e - 1.0) < 0.3 and abs(density / rho - 1.0) < 0.15 for e, rho in _METALS)


def _plastic(young: float, density: float) -> bool:
    """Return True for values (Pa, kg/m³) of plastics, plain or with fibres."""
    return 1e9 <= young <= 6e10 and 800.0 <= density <= 2200.0


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
