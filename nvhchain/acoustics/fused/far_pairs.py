"""Compiled inner loop of the fused engine over well separated pairs of triangles, tile by tile of trial triangles."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from nvhchain.acoustics.fused.kernels import inline
from nvhchain.acoustics.fused.points import (
    FACING,
    PAIR_SUMS,
    SHARE,
    TEST_SUMS,
    THREE,
    TILE,
    TRIAL_SUMS,
    add_test_points,
    begin,
    distances,
    heights,
    set_step,
    three_points,
)

_LINE = 8  # rows of a test vertex before A: B re, im; three components of the curl sum, re, im


@inline
def _add_line(line, pair_sums, a0, a1, a2, i, curl_0, curl_1, curl_2):
    """Add test hat i to the line of its vertex: B, G times the hat's curl, A at three trial points."""
    for u in range(TILE):
        re, im = pair_sums[0, u], pair_sums[1, u]
        line[0, u] += pair_sums[2 * i + 2, u]
        line[1, u] += pair_sums[2 * i + 3, u]
        line[2, u] += curl_0 * re
        line[3, u] += curl_0 * im
        line[4, u] += curl_1 * re
        line[5, u] += curl_1 * im
        line[6, u] += curl_2 * re
        line[7, u] += curl_2 * im
        line[_LINE, u] += a0[2 * i, u]
        line[_LINE + 1, u] += a0[2 * i + 1, u]
        line[_LINE + 2, u] += a1[2 * i, u]
        line[_LINE + 3, u] += a1[2 * i + 1, u]
        line[_LINE + 4, u] += a2[2 * i, u]
        line[_LINE + 5, u] += a2[2 * i + 1, u]


@inline
def _add_points(line, first, test_sums, m, i):
    """Add A of test hat i at another trial point to the line of its vertex."""
    for u in range(TILE):
        line[first, u] += test_sums[m, 2 * i, u]
        line[first + 1, u] += test_sums[m, 2 * i + 1, u]


@inline
def _accumulate(lines, test_sums, trial_sums, pair_sums, threes, pair, line_of, curl, t, hat, k, beta):
    """Add one test triangle at one wavenumber to the lines of its three vertices."""
    n_m, n_three = threes.shape[0], threes.shape[1]
    scale = beta * k * k
    test_sums[:] = 0.0
    trial_sums[:] = 0.0
    pair_sums[:] = 0.0
    for m in range(n_m):
        for g in range(n_three):
            three_points(test_sums[m], trial_sums[g], threes[m, g], pair, hat, 3 * g, k, scale)
    for g in range(n_three):
        add_test_points(pair_sums, trial_sums[g], hat, 3 * g, beta)
    for i in range(3):
        line = lines[line_of[t, i]]
        c0, c1, c2 = curl[t, i, 0], curl[t, i, 1], curl[t, i, 2]
        _add_line(line, pair_sums, test_sums[0], test_sums[1], test_sums[2], i, c0, c1, c2)
        for m in range(3, n_m):
            _add_points(line, _LINE + 2 * m, test_sums, m, i)


