"""Compiled inner loops of the fused engine: every operator from one evaluation of distance and exponential.

With r = x − y, R = |r|, G = e^{−jkR}/(4πR), the project's α = −jβ, and for flat triangles the lengths
d = r·n(y) (constant over y) and e = −r·n(x) (constant over x), a pair of points contributes

    A: φᵢ(x) φⱼ(y) G [−d/R² + j (βk² n·n′ − k d/R)]  − jβ G curlᵢ·curlⱼ      (−K + αW, W by Maue's formula)
    B: −φᵢ(x) G [1 + βk e/R − jβ e/R²]                                       (−(S + αK′))

so one complex factor each for A and B. Everything but e^{−jkR} is kept over all wavenumbers of a batch, and
e^{−jkR} advances from one wavenumber to the next by a complex factor that equal steps share.
"""

from __future__ import annotations

import numba
import numpy as np

TILE = 32
"""Trial triangles handled side by side; the innermost loops run over them, so their scratch stays in the L1/L2 cache."""

CHUNK = 256
"""Points of a pair rule handled side by side."""

_FAST = {"contract", "reassoc", "nsz", "arcp"}
_OPTIONS = {"fastmath": _FAST, "error_model": "numpy", "nogil": True, "cache": True}
_TINY = 1e-300
_GEOMETRY = 9  # rows per pair of points: E re, im; step re, im; d/R, d/R², e/R, e/R²; R
_LINE = 8  # rows of a test vertex before the trial points: B re, im; three components of the curl sum, re, im


@numba.njit(inline="always", fastmath=_FAST, error_model="numpy")
def _cosine_sine(phase):
    """cos and sin of `phase` without branches, to 1e-13: a quarter of the angle by Taylor, then doubled twice."""
    turns = phase * 0.15915494309189535
    angle = (turns - np.floor(turns + 0.5)) * 1.5707963267948966
    q = angle * angle
    s = angle * (
        1.0
        + q
        * (
            -1.0 / 6
            + q * (1.0 / 120 + q * (-1.0 / 5040 + q * (1.0 / 362880 + q * (-1.0 / 39916800 + q / 6227020800.0))))
        )
    )
    c = 1.0 + q * (
        -0.5
        + q
        * (
            1.0 / 24
            + q
            * (
                -1.0 / 720
                + q * (1.0 / 40320 + q * (-1.0 / 3628800 + q * (1.0 / 479001600 - q / 87178291200.0)))
            )
        )
    )
    c, s = c * c - s * s, 2.0 * c * s
    return c * c - s * s, 2.0 * c * s


