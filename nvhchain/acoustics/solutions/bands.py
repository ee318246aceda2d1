"""Values of a quantity in one band of frequencies, by boundary elements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nvhchain.acoustics.solutions.quantity import Line, Quantity
from nvhchain.acoustics.systems.engines import solve_each, systems
from nvhchain.acoustics.systems.frequency_blocks import Solved
from nvhchain.acoustics.systems.linear_system import System
from nvhchain.handoff import ComplexArray, FloatArray

if TYPE_CHECKING:
    from nvhchain.acoustics.solutions.exterior import ExteriorProblem


def band_values(
    frequency: FloatArray,
    *rows: ComplexArray,
    problem: ExteriorProblem,
    quantity: Quantity,
    task: tuple[int, float],
) -> Solved:
    """Return values of one band and their solver record; `task` holds bytes for systems and the quadrature error."""
    memory, quadrature_error = task
    values = np.zeros((len(frequency), *quantity.shape), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(quantity.moves(frequency, *rows))
    wavenumbers = omega[solved] / problem.air.speed_of_sound

    def solve(number: int, system: System) -> None:
        at = solved[number]
        line = Line(omega[at], float(wavenumbers[number]), quadrature_error)
        values[at] = quantity.values(system, line, *(row[at] for row in rows))

    batches = systems(problem.engine, problem.surface, wavenumbers, problem.fidelity, problem.plane, memory)
    return Solved(values, solve_each(batches, solve))
