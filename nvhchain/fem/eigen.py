"""Lowest normal modes of K φ = λ M φ by block shift-invert Lanczos, with proof that none is missed.

One factor of K − σM, σ = (2π f_max)², serves three ends. Its negative pivots count the modes below f_max (Sturm). It
inverts for Lanczos: A = (K − σM)⁻¹M has the eigenvalues θ = 1/(λ − σ), and the modes below f_max are those with θ < 0.
Blocks turn the triangular solves into matrix products; every block is made orthogonal to all others in the M inner
product (Grimes, Lewis & Simon, SIAM J. Matrix Anal. Appl. 15, 1994).

The first block is x₀ = (K − σM)⁻¹b for some loads b, and random directions. The basis then also holds how all modes
above f_max move under the loads: their residual flexibility r₁ = Σ φ φᵀb/λ with φᵀb/λ = φᵀM x₀/(1 + σθ) over θ > 0, and
r₂ = Σ φ φᵀb/λ², … Ritz vectors in the space of r₁ … r_p move as these modes do, up to ω^(2p) in the series over ω; at
the loads themselves up to ω^(4p) (Galerkin; compare Craig & Kurdila, Fundamentals of Structural Dynamics, 2nd ed.,
§17). Rigid modes lie below f_max and take no part, so that K may be singular.

Where no solver factors indefinite matrices of that size, σ lies below zero: K − σM is positive definite. θ is then
positive, and nothing counts the modes. They are complete as soon as they and the first ones above f_max have converged,
and further random directions have revealed no others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import ResourceError, SolverError, require
from nvhchain.fem._sparse import Factor, counts_eigenvalues, factorize
from nvhchain.handoff import FloatArray
from nvhchain.runtime.memory import free_memory

BLOCK, _DRAWN = 16, 2
"""Least number of vectors per Lanczos step, and of random ones among them, for modes that the loads do not excite."""

_NEGATIVE_SHIFT, _UNCOUNTED, _HIGHER_MODES, _ROUGH, _PROBES = 0.01, 500, 8, 1e-3, 3
"""Without a count of the modes: −σ over (2π f_max)², modes for which room is foreseen, the modes above f_max that have
to converge too, their relative residual, and steps with further random directions that must reveal no mode."""

_DENSE = 400
"""Number of unknowns below which a dense solution is faster and robust."""

_ROUNDING = 4 * np.finfo(float).eps
"""Relative rounding error of a stiffness entry, the sum of several element contributions."""

_DEPENDENT = 1e-12
"""Relative eigenvalue of a scaled Gram matrix below which a direction counts as dependent on the others."""

_MODES_ALONE = 1e-6
"""Square of the part outside the modes below which a direction of the residual motions consists of modes alone."""

_STEEP = 1e-4
"""Relative eigenvalue below which a normalised block is made orthogonal to the basis once more."""

_FAINT, _NOTHING = 1e-8, 1e-14
"""Remainder of a block outside the basis, relative to the operator's norm. Below the first the block is made orthogonal
once more. Below the second it is rounding: the basis then holds the operator's whole image of this direction."""

_MOVED = 1e-6
"""Relative rise of σ for another attempt if the first fails, mostly because f_max is a natural frequency."""

_SINGULAR = 1e8
"""Largest θσ of the modes beside f_max: rounding errors of the others are as many times larger."""

_TOLERANCE, _FINEST = 4e-7, 1e-8
"""Residual of an eigenpair relative to its eigenvalue (of the inverted operator), and of the residual flexibility.

It is the error of a shape beside modes that are well separated from it. The error of λ is about its square times σ.
Slow modes therefore converge to 1e-5 √(λ/σ), down to the second value.
"""

_INDEFINITE = 0.01
"""Negative eigenvalue of (K, M) over (2π f_max)² that is no rounding of a rigid mode."""

_SMALL = 1e-13
"""Rounding error of the residual flexibility over the first block."""

_LOST = 1e-12
"""Relative rounding error of λ = σ + 1/θ above which a Rayleigh–Ritz step with K replaces it."""


