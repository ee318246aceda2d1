"""Signs, phases and reference values that every stage shares.

Time factor e^{+jωt}; outward surface normals; spectra are single-sided complex peak amplitudes, so that
x(t) = Re(X e^{jωt}) and levels use RMS = |X|/√2; SI units and radians inside, Hz on stored frequency axes.
The gearbox frame has z along the shafts, x and y in the transverse plane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

from nvhchain.dimensions import Modulus
from nvhchain.errors import require

REFERENCE_PRESSURE = 20e-6
"""Pa (RMS), 0 dB of sound pressure level, ISO 1683."""

REFERENCE_POWER = 1e-12
"""W, 0 dB of sound power level, ISO 1683."""

REFERENCE_VELOCITY = 1e-9
"""m/s, 0 dB of vibratory velocity level, ISO 1683."""

REFERENCE_FORCE = 1e-6
"""N, 0 dB of vibratory force level, ISO 1683."""

Progress = Callable[[int, int], None]
"""What a stage calls with (steps done, steps in all) while it works."""


@dataclass(frozen=True)
class Air:
    """The fluid around the body.

    speed_of_sound: m/s, 1 … 10 000.  density: kg/m³, 1e-3 … 2000.
    """

    speed_of_sound: float = 343.0
    density: float = 1.21

    def __post_init__(self) -> None:
        for name, low, high, unit in (("speed_of_sound", 1.0, 1e4, "m/s"), ("density", 1e-3, 2e3, "kg/m³")):
            value = getattr(self, name)
            require(
                isfinite(value) and low <= value <= high,
                f"air {name} = {value} {unit} is outside {low:g}…{high:g} {unit}: give it in {unit}",
            )

    @property
    def impedance(self) -> float:
        """Characteristic impedance ρc, Pa s/m."""
        return self.density * self.speed_of_sound


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic solid.  young: Pa.  poisson: 0 … 0.5.  density: kg/m³."""

    young: Modulus
    poisson: float
    density: float

    def __post_init__(self) -> None:
        for name, low, high, unit in (
            ("young", 1e6, 2e12, "Pa"),
            ("poisson", 0.0, 0.499, ""),
            ("density", 10.0, 3e4, "kg/m³"),
        ):
            value = getattr(self, name)
            require(
                isfinite(value) and low <= value <= high,
                f"material {name} = {value} {unit} is outside {low:g}…{high:g} {unit}: give it in SI units",
            )


STEEL = Material(young=210e9, poisson=0.3, density=7850.0)
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)
