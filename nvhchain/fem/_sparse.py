"""Sparse symmetric direct solver, factored once and kept; the only module that imports pypardiso or cvxopt.

PARDISO (Intel MKL, x86-64) takes the upper triangle only. Elsewhere CHOLMOD, of the optional package cvxopt, factors
what is positive definite. SuperLU solves small systems and refuses large ones: its fill-in on three-dimensional
elasticity explodes (8 GB and minutes at 9·10⁴ unknowns).
"""

from __future__ import annotations

import ctypes
import os
import platform
import weakref
from abc import ABC, abstractmethod
from functools import cache
from importlib import metadata
from types import TracebackType
from typing import Any, Protocol, TypeVar

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_info

from nvhchain.errors import InputError, ResourceError, SolverError, require
from nvhchain.handoff import ComplexArray, FloatArray, IntArray
from nvhchain.runtime.extras import remedy
from nvhchain.runtime.memory import free_memory

ENGINES, VARIABLE = ("pardiso", "cholmod", "superlu"), "NVHCHAIN_SPARSE"
"""Solvers in the order of preference, and the variable of the environment that names the preferred one."""

SUPERLU_UNKNOWNS = 40_000
"""Largest number of unknowns for SuperLU: about a minute and 2 GB for quadratic solid elements."""

_CHOLMOD_BYTES = 90.0
"""Memory (bytes) while CHOLMOD factors, over n^(4/3), n unknowns of quadratic solid elements. Measured on castings of
133 932 and 189 261 unknowns: 89 and 86, of which 67 are kept."""

A = TypeVar("A", FloatArray, ComplexArray)

BLOCK = 64
"""Right-hand sides solved together: enough for level-3 BLAS, few enough to stay small beside the factor."""

_ENGINE_REMEDY = f"install pypardiso (x86-64), or CHOLMOD by {remedy('cvxopt')}"

_MEMORY_SHARE = 0.9
"""Share of the available memory that a factor may take."""


class Factor(Protocol):
    """Factored symmetric or Hermitian matrix; close it (or use `with`) to release its memory.

    unknowns: order of the matrix.
    negative: number of negative eigenvalues (inertia, Sylvester's law).
    memory: memory of the factor (bytes).
    """

    unknowns: int
    negative: int
    memory: int

    def solve(self, rhs: A) -> A:
        """Return the solution for right-hand side(s) `rhs` of shape (n,) or (n, k)."""

    def close(self) -> None:
        """Release the memory of the factor."""

    def __enter__(self) -> Factor: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def factorize(
    matrix: sp.spmatrix | sp.sparray,
    *,
    symmetric_positive_definite: bool = True,
    engine: str = "auto",
    upper: bool = False,
    loaded: IntArray | None = None,
) -> Factor:
    """Factor a real symmetric or complex Hermitian sparse matrix.

    matrix (n, n) sparse matrix: matrix, or its upper triangle.
    symmetric_positive_definite: True for Cholesky; complex matrices are taken as such. Otherwise LDLᵀ with pivoting,
    whose `negative` counts the negative eigenvalues (Sturm sequence property).
    engine {"auto", "pardiso", "cholmod", "superlu"}: solver; auto takes the first that exists and can. CHOLMOD takes
    positive definite matrices only.
    upper: True if `matrix` is the upper triangle alone.
    loaded (m,): the only unknowns that are loaded and read. `solve` of the factor takes and returns these alone.
    PARDISO then skips the others where it can. The matrix must be positive definite.
    """
    if loaded is not None:
        require(symmetric_positive_definite, "factors of some unknowns alone need a positive definite matrix")
        return _PartialFactor(loaded, _factorized(matrix, symmetric_positive_definite, engine, upper, loaded))
    return _factorized(matrix, symmetric_positive_definite, engine, upper, None)


def _factorized(matrix: Any, symmetric_positive_definite: bool, engine: str, upper: bool, loaded: Any) -> Factor:
    """Return the factor of all unknowns."""
    require(matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1], f"matrix of shape {matrix.shape} is not square")
    require(engine in ("auto", *ENGINES), f"engine {engine!r} is none of auto, {', '.join(ENGINES)}")
    if engine == "auto":
        engine = "superlu"
        if _has_pardiso():
            engine = "pardiso"
        elif symmetric_positive_definite and _has_cholmod():
            engine = "cholmod"
    if engine == "pardiso":
        return _PardisoFactor(matrix if upper else sp.triu(matrix), symmetric_positive_definite, loaded)
    if engine == "cholmod":
        require(symmetric_positive_definite, "CHOLMOD takes positive definite matrices only: use another engine")
        return _CholmodFactor(matrix if upper else sp.triu(matrix))
    if upper:
        matrix = matrix + sp.triu(matrix, 1).conj().T
    return _SuperluFactor(matrix, symmetric_positive_definite)


