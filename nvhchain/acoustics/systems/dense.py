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
"""Least residual that products in single precision reach with certainty."""

PRODUCTS = 30
"""Products with A per right-hand side that an iterative solution costs, in flops of a factorisation: 20 iterations at
two thirds of its rate."""

SETUP = 250
"""Products with A that the patches cost."""


def dense_system(a: ComplexArray, b: ComplexArray, positions: FloatArray, fidelity: AcousticsFidelity) -> System:
    """A p = B ∂p/∂n, solved as `fidelity.solver` says; A (n_v, n_v), which may be overwritten, and B (n_v, n_face).

    positions: (n_v, 3) m of the vertices.  Raises SolverError for matrices that cannot be factorised.
    """
    if fidelity.solver == "direct":
        return DirectSystem(a, b)
    if fidelity.solver == "iterative":
        return iterated(a, b, positions, fidelity)
    return CheapestSystem(a, b, positions, fidelity)


def iterated(a: ComplexArray, b: ComplexArray, positions: FloatArray, fidelity: AcousticsFidelity) -> IterativeSystem:
    """A p = B ∂p/∂n to be solved by GMRES; A and B are left as they are."""

    def patches() -> Patches:
        made = Patches(positions)
        made.fill(np.arange(len(a)), a)
        return made

    residual = max(fidelity.solver_residual, SINGLE_RESIDUAL if a.dtype == np.complex64 else 0.0)
    return IterativeSystem(DenseMatrix(a), DenseMatrix(b), patches, residual, fidelity.solver_iterations)


class CheapestSystem:
    """Iterates for few right-hand sides; factorises for many, and where the iteration does not converge."""

    def __init__(self, a: ComplexArray, b: ComplexArray, positions: FloatArray, fidelity: AcousticsFidelity) -> None:
        """Keep A (n_v, n_v) and B (n_v, n_face) until it is known for how many right-hand sides they are solved."""
        self._a, self._b, self._positions, self._fidelity = a, b, positions, fidelity
        self._iterative: System | None = None
        self._direct: System | None = None
        self.record = SolverRecord()

    def solve(self, rhs: ComplexArray) -> ComplexArray:
        """A⁻¹ rhs."""
        return self._solved(rhs, lambda system: system.solve(rhs))

    def adjoint(self, rhs: ComplexArray) -> ComplexArray:
        """Bᵀ A⁻ᵀ rhs."""
        return self._solved(rhs, lambda system: system.adjoint(rhs))

    def apply_b(self, gradient: ComplexArray) -> ComplexArray:
        """B · gradient."""
        return DenseMatrix(self._b).apply(gradient)

    def release(self) -> None:
        """Forget A, B and what was made of them."""
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

    def _recorded(self, solved: ComplexArray, by: System) -> ComplexArray:
        self.record += by.record
        return solved


def iteration_pays(unknowns: int, columns: int) -> bool:
    """Whether GMRES costs less than LU factors (8/3 n³ flops, n/3 products with A) for some right-hand sides."""
    return unknowns / 3 > PRODUCTS * max(columns, 2) + SETUP
