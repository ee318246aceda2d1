"""Dense boundary element systems: factorised, iterated, or whichever is cheaper."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nvhchain.acoustics.systems.iterative import IterativeSystem, Patches
from nvhchain.acoustics.systems.linear_system import DenseMatrix, DirectSystem, SolverRecord, System
from nvhchain.errors import SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray

SINGLE_RESIDUAL = 1e-6
"""Smallest residual that products in single precision reach reliably."""

PRODUCTS = 30
"""Cost of an iterative solution per right-hand side, in products with A at the rate of a factorisation. It stands for
20 iterations at two thirds of that rate."""

SETUP = 250
"""Cost of the patches, in products with A."""


def dense_system(a: ComplexArray, b: ComplexArray, positions: FloatArray, fidelity: AcousticsFidelity) -> System:
    """Return A p = B ∂p/∂n for `fidelity.solver`; A (n_v, n_v), which may be overwritten, and B (n_v, n_face).

    positions : (n_v, 3) m of the vertices.

    SolverError for matrices that cannot be factorised.
    """
    if fidelity.solver == "direct":
        return DirectSystem(a, b)
    if fidelity.solver == "iterative":
        return iterated(a, b, positions, fidelity)
    return CheapestSystem(a, b, positions, fidelity)


def iterated(a: ComplexArray, b: ComplexArray, positions: FloatArray, fidelity: AcousticsFidelity) -> IterativeSystem:
    """Return A p = B ∂p/∂n for GMRES; A and B remain unchanged."""

    def patches() -> Patches:
        made = Patches(positions)
        made.fill(np.arange(len(a)), a)
        return made

    residual = max(fidelity.solver_residual, SINGLE_RESIDUAL if a.dtype == np.complex64 else 0.0)
    return IterativeSystem(DenseMatrix(a), DenseMatrix(b), patches, residual, fidelity.solver_iterations)


class CheapestSystem:
    """System that iterates for few right-hand sides, and factorises for many or if the iteration does not converge."""

    def __init__(self, a: ComplexArray, b: ComplexArray, positions: FloatArray, fidelity: AcousticsFidelity) -> None:
        """Keep A (n_v, n_v) and B (n_v, n_face) until the number of right-hand sides is known."""
        self._a, self._b, self._positions, self._fidelity = a, b, positions, fidelity
        self._iterative: System | None = None
        self._direct: System | None = None
        self.record = SolverRecord()

    def solve(self, rhs: ComplexArray) -> ComplexArray:
        """Return A⁻¹ rhs."""
        return self._solved(rhs, lambda system: system.solve(rhs))

    def adjoint(self, rhs: ComplexArray) -> ComplexArray:
        """Return Bᵀ A⁻ᵀ rhs."""
        return self._solved(rhs, lambda system: system.adjoint(rhs))

    def apply_b(self, gradient: ComplexArray) -> ComplexArray:
        """Return B · gradient."""
        return DenseMatrix(self._b).apply(gradient)

    def release(self) -> None:
        """Release A, B and all results of them."""
        del self._a, self._b, self._iterative, self._direct

    def _solved(self, rhs: ComplexArray, solution: Callable[[System], ComplexArray]) -> ComplexArray:
        if self._direct is None and iteration_pays(len(self._a), rhs.size // len(rhs)):
            try:
                self._iterative = self._iterative or iterated(self._a, self._b, self._positions, self._fidelity)
                return self._recorded(solution(self._iterative), self._iterative)
            except SolverError:
                self._iterative = None
        self._direct = self._direct or DirectSystem(self._a, self._b)
        return self._recorded(solution(self._direct), self._direct)

    def _recorded(self, solved: ComplexArray, solver: System) -> ComplexArray:
        self.record += solver.record
        return solved


def iteration_pays(unknowns: int, columns: int) -> bool:
    """Return True if GMRES costs less than LU factors for `columns` right-hand sides.

    LU factors cost 8/3 n³ flops, or n/3 products with A.
    """
    return unknowns / 3 > PRODUCTS * max(columns, 2) + SETUP