def _allowed(engine: str) -> bool:
    """Return True unless the environment prefers another engine that this machine has."""
    name = os.environ.get(VARIABLE) or engine
    require(name in ENGINES, f"{VARIABLE} = {name!r} is none of {', '.join(ENGINES)}")
    return name == engine or not {"pardiso": _pardiso_loads, "cholmod": _cholmod_loads}.get(name, lambda: True)()


def _has_pardiso() -> bool:
    return _allowed("pardiso") and _pardiso_loads()


def _has_cholmod() -> bool:
    return _allowed("cholmod") and _cholmod_loads()


def _pardiso_loads() -> bool:
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return False
    _name_mkl()
    try:
        import pypardiso  # noqa: F401
    except (ImportError, OSError):
        return False
    return True


def _cholmod_loads() -> bool:
    try:
        import cvxopt.cholmod  # noqa: F401
    except (ImportError, OSError):
        return False
    return True


def check_unknowns(unknowns: float) -> None:
    """Raise ResourceError for more unknowns of a structure than the solvers of this machine can factor."""
    if not (_has_pardiso() or _has_cholmod()):
        _check_superlu(round(unknowns))


def _check_superlu(unknowns: int) -> None:
    if unknowns > SUPERLU_UNKNOWNS:
        raise ResourceError(
            f"{unknowns} unknowns are too many for SuperLU (limit {SUPERLU_UNKNOWNS}): {_ENGINE_REMEDY}, or use a "
            "coarser mesh"
        )


def counts_eigenvalues(unknowns: int) -> bool:
    """Return whether an indefinite matrix of that size can be factored, which counts its negative eigenvalues."""
    return _has_pardiso() or unknowns <= SUPERLU_UNKNOWNS or not _has_cholmod()


@cache
def _name_mkl() -> None:
    """Set the path of MKL for pypardiso, which otherwise searches the installation for every matrix (0.4 s each)."""
    try:
        files = metadata.files("mkl") or ()
    except metadata.PackageNotFoundError:
        return
    for file in files:
        library = os.path.realpath(str(file.locate()))
        if "mkl_rt" in file.name and os.path.exists(library):
            os.environ.setdefault("PYPARDISO_MKL_RT", library)


@cache
def _openmp() -> Any:
    """Return Intel's OpenMP runtime as MKL has loaded it; None if MKL threads otherwise."""
    for library in threadpool_info():
        if library["user_api"] == "openmp" and "iomp" in library["prefix"]:
            return ctypes.CDLL(library["filepath"])
    return None


def _let_workers_sleep() -> None:
    """Stop Intel's workers from spinning.

    For 0.2 s after every parallel region they would take the cores from numpy's threads.
    """
    runtime = _openmp()
    if runtime is not None:
        runtime.kmp_set_blocktime(0)


def _rhs(rhs: Any, unknowns: int, kind: type) -> Any:
    rhs = np.asarray(rhs, dtype=kind)
    if rhs.ndim not in (1, 2) or rhs.shape[0] != unknowns:
        raise InputError(f"right-hand side of shape {rhs.shape} does not fit {unknowns} unknowns")
    return rhs


class _Closing(ABC):
    """Base class of factors that `with` closes."""

    @abstractmethod
    def close(self) -> None:
        """Release the memory of the factor."""

    def __enter__(self) -> Any:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _PartialFactor(_Closing):
    """Factor of which some unknowns alone are loaded and read."""

    def __init__(self, loaded: IntArray, factor: Any) -> None:
        self._loaded, self._factor = loaded, factor
        self.unknowns, self.negative, self.memory = len(loaded), factor.negative, factor.memory

    def solve(self, rhs: A) -> A:
        """Return the solution for right-hand side(s) `rhs` of shape (m,) or (m, k)."""
        rhs = _rhs(rhs, self.unknowns, self._factor._kind)
        columns = rhs.reshape(self.unknowns, -1)
        solution: Any = np.empty_like(columns)
        for start in range(0, columns.shape[1], BLOCK):
            block = columns[:, start : start + BLOCK]
            whole = np.zeros((self._factor.unknowns, block.shape[1]), columns.dtype, order="F")
            whole[self._loaded] = block
            solution[:, start : start + BLOCK] = self._factor.solve(whole)[self._loaded]
        return np.asarray(solution.reshape(rhs.shape))

    def close(self) -> None:
        """Release the memory of the factor."""
        self._factor.close()


