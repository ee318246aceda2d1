"""Lowest normal modes of K φ = λ M φ by block shift-invert Lanczos, with proof that none is missed.

Full reorthogonalisation in the M inner product (Grimes, Lewis & Simon, SIAM J. Matrix Anal. Appl. 15, 1994), blocks so
that the triangular solves run as matrix products; the Sturm count (negative pivots of K − λ_max M) must agree.
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
"""Below this many unknowns a dense solution is quicker and needs no care."""

_ROUNDING = 4 * np.finfo(float).eps
"""Relative error of a stiffness entry that is a sum of some element contributions."""

_DEPENDENT = 1e-12
"""Eigenvalue of a scaled Gram matrix, relative, below which a direction is taken to depend on the others."""

_STEEP = 1e-4
"""The same below which a block is made orthogonal to the basis once more after it has been normalised."""

_FAINT, _NOTHING = 1e-8, 1e-14
"""What is left of a block outside the basis, in parts of the operator's norm: below the first it is made orthogonal
once more too, below the second it is rounding, and the basis holds all that the operator makes of this direction."""

_SHIFT = 0.1
"""Default shift in parts of f_max: K + (2π · 0.1 f_max)² M is positive definite for a free structure too."""


def lowest_modes(
    K: Any, M: Any, f_max: float, *, factor: Factor | None = None, tolerance: float = 1e-6
) -> tuple[FloatArray, FloatArray]:
    """Natural frequencies (m,) Hz up to f_max and mass-normalised shapes (n, m) kg^-½.

    K, M: (n, n) sparse symmetric, K semidefinite, M positive definite.  f_max: Hz, > 0.
    factor: of K itself where the structure is held and the caller has it; otherwise K is shifted and factored here.
    tolerance: of the eigenpair residual, relative to its eigenvalue (of the inverted operator): the error of a shape
        beside modes that are apart from it; that of its frequency is about the square.

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
    """The `expected` eigenpairs of (K, M) below `limit`; `factor` solves with K − shift·M.

    Three-term recurrence, then a pass against the whole basis; M Q is kept with Q: two products with M per step.
    """
    n = M.shape[0]
    capacity = min(n, 6 * expected + 64 * BLOCK)
    _check_memory(n, min(capacity, 4 * expected + 4 * BLOCK))
    basis = np.empty((n, capacity + BLOCK), order="F")  # pages are taken as they are filled
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
            raise SolverError(f"{found} modes found below the limit where the Sturm count says {expected}")
        if found == expected:
            # the residual of a Ritz pair lies in the next block: its norm is ‖coupling · last rows of the vector‖
            residual = np.linalg.norm(coupling @ vectors[first:size, :found], axis=0)
            if block.shape[1] == 0 or (residual <= tolerance * inverse[:found]).all():
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
    """M-orthonormal Q, orthogonal to the basis too, M Q, and R with new = Q R + what lies in the basis.

    norm: of the operator that made `new`.  Directions that depend on others or lie in the basis give way to random
    ones, with rows of zeros in R: of a frequency that many modes share, the operator shows no more than a block has
    vectors.
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
        drawn = _outside(basis, random.standard_normal((len(new), others)), M)
        Q = np.hstack([Q, drawn / np.sqrt(np.einsum("ij,ij->j", drawn, M @ drawn))])
        R = np.vstack([R, np.zeros((others, R.shape[1]))])
    weighted = M @ Q
    if others > 0 or value[0] < _STEEP * value[-1] or left.min() < _FAINT * norm:
        # what of the basis was left by rounding has been enlarged with the directions nearly lost
        Q = _outside(basis, Q, M)
        weighted = M @ Q
    lower = np.linalg.cholesky(Q.T @ weighted)
    normalise = scipy.linalg.solve_triangular(lower, np.eye(len(lower)), lower=True).T
    return Q @ normalise, weighted @ normalise, lower.T @ R


def _outside(basis: FloatArray, vectors: FloatArray, M: Any) -> FloatArray:
    """What of the vectors is M-orthogonal to the basis."""
    return np.asarray(vectors - basis @ (basis.T @ (M @ vectors)))


def _check_memory(unknowns: int, vectors: int) -> None:
    need, free = 8.0 * unknowns * vectors, free_memory()
    if need > free:
        raise ResourceError(
            f"{vectors} Lanczos vectors of {unknowns} unknowns need {need / 1e9:.1f} GB, {free / 1e9:.1f} GB are free: "
            "lower f_max or use a coarser mesh"
        )


def _finished(K: Any, values: FloatArray, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies and signed shapes; an eigenvalue below the rounding of K itself belongs to a rigid mode: zero."""
    magnitude, rows = np.abs(shapes), abs(K)
    slow = np.flatnonzero(values < _ROUNDING * rows.sum(axis=1).max() * (magnitude**2).sum(axis=0))
    rounding = np.zeros(len(values))
    rounding[slow] = _ROUNDING * np.einsum("ij,ij->j", magnitude[:, slow], rows @ magnitude[:, slow])
    frequency = np.sqrt(np.where(values < rounding, 0.0, values)) / (2 * np.pi)
    largest = np.take_along_axis(shapes, magnitude.argmax(axis=0)[None], axis=0) if shapes.size else np.ones(0)
    return frequency, shapes * np.where(largest < 0, -1.0, 1.0)