@inline
def _column_values(values, line, curl, hat, beta):
    """Compute A for the three trial hats of every triangle: −jβ Σ G curlᵢ · curlⱼ and the first three trial points."""
    h00, h01, h02, h10, h11, h12 = hat[0, 0], hat[0, 1], hat[0, 2], hat[1, 0], hat[1, 1], hat[1, 2]
    h20, h21, h22 = hat[2, 0], hat[2, 1], hat[2, 2]
    for u in range(TILE):
        re_0, im_0, re_1, im_1 = -beta * line[2, u], beta * line[3, u], -beta * line[4, u], beta * line[5, u]
        re_2, im_2 = -beta * line[6, u], beta * line[7, u]
        a0r, a0i, a1r, a1i = line[_LINE, u], line[_LINE + 1, u], line[_LINE + 2, u], line[_LINE + 3, u]
        a2r, a2i = line[_LINE + 4, u], line[_LINE + 5, u]
        c0, c1, c2 = curl[0, 0, u], curl[0, 1, u], curl[0, 2, u]
        values[0, u] = im_0 * c0 + im_1 * c1 + im_2 * c2 + h00 * a0r + h10 * a1r + h20 * a2r
        values[1, u] = re_0 * c0 + re_1 * c1 + re_2 * c2 + h00 * a0i + h10 * a1i + h20 * a2i
        c0, c1, c2 = curl[1, 0, u], curl[1, 1, u], curl[1, 2, u]
        values[2, u] = im_0 * c0 + im_1 * c1 + im_2 * c2 + h01 * a0r + h11 * a1r + h21 * a2r
        values[3, u] = re_0 * c0 + re_1 * c1 + re_2 * c2 + h01 * a0i + h11 * a1i + h21 * a2i
        c0, c1, c2 = curl[2, 0, u], curl[2, 1, u], curl[2, 2, u]
        values[4, u] = im_0 * c0 + im_1 * c1 + im_2 * c2 + h02 * a0r + h12 * a1r + h22 * a2r
        values[5, u] = re_0 * c0 + re_1 * c1 + re_2 * c2 + h02 * a0i + h12 * a1i + h22 * a2i


@inline
def _add_column_values(values, line, first, hat_0, hat_1, hat_2):
    """Add the sums at another trial point to A of the three trial hats."""
    for u in range(TILE):
        re, im = line[first, u], line[first + 1, u]
        values[0, u] += hat_0 * re
        values[1, u] += hat_0 * im
        values[2, u] += hat_1 * re
        values[3, u] += hat_1 * im
        values[4, u] += hat_2 * re
        values[5, u] += hat_2 * im


@inline
def _scatter(values, line, curl, hat, beta, row_a, row_b, corner, width):
    """Add the line of a test vertex to the tile's part of its row of A and B."""
    _column_values(values, line, curl, hat, beta)
    for m in range(3, hat.shape[0]):
        _add_column_values(values, line, _LINE + 2 * m, hat[m, 0], hat[m, 1], hat[m, 2])
    for u in range(width):
        row_b[u] += complex(line[0, u], line[1, u])
    for u in range(width):
        row_a[corner[u, 0]] += complex(values[0, u], values[1, u])
        row_a[corner[u, 1]] += complex(values[2, u], values[3, u])
        row_a[corner[u, 2]] += complex(values[4, u], values[5, u])


FAR_BLOCK = (
    "void(float64[:,:,::1], real[:,::1], real[:,:,::1], real[::1], int64[:,::1], int64[::1], int64[::1], int64[::1],"
    "real[:,::1], real[::1], float64[:,:,::1], real[:,::1], real[:,:,::1], real[::1], int64[:,::1], int64[::1],"
    "real[:,::1], real[::1], real[::1], real[::1], boolean[::1], real[::1], cplx[:,:,::1], cplx[:,:,::1])"
)
"""Signature of `far_block`."""


