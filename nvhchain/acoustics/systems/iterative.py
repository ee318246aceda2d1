"""Boundary element systems solved by GMRES, several right-hand sides at once, preconditioned by overlapping patches.

A dense system is factorised or iterated, whichever is cheaper.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from nvhchain.acoustics.surfaces.clustering import distance_to_box, groups
from nvhchain.acoustics.systems.linear_system import DenseMatrix, DirectSystem, Matrix, SolverRecord, System
from nvhchain.errors import SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray
from nvhchain.runtime.threads import blas_threads

SINGLE_RESIDUAL = 1e-6
"""Smallest residual that products in single precision reach reliably."""

PRODUCTS = 30
"""Cost of an iterative solution per right-hand side, in products with A at the rate of a factorisation. It stands for
20 iterations at two thirds of that rate."""

SETUP = 250
"""Cost of the patches, in products with A."""


PATCH = 64
"""Unknowns that one patch owns."""

REACH = 192
"""Unknowns that one patch solves for, its neighbours included. Three times its own halve the iterations of patches
without overlap; more costs as much as it saves."""

CYCLE = 50
"""Iterations after which GMRES restarts from its residual, so that the Krylov spaces stay small."""

COLUMNS = 16
"""Right-hand sides iterated together: enough for products of matrices, few enough for their Krylov spaces."""

Product = Callable[[ComplexArray], ComplexArray]


class Patches:
    """Diagonal blocks of A for overlapping groups of neighbours: y[own] = (A[all, all]⁻¹ x[all])[own] in every group.

    This is restricted additive Schwarz (Cai & Sarkis, SIAM J. Sci. Comput. 21, 1999, 792). The only ill-conditioned
    part of A is the effect of Burton and Miller's hypersingular operator among neighbours, which the patches invert.
    """

    def __init__(self, positions: FloatArray) -> None:
        """Choose the groups for unknowns at `positions` (n, 3) m; `fill` must follow for all rows."""
        self.members: list[IntArray] = []
        self.own: list[int] = []
        for own in groups(positions, PATCH):
            distance = distance_to_box(positions[own], positions)
            distance[own] = -1.0
            nearest = np.argpartition(distance, min(REACH, len(positions)) - 1)[:REACH]
            self.members.append(np.concatenate([own, nearest[distance[nearest] >= 0.0]]))
            self.own.append(len(own))
        self._blocks = [np.empty((len(m), len(m)), dtype=complex) for m in self.members]
        self._inverses: dict[bool, list[ComplexArray]] = {}

    def fill(self, rows: IntArray, values: ComplexArray) -> None:
        """Store the entries of some rows of A, (n_row, n), that belong to patches."""
        place = np.full(max(int(m.max()) for m in self.members) + 1, -1)
        place[rows] = np.arange(len(rows))
        for members, block in zip(self.members, self._blocks, strict=True):
            member_rows = place[members]
            here = member_rows >= 0
            if here.any():
                block[here] = values[np.ix_(member_rows[here], members)]

    def apply(self, x: ComplexArray) -> ComplexArray:
        """Return an approximation of A⁻¹ x, (n, m)."""
        return self._apply(x, transposed=False)

    def apply_transposed(self, x: ComplexArray) -> ComplexArray:
        """Return an approximation of A⁻ᵀ x, (n, m)."""
        return self._apply(x, transposed=True)

    def _apply(self, x: ComplexArray, transposed: bool) -> ComplexArray:
        if transposed not in self._inverses:
            self._inverses[transposed] = [
                _rows_of_inverse(block.T if transposed else block, own)
                for block, own in zip(self._blocks, self.own, strict=True)
            ]
        y = np.empty_like(x)
        for members, own, inverse in zip(self.members, self.own, self._inverses[transposed], strict=True):
            y[members[:own]] = inverse @ x[members]
        return y


def _rows_of_inverse(block: ComplexArray, count: int) -> ComplexArray:
    try:
        return np.ascontiguousarray(np.linalg.solve(block.T, np.eye(len(block), count)).T)
    except np.linalg.LinAlgError as error:
        raise SolverError(
            "boundary element matrix is singular among neighbours: look for coinciding surfaces or very thin gaps"
        ) from error


class IterativeSystem:
    """System A p = B ∂p/∂n solved by GMRES to a relative residual.

    a, b : matrices of the system.
    patches : returns patches filled with the rows of A, when they are needed.
    residual : residual relative to each right-hand side.
    iterations : largest number of iterations.
    name : name of the solver in the record.
    """

    def __init__(
        self,
        a: Matrix,
        b: Matrix,
        patches: Callable[[], Patches],
        residual: float,
        iterations: int,
        name: str = "iterative",
    ) -> None:
        """Keep the matrices; see the class for the parameters."""
        self._a, self._b, self._filled = a, b, patches
        self._residual, self._iterations = residual, iterations
        self.record = SolverRecord((name,), tolerance=residual)

    @cached_property
    def _patches(self) -> Patches:
        return self._filled()

    def solve(self, rhs: ComplexArray) -> ComplexArray:
        """Return A⁻¹ rhs; SolverError if the residual is not reached."""
        return self._solve(self._a.apply, self._patches.apply, rhs)

    def adjoint(self, rhs: ComplexArray) -> ComplexArray:
        """Return Bᵀ A⁻ᵀ rhs; SolverError if the residual is not reached."""
        return self._b.apply_transposed(self._solve(self._a.apply_transposed, self._patches.apply_transposed, rhs))

    def apply_b(self, gradient: ComplexArray) -> ComplexArray:
        """Return B · gradient."""
        return self._b.apply(gradient)

    def release(self) -> None:
        """Release all matrices."""
        del self._a, self._b, self._filled
        self.__dict__.pop("_patches", None)

    def _solve(self, product: Callable[..., ComplexArray], precondition: Product, rhs: ComplexArray) -> ComplexArray:
        # Most products are small: BLAS threads that wait for the next one would cost more than they save.
        with blas_threads(1):
            return gmres(
                product,
                precondition,
                rhs,
                residual=self._residual,
                iterations=self._iterations,
                reached=self._reached,
                exact=partial(product, exact=True),
            )

    def _reached(self, residual: float) -> None:
        self.record += SolverRecord(residual=residual)


def patches_size(unknowns: int) -> int:
    """Return the bytes of the patches for `unknowns`; halving leaves three quarters of `PATCH` to each."""
    return int(16 * unknowns * min(REACH, unknowns) ** 2 / (0.75 * PATCH))


def iteration_size(unknowns: int) -> int:
    """Return the bytes of the patches' inverses and of the Krylov spaces of a solution for `unknowns`."""
    return int(16 * unknowns * (REACH + COLUMNS * CYCLE / 2))


