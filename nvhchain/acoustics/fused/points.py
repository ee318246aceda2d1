"""Pairs of points of the fused engine: every operator from one evaluation of distance and exponential.

Let r = x − y, R = |r|, G = e^{−jkR}/(4πR) and α = −jβ. For flat triangles, the height d = r·n(y) is the same for every
y of a triangle, and e = −r·n(x) for every x. A pair of points contributes

    A: φᵢ(x) φⱼ(y) [−d F + jβk² n·n′ G]  − jβ G curlᵢ·curlⱼ      (−K + αW, W by Maue's formula)
    B: −φᵢ(x) [G − jβ e F]                                       (−(S + αK′))

with F = G (1/R² + jk/R). Only sums of G and e F over y enter B, so that G and F need one complex factor each. All
quantities but e^{−jkR} are kept over all wavenumbers of a batch. e^{−jkR} advances from one wavenumber to the next by a
complex factor that equal steps share.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from nvhchain.acoustics.fused.kernels import cosine_sine, inline

TILE = 32
"""Trial triangles processed side by side in the innermost loops; their scratch remains in the first-level cache."""

# Few arrays with rows at fixed places: the compiler can prove that rows do not overlap.
# Three test points against a trial point: G, the step's factor, re, im, and 1/R of each; d of each; e.
POINT, HEIGHT, TRIAL_HEIGHT, THREE = 5, 15, 18, 19
SHARE, FACING = 0, 1  # for a pair of triangles: area · area′/(4π) or 0; n·n′
TRIAL_SUMS = 12  # three test points, summed over the trial points: G re, im of each; e F re, im of each
TEST_SUMS = 6  # a trial point, summed over the test points: A of the three test hats, re, im
PAIR_SUMS = 8  # G re, im; B of the three test hats, re, im


@inline
def heights(three, y, normal_y, x0, x1, x2, nx, ny, nz, q):
    """Compute heights of one test point over the trial triangles and of their points over the test triangle."""
    for u in range(TILE):
        r0, r1, r2 = x0 - y[0, u], x1 - y[1, u], x2 - y[2, u]
        three[HEIGHT + q, u] = r0 * normal_y[0, u] + r1 * normal_y[1, u] + r2 * normal_y[2, u]
        three[TRIAL_HEIGHT, u] = -(r0 * nx + r1 * ny + r2 * nz)


@inline
def distances(three, distance, pair, y, x0, x1, x2, weight, q, one, tiny):
    """Compute the distance of one test point to one point of every trial triangle of the tile, and the weights."""
    for u in range(TILE):
        r0, r1, r2 = x0 - y[0, u], x1 - y[1, u], x2 - y[2, u]
        square = r0 * r0 + r1 * r1 + r2 * r2
        # Pairs with share 0 may meet in a point; their values need only be finite.
        inverse = one / np.sqrt(max(square, tiny))
        three[POINT * q, u] = weight * pair[SHARE, u] * inverse
        three[POINT * q + 4, u] = inverse
        distance[u] = square * inverse


@inline
def begin(three, distance, k, q, wave):
    """Multiply the weights by e^{−jkR}."""
    for u in range(TILE):
        c, s = cosine_sine(k * distance[u], wave)
        w = three[POINT * q, u]
        three[POINT * q, u] = w * c
        three[POINT * q + 1, u] = -w * s


@inline
def set_step(three, distance, k, q, wave):
    """Set the factors that advance the exponentials by the wavenumber step k."""
    for u in range(TILE):
        c, s = cosine_sine(k * distance[u], wave)
        three[POINT * q + 2, u] = c
        three[POINT * q + 3, u] = -s


@inline
def _point(three, q, u, k, slope):
    """Return G, F and the integrand of A at a pair of points, and advance the exponential; `slope` is βk² n·n′."""
    er, ei = three[POINT * q, u], three[POINT * q + 1, u]
    sr, si, inverse = three[POINT * q + 2, u], three[POINT * q + 3, u], three[POINT * q + 4, u]
    height = three[HEIGHT + q, u]
    fr, fi = inverse * (inverse * er - k * ei), inverse * (inverse * ei + k * er)
    three[POINT * q, u] = er * sr - ei * si
    three[POINT * q + 1, u] = er * si + ei * sr
    return er, ei, fr, fi, -height * fr - slope * ei, slope * er - height * fi


@inline
def three_points(test_sums, trial_sums, three, pair, hat, first, k, scale):
    """Add three test points against one trial point: A of the three test hats, G and e F of the points."""
    h00, h01, h02 = hat[first, 0], hat[first, 1], hat[first, 2]
    h10, h11, h12 = hat[first + 1, 0], hat[first + 1, 1], hat[first + 1, 2]
    h20, h21, h22 = hat[first + 2, 0], hat[first + 2, 1], hat[first + 2, 2]
    for u in range(TILE):
        turn, e = scale * pair[FACING, u], three[TRIAL_HEIGHT, u]
        e0r, e0i, f0r, f0i, a0r, a0i = _point(three, 0, u, k, turn)
        e1r, e1i, f1r, f1i, a1r, a1i = _point(three, 1, u, k, turn)
        e2r, e2i, f2r, f2i, a2r, a2i = _point(three, 2, u, k, turn)
        trial_sums[0, u] += e0r
        trial_sums[1, u] += e0i
        trial_sums[2, u] += e1r
        trial_sums[3, u] += e1i
        trial_sums[4, u] += e2r
        trial_sums[5, u] += e2i
        trial_sums[6, u] += e * f0r
        trial_sums[7, u] += e * f0i
        trial_sums[8, u] += e * f1r
        trial_sums[9, u] += e * f1i
        trial_sums[10, u] += e * f2r
        trial_sums[11, u] += e * f2i
        test_sums[0, u] += h00 * a0r + h10 * a1r + h20 * a2r
        test_sums[1, u] += h00 * a0i + h10 * a1i + h20 * a2i
        test_sums[2, u] += h01 * a0r + h11 * a1r + h21 * a2r
        test_sums[3, u] += h01 * a0i + h11 * a1i + h21 * a2i
        test_sums[4, u] += h02 * a0r + h12 * a1r + h22 * a2r
        test_sums[5, u] += h02 * a0i + h12 * a1i + h22 * a2i


@inline
def add_test_points(pair_sums, trial_sums, hat, first, beta):
    """Add G and B = −G + jβ e F of three test points to the sums of the three test hats."""
    h00, h01, h02 = hat[first, 0], hat[first, 1], hat[first, 2]
    h10, h11, h12 = hat[first + 1, 0], hat[first + 1, 1], hat[first + 1, 2]
    h20, h21, h22 = hat[first + 2, 0], hat[first + 2, 1], hat[first + 2, 2]
    for u in range(TILE):
        e0r, e0i, e1r = trial_sums[0, u], trial_sums[1, u], trial_sums[2, u]
        e1i, e2r, e2i = trial_sums[3, u], trial_sums[4, u], trial_sums[5, u]
        b0r, b0i = -beta * trial_sums[7, u] - e0r, beta * trial_sums[6, u] - e0i
        b1r, b1i = -beta * trial_sums[9, u] - e1r, beta * trial_sums[8, u] - e1i
        b2r, b2i = -beta * trial_sums[11, u] - e2r, beta * trial_sums[10, u] - e2i
        pair_sums[0, u] += e0r + e1r + e2r
        pair_sums[1, u] += e0i + e1i + e2i
        pair_sums[2, u] += h00 * b0r + h10 * b1r + h20 * b2r
        pair_sums[3, u] += h00 * b0i + h10 * b1i + h20 * b2i
        pair_sums[4, u] += h01 * b0r + h11 * b1r + h21 * b2r
        pair_sums[5, u] += h01 * b0i + h11 * b1i + h21 * b2i
        pair_sums[6, u] += h02 * b0r + h12 * b1r + h22 * b2r
        pair_sums[7, u] += h02 * b0i + h12 * b1i + h22 * b2i
