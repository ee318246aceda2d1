"""Close and touching pairs of triangles: a rule over both at once, with the integrands of `points`."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numba
import numpy as np

from nvhchain.acoustics.fused.kernels import COMPILED, cosine_sine, inline
from nvhchain.acoustics.fused.splitting import cut, map_points

CHUNK = 256
"""Points of a pair rule processed side by side."""

NEAREST = 3
"""Rule of the nearest pairs that do not touch."""

_ROWS = 13  # E re, im; step re, im; d/R, d/R², e/R, e/R²; R; integrands of A and B re, im


@inline
def _match(triangles, t, s, left_order, right_order):
    """Order the local vertices of two triangles: shared vertices first, in the same order."""
    shared = 0
    for i in range(3):
        for j in range(3):
            if triangles[t, i] == triangles[s, j]:
                left_order[shared], right_order[shared] = i, j
                shared += 1
    n_left, n_right = shared, shared
    for i in range(3):
        found_left, found_right = False, False
        for j in range(shared):
            found_left |= left_order[j] == i
            found_right |= right_order[j] == i
        if not found_left:
            left_order[n_left] = i
            n_left += 1
        if not found_right:
            right_order[n_right] = i
            n_right += 1


@inline
def _corners(vertices, triangles, t, order):
    """Return the coordinates of the three corners in the given local order, flat."""
    a, b, c = triangles[t, order[0]], triangles[t, order[1]], triangles[t, order[2]]
    return (
        vertices[a, 0], vertices[a, 1], vertices[a, 2],
        vertices[b, 0], vertices[b, 1], vertices[b, 2],
        vertices[c, 0], vertices[c, 1], vertices[c, 2],
    )  # fmt: skip


@inline
def _geometry(work, x, y, rule, width, normal_x, normal_y, share):
    """Compute distance and projections at a chunk of the points of a pair rule."""
    x00, x01, x02, x10, x11, x12, x20, x21, x22 = x
    y00, y01, y02, y10, y11, y12, y20, y21, y22 = y
    nx0, nx1, nx2 = normal_x
    ny0, ny1, ny2 = normal_y
    for u in range(width):
        l0, l1, l2, m0, m1, m2 = rule[0, u], rule[1, u], rule[2, u], rule[3, u], rule[4, u], rule[5, u]
        r0 = l0 * x00 + l1 * x10 + l2 * x20 - m0 * y00 - m1 * y10 - m2 * y20
        r1 = l0 * x01 + l1 * x11 + l2 * x21 - m0 * y01 - m1 * y11 - m2 * y21
        r2 = l0 * x02 + l1 * x12 + l2 * x22 - m0 * y02 - m1 * y12 - m2 * y22
        square = r0 * r0 + r1 * r1 + r2 * r2
        inverse = 1.0 / np.sqrt(square)
        d = (r0 * ny0 + r1 * ny1 + r2 * ny2) * inverse
        e = -(r0 * nx0 + r1 * nx1 + r2 * nx2) * inverse
        work[0, u] = rule[6, u] * share * inverse
        work[4, u] = d
        work[5, u] = d * inverse
        work[6, u] = e
        work[7, u] = e * inverse
        work[8, u] = square * inverse


@inline
def _begin(work, k, width, wave):
    """Multiply the weight in the first row by e^{−jkR}."""
    for u in range(width):
        c, s = cosine_sine(k * work[8, u], wave)
        w = work[0, u]
        work[0, u] = w * c
        work[1, u] = -w * s


@inline
def _set_step(work, k, width, wave):
    """Set the factor that advances the exponential by the wavenumber step k."""
    for u in range(width):
        c, s = cosine_sine(k * work[8, u], wave)
        work[2, u] = c
        work[3, u] = -s


@inline
def _values(work, width, k, beta, facing):
    """Store the integrands of A and B in the last rows, advance the exponential and return the sum of G."""
    total_re, total_im = 0.0, 0.0
    for u in range(width):
        er, ei = work[0, u], work[1, u]
        sr, si = work[2, u], work[3, u]
        a0, a1 = -work[5, u], k * (k * beta * facing - work[4, u])
        b0, b1 = -1.0 - k * beta * work[6, u], beta * work[7, u]
        work[9, u] = er * a0 - ei * a1
        work[10, u] = er * a1 + ei * a0
        work[11, u] = er * b0 - ei * b1
        work[12, u] = er * b1 + ei * b0
        work[0, u] = er * sr - ei * si
        work[1, u] = er * si + ei * sr
        total_re += er
        total_im += ei
    return total_re, total_im


@inline
def _sums(work, rule, hat, width):
    """Return the integrals over a chunk against test hat i: A with the three trial hats, then B; re, im of each."""
    a0r, a0i, a1r, a1i, a2r, a2i, br, bi = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for u in range(width):
        h = hat[u]
        re, im = h * work[9, u], h * work[10, u]
        a0r += rule[3, u] * re
        a0i += rule[3, u] * im
        a1r += rule[4, u] * re
        a1i += rule[4, u] * im
        a2r += rule[5, u] * re
        a2i += rule[5, u] * im
        br += h * work[11, u]
        bi += h * work[12, u]
    return a0r, a0i, a1r, a1i, a2r, a2i, br, bi


CLOSE_BLOCK = (
    "void(int64[::1], int64[::1], int64[::1], int64[::1], int64, int64[::1], float64[:,:,::1], int64[::1],"
    "float64[:,::1], int64[:,::1], float64[:,::1], float64[:,:,::1], float64[::1], float64[::1],"
    "float64[:,::1], float64[:,::1], float64[:,:,::1], float64, float64, int64[:,::1], int64[::1], float64[::1],"
    "float64[::1], boolean[::1], float64[::1], cplx[:,:,::1], cplx[:,:,::1])"
)
"""Signature of `close_block`, in double precision for any precision of the matrices."""


def close_block(
    test,  # (n_test,) test triangles
    pair_start,  # (n_face + 1,) into `trial` and `kind`
    trial,  # trial triangles of the close pairs
    kind,  # rule of every close pair; 0, 1, 2 for 1, 2, 3 shared vertices, as are all from n_plain on
    n_plain,  # number of rules before those of touching needles
    rule_start,  # (n_rule + 1,) into the chunks of all rules
    rule,  # (n_chunk, 7, CHUNK) barycentric coordinates of first and second point, weight
    rule_width,  # (n_chunk,) points of every chunk
    vertices,  # (n_v, 3)
    triangles,  # (n_face, 3)
    normal,  # (n_face, 3)
    curl,  # (n_face, 3, 3)
    area,  # (n_face,)
    size,  # (n_face,) longest edges
    trial_vertices,  # (n_v, 3) of the surface or of its mirror image
    trial_normal,  # (n_face, 3)
    trial_curl,  # (n_face, 3, 3)
    gap,  # pairs nearer than this multiple of the longer triangle are cut
    least_scale,  # smallest piece, as a share of its triangle
    corner,  # (n_face, 3) columns of A; columns of B follow the triangles
    row_of,  # (n_v,) row of A and B of every vertex; −1 for vertices of other parts
    k,  # (n_k,)
    beta,  # (n_k,)
    new_step,  # (n_k,)
    wave,  # coefficients of `cosine_sine`
    a,  # (n_k, n_row, n_v) added to
    b,  # (n_k, n_row, n_face) added to
):
    """Add the close pairs of a block of test triangles to the rows that are owned."""
    n_k = k.shape[0]
    work = np.zeros((_ROWS, CHUNK))
    sums = np.empty((n_k, 3, 8))
    whole = np.empty((n_k, 2))
    mapped, corners = np.empty((7, CHUNK)), np.empty((2, 3, 3))
    pieces, part_share = np.empty((256, 2, 3, 3)), np.empty(256)
    left, right = np.empty(3, np.int64), np.empty(3, np.int64)
    for t in test:
        for i_pair in range(pair_start[t], pair_start[t + 1]):
            s, r = trial[i_pair], kind[i_pair]
            for i in range(3):
                left[i] = right[i] = i
            if r < NEAREST or r >= n_plain:
                _match(triangles, t, s, left, right)
            x, y = _corners(vertices, triangles, t, left), _corners(trial_vertices, triangles, s, right)
            normal_x = (normal[t, 0], normal[t, 1], normal[t, 2])
            normal_y = (trial_normal[s, 0], trial_normal[s, 1], trial_normal[s, 2])
            facing = normal_x[0] * normal_y[0] + normal_x[1] * normal_y[1] + normal_x[2] * normal_y[2]
            share = area[t] * area[s] / (4.0 * np.pi)
            sums[:] = 0.0
            whole[:] = 0.0
            n_piece = 1
            if r == NEAREST:
                for i in range(3):
                    for axis in range(3):
                        corners[0, i, axis] = vertices[triangles[t, left[i]], axis]
                        corners[1, i, axis] = trial_vertices[triangles[s, right[i]], axis]
                least_x, least_y = least_scale * size[t], least_scale * size[s]
                pieces, part_share, n_piece = cut(pieces, part_share, corners, gap, least_x, least_y)
            for n in range(n_piece):
                for i_chunk in range(rule_start[r], rule_start[r + 1]):
                    points, width = rule[i_chunk], rule_width[i_chunk]
                    if n_piece > 1:
                        map_points(mapped, points, width, pieces, part_share, n)
                        points = mapped
                    _geometry(work, x, y, points, width, normal_x, normal_y, share)
                    _begin(work, k[0], width, wave)
                    for ik in range(n_k):
                        if ik + 1 < n_k and new_step[ik]:
                            _set_step(work, k[ik + 1] - k[ik], width, wave)
                        re, im = _values(work, width, k[ik], beta[ik], facing)
                        whole[ik, 0] += re
                        whole[ik, 1] += im
                        for i in range(3):
                            part = _sums(work, points, points[i], width)
                            for j in range(8):
                                sums[ik, i, j] += part[j]
            for i in range(3):
                row = row_of[triangles[t, left[i]]]
                if row < 0:
                    continue
                for j in range(3):
                    c = 0.0
                    for axis in range(3):
                        c += curl[t, left[i], axis] * trial_curl[s, right[j], axis]
                    for ik in range(n_k):
                        a[ik, row, corner[s, right[j]]] += complex(
                            sums[ik, i, 2 * j] + beta[ik] * c * whole[ik, 1],
                            sums[ik, i, 2 * j + 1] - beta[ik] * c * whole[ik, 0],
                        )
                for ik in range(n_k):
                    b[ik, row, s] += complex(sums[ik, i, 6], sums[ik, i, 7])


@numba.njit(
    "void(float64[:,::1], float64[:,::1], float64[::1], int64[::1], int64[:,::1], boolean, float64[::1], int64[::1],"
    "int64[::1], int64[::1])",
    **COMPILED,
)
def close_pairs(
    centroid,  # (n_face, 3)
    trial_centroid,  # (n_face, 3) of the surface or of its mirror image
    size,  # (n_face,)
    slenderness,  # (n_face,) 0, 1, 2: level of needles
    triangles,  # (n_face, 3)
    same,  # True if the trial triangles are the surface itself, so that equal vertices touch
    ratio,  # (n_level,) increasing: level of a pair from centroid distance / larger size
    start,  # (n_face + 1,) places of the pairs; out if start[-1] < 0: counts
    trial,  # out
    rule,  # out: shared vertices − 1 for touching pairs (those of needles after all others), else 3 + level
):
    """List the close pairs of every triangle in ascending order of the trial triangle, or count them."""
    n, n_level = len(size), len(ratio)
    counting = start[n] < 0
    found = 0
    for i in range(n):
        if counting:
            start[i] = found
        for j in range(n):
            square = 0.0
            for axis in range(3):
                square += (centroid[i, axis] - trial_centroid[j, axis]) ** 2
            larger = max(size[i], size[j])
            if square >= (ratio[n_level - 1] * larger) ** 2:
                continue
            if not counting:
                shared = 0
                for p in range(3):
                    for q in range(3):
                        if same and triangles[i, p] == triangles[j, q]:
                            shared += 1
                level = 0
                while square >= (ratio[level] * larger) ** 2:
                    level += 1
                trial[found] = j
                needle = max(slenderness[i], slenderness[j])
                rule[found] = 3 + level
                if shared > 0:
                    rule[found] = shared - 1 + (n_level + 3 * needle if needle > 0 else 0)
            found += 1
    if counting:
        start[n] = found
