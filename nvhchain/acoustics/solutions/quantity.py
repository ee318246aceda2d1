"""Quantities of an exterior problem: values from one boundary element system per frequency."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.systems.linear_system import System
from nvhchain.handoff import ComplexArray, FloatArray


class Line(NamedTuple):
    """One frequency above 0 Hz.

    Parameters
    ----------
    omega : float
        Angular frequency (rad/s).
    wavenumber : float
        Wavenumber (rad/m).
    quadrature_error : float
        Relative error of the quadrature.
    """

    omega: float
    wavenumber: float
    quadrature_error: float


class Quantity(Protocol):
    """Values at every frequency, from the system there and, for some quantities, from a row of input.

    Quantities are frozen dataclasses: workers receive them, and their content identifies checkpoints.

    Attributes
    ----------
    step : str
        Name in provenance and checkpoints.
    knobs : tuple of str
        Fields of the fidelity that affect the values, besides those of the system.
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
