"""Boundary element matrices compressed row by row: what a group of rows sees from afar has few degrees of freedom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas, eigh

from nvhchain.acoustics.surfaces.clustering import diameter, distance_to_box, groups, halves
from nvhchain.errors import SolverError
from nvhchain.handoff import ComplexArray, FloatArray, IntArray

LARGEST = 512
"""Rows whose far columns are compressed together at most."""

SMALLEST = 32
"""Rows that are not divided further: what they see from near by is kept as it is."""

SEPARATION = 0.3
"""Least distance of a far column from a group of rows, in diameters of the group. The error is kept whatever it is; at
0.3 the compressed matrices are smallest (0.6 and 1 take 5 to 30 % more on a gearbox)."""

WORTH = 0.8
"""A group is divided unless its factors take less than this share of what they replace."""

SKETCH = 4
"""Columns of the random mixture from which the dominant directions are found, per row."""

SINGLE = 1e-5
"""Error from which single precision, which solves to a residual of some 1e-7, adds nothing to it."""


@dataclass(frozen=True, eq=False)
class _Near:
    """values (n_row, n_column): kept entries."""

    rows: IntArray
    columns: IntArray
    values: ComplexArray


@dataclass(frozen=True, eq=False)
class _Far:
    """directions (n_row, rank) · weights (rank, n_column): what the rows see of far columns."""

    rows: IntArray
    columns: IntArray
    directions: ComplexArray
    weights: ComplexArray


class CompressedMatrix:
    """A matrix (n_row, n_column) whose far entries are products of narrow factors.

    For every group of rows that are neighbours in space, the entries of all columns at a distance from it are projected
    on the few directions that carry them; the columns left over pass to the two halves of the group, and what the
    smallest groups have left is stored as it is. Rows come in stripes, so that the whole matrix never exists.
    """

    def __init__(
        self,
        positions: FloatArray,
        columns: Sequence[FloatArray],
        error: float,
        bodies: Sequence[IntArray] | None = None,
    ) -> None:
        """positions: (n_row, 3) m of the rows.  columns: (n_column, 3) m of the columns, and of their images.

        error: relative to the norm of each row, as the root mean square over every group of rows; of what it has of
        every body by itself: a small one that sounds alone is nothing beside the whole row of a large one.
        bodies: the columns (n,) of each.  None: of one body.
        """
        self._positions, self._columns, self._error = positions, columns, error
        self._bodies = [np.arange(len(columns[0]))] if bodies is None else bodies
        self.shape = len(positions), len(columns[0])
        self._kind = np.complex64 if error >= SINGLE else np.complex128
        self._near: list[_Near] = []
        self._far: list[_Far] = []
        self._random = np.random.default_rng(0)

    def fill(self, rows: IntArray, values: ComplexArray) -> None:
        """Compress some rows, neighbours in space, of which `values` (n_row, n_column) is the matrix."""
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
        """Store the entries of `group` (into rows) and `columns`: far ones as factors, the others divided or kept.

        sizes: (n_row,) root mean squares of all rows, in which errors are counted: rows of small triangles are small.
        """
        here = self._positions[rows[group]]
        distance = np.min([distance_to_box(here, points[columns]) for points in self._columns], axis=0)
        far = distance >= SEPARATION * diameter(here)
        if far.sum() > len(group):
            block = values[np.ix_(group, columns[far])] / sizes[group, None].astype(values.real.dtype)
            directions = self._dominant(block, self._error * np.sqrt(block.size))
            if directions.shape[1] * (len(group) + far.sum()) < WORTH * block.size:
                weights = directions.conj().T.astype(self._kind) @ block.astype(self._kind)
                directions = (directions * sizes[group, None]).astype(self._kind)
                self._far.append(_Far(rows[group], columns[far], directions, weights))
                columns = columns[~far]
        if len(group) > SMALLEST:
            for half in halves(self._positions[rows], group):
                self._divide(rows, values, sizes, half, columns)
        else:
            self._near.append(_Near(rows[group], columns, values[np.ix_(group, columns)].astype(self._kind)))

    def _dominant(self, block: ComplexArray, allowed: float) -> ComplexArray:
        """Orthonormal directions (n_row, rank) outside which the block has no more than `allowed` (Frobenius)."""
        count = SKETCH * len(block)
        if block.shape[1] > 2 * count:
            # Columns added up at random with random signs keep the weight of every direction (Charikar, Chen &
            # Farach-Colton, Theor. Comput. Sci. 312, 2004, 3), and the squares of the sums are soon made.
            order = self._random.permutation(block.shape[1])
            sign = self._random.choice([-1.0, 1.0], block.shape[1])
            sums = np.zeros((len(block), count), dtype=complex)
            for start in range(0, len(order), count):
                some = order[start : start + count]
                sums[:, : len(some)] += block[:, some] * sign[some]
            block = sums
        by_columns = block.T.astype(complex, copy=False)  # as BLAS reads a C-ordered block
        squares = blas.zherk(1.0, by_columns, trans=2, lower=1)  # conj(block blockᴴ)
        value, vector = eigh(squares, lower=True, overwrite_a=True, check_finite=False)
        left = np.cumsum(np.maximum(value, 0.0))
        return np.ascontiguousarray(vector[:, np.searchsorted(left, allowed**2) :].conj())

    @property
    def memory(self) -> int:
        """Bytes of the stored factors and entries with their columns."""
        kept = sum(near.values.nbytes + near.columns.nbytes for near in self._near)
        return kept + sum(far.directions.nbytes + far.weights.nbytes + far.columns.nbytes for far in self._far)

    def apply(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Matrix · x, (n_row, …) of (n_column, …)."""
        x = x.astype(complex if exact else self._kind)
        y = np.zeros((self.shape[0], *x.shape[1:]), dtype=x.dtype)
        for near in self._near:
            y[near.rows] += near.values @ x[near.columns]
        for far in self._far:
            y[far.rows] += far.directions @ (far.weights @ x[far.columns])
        return y.astype(complex)

    def apply_transposed(self, x: ComplexArray, exact: bool = False) -> ComplexArray:
        """Matrixᵀ · x (not conjugated), (n_column, …) of (n_row, …)."""
        x = x.astype(complex if exact else self._kind)
        y = np.zeros((self.shape[1], *x.shape[1:]), dtype=x.dtype)
        for near in self._near:
            y[near.columns] += near.values.T @ x[near.rows]
        for far in self._far:
            y[far.columns] += far.weights.T @ (far.directions.T @ x[far.rows])
        return y.astype(complex)