def far_block(
    x,  # (n_test, n_q, 3) quadrature points of the test triangles, m
    normal_x,  # (n_test, 3)
    curl_x,  # (n_test, 3, 3) curl of hat i, 1/m
    area_x,  # (n_test,)
    line_of,  # (n_test, 3) line of the test vertices; corner i of another part goes to the spare line n_row + i
    row,  # (n_row,) row of A and B of every line except spare ones
    skip_start,  # (n_test + 1,) into `skip`
    skip,  # trial triangles of the pair rules, ascending for every test triangle
    hat_x,  # (n_q, 3)
    weight_x,  # (n_q,)
    y,  # (n_m, 3, n_face) quadrature points of the trial triangles
    normal_y,  # (3, n_face)
    curl_y,  # (3, 3, n_face) curl of hat j
    area_y,  # (n_face,)
    vertex_y,  # (n_face, 3) columns of A; columns of B follow the trial triangles
    tile,  # (n_tile + 1,) first trial triangle of every tile
    hat_y,  # (n_m, 3)
    weight_y,  # (n_m,)
    k,  # (n_k,) wavenumbers
    beta,  # (n_k,) β of α = −jβ
    new_step,  # (n_k,) True if the step from k[i] to k[i + 1] differs from the one before
    wave,  # coefficients of `cosine_sine`
    a,  # (n_k, n_row, n_v) added to
    b,  # (n_k, n_row, n_face) added to
):
    """Add the well separated pairs of a block of test triangles with all trial triangles to the rows they own."""
    n_test, n_q, n_m, n_k = x.shape[0], x.shape[1], y.shape[0], k.shape[0]
    n_row, n_three = row.shape[0], n_q // 3
    one, tiny, full_angle = k.dtype.type(1.0), k.dtype.type(1e-30), k.dtype.type(4.0 * np.pi)
    lines = np.empty((n_k, n_row + 3, _LINE + 2 * n_m, TILE), k.dtype)
    threes, distance = np.empty((n_m, n_three, THREE, TILE), k.dtype), np.empty((n_m, n_q, TILE), k.dtype)
    pair, pair_sums = np.empty((2, TILE), k.dtype), np.empty((PAIR_SUMS, TILE), k.dtype)
    test_sums, trial_sums = np.empty((n_m, TEST_SUMS, TILE), k.dtype), np.empty((n_three, TRIAL_SUMS, TILE), k.dtype)
    # The last tile is padded with its own first triangle, at share 0.
    points, normals = np.empty((n_m, 3, TILE), k.dtype), np.empty((3, TILE), k.dtype)
    curls, values, origin = np.empty((3, 3, TILE), k.dtype), np.empty((6, TILE), k.dtype), np.empty(3)
    here, next_skip = np.empty((n_q, 3), k.dtype), skip_start[:-1].copy()
    for it in range(tile.shape[0] - 1):
        start, width = tile[it], tile[it + 1] - tile[it]
        for axis in range(3):
            origin[axis] = y[0, axis, start]  # keeps short distances accurate in single precision
            for u in range(TILE):
                v = start + (u if u < width else 0)
                normals[axis, u] = normal_y[axis, v]
                for j in range(3):
                    curls[j, axis, u] = curl_y[j, axis, v]
                for m in range(n_m):
                    points[m, axis, u] = y[m, axis, v] - origin[axis]
        pair[:] = 0.0
        lines[:] = 0.0
        for t in range(n_test):
            nx, ny, nz = normal_x[t, 0], normal_x[t, 1], normal_x[t, 2]
            for u in range(width):
                pair[SHARE, u] = area_y[start + u] * area_x[t] / full_angle
            for u in range(TILE):
                pair[FACING, u] = nx * normals[0, u] + ny * normals[1, u] + nz * normals[2, u]
            while next_skip[t] < skip_start[t + 1] and skip[next_skip[t]] < start + width:
                if skip[next_skip[t]] >= start:
                    pair[SHARE, skip[next_skip[t]] - start] = 0.0
                next_skip[t] += 1
            for q in range(n_q):
                for axis in range(3):
                    here[q, axis] = x[t, q, axis] - origin[axis]
            for m in range(n_m):
                for q in range(n_q):
                    three, x0, x1, x2 = threes[m, q // 3], here[q, 0], here[q, 1], here[q, 2]
                    heights(three, points[m], normals, x0, x1, x2, nx, ny, nz, q % 3)
                    distances(
                        three, distance[m, q], pair, points[m], x0, x1, x2, weight_x[q] * weight_y[m], q % 3, one, tiny
                    )
            for ik in range(n_k):
                for m in range(n_m):
                    for q in range(n_q):
                        if ik == 0:
                            begin(threes[m, q // 3], distance[m, q], k[0], q % 3, wave)
                        if ik + 1 < n_k and new_step[ik]:
                            set_step(threes[m, q // 3], distance[m, q], k[ik + 1] - k[ik], q % 3, wave)
                _accumulate(
                    lines[ik], test_sums, trial_sums, pair_sums, threes, pair, line_of, curl_x, t, hat_x, k[ik],
                    beta[ik],
                )  # fmt: skip
        for ik in range(n_k):
            for i in range(n_row):
                row_a, row_b = a[ik, row[i]], b[ik, row[i], start : start + width]
                _scatter(values, lines[ik, i], curls, hat_y, beta[ik], row_a, row_b, vertex_y[start:], width)