class _PardisoFactor(_Closing):
    """PARDISO, matrix type 2 or 4 (Cholesky) or −2 (Bunch–Kaufman); iparm numbers as in Intel's manual, from 1."""

    def __init__(self, upper: Any, positive_definite: bool, loaded: IntArray | None = None) -> None:
        _name_mkl()
        from pypardiso.pardiso_wrapper import PyPardisoSolver

        self._kind: type = complex if np.iscomplexobj(upper) else float
        self._upper = sp.csr_matrix(upper, dtype=self._kind)
        self._upper.sort_indices()
        self.unknowns = self._upper.shape[0]
        # PARDISO reads the diagonal of every row unchecked: absent entries must be stored, zero ones refused
        if not (self._upper.diagonal() != 0).all():
            row = int(np.argmin(self._upper.diagonal() != 0))
            raise SolverError(f"matrix has a zero on its diagonal at row {row}: a part of the structure is not held")
        self._solver: Any = PyPardisoSolver(mtype=4 if self._kind is complex else 2 if positive_definite else -2)
        for number, value in ((1, 1), (2, 2), (10, 13), (18, -1), (21, 1)):
            # 1: own settings; 2: METIS ordering; 10: pivot perturbation 1e-13; 18: report fill; 21: 2×2 pivots
            self._solver.set_iparm(number, value)
        if loaded is not None:  # 31: only these unknowns are loaded and read
            self._solver.set_iparm(31, 1)
            self._solver.perm = np.zeros(self.unknowns, np.int32)
            self._solver.perm[loaded] = 1
        # MKL's memory is not Python's: freed on close, with the last reference, or at exit, whichever comes first
        self._release = weakref.finalize(self, self._solver.free_memory, everything=True)
        self._rows, self._columns = (part.astype(np.int32) + 1 for part in (self._upper.indptr, self._upper.indices))
        empty = np.zeros((self.unknowns, 1), self._kind, order="F")
        try:
            self._run(11, empty)
            _let_workers_sleep()
            peak, kept, work = (1024 * int(self._solver.get_iparm(i)) for i in (15, 16, 17))
            self.memory = kept + work
            free = free_memory()
            if max(peak, self.memory) > _MEMORY_SHARE * free:
                raise ResourceError(
                    f"factor of {self.unknowns} unknowns needs {max(peak, self.memory) / 1e9:.1f} GB, "
                    f"{free / 1e9:.1f} GB are free: use a coarser mesh or a machine with more memory"
                )
            self._run(22, empty)
        except BaseException:
            self.close()
            raise
        if not positive_definite and self._solver.get_iparm(14) > 0:
            perturbed = int(self._solver.get_iparm(14))
            self.close()
            raise SolverError(f"matrix is singular to working precision ({perturbed} perturbed pivots)")
        self.negative = 0 if positive_definite else int(self._solver.get_iparm(23))

    def _run(self, phase: int, rhs: Any) -> Any:
        """Return the solution for columns in Fortran order. The call of pypardiso copies the matrix every time."""
        solver, solution, failed = self._solver, np.empty_like(rhs), ctypes.c_int32(0)

        def number(value: int) -> Any:
            return ctypes.byref(ctypes.c_int32(value))

        def whole(array: Any) -> Any:
            return array.ctypes.data_as(ctypes.POINTER(ctypes.c_int32))

        solver._mkl_pardiso(
            solver.pt.ctypes.data_as(ctypes.POINTER(solver._pt_type[0])), number(1), number(1), number(solver.mtype),
            number(phase), number(self.unknowns), self._upper.data.ctypes.data, whole(self._rows),
            whole(self._columns), whole(solver.perm), number(rhs.shape[1]), whole(solver.iparm), number(0),
            rhs.ctypes.data, solution.ctypes.data, ctypes.byref(failed),
        )  # fmt: skip
        if failed.value == -2:
            raise ResourceError(f"no memory left to factor {self.unknowns} unknowns: use a coarser mesh")
        if failed.value in (-4, -7):
            raise SolverError(
                f"matrix of {self.unknowns} unknowns is singular or not positive definite: "
                "is the structure held against rigid motion?"
            )
        if failed.value:
            raise SolverError(f"PARDISO failed in phase {phase} with code {failed.value}")
        return solution

    def solve(self, rhs: A) -> A:
        """Return the solution for right-hand side(s) `rhs` of shape (n,) or (n, k)."""
        rhs = _rhs(rhs, self.unknowns, self._kind)
        require(self._solver is not None, "the factor has been closed: factorize again")
        columns = rhs.reshape(self.unknowns, -1)
        _let_workers_sleep()
        solution: Any = np.empty(columns.shape, self._kind)
        for start in range(0, columns.shape[1], BLOCK):
            block = slice(start, start + BLOCK)
            solution[:, block] = self._run(33, np.asfortranarray(columns[:, block]))
        return solution.reshape(rhs.shape)

    def close(self) -> None:
        """Release the memory of the factor."""
        self._release()
        self._solver = self._upper = self._rows = self._columns = None