@numba.njit(
    "void(float64[:,:,::1], float64[:,::1], float64[:,:,::1], float64[::1], int64[:,::1], int64[::1], int64[::1],"
    "int64[::1], float64[:,::1], float64[::1], float64[:,:,::1], float64[:,::1], float64[:,:,::1], float64[::1],"
    "int64[:,::1], int64[::1], int64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], boolean[::1],"
    "complex128[:,:,::1], complex128[:,:,::1])",
    **_OPTIONS,
)
def far_block(
    x,  # (n_test, n_q, 3) quadrature points of the test triangles, m
    normal_x,  # (n_test, 3)
    curl_x,  # (n_test, 3, 3) curl of hat i, 1/m
    area_x,  # (n_test,)
    line_of,  # (n_test, 3) local number of the test vertices; those of another owner point to a spare line
    row,  # (n_line − 1,) row of A and B of every local line but the spare one
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
    n_line = row.shape[0] + 1
    height = _LINE + 2 * n_m
    lines = np.empty((n_k, n_line, height, TILE))
    pairs = np.empty((n_m * n_q, _GEOMETRY, TILE))
    share = np.empty((4, TILE))  # 0/1 · area/(4π); n·n′; sum of G re, im
    for it in range(tile.shape[0] - 1):
        start, stop = tile[it], tile[it + 1]
        width = stop - start
        lines[:] = 0.0
        for t in range(n_test):
            for u in range(TILE):
                share[0, u] = 0.0
                share[1, u] = 0.0
            nx, ny, nz = normal_x[t, 0], normal_x[t, 1], normal_x[t, 2]
            for u in range(width):
                v = start + u
                share[0, u] = area_y[v] * area_x[t] / (4.0 * np.pi)
                share[1, u] = nx * normal_y[0, v] + ny * normal_y[1, v] + nz * normal_y[2, v]
            for i in range(skip_start[t], skip_start[t + 1]):
                v = skip[i]
                if start <= v < stop:
                    share[0, v - start] = 0.0
            for m in range(n_m):
                for q in range(n_q):
                    _geometry(
                        pairs[m * n_q + q], share, x[t, q, 0], x[t, q, 1], x[t, q, 2], nx, ny, nz,
                        y[m], normal_y, weight_x[q] * weight_y[m], start, width,
                    )  # fmt: skip
            for c in range(n_m * n_q):
                _start(pairs[c], k[0], True)
            for ik in range(n_k):
                if ik + 1 < n_k and new_step[ik]:
                    for c in range(n_m * n_q):
                        _start(pairs[c], k[ik + 1] - k[ik], False)
                _accumulate(
                    lines[ik], pairs, share, line_of[t, 0], line_of[t, 1], line_of[t, 2], curl_x[t],
                    hat_x, n_m, n_q, k[ik], beta[ik],
                )  # fmt: skip
        for ik in range(n_k):
            for i in range(n_line - 1):
                line, to_a, to_b = lines[ik, i], a[ik, row[i]], b[ik, row[i]]
                for u in range(width):
                    v = start + u
                    to_b[column_y[v]] += complex(line[0, u], line[1, u])
                    for j in range(3):
                        # −jβ times the sum of G curlᵢ, which `line` holds, times curlⱼ
                        re = line[2, u] * curl_y[j, 0, v] + line[4, u] * curl_y[j, 1, v] + line[6, u] * curl_y[j, 2, v]
                        im = line[3, u] * curl_y[j, 0, v] + line[5, u] * curl_y[j, 1, v] + line[7, u] * curl_y[j, 2, v]
                        re, im = beta[ik] * im, -beta[ik] * re
                        for m in range(n_m):
                            re += hat_y[m, j] * line[_LINE + 2 * m, u]
                            im += hat_y[m, j] * line[_LINE + 2 * m + 1, u]
                        to_a[vertex_y[v, j]] += complex(re, im)


@numba.njit(inline="always", fastmath=_FAST, error_model="numpy")
def _geometry(pair, share, x0, x1, x2, nx, ny, nz, y, normal_y, weight, start, width):
    """Distance and projections of one test point to one point of every trial triangle of the tile."""
    for u in range(TILE):
        v = start + (u if u < width else 0)
        r0, r1, r2 = x0 - y[0, v], x1 - y[1, v], x2 - y[2, v]
        square = r0 * r0 + r1 * r1 + r2 * r2
        inverse = 1.0 / np.sqrt(max(square, _TINY)) if share[0, u] > 0.0 else 0.0
        d = (r0 * normal_y[0, v] + r1 * normal_y[1, v] + r2 * normal_y[2, v]) * inverse
        e = -(r0 * nx + r1 * ny + r2 * nz) * inverse
        pair[0, u] = weight * share[0, u] * inverse
        pair[4, u] = d
        pair[5, u] = d * inverse
        pair[6, u] = e
        pair[7, u] = e * inverse
        pair[8, u] = square * inverse


@numba.njit(inline="always", fastmath=_FAST, error_model="numpy")
def _start(pair, k, first):
    """Set e^{−jkR} times the weight left in row 0 (first), or the factor that advances it by `k`."""
    if first:
        for u in range(TILE):
            c, s = _cosine_sine(k * pair[8, u])
            pair[1, u] = -pair[0, u] * s
            pair[0, u] = pair[0, u] * c
    else:
        for u in range(TILE):
            c, s = _cosine_sine(k * pair[8, u])
            pair[2, u] = c
            pair[3, u] = -s


@numba.njit(inline="always", fastmath=_FAST, error_model="numpy")
def _accumulate(line, pairs, share, i0, i1, i2, curl, hat, n_m, n_q, k, beta):
    """Add one test triangle at one wavenumber to the lines of its three vertices and advance the exponential."""
    for u in range(TILE):
        share[2, u] = 0.0
        share[3, u] = 0.0
    kb, kkb = k * beta, k * k * beta
    for m in range(n_m):
        for q in range(n_q):
            pair = pairs[m * n_q + q]
            h0, h1, h2 = hat[q, 0], hat[q, 1], hat[q, 2]
            for u in range(TILE):
                er, ei = pair[0, u], pair[1, u]
                c0, c1 = -pair[5, u], kkb * share[1, u] - k * pair[4, u]
                ar, ai = er * c0 - ei * c1, er * c1 + ei * c0
                d0, d1 = -1.0 - kb * pair[6, u], beta * pair[7, u]
                br, bi = er * d0 - ei * d1, er * d1 + ei * d0
                share[2, u] += er
                share[3, u] += ei
                line[i0, 0, u] += h0 * br
                line[i0, 1, u] += h0 * bi
                line[i1, 0, u] += h1 * br
                line[i1, 1, u] += h1 * bi
                line[i2, 0, u] += h2 * br
                line[i2, 1, u] += h2 * bi
                line[i0, _LINE + 2 * m, u] += h0 * ar
                line[i0, _LINE + 2 * m + 1, u] += h0 * ai
                line[i1, _LINE + 2 * m, u] += h1 * ar
                line[i1, _LINE + 2 * m + 1, u] += h1 * ai
                line[i2, _LINE + 2 * m, u] += h2 * ar
                line[i2, _LINE + 2 * m + 1, u] += h2 * ai
                pair[0, u] = er * pair[2, u] - ei * pair[3, u]
                pair[1, u] = er * pair[3, u] + ei * pair[2, u]
    for component in range(3):
        c0, c1, c2 = curl[0, component], curl[1, component], curl[2, component]
        for u in range(TILE):
            re, im = share[2, u], share[3, u]
            line[i0, 2 + 2 * component, u] += c0 * re
            line[i0, 3 + 2 * component, u] += c0 * im
            line[i1, 2 + 2 * component, u] += c1 * re
            line[i1, 3 + 2 * component, u] += c1 * im
            line[i2, 2 + 2 * component, u] += c2 * re
            line[i2, 3 + 2 * component, u] += c2 * im


@numba.njit("int64[::1](float64[:,::1], float64[::1], float64)", **_OPTIONS)
def count_close(centroid, size, ratio):
    """Number of triangles within `ratio` × the larger of both sizes of every triangle, itself included."""
    n = len(size)
    count = np.zeros(n, dtype=np.int64)
    for i in range(n):
        for j in range(n):
            reach = ratio * max(size[i], size[j])
            d0, d1, d2 = (
                centroid[i, 0] - centroid[j, 0],
                centroid[i, 1] - centroid[j, 1],
                centroid[i, 2] - centroid[j, 2],
            )
            if d0 * d0 + d1 * d1 + d2 * d2 < reach * reach:
                count[i] += 1
    return count
