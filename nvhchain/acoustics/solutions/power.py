"""Radiated sound power from the waves that leave the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.accuracy.cancellation import cancellation_resistance
from nvhchain.acoustics.solutions.quantity import Line, Quantity
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.acoustics.systems.engines import workers
from nvhchain.acoustics.systems.linear_system import System
from nvhchain.acoustics.waves.interference import squared_waves, waves_memory
from nvhchain.conventions import Air
from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface, SurfaceVelocity

FASTEST = 1e140
"""Largest normal velocity (m/s) whose squared results do not overflow."""


def check_speed(velocity: SurfaceVelocity) -> None:
    """Raise InputError for normal velocities whose power overflows."""
    fastest = float(np.abs(velocity.normal_velocity).max(initial=0.0))
    require(
        fastest <= FASTEST,
        f"normal velocities of {fastest:.3g} m/s have no sound power in double precision, at most {FASTEST:g} have: "
        "scale them down",
    )


@dataclass(frozen=True, eq=False)
class Power(Quantity):
    """Sound power (W), and that of the error where parts of the motion cancel: (2,).

    top : highest wavenumber (rad/m).
    digits : decimal digits of the spherical waves.
    """

    step, knobs = "sound_power", ("multipole_digits",)

    surface: Surface
    air: Air
    plane: RigidPlane | None
    top: float
    digits: float

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        return (2,)

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        return 0, workers(frequencies) * waves_memory(self.surface, self.top, self.plane, self.digits)

    def moves(self, frequency: FloatArray, *rows: ComplexArray) -> NDArray[np.bool_]:
        """Return the lines (n_f,) that need a system."""
        (normal_velocity,) = rows
        return np.asarray((frequency > 0) & normal_velocity.any(axis=1))

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return power and error power at one frequency."""
        (normal_velocity,) = row
        surface, k = self.surface, line.wavenumber
        gradient = -1j * line.omega * self.air.density * (velocity_within_faces(surface) @ normal_velocity)
        pressure = system.solve(system.apply_b(gradient))
        error = cancellation_resistance(surface, k, pressure[:, None], self.plane, line.quadrature_error)
        power = squared_waves(surface, k, pressure, gradient, self.plane, self.digits)
        return np.asarray(np.array([power, error[0, 0]], dtype=complex) / (2 * self.air.impedance), dtype=complex)
