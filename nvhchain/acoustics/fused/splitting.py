"""Splitting of pairs of triangles across a gap narrower than their length, down to pieces shorter than the gap."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numba
import numpy as np

from nvhchain.acoustics.fused.kernels import COMPILED, inline

# Samples of the distance of two pieces: corners, midpoints of edges, centroid.
_SAMPLES = np.array(
    [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]]
)


@numba.njit(inline="always")
def _multiply(left, right, product):
    """Store the matrix product (n, 3) × (3, 3) in `product`."""
    for i in range(left.shape[0]):
        for j in range(3):
            product[i, j] = left[i, 0] * right[0, j] + left[i, 1] * right[1, j] + left[i, 2] * right[2, j]


@numba.njit(inline="always")
def _squared_distance(left, right):
    """Return the square of the smallest distance between two sets of points."""
    least = np.inf
    for p in range(left.shape[0]):
        for q in range(right.shape[0]):
            d0, d1, d2 = left[p, 0] - right[q, 0], left[p, 1] - right[q, 1], left[p, 2] - right[q, 2]
            least = min(least, d0 * d0 + d1 * d1 + d2 * d2)
    return least


@numba.njit(inline="always")
def _longest_edge(samples):
    """Return (first corner of the longest edge, its length) of a triangle whose corners come first in `samples`."""
    corner, square = 0, 0.0
    for i in range(3):
        length = 0.0
        for axis in range(3):
            length += (samples[i, axis] - samples[(i + 1) % 3, axis]) ** 2
        if length > square:
            corner, square = i, length
    return corner, np.sqrt(square)


@numba.njit(inline="always")
def _copy(pieces, n, others, m):
    """Set others[m] = pieces[n] number by number; the shape checks of whole arrays compile for seconds."""
    for side in range(2):
        for i in range(3):
            for j in range(3):
                others[m, side, i, j] = pieces[n, side, i, j]


@numba.njit(
    "Tuple((float64[:,:,:,::1], float64[::1], int64))"
    "(float64[:,:,:,::1], float64[::1], float64[:,:,::1], float64, float64, float64)",
    **COMPILED,
)
def cut(pieces, share, corners, gap, least_x, least_y):
    """Halve a pair of triangles until no piece is nearer to its partner than `gap` × the longest edge of both.

    pieces : scratch (any, 2, 3, 3), barycentric corners of the piece of either triangle.
    share : scratch (any,), share of the pieces in the product of both areas.
    corners : (2, 3, 3) m.
    least_x, least_y : lengths (m) of pieces that are not cut further.

    The longer piece of a pair is cut across its longest edge, so that needles become shorter, not thinner. The results
    are pieces and shares, in larger scratch if required, and their number.
    """
    samples, barycentric = np.empty((2, 7, 3)), np.empty((7, 3))
    for i in range(3):
        for j in range(3):
            pieces[0, 0, i, j] = pieces[0, 1, i, j] = 1.0 if i == j else 0.0
    share[0] = 1.0
    count, n = 1, 0
    while n < count:
        for side in range(2):
            _multiply(_SAMPLES, pieces[n, side], barycentric)
            _multiply(barycentric, corners[side], samples[side])
        (edge_x, long_x), (edge_y, long_y) = _longest_edge(samples[0]), _longest_edge(samples[1])
        side, edge, longer, least = 0, edge_x, long_x, least_x
        if long_y > long_x:
            side, edge, longer, least = 1, edge_y, long_y, least_y
        if longer <= least or _squared_distance(samples[0], samples[1]) >= (gap * longer) ** 2:
            n += 1
            continue
        if count == len(pieces):
            more_pieces, more_share = np.empty((2 * count, 2, 3, 3)), np.empty(2 * count)
            for i in range(count):
                _copy(pieces, i, more_pieces, i)
                more_share[i] = share[i]
            pieces, share = more_pieces, more_share
        share[n] *= 0.5
        _copy(pieces, n, pieces, count)
        share[count] = share[n]
        for j in range(3):
            middle = 0.5 * (pieces[n, side, edge, j] + pieces[n, side, (edge + 1) % 3, j])
            pieces[n, side, edge, j] = middle
            pieces[count, side, (edge + 1) % 3, j] = middle
        count += 1
    return pieces, share, count


@inline
def map_points(mapped, points, width, pieces, share, n):
    """Move points and weights of a rule over the whole pair to a pair of pieces."""
    for side in range(2):
        for i in range(3):
            c0, c1, c2 = (pieces[n, side, 0, i], pieces[n, side, 1, i], pieces[n, side, 2, i])
            for u in range(width):
                mapped[3 * side + i, u] = (
                    c0 * points[3 * side, u] + c1 * points[3 * side + 1, u] + c2 * points[3 * side + 2, u]
                )
    for u in range(width):
        mapped[6, u] = share[n] * points[6, u]