def gmres(
    product: Product,
    precondition: Product,
    rhs: ComplexArray,
    *,
    residual: float,
    iterations: int,
    reached: Callable[[float], None] = lambda residual: None,
    exact: Product | None = None,
) -> ComplexArray:
    """Return x with |rhs − A x| ≤ residual · |rhs| for every column of rhs (n,) or (n, m): restarted GMRES.

    product, precondition : functions on (n, m): A and, from the right, an approximation of its inverse.
    reached : function that receives the largest remaining residual.
    exact : product in double precision if `product` is in single. It corrects the residual after a cycle that is not
        sufficient: for a nearly singular A, products in single precision stagnate.

    Every column has its own Krylov space; the products with A are computed for all of them at once. SolverError with
    the residual if `iterations` are not sufficient.
    """
    columns = rhs.reshape(len(rhs), -1)
    parts = [
        _converged(
            product, exact or product, precondition, columns[:, start : start + COLUMNS], residual, iterations, reached
        )
        for start in range(0, columns.shape[1], COLUMNS)
    ]
    return np.concatenate(parts, axis=1).reshape(rhs.shape)


def _converged(
    product: Product,
    exact: Product,
    precondition: Product,
    rhs: ComplexArray,
    residual: float,
    iterations: int,
    reached: Callable[[float], None],
) -> ComplexArray:
    target = residual * np.linalg.norm(rhs, axis=0)
    x, left, done = np.zeros_like(rhs, dtype=complex), rhs, 0
    while True:
        size = np.linalg.norm(left, axis=0)
        if (size <= target).all():
            reached(float((residual * size / np.where(target > 0, target, 1.0)).max()))
            return x
        if done >= iterations or not np.isfinite(size).all():
            worst = float((size / np.maximum(target, np.finfo(float).tiny)).max() * residual)
            raise SolverError(
                f"boundary element system of {len(rhs)} unknowns: GMRES reached a residual of {worst:.2g} in {done} "
                f"iterations, {residual:.2g} in {iterations} were asked for: choose solver = 'direct' or allow more "
                "solver_iterations; thin gaps and open cavities slow it down"
            )
        step, count = _cycle(product, precondition, left, 0.9 * target, min(CYCLE, iterations - done))
        x = x + step
        left = rhs - product(x)
        if (np.linalg.norm(left, axis=0) > target).any():
            left = rhs - exact(x)
        done += count