class _CholmodFactor(_Closing):
    """CHOLMOD's supernodal Cholesky factor, real or complex Hermitian, columns ordered by minimum degree."""

    def __init__(self, upper: Any) -> None:
        from cvxopt import cholmod, matrix, spmatrix

        self._kind: type = complex if np.iscomplexobj(upper) else float
        self.unknowns, self.negative = upper.shape[0], 0
        self.memory = int(_CHOLMOD_BYTES * self.unknowns ** (4 / 3)) * (2 if self._kind is complex else 1)
        free = free_memory()
        if self.memory > _MEMORY_SHARE * free:
            raise ResourceError(
                f"factor of {self.unknowns} unknowns needs about {self.memory / 1e9:.1f} GB, {free / 1e9:.1f} GB are "
                "free: use a coarser mesh or a machine with more memory"
            )
        entries = sp.coo_matrix(upper, dtype=self._kind)
        rows, columns = (matrix(number.astype(np.int64)) for number in (entries.row, entries.col))
        code = "z" if self._kind is complex else "d"
        stored = spmatrix(matrix(entries.data, tc=code), rows, columns, upper.shape, code)
        cholmod.options["supernodal"] = 2
        self._cholmod: Any = cholmod
        try:
            self._factor: Any = cholmod.symbolic(stored, uplo="U")
            cholmod.numeric(stored, self._factor)
        except MemoryError:
            raise ResourceError(f"no memory left to factor {self.unknowns} unknowns: use a coarser mesh") from None
        except ArithmeticError:
            raise SolverError(
                f"matrix of {self.unknowns} unknowns is singular or not positive definite: "
                "is the structure held against rigid motion?"
            ) from None

    def solve(self, rhs: A) -> A:
        """Return the solution for right-hand side(s) `rhs` of shape (n,) or (n, k)."""
        from cvxopt import matrix

        rhs = _rhs(rhs, self.unknowns, self._kind)
        require(self._factor is not None, "the factor has been closed: factorize again")
        columns = rhs.reshape(self.unknowns, -1)
        solution: Any = np.empty(columns.shape, self._kind)
        for start in range(0, columns.shape[1], BLOCK):
            block = slice(start, start + BLOCK)
            solved = matrix(np.ascontiguousarray(columns[:, block]))
            self._cholmod.solve(self._factor, solved)
            solution[:, block] = np.array(solved)
        return solution.reshape(rhs.shape)

    def close(self) -> None:
        """Release the memory of the factor."""
        self._factor = None


class _SuperluFactor(_Closing):
    """SciPy's SuperLU in symmetric mode: diagonal pivots, so that the signs of U's diagonal give the inertia."""

    def __init__(self, matrix: Any, positive_definite: bool) -> None:
        from scipy.sparse.linalg import splu

        self.unknowns, self._kind = matrix.shape[0], complex if np.iscomplexobj(matrix) else float
        _check_superlu(self.unknowns)
        options = {"SymmetricMode": True}
        try:
            self._lu: Any = splu(
                sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
            )
        except RuntimeError as error:
            raise SolverError(f"matrix of {self.unknowns} unknowns is singular: {error}") from error
        pivots = self._lu.U.diagonal().real
        symmetric = np.array_equal(self._lu.perm_r, self._lu.perm_c)
        self.negative = int((pivots < 0).sum())
        self.memory = 12 * int(self._lu.nnz)
        if positive_definite and (self.negative or not symmetric):
            raise SolverError(f"matrix of {self.unknowns} unknowns is not positive definite: is the structure held?")
        if not symmetric:
            raise SolverError(
                f"SuperLU left the diagonal while pivoting, its negative eigenvalues are not counted: {_ENGINE_REMEDY}"
            )

    def solve(self, rhs: A) -> A:
        """Return the solution for right-hand side(s) `rhs` of shape (n,) or (n, k)."""
        rhs = _rhs(rhs, self.unknowns, self._kind)
        require(self._lu is not None, "the factor has been closed: factorize again")
        return np.asarray(self._lu.solve(rhs))

    def close(self) -> None:
        """Release the memory of the factor."""
        self._lu = None
