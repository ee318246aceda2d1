"""Boundary element systems A p = B ∂p/∂n, and the solution of dense ones by LU factors."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.linalg import lapack

from nvhchain.errors import SolverError
from nvhchain.handoff import ComplexArray, IntArray, SolverRecord
from nvhchain.runtime.threads import blas_threads, threads

THREAD_ENTRIES = 3_000_000
"""Entries of a matrix for which a separate thread pays; limiting its BLAS to one thread takes a few milliseconds."""


class SinglePrecisionError(SolverError):
    """Matrix in single precision that is singular to it and perhaps not to double precision."""


class Matrix(Protocol):
    """Product with a matrix (n_row, n_column) in any storage, for one column or several.

    `exact` requests double precision for any precision of the matrix.
    """

    def apply(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Return matrix · x, (n_row, …) of (n_column, …)."""

    def apply_transposed(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Return matrixᵀ · x (not conjugated), (n_column, …) of (n_row, …)."""


class DenseMatrix:
    """Matrix held as an unchanged array; products in its own precision, on the granted threads."""

    def __init__(self, values: ComplexArray) -> None:
        self._values = values

    def apply(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Return matrix · x."""
        return _product(self._values, x, exact)

    def apply_transposed(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Return matrixᵀ · x."""
        return _product(self._values.T, x, exact)


def _product(matrix: ComplexArray, x: ComplexArray, exact: bool) -> ComplexArray:
    """Return matrix · x in the precision of the matrix, with its rows distributed to threads.

    exact : compute in double precision, some rows at a time.

    BLAS distributes square products well, but those with few columns badly. They take up to twice as long as the
    transposed products with few rows used here.
    """
    if exact and matrix.dtype == np.complex64:
        rows = max(1, THREAD_ENTRIES // matrix.shape[1])
        return np.concatenate([matrix[i : i + rows].astype(complex) @ x for i in range(0, len(matrix), rows)])
    x, size = _scaled(x, matrix.dtype)
    count = min(threads(), matrix.size // THREAD_ENTRIES)
    if count < 2:
        return size * np.asarray((x.T @ matrix.T).T, dtype=complex)
    y = np.empty((len(matrix), *x.shape[1:]), dtype=complex)
    limits = np.linspace(0, len(matrix), count + 1).astype(int)

    def some(start: int, stop: int) -> None:
        with blas_threads(1):
            y[start:stop] = (x.T @ matrix[start:stop].T).T

    with ThreadPoolExecutor(count) as pool:
        list(pool.map(some, limits[:-1], limits[1:]))
    return size * y


def _scaled(x: ComplexArray, kind: np.dtype[Any]) -> tuple[ComplexArray, Any]:
    """Return columns (n, …) in a precision and their sizes (…): single precision holds 1e-38 … 1e38 alone."""
    if kind != np.complex64:
        return x.astype(kind), 1.0
    size = np.abs(x).max(axis=0, initial=0.0)
    size = np.where(size > 0, size, 1.0)
    return (x / size).astype(kind), size


class System(Protocol):
    """System A p = B ∂p/∂n at one wavenumber, for any storage and solver.

    Every method accepts and returns one column or several: (n,) or (n, m).
    """

    def solve(self, rhs: ComplexArray) -> ComplexArray:
        """Return p at the vertices (n_v, …) of A p = rhs; SolverError if there is no solution."""

    def adjoint(self, rhs: ComplexArray) -> ComplexArray:
        """Return Bᵀ A⁻ᵀ rhs (n_face, …), transposed, not conjugated: the contribution of every face to rhs · p.

        SolverError if there is no solution.
        """

    def apply_b(self, gradient: ComplexArray) -> ComplexArray:
        """Return B · gradient (n_v, …) of the pressure gradient ∂p/∂n of every face."""

    @property
    def record(self) -> SolverRecord:
        """Record of the solutions so far."""

    def release(self) -> None:
        """Release the memory; the system cannot be solved afterwards."""


class DirectSystem:
    """System of dense A and B; A is factorised in its own memory and precision at the first solution."""

    def __init__(self, a: ComplexArray, b: ComplexArray) -> None:
        """Keep A (n_v, n_v), which is overwritten, and B (n_v, n_face)."""
        self._a, self._b = a, DenseMatrix(b)
        self.record = SolverRecord(("direct",))

    @cached_property
    def factors(self) -> tuple[Callable[..., Any], ComplexArray, IntArray]:
        """Substitution of LAPACK with LU factors and pivots; SolverError if A is not finite or singular."""
        matrix = self._a
        routines = lapack.get_lapack_funcs(("lange", "getrf", "gecon", "getrs"), (matrix,))
        one_norm, factorise, condition, substitute = routines
        # LAPACK needs column order: the transposed view of a C-ordered array has it without a copy.
        norm = float(one_norm("1", matrix.T))
        if not np.isfinite(norm):
            raise SolverError("boundary element matrix holds values that are not finite: the engine failed")
        lu, pivots, info = factorise(matrix.T, overwrite_a=True)
        reciprocal_condition = float(condition(lu, norm)[0]) if info == 0 else 0.0
        least = len(matrix) * float(np.finfo(matrix.real.dtype).eps)
        if reciprocal_condition < least:
            refused = SinglePrecisionError if matrix.dtype == np.complex64 else SolverError
            raise refused(
                f"boundary element matrix of {len(matrix)} unknowns is singular to working precision (reciprocal "
                f"condition number {reciprocal_condition:.2g}, {least:.2g} at least): look for coinciding surfaces, "
                "very thin gaps and cavities that resonate"
            )
        self.record += SolverRecord(condition=reciprocal_condition)
        return substitute, lu, pivots

    def solve(self, rhs: ComplexArray) -> ComplexArray:
        """Return A⁻¹ rhs."""
        return self._substituted(rhs, transposed=1)

    def adjoint(self, rhs: ComplexArray) -> ComplexArray:
        """Return Bᵀ A⁻ᵀ rhs."""
        return self._b.apply_transposed(self._substituted(rhs, transposed=0))

    def apply_b(self, gradient: ComplexArray) -> ComplexArray:
        """Return B · gradient."""
        return self._b.apply(gradient)

    def release(self) -> None:
        """Release A, its factors and B."""
        del self._a, self._b
        self.__dict__.pop("factors", None)

    def _substituted(self, rhs: ComplexArray, transposed: int) -> ComplexArray:
        """Return the solution (n,) or (n, m); the factors are those of Aᵀ."""
        substitute, lu, pivots = self.factors
        scaled, size = _scaled(rhs, lu.dtype)
        x, _ = substitute(lu, pivots, scaled, trans=transposed)
        if not np.isfinite(x).all():
            raise SolverError("boundary element solution holds values that are not finite: check the right-hand side")
        return np.ascontiguousarray(size * x, dtype=complex)
