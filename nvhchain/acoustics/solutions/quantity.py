"""Quantity that an exterior problem is solved for: what one boundary element system per frequency has to give."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.systems.linear_system import System
from nvhchain.handoff import ComplexArray, FloatArray


class Line(NamedTuple):
    """One frequency above 0 Hz: angular frequency, rad/s, wavenumber, rad/m, and relative error of the quadrature."""

    omega: float
    wavenumber: float
    quadrature_error: float


class Quantity(Protocol):
    """Values at every frequency, from the system there and, for some, from a row of input.

    Quantities are frozen dataclasses: they go to workers, and finished blocks are kept under their content.

    Attributes
    ----------
    stage : str
        Name in provenance and checkpoints.
    knobs : tuple of str
        Fields of the fidelity that it depends on, beside those of the system.
    """

    stage: ClassVar[str]
    knobs: ClassVar[tuple[str, ...]] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        ...

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Bytes of all results, and of the columns of one block."""
        ...

    def values(self, system: System, line: Line, *row: Any) -> ComplexArray:
        """Values of this `shape` at one frequency."""
        ...

    def moves(self, frequency: FloatArray, *rows: ComplexArray) -> NDArray[np.bool_]:
        """Lines (n_f,) that need a system; the values are zero at others."""
        return np.asarray(frequency > 0)
