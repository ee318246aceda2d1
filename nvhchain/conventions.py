"""Sign conventions, phase conventions, reference values and materials of all stages.

The time factor is e^{+jωt}.  Surface normals point outwards. Spectra are single-sided complex peak amplitudes: x(t) =
Re(X e^{jωt}).  Levels use RMS = |X|/√2. Units are SI and radians; stored frequency axes are in Hz. The gearbox frame
has z along the shafts, x and y in the transverse plane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nvhchain.dimensions import Modulus
from nvhchain.errors import require_within

__all__ = ["STEEL", "Air", "Material"]

REFERENCE_PRESSURE = 20e-6
"""Pressure of 0 dB sound pressure level (Pa, RMS), ISO 1683."""

REFERENCE_POWER = 1e-12
"""Power of 0 dB sound power level (W), ISO 1683."""

REFERENCE_VELOCITY = 1e-9
"""Velocity of 0 dB vibratory velocity level (m/s), ISO 1683."""

REFERENCE_FORCE = 1e-6
"""Force of 0 dB vibratory force level (N), ISO 1683."""

Progress = Callable[[int, int], None]
"""Callback for long computations, called with (steps done, steps in all)."""


@dataclass(frozen=True)
class Air:
    """Fluid around the body.

    Parameters
    ----------
    speed_of_sound : float
        Speed of sound (m/s), 1 … 10 000.
    density : float
        Density (kg/m³), 1e-3 … 2000.

    Raises
    ------
    InputError
        If a value is outside its range.
    """

    speed_of_sound: float = 343.0
    density: float = 1.21

    def __post_init__(self) -> None:
        for name, low, high, unit in (("speed_of_sound", 1.0, 1e4, "m/s"), ("density", 1e-3, 2e3, "kg/m³")):
            require_within(f"air {name}", getattr(self, name), low, high, unit)

    @property
    def impedance(self) -> float:
        """Characteristic impedance ρc (Pa s/m)."""
        return self.density * self.speed_of_sound


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic solid.

    Parameters
    ----------
    young : float
        Young's modulus (Pa), 1e6 … 2e12.
    poisson : float
        Poisson's ratio, 0 … 0.499.
    density : float
        Density (kg/m³), 10 … 3e4.

    Raises
    ------
    InputError
        If a value is outside its range.
    """

    young: Modulus
    poisson: float
    density: float

    def __post_init__(self) -> None:
        for name, low, high, unit, remedy in (
            ("young", 1e6, 2e12, "Pa", "steel has 2.1e11 Pa, which is young_GPa = 210"),
            ("poisson", 0.0, 0.499, "", "metals have about 0.3"),
            ("density", 10.0, 3e4, "kg/m³", "steel has 7850 kg/m³, 1000 times its g/cm³"),
        ):
            require_within(f"material {name}", getattr(self, name), low, high, unit, remedy)


STEEL = Material(young=210e9, poisson=0.3, density=7850.0)
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)
