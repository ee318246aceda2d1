"""Quantities of an exterior problem: values from one boundary element system per frequency, band by band."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nvhchain.acoustics.surfaces.surface import real_numbers
from nvhchain.acoustics.systems.engines import solve_each, systems
from nvhchain.acoustics.systems.frequency_blocks import Solved
from nvhchain.acoustics.systems.linear_system import SinglePrecisionError, System
from nvhchain.errors import require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray

if TYPE_CHECKING:
    from nvhchain.acoustics.solutions.exterior import ExteriorProblem


class Line(NamedTuple):
    """One frequency above 0 Hz.

    omega : angular frequency (rad/s).
    wavenumber : wavenumber (rad/m).
    quadrature_error : relative error of the quadrature.
    """

    omega: float
    wavenumber: float
    quadrature_error: float


class Quantity(Protocol):
    """Values at every frequency, from the system there and, for some quantities, from a row of input.

    Quantities are frozen dataclasses: workers receive them, and their content identifies checkpoints.

    step : name in provenance and checkpoints.
    knobs : fields of the fidelity that affect the values, besides those of the system.
    """

    step: ClassVar[str]
    knobs: ClassVar[tuple[str, ...]] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        ...

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        ...

    def values(self, system: System, line: Line, *row: Any) -> ComplexArray:
        """Return values of this `shape` at one frequency."""
        ...

    def moves(self, frequency: FloatArray, *rows: ComplexArray) -> NDArray[np.bool_]:
        """Return the lines (n_f,) that need a system; the values are zero at others."""
        return np.asarray(frequency > 0)


def check_frequencies(frequencies: ArrayLike) -> FloatArray:
    """Return frequencies (Hz) as a strictly increasing (n_f,) array from 0 up; InputError otherwise."""
    f = np.atleast_1d(real_numbers(frequencies, "frequencies"))
    require(
        f.ndim == 1 and f.size > 0 and bool(np.isfinite(f).all()) and f[0] >= 0 and bool((np.diff(f) > 0).all()),
        "frequencies must be finite, not negative and strictly increasing, in Hz: sort them and drop repeated ones",
    )
    return f


def band_values(
    frequency: FloatArray, *rows: ComplexArray, problem: ExteriorProblem, quantity: Quantity, task: tuple[int, float]
) -> Solved:
    """Return values of one band and their solver record; `task` holds bytes for systems and the quadrature error.

    A band with a matrix that is singular to single precision is solved in double precision.
    """
    memory, quadrature_error = task
    values = np.zeros((len(frequency), *quantity.shape), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(quantity.moves(frequency, *rows))
    wavenumbers = omega[solved] / problem.air.speed_of_sound

    def solve(number: int, system: System) -> None:
        at = solved[number]
        line = Line(omega[at], float(wavenumbers[number]), quadrature_error)
        values[at] = quantity.values(system, line, *(row[at] for row in rows))

    def solved_by(fidelity: AcousticsFidelity) -> Solved:
        batches = systems(problem.engine, problem.surface, wavenumbers, fidelity, problem.plane, memory)
        return Solved(values, solve_each(batches, solve))

    try:
        return solved_by(problem.fidelity)
    except SinglePrecisionError:
        return solved_by(replace(problem.fidelity, precision="double"))