def lowest_modes(K: Any, M: Any, f_max: float) -> tuple[FloatArray, FloatArray]:
    """Return natural frequencies up to f_max and mass-normalised shapes.

    K, M (n, n) sparse matrices: symmetric stiffness and mass; K semidefinite, M positive definite.
    f_max: highest frequency (Hz), > 0.
    Returns frequency (m,): natural frequencies (Hz); a rigid mode, zero up to rounding, has 0. shapes (n, m): shapes
    (kg^-½), with a positive largest component.
    """
    return modes_and_ritz_vectors(K, M, f_max, np.empty((K.shape[0], 0)), ())[:2]


@dataclass(frozen=True, eq=False)
class RitzVectors:
    """Vectors that move under the loads as all modes above a limit do, in rising order of their frequencies.

    frequency : (r,) frequencies (Hz), above the limit.
    shapes : (n, r) mass-normalised shapes (kg^-½), orthogonal to the modes and to each other.
    """

    frequency: FloatArray
    shapes: FloatArray


def modes_and_ritz_vectors(
    K: Any, M: Any, f_max: float, load: FloatArray, terms: Sequence[int]
) -> tuple[FloatArray, FloatArray, list[RitzVectors]]:
    """Return `lowest_modes`, and Ritz vectors of all other modes under loads (n, k) for each number of terms.

    terms: numbers p ≥ 1 of residual motions r₁ … r_p that the vectors span; they are exact statically, and p·k at most.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    limit = (2 * np.pi * f_max) ** 2
    if K.shape[0] <= _DENSE:
        values, shapes = scipy.linalg.eigh(K.toarray(), M.toarray())
        count = int(np.searchsorted(values, limit, side="right"))
        above = shapes[:, count:]
        series = [above.T @ load / values[count:, None] ** number for number in range(1, max(terms, default=0) + 1)]
        values, shapes = values[:count], shapes[:, :count]
        ritz = _ritz_vectors(K, M, shapes, above, series, terms)
    else:
        shifts = (limit, (1 + _MOVED) * limit) if counts_eigenvalues(K.shape[0]) else (-_NEGATIVE_SHIFT * limit,)
        for shift in shifts:
            try:
                with _shifted(K, M, shift) as factor:
                    bounds = (shift, max(shift, (1 + _MOVED) * limit))
                    values, shapes, ritz = _lanczos(K, M, factor, bounds, load, terms)
                break
            except SolverError:
                if shift == shifts[-1]:
                    raise
    if (values < -_INDEFINITE * limit).any():
        raise SolverError(
            f"stiffness matrix has the eigenvalue {values.min():.3g} rad²/s², at least 0 is needed: check it"
        )
    return *_finished(K, values, shapes), ritz


def _ritz_vectors(
    K: Any, M: Any, modes: FloatArray, basis: FloatArray, motions: list[FloatArray], terms: Sequence[int]
) -> list[RitzVectors]:
    """Return Ritz vectors beside the modes in the space of the first motions (m, k), for each number of terms.

    basis: (n, m) M-orthonormal vectors, in whose coordinates the motions are given.
    """
    if not motions:
        return []
    spans = [_span(motions[:number]) for number in terms]
    widest = spans[int(np.argmax(terms))]
    vectors = basis @ widest
    vectors -= modes @ (modes.T @ (M @ vectors))
    whole_mass, stiffness = vectors.T @ (M @ vectors), vectors.T @ (K @ vectors)
    found = []
    for span in spans:
        part = widest.T @ span
        mass = part.T @ whole_mass @ part
        part = part[:, mass.diagonal() > _MODES_ALONE]  # the others were rounding errors of the modes
        values, turned = scipy.linalg.eigh(part.T @ stiffness @ part, part.T @ whole_mass @ part)
        found.append(RitzVectors(np.sqrt(values) / (2 * np.pi), vectors @ (part @ turned)))
    return found


def _span(motions: list[FloatArray]) -> FloatArray:
    """Return orthonormal columns that span the motions (m, k)."""
    series = np.hstack(motions)
    series = series / np.linalg.norm(series, axis=0).clip(np.finfo(float).tiny)
    left, size, _ = np.linalg.svd(series, full_matrices=False)
    return np.asarray(left[:, size > _DEPENDENT * max(size.max(initial=0.0), np.finfo(float).tiny)])


def _shifted(K: Any, M: Any, shift: float) -> Factor:
    return factorize(sp.csr_matrix(K - shift * M), symmetric_positive_definite=shift < 0)


def _lanczos(
    K: Any, M: Any, factor: Factor, bounds: tuple[float, float], load: FloatArray, terms: Sequence[int]
) -> tuple[FloatArray, FloatArray, list[RitzVectors]]:
    """Return eigenvalues and shapes of (K, M) below a limit, and Ritz vectors of the others under the loads.

    bounds: shift of `factor`, K − shift·M, and limit, which is the shift or lies above a negative one.

    Three-term recurrence, then a pass against the whole basis. M Q is kept with Q: two products with M per step. Below
    a negative shift the operator changes its sign: the wanted eigenvalues are the negative ones in both cases.
    """
    (shift, limit), sign = bounds, 1.0 if bounds[0] > 0 else -1.0
    n, loads, shift = M.shape[0], load.shape[1], abs(shift)
    counted = sign > 0
    expected = factor.negative if counted else _UNCOUNTED
    if not expected + loads:
        return np.empty(0), np.empty((n, 0)), [RitzVectors(np.empty(0), load) for _ in terms]
    highest = -0.5 / shift if counted else -1 / (limit + shift)  # of the wanted ones; λ = 0 is at −1/shift
    width = max(BLOCK, loads + _DRAWN)
    capacity = min(n, 6 * expected + 64 * width)
    _check_memory(n, min(capacity, 4 * (expected if counted else 4 * width) + 4 * width))
    basis = np.empty((n, capacity + 2 * width), order="F")  # the system allocates pages as they are filled
    projected = np.zeros((capacity + 2 * width, capacity + 2 * width))
    random = np.random.default_rng(20)
    # loads that move the whole structure are almost parallel: Householder's QR keeps their small differences
    scale = np.sqrt(M.diagonal().clip(np.finfo(float).eps * M.diagonal().max()))[:, None]
    drawn = M @ random.standard_normal((n, width - loads))
    block, upper = scipy.linalg.qr(scale * factor.solve(np.hstack([load, drawn])), mode="economic")
    block, weighted, coupling = _next_block(block / scale, basis[:, :0], M, 0.0, random)
    start = coupling @ upper[:, :loads]
    first, size, coupling = 0, 0, np.empty((block.shape[1], 0))
    revealed, unchanged = -1, 0
    while True:
        before, first, size = first, size, size + block.shape[1]
        basis[:, first:size] = block
        new = sign * factor.solve(weighted)
        diagonal = weighted.T @ new
        new -= block @ diagonal
        new -= basis[:, before:first] @ coupling.T
        projected[first:size, first:size] = (diagonal + diagonal.T) / 2
        inverse, vectors = np.linalg.eigh(projected[:size, :size])  # reads the lower triangle
        norm = float(np.abs(inverse).max())
        if norm * shift > _SINGULAR:
            raise SolverError(f"{np.sqrt(shift) / (2 * np.pi)} Hz is a natural frequency: move f_max away from it")
        block, weighted, coupling = _next_block(new, basis[:, :size], M, norm, random)
        found = int((inverse < highest).sum())
        if counted and found > expected:
            raise SolverError(f"{found} modes found below the limit, {expected} by the Sturm count")
        if found == expected or not counted:
            # A V s − V s θ = Q C s_last, with Q the next block, C its coupling and s_last the last rows of s. The term
            # also improves the vector: one more application of A that costs no solution
            theta, below, above = inverse[:found], vectors[:, :found], vectors[:, found:]
            excited = above[: len(start)].T @ start / (1 + shift * inverse[found:, None])  # φᵀb/λ
            static = above @ excited
            correction = coupling @ below[first:size] / theta
            spilled = correction @ (below[: len(start)].T @ start)  # from the modes into the residual
            error = np.linalg.norm(np.hstack([correction, -shift * (coupling @ static[first:size]), spilled]), axis=0)
            finest = np.clip(1e-5 * np.sqrt(np.abs(1 + 1 / (shift * theta))), _FINEST, _TOLERANCE)
            if not counted:
                finest[:] = _FINEST
            least = _TOLERANCE * np.linalg.norm(static, axis=0) + _SMALL * np.linalg.norm(start, axis=0)
            allowed = np.concatenate([finest, least, least])
            converged = (error <= allowed).all()
            if block.shape[1] == 0 or (counted and converged):
                break
            following = slice(found, found + _HIGHER_MODES)
            left = np.linalg.norm(coupling @ vectors[first:size, following] / inverse[following], axis=0)
            if converged and len(left) == _HIGHER_MODES and (left < _ROUGH).all():
                unchanged = unchanged + 1 if found == revealed else 0
                if unchanged > _PROBES:
                    break
                if revealed < 0:
                    block, weighted, coupling = _add_random(block, coupling, basis[:, :size], M, random)
                revealed = found
        if block.shape[1] == 0 or size + block.shape[1] > capacity:
            raise SolverError(
                f"{found}{f' of {expected}' if counted else ''} modes converged in a Krylov space of {size}: "
                "move f_max into a gap of the spectrum or look for a badly scaled mass matrix"
            )
        projected[size : size + block.shape[1], first:size] = coupling
    whole = size + block.shape[1]
    basis[:, size:whole] = block
    values, shapes = sign * (shift + 1 / theta), basis[:, :whole] @ np.vstack([below, correction])
    higher = shift + 1 / np.where(inverse[found:] == 0, np.finfo(float).tiny, inverse[found:])
    before, series = np.zeros_like(static), []
    for number in range(max(terms, default=0)):
        motion = above @ (excited / (sign * higher[:, None]) ** number)
        # r_j = A r_(j−1) − σ A r_j, once more as above
        series.append(np.vstack([motion, coupling @ (before - shift * motion)[first:size]]))
        before = sign * motion
    order = np.argsort(values)
    values, shapes = values[order], shapes[:, order]
    lost = np.flatnonzero(np.finfo(float).eps * norm > _LOST * np.abs(values) * (values - sign * shift) ** -2.0)
    if lost.size:
        part = shapes[:, lost]
        values[lost], turned = scipy.linalg.eigh(part.T @ (K @ part), part.T @ (M @ part))
        shapes[:, lost] = part @ turned
    return values, shapes, _ritz_vectors(K, M, shapes, basis[:, :whole], series, terms)


def _next_block(
    new: FloatArray, basis: FloatArray, M: Any, norm: float, random: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return M-orthonormal Q, also orthogonal to the basis, M Q, and R with new = Q R + a part in the basis.

    norm : norm of the operator that made `new`, which is overwritten.

    Random directions replace those that depend on others or lie in the basis; R has rows of zeros for them. Otherwise
    the operator reveals no more modes of a repeated frequency than a block has vectors.
    """
    weighted = M @ new
    new -= ((weighted.T @ basis) @ basis.T).T  # by rows of the transpose: half the time
    gram = new.T @ weighted
    scale = np.sqrt(gram.diagonal().clip(np.finfo(float).tiny))
    value, vector = np.linalg.eigh(gram / np.outer(scale, scale))
    left = np.linalg.norm(vector * scale[:, None], axis=0) * np.sqrt(value.clip(0.0))
    room = min(new.shape[1], len(new) - basis.shape[1])
    keep = (value > _DEPENDENT * max(value[-1], np.finfo(float).tiny)) & (left > _NOTHING * norm)
    keep[: len(keep) - room] = False
    # arrays are used again: fresh ones of this size cost as much time as the products
    Q = np.matmul(new, vector[:, keep] / np.sqrt(value[keep]) / scale[:, None], out=weighted[:, : keep.sum()])
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
    block = np.matmul(Q, normalise, out=new[:, : Q.shape[1]])
    return block, np.matmul(weighted, normalise, out=Q), lower.T @ R


def _add_random(
    block: FloatArray, coupling: FloatArray, basis: FloatArray, M: Any, random: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return an M-orthonormal block with as many random directions beside it, its product with M, and its coupling."""
    before, drawn = np.hstack([basis, block]), random.standard_normal(block.shape)
    for _ in range(2):
        drawn = _orthogonal_part(before, drawn, M)
        drawn = scipy.linalg.solve_triangular(np.linalg.cholesky(drawn.T @ (M @ drawn)), drawn.T, lower=True).T
    block = np.hstack([block, drawn])
    return block, M @ block, np.vstack([coupling, np.zeros((drawn.shape[1], coupling.shape[1]))])


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
