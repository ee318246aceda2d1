"""Systems of matrices compressed row by row: the far field of a group of rows has few degrees of freedom."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import blas, eigh

from nvhchain.acoustics.surfaces.bodies import split_bodies
from nvhchain.acoustics.surfaces.clustering import bisect, diameter, distance_to_box, groups
from nvhchain.acoustics.systems.iterative import SINGLE_RESIDUAL, IterativeSystem, Patches
from nvhchain.errors import SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface

LARGEST = 512
"""Largest number of rows whose far columns are compressed together."""

SMALLEST = 32
"""Number of rows that are not divided further; their near entries are stored uncompressed."""

SEPARATION = 0.3
"""Smallest distance of a far column from a group of rows, in diameters of the group. The error does not depend on it.
At 0.3, the compressed matrices are smallest; 0.6 and 1 take 5 to 30 % more for a gearbox."""

DIVISION_RATIO = 0.8
"""Largest size of factors, relative to the entries they replace, at which a group is not divided."""

SKETCH = 4
"""Columns per row of the random mixture that yields the dominant directions."""

SINGLE = 1e-5
"""Error from which single precision, which solves to a residual of about 1e-7, adds nothing."""


@dataclass(frozen=True, eq=False)
class _DenseBlock:
    """Entries (n_row, n_column) stored uncompressed."""

    rows: IntArray
    columns: IntArray
    values: ComplexArray


@dataclass(frozen=True, eq=False)
class _Far:
    """Entries of far columns as directions (n_row, rank) · weights (rank, n_column)."""

    rows: IntArray
    columns: IntArray
    directions: ComplexArray
    weights: ComplexArray


class CompressedMatrix:
    """Matrix (n_row, n_column) whose far entries are products of narrow factors.

    Rows that are neighbours in space form groups. For every group, the entries of far columns are projected on the few
    directions that carry them. The other columns pass to the two halves of the group. The smallest groups store theirs
    uncompressed. Rows come in stripes, so that the whole matrix never exists.

    positions : (n_row, 3) positions of the rows (m).
    columns : (n_column, 3) positions of the columns, and of their images (m).
    error : error relative to the norm of each row, root mean square over every group of rows. It applies to the part
        of every body by itself: a small body that sounds alone is negligible in the whole row of a large one.
    bodies : (n,) columns of each body; without it there is one body.
    """

    def __init__(
        self,
        positions: FloatArray,
        columns: Sequence[FloatArray],
        error: float,
        bodies: Sequence[IntArray] | None = None,
    ) -> None:
        """Start an empty matrix; see the class for the parameters."""
        self._positions, self._columns, self._error = positions, columns, error
        self._bodies = [np.arange(len(columns[0]))] if bodies is None else bodies
        self.shape = len(positions), len(columns[0])
        self._kind = np.complex64 if error >= SINGLE else np.complex128
        self._near: list[_DenseBlock] = []
        self._far: list[_Far] = []
        self._random = np.random.default_rng(0)

    def fill(self, rows: IntArray, values: ComplexArray) -> None:
        """Compress some rows, neighbours in space, with matrix entries `values` (n_row, n_column)."""
        if not np.isfinite(values).all():
            raise SolverError("boundary element matrix holds values that are not finite: the engine failed")
        together = groups(self._positions[rows], LARGEST)
        for columns in self._bodies:
            sizes = np.sqrt([np.vdot(row[columns], row[columns]).real for row in values])
            sizes[sizes == 0.0] = 1.0
            for group in together:
                self._divide(rows, values, sizes / np.sqrt(len(columns)), group, columns)

    def _divide(
        self, rows: IntArray, values: ComplexArray, sizes: FloatArray, group: IntArray, columns: IntArray
    ) -> None:
        """Store the entries of `group` (into rows) and `columns`: far ones as factors, others divided or uncompressed.

        sizes : (n_row,) root mean squares of all rows, the unit of errors: rows of small triangles are small.
        """
        here = self._positions[rows[group]]
        distance = np.min([distance_to_box(here, points[columns]) for points in self._columns], axis=0)
        far = distance >= SEPARATION * diameter(here)
        if far.sum() > len(group):
            block = values[np.ix_(group, columns[far])] / sizes[group, None].astype(values.real.dtype)
            directions = self._dominant(block, self._error * np.sqrt(block.size))
            if directions.shape[1] * (len(group) + far.sum()) < DIVISION_RATIO * block.size:
                weights = directions.conj().T.astype(self._kind) @ block.astype(self._kind)
                directions = (directions * sizes[group, None]).astype(self._kind)
                self._far.append(_Far(rows[group], columns[far], directions, weights))
                columns = columns[~far]
        if len(group) > SMALLEST:
            for half in bisect(self._positions[rows], group):
                self._divide(rows, values, sizes, half, columns)
        else:
            self._near.append(_DenseBlock(rows[group], columns, values[np.ix_(group, columns)].astype(self._kind)))

    def _dominant(self, block: ComplexArray, tolerance: float) -> ComplexArray:
        """Return orthonormal directions (n_row, rank) outside which the block has at most `tolerance` (Frobenius)."""
        count = SKETCH * len(block)
        if block.shape[1] > 2 * count:
            # Random sums of columns with random signs preserve the weight of every direction (Charikar, Chen & Farach-
            # Colton, Theor. Comput. Sci. 312, 2004, 3), and their squares are cheap.
            order = self._random.permutation(block.shape[1])
            sign = self._random.choice([-1.0, 1.0], block.shape[1])
            sums = np.zeros((len(block), count), dtype=complex)
            for start in range(0, len(order), count):
                some = order[start : start + count]
                sums[:, : len(some)] += block[:, some] * sign[some]
            block = sums
        transposed = block.T.astype(complex, copy=False)  # as BLAS reads a C-ordered block
        squares = blas.zherk(1.0, transposed, trans=2, lower=1)  # conj(block blockᴴ)
        value, vector = eigh(squares, lower=True, overwrite_a=True, check_finite=False)
        left = np.cumsum(np.maximum(value, 0.0))
        return np.ascontiguousarray(vector[:, np.searchsorted(left, tolerance**2) :].conj())

    @property
    def memory(self) -> int:
        """Bytes of the stored factors and entries with their columns."""
        kept = sum(near.values.nbytes + near.columns.nbytes for near in self._near)
        return kept + sum(far.directions.nbytes + far.weights.nbytes + far.columns.nbytes for far in self._far)

    def apply(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Return matrix · x, (n_row, …) of (n_column, …)."""
        x = x.astype(complex if exact else self._kind)
        y = np.zeros((self.shape[0], *x.shape[1:]), dtype=x.dtype)
        for near in self._near:
            y[near.rows] += near.values @ x[near.columns]
        for far in self._far:
            y[far.rows] += far.directions @ (far.weights @ x[far.columns])
        return y.astype(complex)

    def apply_transposed(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Return matrixᵀ · x (not conjugated), (n_column, …) of (n_row, …)."""
        x = x.astype(complex if exact else self._kind)
        y = np.zeros((self.shape[1], *x.shape[1:]), dtype=x.dtype)
        for near in self._near:
            y[near.columns] += near.values.T @ x[near.rows]
        for far in self._far:
            y[far.columns] += far.weights.T @ (far.directions.T @ x[far.rows])
        return y.astype(complex)


Stripe = tuple[IntArray, ComplexArray, ComplexArray]
"""Rows (n_row,), A (n_k, n_row, n_v) and B (n_k, n_row, n_face) of some rows at every wavenumber."""


def compressed_systems(
    stripes: Iterable[Stripe], surface: Surface, count: int, fidelity: AcousticsFidelity, plane: RigidPlane | None
) -> list[IterativeSystem]:
    """Return A p = B ∂p/∂n at `count` wavenumbers from stripes, compressed to `fidelity.compression_error`.

    stripes : all rows, in stripes.
    plane : rigid plane, whose image of the body is part of the matrices.

    SolverError for values that are not finite.
    """
    vertices, centroids = [surface.vertices], [surface.centroids]
    if plane is not None:
        vertices, centroids = [*vertices, plane.mirror(vertices[0])], [*centroids, plane.mirror(centroids[0])]
    error = fidelity.compression_error
    faces = [body_faces for body_faces, _ in split_bodies(surface)]
    corners = [np.unique(surface.triangles[body_faces]) for body_faces in faces]
    a = [CompressedMatrix(surface.vertices, vertices, error, corners) for _ in range(count)]
    b = [CompressedMatrix(surface.vertices, centroids, error, faces) for _ in range(count)]
    patches = [Patches(surface.vertices) for _ in range(count)]
    single = False
    for rows, a_rows, b_rows in stripes:
        single = a_rows.dtype == np.complex64
        for i in range(count):
            patches[i].fill(rows, a_rows[i])
            a[i].fill(rows, a_rows[i])
            b[i].fill(rows, b_rows[i])
    residual = max(fidelity.solver_residual, 0.1 * error, SINGLE_RESIDUAL if single else 0.0)
    return [
        IterativeSystem(
            a_matrix, b_matrix, partial(list.pop, [filled]), residual, fidelity.solver_iterations, "compressed"
        )
        for a_matrix, b_matrix, filled in zip(a, b, patches, strict=True)
    ]


def compressed_size(n_vertex: int, n_face: int, fidelity: AcousticsFidelity) -> int:
    """Return the bytes of both compressed matrices for `fidelity.elements_per_wavelength`.

    The formula fits gearboxes of 1800 to 28 300 triangles with 4.6 to 430 elements per wavelength within 12 %. The far
    field of a group of rows has additional degrees of freedom for each wavelength in the group.
    """
    share = 0.2 + 260.0 / n_vertex + 6.0 / fidelity.elements_per_wavelength**2
    share *= 0.72 ** np.log10(fidelity.compression_error / 1e-5)
    entry = 8 if fidelity.compression_error >= SINGLE else 16
    return int(min(share, 1.0) * entry * n_vertex * (n_vertex + n_face))
