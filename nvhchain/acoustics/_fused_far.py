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

TILE = 32
"""Trial triangles handled side by side: the innermost loops run over them, and their scratch stays in the cache."""

_TINY = 1e-300
# Rows of the scratch, one column per trial triangle of the tile. One array with rows at fixed places lets the compiler
# see that rows do not overlap, without which it would not vectorise.
_SHARE, _FACING = 0, 1  # 0/1 · area · area′/(4π); n·n′
_SUM_G, _SUM_B, _SUM_A = 2, 4, 10  # G re, im; B and A of the three test hats re, im
_PAIRS, _PAIR = 16, 9  # from here nine rows per pair of points: E re, im; step re, im; d/R, d/R², e/R, e/R²; R
_LINE = 8  # rows of a test vertex before the trial points: B re, im; three components of the curl sum, re, im


@numba.njit(**INLINE)
def _geometry(work, row, x0, x1, x2, nx, ny, nz, y, m, normal_y, weight, start, width):
    """Distance and projections of one test point to point m of every trial triangle of the tile."""
    for u in range(width):
        v = start + u
        r0, r1, r2 = x0 - y[m, 0, v], x1 - y[m, 1, v], x2 - y[m, 2, v]
        square = r0 * r0 + r1 * r1 + r2 * r2
        # Pairs with share 0 may meet in a point; their numbers must only stay finite.
        inverse = 1.0 / np.sqrt(max(square, _TINY))
        d = (r0 * normal_y[0, v] + r1 * normal_y[1, v] + r2 * normal_y[2, v]) * inverse
        e = -(r0 * nx + r1 * ny + r2 * nz) * inverse
        work[row, u] = weight * work[_SHARE, u] * inverse
        work[row + 4, u] = d
        work[row + 5, u] = d * inverse
        work[row + 6, u] = e
        work[row + 7, u] = e * inverse
        work[row + 8, u] = square * inverse


@numba.njit(**INLINE)
def _begin(work, row, k):
    """Multiply the weight in the first row by e^{−jkR}."""
    for u in range(TILE):
        c, s = cosine_sine(k * work[row + 8, u])
        w = work[row, u]
        work[row, u] = w * c
        work[row + 1, u] = -w * s


@numba.njit(**INLINE)
def _set_step(work, row, k):
    """Set the factor that advances the exponential by the wavenumber step k."""
    for u in range(TILE):
        c, s = cosine_sine(k * work[row + 8, u])
        work[row + 2, u] = c
        work[row + 3, u] = -s


@numba.njit(**INLINE)
def _point(work, row, u, facing, k, beta):
    """Values of G and of the integrands of A and B at a pair of points; advances the exponential."""
    er, ei = work[row, u], work[row + 1, u]
    sr, si = work[row + 2, u], work[row + 3, u]
    a0, a1 = -work[row + 5, u], k * (k * beta * facing - work[row + 4, u])
    b0, b1 = -1.0 - k * beta * work[row + 6, u], beta * work[row + 7, u]
    work[row, u] = er * sr - ei * si
    work[row + 1, u] = er * si + ei * sr
    return er, ei, er * a0 - ei * a1, er * a1 + ei * a0, er * b0 - ei * b1, er * b1 + ei * b0


@numba.njit(**INLINE)
def _three_points(work, row, hat, q, k, beta):
    """Add test points q, q + 1, q + 2 against one trial point to the sums of the three test hats."""
    h00, h01, h02 = hat[q, 0], hat[q, 1], hat[q, 2]
    h10, h11, h12 = hat[q + 1, 0], hat[q + 1, 1], hat[q + 1, 2]
    h20, h21, h22 = hat[q + 2, 0], hat[q + 2, 1], hat[q + 2, 2]
    for u in range(TILE):
        facing = work[_FACING, u]
        e0r, e0i, a0r, a0i, b0r, b0i = _point(work, row, u, facing, k, beta)
        e1r, e1i, a1r, a1i, b1r, b1i = _point(work, row + _PAIR, u, facing, k, beta)
        e2r, e2i, a2r, a2i, b2r, b2i = _point(work, row + 2 * _PAIR, u, facing, k, beta)
        work[_SUM_G, u] += e0r + e1r + e2r
        work[_SUM_G + 1, u] += e0i + e1i + e2i
        work[_SUM_B, u] += h00 * b0r + h10 * b1r + h20 * b2r
        work[_SUM_B + 1, u] += h00 * b0i + h10 * b1i + h20 * b2i
        work[_SUM_B + 2, u] += h01 * b0r + h11 * b1r + h21 * b2r
        work[_SUM_B + 3, u] += h01 * b0i + h11 * b1i + h21 * b2i
        work[_SUM_B + 4, u] += h02 * b0r + h12 * b1r + h22 * b2r
        work[_SUM_B + 5, u] += h02 * b0i + h12 * b1i + h22 * b2i
        work[_SUM_A, u] += h00 * a0r + h10 * a1r + h20 * a2r
        work[_SUM_A + 1, u] += h00 * a0i + h10 * a1i + h20 * a2i
        work[_SUM_A + 2, u] += h01 * a0r + h11 * a1r + h21 * a2r
        work[_SUM_A + 3, u] += h01 * a0i + h11 * a1i + h21 * a2i
        work[_SUM_A + 4, u] += h02 * a0r + h12 * a1r + h22 * a2r
        work[_SUM_A + 5, u] += h02 * a0i + h12 * a1i + h22 * a2i


