"""Compiled inner loops of the fused engine: every operator from one evaluation of distance and exponential.

With r = x − y, R = |r|, G = e^{−jkR}/(4πR), the project's α = −jβ, and for flat triangles the lengths
d = r·n(y) (constant over y) and e = −r·n(x) (constant over x), a pair of points contributes

    A: φᵢ(x) φⱼ(y) G [−d/R² + j (βk² n·n′ − k d/R)]  − jβ G curlᵢ·curlⱼ      (−K + αW, W by Maue's formula)
    B: −φᵢ(x) G [1 + βk e/R − jβ e/R²]                                       (−(S + αK′))

so one complex factor each for A and B. Everything but e^{−jkR} is kept over all wavenumbers of a batch, and
e^{−jkR} advances from one wavenumber to the next by a complex factor that equal steps share.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numba
import numpy as np

from nvhchain.acoustics._fused_wave import COMPILED, INLINE, cosine_sine

TILE = 64
"""Trial triangles handled side by side: the innermost loops run over them, and their scratch stays in the cache."""

_TINY = 1e-300
# Rows of the scratch of a test triangle over the tile: G re, im; B and A of the three test hats re, im;
# 0/1 · area · area′/(4π); n·n′. Few arrays with rows at fixed places let the compiler see that rows do not overlap.
_SUM_G, _SUM_B, _SUM_A, _SHARE, _FACING, _SUMS = 0, 2, 8, 14, 15, 16
_PAIR = 9  # rows per pair of points: E re, im; step re, im; d/R, d/R², e/R, e/R²; R
_LINE = 8  # rows of a test vertex before the trial points: B re, im; three components of the curl sum, re, im


@numba.njit(**INLINE)
def _geometry(pair, sums, y, normal_y, x0, x1, x2, nx, ny, nz, weight):
    """Distance and projections of one test point to one point of every trial triangle of the tile."""
    for u in range(TILE):
        r0, r1, r2 = x0 - y[0, u], x1 - y[1, u], x2 - y[2, u]
        square = r0 * r0 + r1 * r1 + r2 * r2
        # Pairs with share 0 may meet in a point; their numbers must only stay finite.
        inverse = 1.0 / np.sqrt(max(square, _TINY))
        d = (r0 * normal_y[0, u] + r1 * normal_y[1, u] + r2 * normal_y[2, u]) * inverse
        e = -(r0 * nx + r1 * ny + r2 * nz) * inverse
        pair[0, u] = weight * sums[_SHARE, u] * inverse
        pair[4, u] = d
        pair[5, u] = d * inverse
        pair[6, u] = e
        pair[7, u] = e * inverse
        pair[8, u] = square * inverse


@numba.njit(**INLINE)
def _begin(pair, k):
    """Multiply the weight in the first row by e^{−jkR}."""
    for u in range(TILE):
        c, s = cosine_sine(k * pair[8, u])
        w = pair[0, u]
        pair[0, u] = w * c
        pair[1, u] = -w * s


@numba.njit(**INLINE)
def _set_step(pair, k):
    """Set the factor that advances the exponential by the wavenumber step k."""
    for u in range(TILE):
        c, s = cosine_sine(k * pair[8, u])
        pair[2, u] = c
        pair[3, u] = -s


@numba.njit(**INLINE)
def _point(three, q, u, facing, k, beta):
    """Values of G and of the integrands of A and B at a pair of points; advances the exponential."""
    er, ei = three[q, 0, u], three[q, 1, u]
    sr, si = three[q, 2, u], three[q, 3, u]
    a0, a1 = -three[q, 5, u], k * (k * beta * facing - three[q, 4, u])
    b0, b1 = -1.0 - k * beta * three[q, 6, u], beta * three[q, 7, u]
    three[q, 0, u] = er * sr - ei * si
    three[q, 1, u] = er * si + ei * sr
    return er, ei, er * a0 - ei * a1, er * a1 + ei * a0, er * b0 - ei * b1, er * b1 + ei * b0


@numba.njit(**INLINE)
def _three_points(sums, three, hat, q, k, beta):
    """Add test points q, q + 1, q + 2 against one trial point to the sums of the three test hats."""
    h00, h01, h02 = hat[q, 0], hat[q, 1], hat[q, 2]
    h10, h11, h12 = hat[q + 1, 0], hat[q + 1, 1], hat[q + 1, 2]
    h20, h21, h22 = hat[q + 2, 0], hat[q + 2, 1], hat[q + 2, 2]
    for u in range(TILE):
        facing = sums[_FACING, u]
        e0r, e0i, a0r, a0i, b0r, b0i = _point(three, 0, u, facing, k, beta)
        e1r, e1i, a1r, a1i, b1r, b1i = _point(three, 1, u, facing, k, beta)
        e2r, e2i, a2r, a2i, b2r, b2i = _point(three, 2, u, facing, k, beta)
        sums[_SUM_G, u] += e0r + e1r + e2r
        sums[_SUM_G + 1, u] += e0i + e1i + e2i
        sums[_SUM_B, u] += h00 * b0r + h10 * b1r + h20 * b2r
        sums[_SUM_B + 1, u] += h00 * b0i + h10 * b1i + h20 * b2i
        sums[_SUM_B + 2, u] += h01 * b0r + h11 * b1r + h21 * b2r
        sums[_SUM_B + 3, u] += h01 * b0i + h11 * b1i + h21 * b2i
        sums[_SUM_B + 4, u] += h02 * b0r + h12 * b1r + h22 * b2r
        sums[_SUM_B + 5, u] += h02 * b0i + h12 * b1i + h22 * b2i
        sums[_SUM_A, u] += h00 * a0r + h10 * a1r + h20 * a2r
        sums[_SUM_A + 1, u] += h00 * a0i + h10 * a1i + h20 * a2i
        sums[_SUM_A + 2, u] += h01 * a0r + h11 * a1r + h21 * a2r
        sums[_SUM_A + 3, u] += h01 * a0i + h11 * a1i + h21 * a2i
        sums[_SUM_A + 4, u] += h02 * a0r + h12 * a1r + h22 * a2r
        sums[_SUM_A + 5, u] += h02 * a0i + h12 * a1i + h22 * a2i


@numba.njit(**INLINE)
def _add_line(line, part, sums, i, curl_0, curl_1, curl_2):
    """Add B and G of test hat i to the line of its vertex, G times the components of the hat's curl."""
    for u in range(TILE):
        re, im = sums[_SUM_G, u], sums[_SUM_G + 1, u]
        line[0, u] += part[0, u]
        line[1, u] += part[1, u]
        line[2, u] += curl_0 * re
        line[3, u] += curl_0 * im
        line[4, u] += curl_1 * re
        line[5, u] += curl_1 * im
        line[6, u] += curl_2 * re
        line[7, u] += curl_2 * im


