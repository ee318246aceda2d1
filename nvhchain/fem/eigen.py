"""Lowest normal modes of K φ = λ M φ by block shift-invert Lanczos, with proof that none is missed.

Full reorthogonalisation in the M inner product (Grimes, Lewis & Simon, SIAM J. Matrix Anal. Appl. 15, 1994). Blocks
turn the triangular solves into matrix products. The Sturm count (negative pivots of K − λ_max M) must agree.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import ResourceError, SolverError, require
from nvhchain.fem._sparse import Factor, factorize
from nvhchain.handoff import FloatArray
from nvhchain.runtime.memory import free_memory

BLOCK = 16
"""Vectors per Lanczos step."""

_DENSE = 400
"""Number of unknowns below which a dense solution is faster and robust."""

_ROUNDING = 4 * np.finfo(float).eps
"""Relative rounding error of a stiffness entry, the sum of several element contributions."""

_DEPENDENT = 1e-12
"""Relative eigenvalue of a scaled Gram matrix below which a direction counts as dependent on the others."""

_STEEP = 1e-4
"""Relative eigenvalue below which a normalised block is made orthogonal to the basis once more."""

_FAINT, _NOTHING = 1e-8, 1e-14
"""Remainder of a block outside the basis, relative to the operator's norm. Below the first the block is made orthogonal
once more. Below the second it is rounding: the basis then holds the operator's whole image of this direction."""

_SHIFT = 0.1
"""Default shift relative to f_max: K + (2π · 0.1 f_max)² M is positive definite for a free structure too."""


_TOLERANCE = 1e-6
"""Residual of an eigenpair relative to its eigenvalue (of the inverted operator).

It is the error of a shape beside modes that are well separated from it. The error of its frequency is about the square.
"""