def _cycle(
    product: Product, precondition: Product, rhs: ComplexArray, target: FloatArray, iterations: int
) -> tuple[ComplexArray, int]:
    """Return (x, iterations) of one GMRES cycle from x = 0.

    Source: Saad & Schultz, SIAM J. Sci. Stat. Comput. 7, 1986, 856.
    """
    n, m = rhs.shape
    length = np.linalg.norm(rhs, axis=0)
    basis = np.empty((m, iterations + 1, n), dtype=complex)
    basis[:, 0] = (rhs / np.where(length > 0, length, 1.0)).T
    triangle = np.zeros((m, iterations, iterations), dtype=complex)
    g = np.zeros((m, iterations + 1), dtype=complex)
    g[:, 0] = length
    cosine, sine = np.zeros((m, iterations)), np.zeros((m, iterations), dtype=complex)
    steps, open_ = np.zeros(m, dtype=int), length > target
    count = 0
    while count < iterations and open_.any():
        j, count = count, count + 1
        w = product(precondition(basis[:, j].T)).T
        h = np.zeros((m, j + 2), dtype=complex)
        for _ in range(2):  # one classical Gram–Schmidt pass loses orthogonality
            share = np.matmul(basis[:, :count], w.conj()[:, :, None])[:, :, 0].conj()
            w = w - np.matmul(share[:, None, :], basis[:, :count])[:, 0]
            h[:, :count] += share
        length = np.linalg.norm(w, axis=1)
        if not np.isfinite(length).all():
            return np.full_like(rhs, np.nan), count
        basis[:, count] = w / np.where(length > 0, length, 1.0)[:, None]
        for i in range(j):
            upper, lower = h[:, i].copy(), h[:, i + 1].copy()
            h[:, i] = cosine[:, i] * upper + sine[:, i] * lower
            h[:, i + 1] = cosine[:, i] * lower - sine[:, i].conj() * upper
        diagonal, total = np.abs(h[:, j]), np.hypot(np.abs(h[:, j]), length)
        phase = np.where(diagonal > 0, h[:, j], 1.0) / np.where(diagonal > 0, diagonal, 1.0)
        total = np.where(total > 0, total, 1.0)
        cosine[:, j], sine[:, j] = diagonal / total, phase * length / total
        triangle[:, :j, j], triangle[:, j, j] = h[:, :j], phase * np.hypot(diagonal, length)
        g[:, count] = -sine[:, j].conj() * g[:, j]
        g[:, j] *= cosine[:, j]
        steps[open_] = count
        open_ &= (np.abs(g[:, count]) > target) & (length > 0)
    z = np.zeros((n, m), dtype=complex)
    for i, taken in enumerate(steps):
        if taken:
            # least squares: no part along a direction that a singular A maps to zero
            weights = np.linalg.lstsq(triangle[i, :taken, :taken], g[i, :taken])[0]
            z[:, i] = weights @ basis[i, :taken]
    return precondition(z), count


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
