"""Normal modes of a housing and the residual flexibility of the excluded modes for unit forces at its seats.

R = Σ φ_r φ_rᵀ / ω_r² over the excluded modes (MacNeal, Computers & Structures 1, 1971): of a held housing K⁻¹ less the
share of the modes. Of a free one it is the elastic flexibility less their share, with forces that the inertia of the
rigid modes balances (Craig & Kurdila, Fundamentals of Structural Dynamics, 2nd ed., §17.6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.fem import modes_and_residual
from nvhchain.handoff import FloatArray, IntArray

RIGID = 1e-5
"""Largest frequency of a rigid motion over the highest frequency asked for; structures on springs begin above it."""


@dataclass(frozen=True, eq=False)
class SeatModes:
    """Modes and residual flexibility.

    Parameters
    ----------
    frequency : (m,) natural frequencies (Hz), 0 for rigid modes.
    shapes : (n, m) mode shapes (kg^-½).
    residual : (n, motions · n_seat) residual flexibility (m/N).
    residual_mass : (motions · n_seat, …) residualᵀ M residual (kg m²/N²).
    seats : (motions · n_seat,) unknowns of the seats.
    """

    frequency: FloatArray
    shapes: FloatArray
    residual: FloatArray
    residual_mass: FloatArray
    seats: IntArray


def seat_modes(K: sp.csr_matrix, M: sp.csr_matrix, count: int, f_top: float, motions: int = 3) -> SeatModes:
    """Return normal modes up to f_top (Hz), rigid ones included, and the residual of unit forces at the `count` seats.

    K, M : (n, n) with the six unknowns of every seat at the end (`rigid_map`).
    motions : 3 for forces at the seats, 5 for forces and moments about x and y.

    Raises SolverError if a mode does not converge.
    """
    seats = seat_unknowns(K.shape[0], count, motions)
    load = np.zeros((K.shape[0], len(seats)))
    load[seats, np.arange(len(seats))] = 1.0
    frequency, shapes, residual = modes_and_residual(K, M, f_top, load)
    residual[seats] = (residual[seats] + residual[seats].T) / 2
    frequency = np.where(frequency < RIGID * f_top, 0.0, frequency)
    return SeatModes(frequency, shapes, residual, residual.T @ (M @ residual), seats)


def seat_unknowns(unknowns: int, seats: int, motions: int = 3) -> IntArray:
    """Return the numbers (motions · seats,) of the seats' motions; six unknowns of each reference point come last."""
    first = unknowns - 6 * np.arange(seats, 0, -1)
    return np.asarray((first[:, None] + np.arange(motions)).ravel(), dtype=np.int64)