def lowest_modes(
    K: Any, M: Any, f_max: float, *, factor: Factor | None = None, count: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return natural frequencies up to f_max and mass-normalised shapes.

    K, M (n, n) sparse matrices: symmetric stiffness and mass; K semidefinite, M positive definite.
    f_max: highest frequency (Hz), > 0.
    factor: factor of K itself, for a structure without rigid modes. By default K is shifted and factored here.
    count: `modes_below(K, M, f_max)`, if counted before. The memory of its factor is then not needed beside another.
    Returns frequency (m,): natural frequencies (Hz); a rigid mode, zero up to rounding, has 0. shapes (n, m): shapes
    (kg^-½), with a positive largest component.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    limit = (2 * np.pi * f_max) ** 2
    if K.shape[0] <= _DENSE:
        values, shapes = scipy.linalg.eigh(K.toarray(), M.toarray(), subset_by_value=(-np.inf, limit))
        return _finished(K, values, shapes)
    expected = modes_below(K, M, f_max) if count is None else count
    if expected == 0:
        return np.empty(0), np.empty((K.shape[0], 0))
    shift = 0.0
    if factor is None:
        shift = -((_SHIFT * 2 * np.pi * f_max) ** 2)
        with factorize(sp.csr_matrix(K - shift * M)) as own:
            values, shapes = _lanczos(M, own, shift, limit, expected)
    else:
        values, shapes = _lanczos(M, factor, shift, limit, expected)
    return _finished(K, values, shapes)


def modes_below(K: Any, M: Any, frequency: float) -> int:
    """Return the number of natural frequencies below a frequency.

    K, M (n, n) sparse matrices: symmetric stiffness and mass.
    frequency: frequency (Hz).
    Returns number of negative eigenvalues of K − ω²M (Sylvester).
    """
    with factorize(sp.csr_matrix(K - (2 * np.pi * frequency) ** 2 * M), symmetric_positive_definite=False) as factor:
        return factor.negative


def _lanczos(M: Any, factor: Factor, shift: float, limit: float, expected: int) -> tuple[FloatArray, FloatArray]:
    """Return the `expected` eigenpairs of (K, M) below `limit`; `factor` solves with K − shift·M.

    Three-term recurrence, then a pass against the whole basis. M Q is kept with Q: two products with M per step.
    """
    n = M.shape[0]
    capacity = min(n, 6 * expected + 64 * BLOCK)
    _check_memory(n, min(capacity, 4 * expected + 4 * BLOCK))
    basis = np.empty((n, capacity + BLOCK), order="F")  # the system allocates pages as they are filled
    projected = np.zeros((capacity + BLOCK, capacity + BLOCK))
    random = np.random.default_rng(20)
    block, weighted, _ = _next_block(random.standard_normal((n, BLOCK)), basis[:, :0], M, 0.0, random)
    first, size, coupling = 0, 0, np.empty((block.shape[1], 0))
    while True:
        before, first, size = first, size, size + block.shape[1]
        basis[:, first:size] = block
        new = factor.solve(weighted)
        diagonal = weighted.T @ new
        new -= block @ diagonal
        new -= basis[:, before:first] @ coupling.T
        projected[first:size, first:size] = (diagonal + diagonal.T) / 2
        inverse, vectors = np.linalg.eigh(projected[:size, :size])  # reads the lower triangle
        inverse, vectors = inverse[::-1], vectors[:, ::-1]
        block, weighted, coupling = _next_block(new, basis[:, :size], M, float(inverse[0]), random)
        wanted = inverse * (limit - shift) >= 1.0
        found = int(wanted.sum())
        if found > expected:
            raise SolverError(f"{found} modes found below the limit, {expected} by the Sturm count")
        if found == expected:
            # the residual of a Ritz pair lies in the next block: its norm is ‖coupling · last rows of the vector‖
            residual = np.linalg.norm(coupling @ vectors[first:size, :found], axis=0)
            if block.shape[1] == 0 or (residual <= _TOLERANCE * inverse[:found]).all():
                break
        if block.shape[1] == 0 or size + block.shape[1] > capacity:
            raise SolverError(
                f"{found} of {expected} modes converged in a Krylov space of {size}: "
                "move f_max into a gap of the spectrum or look for a badly scaled mass matrix"
            )
        projected[size : size + block.shape[1], first:size] = coupling
    return shift + 1 / inverse[:expected], basis[:, :size] @ vectors[:, :expected]


def _next_block(
    new: FloatArray, basis: FloatArray, M: Any, norm: float, random: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return M-orthonormal Q, also orthogonal to the basis, M Q, and R with new = Q R + a part in the basis.

    norm : norm of the operator that made `new`.

    Random directions replace those that depend on others or lie in the basis; R has rows of zeros for them. Otherwise
    the operator reveals no more modes of a repeated frequency than a block has vectors.
    """
    weighted = M @ new
    new = new - ((weighted.T @ basis) @ basis.T).T  # by rows of the transpose: half the time
    gram = new.T @ weighted
    scale = np.sqrt(gram.diagonal().clip(np.finfo(float).tiny))
    value, vector = np.linalg.eigh(gram / np.outer(scale, scale))
    left = np.linalg.norm(vector * scale[:, None], axis=0) * np.sqrt(value.clip(0.0))
    room = min(BLOCK, len(new) - basis.shape[1])
    keep = (value > _DEPENDENT * max(value[-1], np.finfo(float).tiny)) & (left > _NOTHING * norm)
    keep[: len(keep) - room] = False
    Q = new @ (vector[:, keep] / np.sqrt(value[keep]) / scale[:, None])
    R = (vector[:, keep] * np.sqrt(value[keep])).T * scale
    others = room - Q.shape[1]
    if others > 0:
        drawn = _orthogonal_part(basis, random.standard_normal((len(new), others)), M)
        Q = np.hstack([Q, drawn / np.sqrt(np.einsum("ij,ij->j", drawn, M @ drawn))])
        R = np.vstack([R, np.zeros((others, R.shape[1]))])
    weighted = M @ Q
    if others > 0 or value[0] < _STEEP * value[-1] or left.min() < _FAINT * norm:
        # normalising nearly lost directions has enlarged their rounding remainder in the basis
        Q = _orthogonal_part(basis, Q, M)
        weighted = M @ Q
    lower = np.linalg.cholesky(Q.T @ weighted)
    normalise = scipy.linalg.solve_triangular(lower, np.eye(len(lower)), lower=True).T
    return Q @ normalise, weighted @ normalise, lower.T @ R


def _orthogonal_part(basis: FloatArray, vectors: FloatArray, M: Any) -> FloatArray:
    """Return the part of the vectors that is M-orthogonal to the basis."""
    return np.asarray(vectors - basis @ (basis.T @ (M @ vectors)))


def _check_memory(unknowns: int, vectors: int) -> None:
    need, free = 8.0 * unknowns * vectors, free_memory()
    if need > free:
        raise ResourceError(
            f"{vectors} Lanczos vectors of {unknowns} unknowns need {need / 1e9:.1f} GB, {free / 1e9:.1f} GB are free: "
            "lower f_max or use a coarser mesh"
        )


def _finished(K: Any, values: FloatArray, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return frequencies and signed shapes; eigenvalues below the rounding of K are rigid modes and become zero."""
    magnitude, rows = np.abs(shapes), abs(K)
    slow = np.flatnonzero(values < _ROUNDING * rows.sum(axis=1).max() * (magnitude**2).sum(axis=0))
    rounding = np.zeros(len(values))
    rounding[slow] = _ROUNDING * np.einsum("ij,ij->j", magnitude[:, slow], rows @ magnitude[:, slow])
    frequency = np.sqrt(np.where(values < rounding, 0.0, values)) / (2 * np.pi)
    largest = np.take_along_axis(shapes, magnitude.argmax(axis=0)[None], axis=0) if shapes.size else np.ones(0)
    return frequency, shapes * np.where(largest < 0, -1.0, 1.0)
