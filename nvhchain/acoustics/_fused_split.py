"""Pairs of triangles that face each other across a gap narrower than they are long: cut until the pieces are not."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numba
import numpy as np

from nvhchain.acoustics._fused_wave import INLINE

PIECE = 20
"""Numbers per pair of pieces: barycentric corners of the first (3 × 3) and of the second, and both scales."""

# The four quarters of a triangle: barycentric coordinates of their corners in its own.
_QUARTERS = np.array(
    [
        [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5]],
        [[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.5, 0.5]],
        [[0.5, 0.0, 0.5], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]],
        [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]],
    ]
)
# Corners, middles of edges, centroid: where the distance of two pieces is sampled.
_SAMPLES = np.array(
    [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]]
)


@numba.njit
def _squared_distance(pieces, n, x, y):
    """Square of the least distance between sample points of both pieces."""
    least = np.inf
    points = np.zeros((2, 7, 3))
    for side in range(2):
        for p in range(7):
            for corner in range(3):
                for i in range(3):
                    share = _SAMPLES[p, corner] * pieces[n, 9 * side + 3 * corner + i]
                    for axis in range(3):
                        points[side, p, axis] += share * (x[3 * i + axis] if side == 0 else y[3 * i + axis])
    for p in range(7):
        for q in range(7):
            square = 0.0
            for axis in range(3):
                square += (points[0, p, axis] - points[1, q, axis]) ** 2
            least = min(least, square)
    return least


@numba.njit
def _put_quarter(to, source, n, side, quarter):
    """Write one quarter of the piece on `side` of source[n] to `to`, or the whole piece for quarter −1."""
    for corner in range(3):
        for i in range(3):
            if quarter < 0:
                to[9 * side + 3 * corner + i] = source[n, 9 * side + 3 * corner + i]
            else:
                value = 0.0
                for j in range(3):
                    value += _QUARTERS[quarter, corner, j] * source[n, 9 * side + 3 * j + i]
                to[9 * side + 3 * corner + i] = value
    to[18 + side] = source[n, 18 + side] * (1.0 if quarter < 0 else 0.5)


@numba.njit
def cut(pieces, x, y, size_x, size_y, gap, least_scale):
    """Cut a pair of triangles until no piece is nearer to its partner than `gap` × the longer of both.

    x, y: nine corner coordinates each.  size_x, size_y: longest edges, m.
    least_scale: smallest piece, of its triangle.  pieces: scratch (any, PIECE).
    Returns the pieces, in a larger scratch if need be, and their number.
    """
    pieces[0] = 0.0
    for i in range(3):
        pieces[0, 4 * i] = 1.0
        pieces[0, 9 + 4 * i] = 1.0
    pieces[0, 18:] = 1.0
    count, n = 1, 0
    parent = np.empty((1, PIECE))
    while n < count:
        long_x, long_y = size_x * pieces[n, 18], size_y * pieces[n, 19]
        longer = max(long_x, long_y)
        split_x = long_x > 0.6 * longer and pieces[n, 18] > least_scale
        split_y = long_y > 0.6 * longer and pieces[n, 19] > least_scale
        if not (split_x or split_y) or _squared_distance(pieces, n, x, y) >= (gap * longer) ** 2:
            n += 1
            continue
        if count + 16 > len(pieces):
            larger = np.empty((2 * len(pieces) + 16, PIECE))
            larger[:count] = pieces[:count]
            pieces = larger
        parent[0] = pieces[n]
        at = n  # the first child takes the parent's place
        for quarter_x in range(4 if split_x else 1):
            for quarter_y in range(4 if split_y else 1):
                _put_quarter(pieces[at], parent, 0, 0, quarter_x if split_x else -1)
                _put_quarter(pieces[at], parent, 0, 1, quarter_y if split_y else -1)
                at = count
                count += 1
        count -= 1
    return pieces, count


@numba.njit(**INLINE)
def map_points(mapped, points, width, pieces, n):
    """Points and weights of a rule over the whole pair, moved to a pair of pieces."""
    piece = pieces[n]
    share = (piece[18] * piece[19]) ** 2
    for side in range(2):
        for i in range(3):
            c0, c1, c2 = piece[9 * side + i], piece[9 * side + 3 + i], piece[9 * side + 6 + i]
            for u in range(width):
                mapped[3 * side + i, u] = (
                    c0 * points[3 * side, u] + c1 * points[3 * side + 1, u] + c2 * points[3 * side + 2, u]
                )
    for u in range(width):
        mapped[6, u] = share * points[6, u]
