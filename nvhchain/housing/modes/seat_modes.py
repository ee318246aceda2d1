"""Normal modes of a housing and the residual flexibility of the excluded modes for unit forces at its seats.

Held housing: R = K⁻¹ − Σ φ_r φ_rᵀ / ω_r² (MacNeal, Computers & Structures 1, 1971).

Free housing: the elastic flexibility Aᵀ K_c⁻¹ A replaces K⁻¹ (Craig & Kurdila, Fundamentals of Structural Dynamics, 2nd
ed., §17.6). A = I − M φ₀ φ₀ᵀ balances a force with the inertia of the rigid modes φ₀ (inertia relief). K_c is K held at
as many unknowns as there are rigid modes. The balanced forces cause no reaction there, so their choice does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import SolverError
from nvhchain.fem import Factor, factorize, lowest_modes, modes_below
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
    residual : (n, 3 n_seat) residual flexibility (m/N).
    residual_mass : (3 n_seat, 3 n_seat) residualᵀ M residual (kg m²/N²).
    seats : (3 n_seat,) unknowns of the seats.
    """

    frequency: FloatArray
    shapes: FloatArray
    residual: FloatArray
    residual_mass: FloatArray
    seats: IntArray


def seat_modes(K: sp.csr_matrix, M: sp.csr_matrix, count: int, f_top: float) -> SeatModes:
    """Return normal modes up to f_top (Hz), rigid ones included, and the residual of unit forces at the `count` seats.

    K, M : (n, n) with the six unknowns of every seat at the end (`rigid_map`).

    A K that cannot be factored belongs to a free structure. Raises SolverError if a mode does not converge.
    """
    seats = seat_unknowns(K.shape[0], count)
    load = np.zeros((K.shape[0], len(seats)))
    load[seats, np.arange(len(seats))] = 1.0
    below = modes_below(K, M, f_top)  # before the factors of K: one of the two is in memory at a time
    held, factor = False, _factored(K)
    if factor is not None:
        with factor:
            static = factor.solve(load)
            held = _slowest(K, M, static) > RIGID * f_top
            if held:
                frequency, shapes = lowest_modes(K, M, f_top, factor=factor, count=below)
    if not held:
        frequency, shapes = lowest_modes(K, M, f_top, count=below)
        frequency = np.where(frequency < RIGID * f_top, 0.0, frequency)
        static = _inertia_relief(K, M, shapes[:, frequency == 0], load)
    elastic = shapes[:, frequency > 0]
    omega2 = (2 * np.pi * frequency[frequency > 0]) ** 2
    residual = static - elastic @ (elastic[seats].T / omega2[:, None])
    residual[seats] = (residual[seats] + residual[seats].T) / 2
    return SeatModes(frequency, shapes, residual, residual.T @ (M @ residual), seats)


def _factored(K: sp.csr_matrix) -> Factor | None:
    """Return the factors of K, or None if K is singular."""
    try:
        return factorize(K)
    except SolverError:
        return None


def seat_unknowns(unknowns: int, seats: int) -> IntArray:
    """Return the numbers (3 · seats,) of the seat translations; six unknowns of each reference point come last."""
    first = unknowns - 6 * np.arange(seats, 0, -1)
    return np.asarray((first[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def _slowest(K: sp.csr_matrix, M: sp.csr_matrix, motion: FloatArray) -> float:
    """Return the lowest Rayleigh quotient (Hz) of some motions; rigid motions prevail if K is singular to rounding."""
    energy = np.einsum("ij,ij->j", motion, K @ motion) / np.einsum("ij,ij->j", motion, M @ motion)
    return float(np.sqrt(energy.min().clip(0))) / (2 * np.pi)


def _inertia_relief(K: sp.csr_matrix, M: sp.csr_matrix, rigid: FloatArray, load: FloatArray) -> FloatArray:
    """Return the elastic displacement (n, k) under loads (n, k) that the inertia of the rigid modes (n, r) balances."""
    unknowns, count = rigid.shape
    if count == 0:
        raise SolverError("the stiffness matrix is singular, but no rigid mode was found: is a part badly scaled?")
    balanced = load - M @ (rigid @ (rigid.T @ load))
    # the r unknowns in which the rigid modes differ most from one another
    hold = scipy.linalg.qr(rigid.T, mode="r", pivoting=True)[1][:count]
    free = np.setdiff1d(np.arange(unknowns), hold)
    displacement = np.zeros_like(load)
    with factorize(sp.csr_matrix(K[free][:, free])) as factor:
        displacement[free] = factor.solve(balanced[free])
    return np.asarray(displacement - rigid @ (rigid.T @ (M @ displacement)))
