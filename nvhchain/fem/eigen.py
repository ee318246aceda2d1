"""Lowest normal modes of K φ = λ M φ by block shift-invert Lanczos, with proof that none is missed.

Full reorthogonalisation in the M inner product (Grimes, Lewis & Simon, SIAM J. Matrix Anal. Appl. 15, 1994), blocks so
that the triangular solves run as matrix products; the Sturm count (negative pivots of K − λ_max M) must agree.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import psutil
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import ResourceError, SolverError, require
from nvhchain.fem._sparse import Factor, factorize
from nvhchain.handoff import FloatArray

BLOCK = 16
"""Vectors per Lanczos step."""

_DENSE = 400
"""Below this many unknowns a dense solution is quicker and needs no care."""

_ROUNDING = 4 * np.finfo(float).eps
"""Relative error of a stiffness entry that is a sum of some element contributions."""

_SHIFT = 0.1
"""Default shift in parts of f_max: K + (2π · 0.1 f_max)² M is positive definite for a free structure too."""


def lowest_modes(
    K: Any, M: Any, f_max: float, *, factor: Factor | None = None, tolerance: float = 1e-8
) -> tuple[FloatArray, FloatArray]:
    """Natural frequencies (m,) Hz up to f_max and mass-normalised shapes (n, m) kg^-½.

    K, M: (n, n) sparse symmetric, K semidefinite, M positive definite.  f_max: Hz, > 0.
    factor: of K itself where the structure is held and the caller has it; otherwise K is shifted and factored here.
    tolerance: of the eigenpair residual, relative to its eigenvalue (of the inverted operator).

    A frequency of a rigid mode, zero up to rounding, comes back as 0.  The sign of a shape makes its largest
    component positive.  Raises SolverError when a mode does not converge or the count disagrees.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    limit = (2 * np.pi * f_max) ** 2
    if K.shape[0] <= _DENSE:
        values, shapes = scipy.linalg.eigh(K.toarray(), M.toarray(), subset_by_value=(-np.inf, limit))
        return _finished(K, values, shapes)
    expected = modes_below(K, M, f_max)
    if expected == 0:
        return np.empty(0), np.empty((K.shape[0], 0))
    shift = 0.0
    if factor is None:
        shift = -((_SHIFT * 2 * np.pi * f_max) ** 2)
        with factorize(sp.csr_matrix(K - shift * M)) as own:
            values, shapes = _lanczos(M, own, shift, limit, expected, tolerance)
    else:
        values, shapes = _lanczos(M, factor, shift, limit, expected, tolerance)
    return _finished(K, values, shapes)


def modes_below(K: Any, M: Any, frequency: float) -> int:
    """How many natural frequencies lie below `frequency` (Hz): negative eigenvalues of K − ω²M (Sylvester)."""
    with factorize(sp.csr_matrix(K - (2 * np.pi * frequency) ** 2 * M), symmetric_positive_definite=False) as factor:
        return factor.negative


def _lanczos(
    M: Any, factor: Factor, shift: float, limit: float, expected: int, tolerance: float
) -> tuple[FloatArray, FloatArray]:
    """The `expected` eigenpairs of (K, M) below `limit`; `factor` solves with K − shift·M."""
    n = M.shape[0]
    capacity = min(n, 6 * expected + 12 * BLOCK)
    _check_memory(n, min(capacity, 4 * expected + 4 * BLOCK))
    basis: list[FloatArray] = []
    projected = np.zeros((capacity + BLOCK, capacity + BLOCK))
    block = _orthonormal(np.random.default_rng(20).standard_normal((n, BLOCK)), M)[0]
    size = 0
    while True:
        basis.append(block)
        first, size = size, size + block.shape[1]
        new = factor.solve(M @ block)
        for _ in range(2):  # classical Gram–Schmidt, twice is enough
            weighted = M @ new
            row = 0
            for old in basis:
                part = old.T @ weighted
                new -= old @ part
                projected[row : row + old.shape[1], first:size] += part
                row += old.shape[1]
        block, coupling = _orthonormal(new, M)
        projected[size : size + block.shape[1], first:size] = coupling
        small = projected[:size, :size]
        inverse, vectors = np.linalg.eigh((small + small.T) / 2)
        inverse, vectors = inverse[::-1], vectors[:, ::-1]
        wanted = inverse * (limit - shift) >= 1.0
        found = int(wanted.sum())
        if found > expected:
            raise SolverError(f"{found} modes found below the limit where the Sturm count says {expected}")
        if found == expected:
            # the residual of a Ritz pair lies in the next block: its norm is ‖coupling · last rows of the vector‖
            residual = np.linalg.norm(coupling @ vectors[first:size, :found], axis=0)
            if block.shape[1] == 0 or (residual <= tolerance * inverse[:found]).all():
                break
        if block.shape[1] == 0 or size + block.shape[1] > capacity:
            raise SolverError(
                f"{found} of {expected} modes converged in a Krylov space of {size}: "
                "refine the tolerance or look for a badly scaled mass matrix"
            )
    values = shift + 1 / inverse[:expected]
    shapes = np.zeros((n, expected))
    row = 0
    for old in basis:
        shapes += old @ vectors[row : row + old.shape[1], :expected]
        row += old.shape[1]
    return values, shapes


def _orthonormal(block: FloatArray, M: Any) -> tuple[FloatArray, FloatArray]:
    """M-orthonormal Q and R with block = Q R; dependent directions are left out of Q."""
    scale = np.sqrt(np.einsum("ij,ij->j", block, M @ block))
    gram = block.T @ (M @ block)
    value, vector = np.linalg.eigh(gram / np.outer(scale, scale).clip(np.finfo(float).tiny))
    keep = value > 1e-12 * max(value[-1], np.finfo(float).tiny)
    Q = block @ (vector[:, keep] / np.sqrt(value[keep]) / scale[:, None])
    again = Q.T @ (M @ Q)
    Q = np.ascontiguousarray(scipy.linalg.solve_triangular(np.linalg.cholesky(again), Q.T, lower=True).T)
    return Q, Q.T @ (M @ block)


def _check_memory(unknowns: int, vectors: int) -> None:
    need, free = 8.0 * unknowns * vectors, psutil.virtual_memory().available
    if need > free:
        raise ResourceError(
            f"{vectors} Lanczos vectors of {unknowns} unknowns need {need / 1e9:.1f} GB, {free / 1e9:.1f} GB are free: "
            "lower f_max or use a coarser mesh"
        )


def _finished(K: Any, values: FloatArray, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies and signed shapes; an eigenvalue below the rounding of K itself belongs to a rigid mode: zero."""
    magnitude = np.abs(shapes)
    rounding = _ROUNDING * np.einsum("ij,ij->j", magnitude, abs(K) @ magnitude)
    frequency = np.sqrt(np.where(values < rounding, 0.0, values)) / (2 * np.pi)
    largest = np.take_along_axis(shapes, magnitude.argmax(axis=0)[None], axis=0) if shapes.size else np.ones(0)
    return frequency, shapes * np.where(largest < 0, -1.0, 1.0)
