"""Pairs of triangles that face each other across a gap narrower than they are long: cut until the pieces are not."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numba
import numpy as np

from nvhchain.acoustics._fused_wave import COMPILED, inline

# Barycentric corners of the four quarters of a triangle, and of the whole.
_PARTS = np.array(
    [
        [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5]],
        [[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.5, 0.5]],
        [[0.5, 0.0, 0.5], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]],
        [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]],
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ]
)
_WHOLE = 4
# Corners, middles of edges, centroid: where the distance of two pieces is sampled.
_SAMPLES = np.array(
    [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]]
)


@numba.njit(error_model="numpy")
def _multiply(left, right, product):
    """Matrix product (n, 3) × (3, 3) into `product`."""
    for i in range(left.shape[0]):
        for j in range(3):
            product[i, j] = left[i, 0] * right[0, j] + left[i, 1] * right[1, j] + left[i, 2] * right[2, j]


@numba.njit(error_model="numpy")
def _squared_distance(left, right):
    """Square of the least distance between two sets of points."""
    least = np.inf
    for p in range(left.shape[0]):
        for q in range(right.shape[0]):
            d0, d1, d2 = left[p, 0] - right[q, 0], left[p, 1] - right[q, 1], left[p, 2] - right[q, 2]
            least = min(least, d0 * d0 + d1 * d1 + d2 * d2)
    return least


@numba.njit(
    "Tuple((float64[:,:,:,::1], float64[:,::1], int64))"
    "(float64[:,:,:,::1], float64[:,::1], float64[:,:,::1], float64, float64, float64, float64)",
    **COMPILED,
)
def cut(pieces, scale, corners, size_x, size_y, gap, least_scale):
    """Cut a pair of triangles until no piece is nearer to its partner than `gap` × the longer of both.

    pieces: scratch (any, 2, 3, 3), barycentric corners of the piece of either triangle.  scale: scratch (any, 2), size
    of the piece over that of its triangle.  corners: (2, 3, 3) m.  size_x, size_y: longest edges, m.  least_scale:
    smallest piece.  Returns the pieces and scales, in larger scratch if need be, and their number.
    """
    samples, barycentric, parent = np.empty((2, 7, 3)), np.empty((7, 3)), np.empty((2, 3, 3))
    for side in range(2):
        scale[0, side] = 1.0
        _multiply(_PARTS[_WHOLE], _PARTS[_WHOLE], pieces[0, side])
    count, n = 1, 0
    while n < count:
        long_x, long_y = size_x * scale[n, 0], size_y * scale[n, 1]
        longer = max(long_x, long_y)
        split_x = long_x > 0.6 * longer and scale[n, 0] > least_scale
        split_y = long_y > 0.6 * longer and scale[n, 1] > least_scale
        for side in range(2):
            _multiply(_SAMPLES, pieces[n, side], barycentric)
            _multiply(barycentric, corners[side], samples[side])
        if not (split_x or split_y) or _squared_distance(samples[0], samples[1]) >= (gap * longer) ** 2:
            n += 1
            continue
        if count + 16 > len(pieces):
            more_pieces, more_scale = np.empty((2 * count + 16, 2, 3, 3)), np.empty((2 * count + 16, 2))
            for i in range(count):
                for side in range(2):
                    more_scale[i, side] = scale[i, side]
                    _multiply(_PARTS[_WHOLE], pieces[i, side], more_pieces[i, side])
            pieces, scale = more_pieces, more_scale
        for side in range(2):
            _multiply(_PARTS[_WHOLE], pieces[n, side], parent[side])
        scale_x, scale_y = scale[n, 0] * (0.5 if split_x else 1.0), scale[n, 1] * (0.5 if split_y else 1.0)
        at = n  # the first child takes the parent's place
        for part_x in range(0 if split_x else _WHOLE, _WHOLE if split_x else _WHOLE + 1):
            for part_y in range(0 if split_y else _WHOLE, _WHOLE if split_y else _WHOLE + 1):
                _multiply(_PARTS[part_x], parent[0], pieces[at, 0])
                _multiply(_PARTS[part_y], parent[1], pieces[at, 1])
                scale[at, 0], scale[at, 1] = scale_x, scale_y
                at = count
                count += 1
        count -= 1
    return pieces, scale, count


@inline
def map_points(mapped, points, width, pieces, scale, n):
    """Points and weights of a rule over the whole pair, moved to a pair of pieces."""
    share = (scale[n, 0] * scale[n, 1]) ** 2
    for side in range(2):
        for i in range(3):
            c0, c1, c2 = (pieces[n, side, 0, i], pieces[n, side, 1, i], pieces[n, side, 2, i])
            for u in range(width):
                mapped[3 * side + i, u] = (
                    c0 * points[3 * side, u] + c1 * points[3 * side + 1, u] + c2 * points[3 * side + 2, u]
                )
    for u in range(width):
        mapped[6, u] = share * points[6, u]
