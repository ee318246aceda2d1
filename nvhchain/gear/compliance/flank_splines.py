"""Compliance between any two points of a gear's flanks, by splines on the compliance grid.

The cubic spline through the grid values (not-a-knot) is written in B-splines, of which four overlap at a point.  A
point of a flank then has 16 weights, however fine the grid.  The transposed weights spread a force over the grid.  The
compliance of points therefore stays symmetric and not negative.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from nvhchain.errors import require
from nvhchain.gear.compliance.flank_compliance import FlankCompliance
from nvhchain.handoff import FloatArray, IntArray

Weights = tuple[NDArray[np.int32], FloatArray]
"""Coefficients (n, 16) that act at points, and their weights."""

FlankWeights = tuple[Weights, Weights | None]
"""Weights on the grid of a compliance, and on the one of a tooth's own part, if it has one."""

_ANY_TOOTH = np.zeros(1, dtype=np.int64)
"""Position of every tooth among the own parts of teeth, which are all the same."""


@dataclass(frozen=True, eq=False)
class LocalBasis:
    """B-splines that overlap in each interval of a grid, as polynomials.

    breaks (n_interval + 1,): ends of the intervals (m).
    powers (n_interval, degree + 1, degree + 1): coefficients by power of the distance from the interval's start and by
        B-spline.  The first B-spline has the number of the interval.
    """

    breaks: FloatArray
    powers: FloatArray

    @property
    def count(self) -> int:
        """Number of B-splines, which is that of grid values."""
        return len(self.powers) + self.powers.shape[1] - 1

    def values(self, x: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the first B-spline (n,) at each `x` (m) and the values (n, degree + 1) of its B-splines.

        Positions beyond the grid are moved to its end.
        """
        inside = np.clip(x, self.breaks[0], self.breaks[-1])
        interval = np.searchsorted(self.breaks[1:-1], inside, side="right")
        distance = inside - self.breaks[interval]
        power = distance[:, None] ** np.arange(self.powers.shape[1])
        return interval, np.matmul(power[:, None, :], self.powers[interval])[:, 0]


def local_basis(grid: FloatArray) -> tuple[LocalBasis, FloatArray]:
    """Return the B-splines on `grid` (n,) in m, and the matrix (n, n) from grid values to their coefficients."""
    spline = make_interp_spline(grid, np.eye(len(grid)), k=min(3, len(grid) - 1))
    k, knots = spline.k, spline.t
    breaks = knots[k : len(knots) - k]
    powers = np.empty((len(breaks) - 1, k + 1, k + 1))
    for i, start in enumerate(breaks[:-1]):
        for j in range(k + 1):
            b = BSpline.basis_element(knots[i + j : i + j + k + 2])
            powers[i, :, j] = [float(b(start, m)) / factorial(m) for m in range(k + 1)]
    return LocalBasis(breaks, powers), spline.c


def point_weights(radial_basis: LocalBasis, axial_basis: LocalBasis, radius: FloatArray, axial: FloatArray) -> Weights:
    """Return the coefficients (n, 16) that act at points (n,), numbered radius by axial, and their weights.

    radius, axial: (n,) m.
    """
    first_r, value_r = radial_basis.values(radius)
    first_z, value_z = axial_basis.values(axial)
    rows = axial_basis.count * (first_r[:, None] + np.arange(value_r.shape[1]))
    index = rows[:, :, None] + (first_z[:, None] + np.arange(value_z.shape[1]))[:, None, :]
    weight = value_r[:, :, None] * value_z[:, None, :]
    n = len(radius)
    return index.reshape(n, -1).astype(np.int32), np.ascontiguousarray(weight.reshape(n, -1))


@dataclass(frozen=True, eq=False)
class FlankSplines:
    """B-spline coefficients of the compliance between flanks of the same side.

    radial_basis, axial_basis: B-splines.
    coefficients (2, n_tooth, reach + 1, n_p n_w, n_p n_w): coefficients (m/N) by flank, held tooth and distance in
        teeth.
    place (sector,): position of each tooth of the sector among those held, −1 if absent.
    friction (n_tooth, 2 reach + 1, 2, n_p n_w, n_p n_w): coefficients of `FlankCompliance.friction` (m/N).
    tooth_basis: B-splines along the axis of a tooth's own part, which `coefficients` does not contain then.
    own (2, 1, 1, n_p n_a, n_p n_a): coefficients of `FlankCompliance.own` (m/N).
    own_friction (2, n_p n_a, n_p n_a): coefficients of `FlankCompliance.own_friction` (m/N).
    """

    radial_basis: LocalBasis
    axial_basis: LocalBasis
    coefficients: FloatArray
    place: IntArray
    friction: FloatArray | None = None
    tooth_basis: LocalBasis | None = None
    own: FloatArray | None = None
    own_friction: FloatArray | None = None

    def weights(self, radius: FloatArray, axial: FloatArray) -> FlankWeights:
        """Return the `point_weights` of both grids."""
        grid_weights = point_weights(self.radial_basis, self.axial_basis, radius, axial)
        if self.tooth_basis is None:
            return grid_weights, None
        return grid_weights, point_weights(self.radial_basis, self.tooth_basis, radius, axial)

    @property
    def uniform(self) -> bool:
        """True where all teeth have the same compliance."""
        return len(self.place) == 1

    def add_common(self, total: FloatArray, side: int, tooth: IntArray, weights: FlankWeights) -> None:
        """Add to `total` (n, n) in m/N the compliance between points on flanks `side` of teeth `tooth` (n,).

        This is the part that stays when all teeth are replaced by others, as many further on; `add_particular` adds the
        rest.  Points of one tooth must follow each other.  Teeth that are absent or too far apart are an InputError.
        """
        grid_weights, tooth_weights = weights
        if self.uniform:
            self._couple(self.coefficients[side], self.place, tooth, grid_weights, total)
        if tooth_weights is not None and self.own is not None:
            self._couple(self.own[side], _ANY_TOOTH, tooth, tooth_weights, total)

    def add_particular(self, total: FloatArray, side: int, tooth: IntArray, weights: FlankWeights) -> None:
        """Add the rest of the compliance, which depends on the teeth."""
        if not self.uniform:
            self._couple(self.coefficients[side], self.place, tooth, weights[0], total)

    def _couple(
        self, coefficients: FloatArray, place: IntArray, tooth: IntArray, weights: Weights, total: FloatArray
    ) -> None:
        """Add the compliance by these coefficients to `total`."""
        from nvhchain.gear.compliance._couple import couple  # compiled

        if len(tooth):
            self._check(tooth, place)
            couple(coefficients, place, tooth, *weights, total)

    def _check(self, tooth: IntArray, place: IntArray) -> None:
        """Refuse teeth outside the coefficients; the compiled loop does not check its indices.

        place: position of each tooth of a sector among those held, −1 if absent.
        """
        low, high, reach = int(tooth.min()), int(tooth.max()), self.coefficients.shape[2] - 1
        require(
            high - low <= reach,
            f"teeth {low} and {high} are {high - low} pitches apart, but the compliance reaches {reach}: "
            "ask flank_compliance for a larger reach",
        )
        require(
            bool((place[tooth % len(place)] >= 0).all()),
            f"teeth {low} to {high} are not among those that this part of the compliance holds: ask `select_angles` "
            "for them",
        )

    def friction_compliance(self, side: int, tooth: IntArray, radius: FloatArray, axial: FloatArray) -> FloatArray:
        """Return the normal displacement (n, n) in m/N at every point under unit forces along the profile at each."""
        assert self.friction is not None
        n, reach = len(tooth), self.friction.shape[1] // 2
        total = np.zeros((n, n))
        if not n:
            return total
        self._check(tooth, self.place)
        grid_weights, tooth_weights = self.weights(radius, axial)
        spread = _spread(grid_weights, self.friction.shape[-1])
        for a in np.unique(tooth):
            for b in np.unique(tooth):
                block = self.friction[self.place[a % len(self.place)], reach + b - a, side]
                moved, loaded = np.flatnonzero(tooth == a), np.flatnonzero(tooth == b)
                total[np.ix_(moved, loaded)] = spread[moved] @ (spread[loaded] @ block.T).T
        if tooth_weights is not None and self.own_friction is not None:
            own = self.own_friction[side]
            spread = _spread(tooth_weights, own.shape[-1])
            for a in np.unique(tooth):
                there = np.flatnonzero(tooth == a)
                total[np.ix_(there, there)] += spread[there] @ (spread[there] @ own.T).T
        return total


def _spread(weights: Weights, count: int) -> sp.csr_matrix:
    """Return the matrix (n, count) from coefficients to values at points."""
    index, weight = weights
    start = np.arange(len(index) + 1) * index.shape[1]
    return sp.csr_matrix((weight.ravel(), index.ravel(), start), shape=(len(index), count))


def flank_splines(compliance: FlankCompliance) -> FlankSplines:
    """Interpolate `compliance` on its grid."""
    c = compliance
    n = len(c.radius) * len(c.axial)
    (radius, radial_matrix), (axial, axial_matrix) = local_basis(c.radius), local_basis(c.axial)

    shape = (len(c.blocks), c.reach + 1, n, n)
    blocks, friction = np.stack([c.blocks[:, :, f, :, :, f].reshape(shape) for f in (0, 1)]), c.friction
    place = np.full(c.sector, -1)
    place[list(c.teeth_held)] = np.arange(len(c.teeth_held))
    basis = own = own_friction = None
    if c.own is not None and c.tooth_axial is not None:
        basis, tooth_matrix = local_basis(c.tooth_axial)
        own = _coefficients(c.own[:, None, None], radial_matrix, tooth_matrix)
        blocks[:, :, 0] -= _thinned(c.own, c)[:, None]
        if friction is not None and c.own_friction is not None:
            own_friction = _coefficients(c.own_friction, radial_matrix, tooth_matrix)
            friction = friction.copy()
            friction[:, c.reach] -= _thinned(c.own_friction, c)
    return FlankSplines(
        radial_basis=radius,
        axial_basis=axial,
        coefficients=_coefficients(blocks, radial_matrix, axial_matrix),
        place=place,
        friction=None if friction is None else _coefficients(friction, radial_matrix, axial_matrix),
        tooth_basis=basis,
        own=own,
        own_friction=own_friction,
    )


def _thinned(own: FloatArray, c: FlankCompliance) -> FloatArray:
    """Return the compliance (2, n, n) at the points of the grid, of `own` (2, n_p n_a, n_p n_a)."""
    assert c.tooth_axial is not None
    points, parts = (len(c.radius), len(c.tooth_axial)), (len(c.tooth_axial) - 1) // (len(c.axial) - 1)
    there = own.reshape(2, *points, *points)[:, :, ::parts, :, ::parts]
    return there.reshape(2, len(c.radius) * len(c.axial), -1)


def _coefficients(values: FloatArray, radial_matrix: FloatArray, axial_matrix: FloatArray) -> FloatArray:
    """Return the coefficients (..., n, n) of grid values (..., n, n)."""
    n = values.shape[-1]
    out = np.empty((values.size // n**2, n, n))
    for i, value in enumerate(values.reshape(out.shape)):
        for _ in range(2):  # first one point, then, transposed, the other
            value = (radial_matrix @ value.reshape(len(radial_matrix), -1)).reshape(
                len(radial_matrix), len(axial_matrix), n
            )
            value = (axial_matrix @ value).reshape(n, n).T
        out[i] = value
    return out.reshape(values.shape)
