"""LU factors of a boundary element matrix: one factorisation, direct and adjoint solves."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from nvhchain.errors import SolverError
from nvhchain.handoff import ComplexArray


class Factor:
    """LU factors of a dense complex matrix A, made in A's own memory: A is overwritten."""

    def __init__(self, matrix: ComplexArray) -> None:
        """Factorise; `SolverError` if A holds values that are not finite or is singular to working precision."""
        norm = float(np.abs(matrix).sum(axis=1).max())  # the 1-norm of Aᵀ
        if not np.isfinite(norm):
            raise SolverError("boundary element matrix holds values that are not finite: the engine failed")
        # LAPACK wants columns in a row: the transposed view of a C-ordered array is one without a copy.
        self._lu, self._pivots, info = lapack.zgetrf(matrix.T, overwrite_a=True)
        reciprocal_condition, _ = lapack.zgecon(self._lu, norm) if info == 0 else (0.0, 0)
        if reciprocal_condition < len(matrix) * np.finfo(float).eps:
            raise SolverError(
                f"boundary element matrix of {len(matrix)} unknowns is singular to working precision (reciprocal "
                f"condition number {reciprocal_condition:.2g}): look for coinciding surfaces or very thin gaps"
            )

    def solve(self, rhs: ComplexArray) -> ComplexArray:
        """x (n,) or (n, m) of A x = rhs."""
        return self._solve(rhs, transposed=True)

    def solve_transposed(self, rhs: ComplexArray) -> ComplexArray:
        """x (n,) or (n, m) of Aᵀ x = rhs (transposed, not conjugated)."""
        return self._solve(rhs, transposed=False)

    def _solve(self, rhs: ComplexArray, transposed: bool) -> ComplexArray:
        x, _ = lapack.zgetrs(self._lu, self._pivots, rhs, trans=1 if transposed else 0)
        if not np.isfinite(x).all():
            raise SolverError("boundary element solution holds values that are not finite: check the right-hand side")
        return np.ascontiguousarray(x)