@numba.njit(**INLINE)
def _add_rows(to, part):
    """Add two rows, re and im."""
    for r in range(2):
        for u in range(TILE):
            to[r, u] += part[r, u]


@numba.njit(**INLINE)
def _accumulate(lines, sums, threes, line_of, curl, t, hat, n_m, n_q, k, beta):
    """Add one test triangle at one wavenumber to the lines of its three vertices."""
    sums[_SUM_G:_SUM_A] = 0.0
    for m in range(n_m):
        sums[_SUM_A:_SHARE] = 0.0
        for q in range(0, n_q, 3):
            _three_points(sums, threes[(m * n_q + q) // 3], hat, q, k, beta)
        for i in range(3):
            _add_rows(lines[line_of[t, i], _LINE + 2 * m :], sums[_SUM_A + 2 * i :])
    for i in range(3):
        _add_line(lines[line_of[t, i]], sums[_SUM_B + 2 * i :], sums, i, curl[t, i, 0], curl[t, i, 1], curl[t, i, 2])


@numba.njit(**INLINE)
def _column_values(values, line, curl, beta):
    """Turn the curl sums of a line into A for the three trial hats of every triangle: −jβ Σ G curlᵢ · curlⱼ."""
    for u in range(TILE):
        re_0, im_0, re_1, im_1, re_2, im_2 = line[2, u], line[3, u], line[4, u], line[5, u], line[6, u], line[7, u]
        values[0, u] = beta * (im_0 * curl[0, 0, u] + im_1 * curl[0, 1, u] + im_2 * curl[0, 2, u])
        values[1, u] = -beta * (re_0 * curl[0, 0, u] + re_1 * curl[0, 1, u] + re_2 * curl[0, 2, u])
        values[2, u] = beta * (im_0 * curl[1, 0, u] + im_1 * curl[1, 1, u] + im_2 * curl[1, 2, u])
        values[3, u] = -beta * (re_0 * curl[1, 0, u] + re_1 * curl[1, 1, u] + re_2 * curl[1, 2, u])
        values[4, u] = beta * (im_0 * curl[2, 0, u] + im_1 * curl[2, 1, u] + im_2 * curl[2, 2, u])
        values[5, u] = -beta * (re_0 * curl[2, 0, u] + re_1 * curl[2, 1, u] + re_2 * curl[2, 2, u])


@numba.njit(**INLINE)
def _add_column_values(values, part, hat_0, hat_1, hat_2):
    """Add the sums at one trial point to A of the three trial hats."""
    for u in range(TILE):
        re, im = part[0, u], part[1, u]
        values[0, u] += hat_0 * re
        values[1, u] += hat_0 * im
        values[2, u] += hat_1 * re
        values[3, u] += hat_1 * im
        values[4, u] += hat_2 * re
        values[5, u] += hat_2 * im


@numba.njit(**INLINE)
def _scatter(values, line, curl, hat, beta, to_a, to_b, corner, width):
    """Add the line of a test vertex to the tile's part of its row of A and B."""
    _column_values(values, line, curl, beta)
    for m in range(hat.shape[0]):
        _add_column_values(values, line[_LINE + 2 * m :], hat[m, 0], hat[m, 1], hat[m, 2])
    for u in range(width):
        to_b[u] += complex(line[0, u], line[1, u])
    for u in range(width):
        to_a[corner[u, 0]] += complex(values[0, u], values[1, u])
        to_a[corner[u, 1]] += complex(values[2, u], values[3, u])
        to_a[corner[u, 2]] += complex(values[4, u], values[5, u])


@numba.njit(
    "void(float64[:,:,::1], float64[:,::1], float64[:,:,::1], float64[::1], int64[:,::1], int64[::1], int64[::1],"
    "int64[::1], float64[:,::1], float64[::1], float64[:,:,::1], float64[:,::1], float64[:,:,::1], float64[::1],"
    "int64[:,::1], int64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], boolean[::1],"
    "complex128[:,:,::1], complex128[:,:,::1])",
    **COMPILED,
)
def far_block(
    x,  # (n_test, n_q, 3) quadrature points of the test triangles, m
    normal_x,  # (n_test, 3)
    curl_x,  # (n_test, 3, 3) curl of hat i, 1/m
    area_x,  # (n_test,)
    line_of,  # (n_test, 3) line of the test vertices; corner i of another owner goes to the spare line n_row + i
    row,  # (n_row,) row of A and B of every line but the spare ones
    skip_start,  # (n_test + 1,) into `skip`
    skip,  # trial triangles that the pair rules handle
    hat_x,  # (n_q, 3)
    weight_x,  # (n_q,)
    y,  # (n_m, 3, n_face) quadrature points of the trial triangles
    normal_y,  # (3, n_face)
    curl_y,  # (3, 3, n_face) curl of hat j
    area_y,  # (n_face,)
    vertex_y,  # (n_face, 3) columns of A; those of B are numbered as the trial triangles
    tile,  # (n_tile + 1,) first trial triangle of every tile
    hat_y,  # (n_m, 3)
    weight_y,  # (n_m,)
    k,  # (n_k,) wavenumbers
    beta,  # (n_k,) β of α = −jβ
    new_step,  # (n_k,) whether the step from k[i] to k[i + 1] differs from the one before
    a,  # (n_k, n_v, n_v) added to
    b,  # (n_k, n_v, n_face) added to
):
    """Add the well separated pairs of a block of test triangles with all trial triangles to the rows they own."""
    n_test, n_q, n_m, n_k = x.shape[0], x.shape[1], y.shape[0], k.shape[0]
    n_row = row.shape[0]
    lines = np.empty((n_k, n_row + 3, _LINE + 2 * n_m, TILE))
    threes = np.empty((n_m * n_q // 3, 3, _PAIR, TILE))
    sums = np.zeros((_SUMS, TILE))
    # The last tile is padded with its own first triangle, at share 0.
    points, normals, curls = np.empty((n_m, 3, TILE)), np.empty((3, TILE)), np.empty((3, 3, TILE))
    values = np.empty((6, TILE))
    for it in range(tile.shape[0] - 1):
        start, width = tile[it], tile[it + 1] - tile[it]
        for u in range(TILE):
            v = start + (u if u < width else 0)
            for axis in range(3):
                normals[axis, u] = normal_y[axis, v]
                for j in range(3):
                    curls[j, axis, u] = curl_y[j, axis, v]
                for m in range(n_m):
                    points[m, axis, u] = y[m, axis, v]
        sums[_SHARE] = 0.0
        lines[:] = 0.0
        for t in range(n_test):
            nx, ny, nz = normal_x[t, 0], normal_x[t, 1], normal_x[t, 2]
            for u in range(width):
                sums[_SHARE, u] = area_y[start + u] * area_x[t] / (4.0 * np.pi)
                sums[_FACING, u] = nx * normals[0, u] + ny * normals[1, u] + nz * normals[2, u]
            for i in range(skip_start[t], skip_start[t + 1]):
                u = skip[i] - start
                if 0 <= u < width:
                    sums[_SHARE, u] = 0.0
            for m in range(n_m):
                for q in range(n_q):
                    pair = threes[(m * n_q + q) // 3, q % 3]
                    x0, x1, x2 = x[t, q, 0], x[t, q, 1], x[t, q, 2]
                    _geometry(pair, sums, points[m], normals, x0, x1, x2, nx, ny, nz, weight_x[q] * weight_y[m])
                    _begin(pair, k[0])
            for ik in range(n_k):
                if ik + 1 < n_k and new_step[ik]:
                    for three in threes:
                        for q in range(3):
                            _set_step(three[q], k[ik + 1] - k[ik])
                _accumulate(lines[ik], sums, threes, line_of, curl_x, t, hat_x, n_m, n_q, k[ik], beta[ik])
        for ik in range(n_k):
            for i in range(n_row):
                to_a, to_b = a[ik, row[i]], b[ik, row[i], start : start + width]
                _scatter(values, lines[ik, i], curls, hat_y, beta[ik], to_a, to_b, vertex_y[start:], width)