@numba.njit(**INLINE)
def _accumulate(lines, ik, work, line_of, curl, t, hat, n_m, n_q, k, beta):
    """Add one test triangle at one wavenumber to the lines of its three vertices."""
    for r in range(_SUM_G, _SUM_A):
        for u in range(TILE):
            work[r, u] = 0.0
    for m in range(n_m):
        for r in range(_SUM_A, _PAIRS):
            for u in range(TILE):
                work[r, u] = 0.0
        for q in range(0, n_q, 3):
            _three_points(work, _PAIRS + (m * n_q + q) * _PAIR, hat, q, k, beta)
        for i in range(3):
            line, to = line_of[t, i], _LINE + 2 * m
            for u in range(TILE):
                lines[ik, line, to, u] += work[_SUM_A + 2 * i, u]
                lines[ik, line, to + 1, u] += work[_SUM_A + 2 * i + 1, u]
    for i in range(3):
        line = line_of[t, i]
        c0, c1, c2 = curl[t, i, 0], curl[t, i, 1], curl[t, i, 2]
        for u in range(TILE):
            re, im = work[_SUM_G, u], work[_SUM_G + 1, u]
            lines[ik, line, 0, u] += work[_SUM_B + 2 * i, u]
            lines[ik, line, 1, u] += work[_SUM_B + 2 * i + 1, u]
            lines[ik, line, 2, u] += c0 * re
            lines[ik, line, 3, u] += c0 * im
            lines[ik, line, 4, u] += c1 * re
            lines[ik, line, 5, u] += c1 * im
            lines[ik, line, 6, u] += c2 * re
            lines[ik, line, 7, u] += c2 * im


@numba.njit(**INLINE)
def _scatter(lines, ik, i, row, start, width, curl_y, vertex_y, column_y, hat_y, beta, a, b):
    """Add the line of a test vertex to its row of A and B."""
    n_m = hat_y.shape[0]
    for u in range(width):
        v = start + u
        b[ik, row, column_y[v]] += complex(lines[ik, i, 0, u], lines[ik, i, 1, u])
        for j in range(3):
            # −jβ times the sum of G curlᵢ, which the line holds, times curlⱼ
            re, im = 0.0, 0.0
            for axis in range(3):
                re += beta * curl_y[j, axis, v] * lines[ik, i, 3 + 2 * axis, u]
                im -= beta * curl_y[j, axis, v] * lines[ik, i, 2 + 2 * axis, u]
            for m in range(n_m):
                re += hat_y[m, j] * lines[ik, i, _LINE + 2 * m, u]
                im += hat_y[m, j] * lines[ik, i, _LINE + 2 * m + 1, u]
            a[ik, row, vertex_y[v, j]] += complex(re, im)


@numba.njit(
    "void(float64[:,:,::1], float64[:,::1], float64[:,:,::1], float64[::1], int64[:,::1], int64[::1], int64[::1],"
    "int64[::1], float64[:,::1], float64[::1], float64[:,:,::1], float64[:,::1], float64[:,:,::1], float64[::1],"
    "int64[:,::1], int64[::1], int64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], boolean[::1],"
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
    vertex_y,  # (n_face, 3) columns of A
    column_y,  # (n_face,) columns of B
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
    work = np.zeros((_PAIRS + _PAIR * n_m * n_q, TILE))
    for it in range(tile.shape[0] - 1):
        start, width = tile[it], tile[it + 1] - tile[it]
        lines[:] = 0.0
        for t in range(n_test):
            nx, ny, nz = normal_x[t, 0], normal_x[t, 1], normal_x[t, 2]
            for u in range(width):
                v = start + u
                work[_SHARE, u] = area_y[v] * area_x[t] / (4.0 * np.pi)
                work[_FACING, u] = nx * normal_y[0, v] + ny * normal_y[1, v] + nz * normal_y[2, v]
            for i in range(skip_start[t], skip_start[t + 1]):
                u = skip[i] - start
                if 0 <= u < width:
                    work[_SHARE, u] = 0.0
            for m in range(n_m):
                for q in range(n_q):
                    _geometry(
                        work, _PAIRS + (m * n_q + q) * _PAIR, x[t, q, 0], x[t, q, 1], x[t, q, 2], nx, ny, nz,
                        y, m, normal_y, weight_x[q] * weight_y[m], start, width,
                    )  # fmt: skip
            for c in range(n_m * n_q):
                _begin(work, _PAIRS + c * _PAIR, k[0])
            for ik in range(n_k):
                if ik + 1 < n_k and new_step[ik]:
                    for c in range(n_m * n_q):
                        _set_step(work, _PAIRS + c * _PAIR, k[ik + 1] - k[ik])
                _accumulate(lines, ik, work, line_of, curl_x, t, hat_x, n_m, n_q, k[ik], beta[ik])
        for ik in range(n_k):
            for i in range(n_row):
                _scatter(lines, ik, i, row[i], start, width, curl_y, vertex_y, column_y, hat_y, beta[ik], a, b)
