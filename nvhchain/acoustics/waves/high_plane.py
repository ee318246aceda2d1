"""Waves of a body high above a rigid plane: from those about its own middle to those of body and image together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import qr, solve_triangular

from nvhchain.handoff import ComplexArray, FloatArray, IntArray

_NODES = 64
"""Nodes of a Gauss–Legendre rule."""

_PHASE_LIMIT = 40.0
"""Sum of wave order and phase (rad) of the path between body and plane that one rule integrates to rounding."""


def image_waves(amplitudes: ComplexArray, height: float, order: int) -> ComplexArray:
    """Return waves (n_row, m) of body and image from the amplitudes (n_row, m) of the body about its own middle.

    height : wavenumber times the height of the middle over the plane.

    Rows are those of `multipole_amplitudes`; the plane's normal is the polar axis.

    Body and image together radiate F = Σ a_lm Y_lm (e^{jkh cos θ} + (−1)^{l+m} e^{−jkh cos θ}), of which the upper half
    counts. The power is a quadratic form of the amplitudes with a matrix for every m. Its triangular factor R yields
    the rows: P = Σ|waves|²/(2ρc). R is real once the amplitudes of odd l + m are multiplied by j. Its rows of low
    degree do not depend on the highest degree. Rows therefore compare between wavenumbers, and those at −k are
    conjugate to those at k. R is computed from the field at quadrature nodes, not from the matrix. Waves that body and
    image almost cancel, within wavelengths of the plane, thereby keep their digits.
    """
    waves = np.empty_like(amplitudes)
    for rows, factor, turn in _factors(height, order):
        waves[rows] = factor @ (turn[:, None] * amplitudes[rows])
    return waves


def body_waves(waves: ComplexArray, height: float, order: int) -> ComplexArray:
    """Return the amplitudes (n_row,) of a body about its own middle, of which `image_waves` makes waves (n_row,)."""
    amplitudes = np.zeros_like(waves)
    for rows, factor, turn in _factors(height, order):
        amplitudes[rows] = solve_triangular(factor, waves[rows]) / turn
    return amplitudes


def _factors(height: float, order: int) -> Iterator[tuple[IntArray, FloatArray, ComplexArray]]:
    """Yield rows (n,), triangular factor (n, n) and phases (n,) of `image_waves` for every m, of either sign."""
    cosine, weight = _nodes(height, order)
    even, odd = 2.0 * np.sqrt(weight) * np.cos(height * cosine), 2.0 * np.sqrt(weight) * np.sin(height * cosine)
    for m, field in enumerate(polar_functions(cosine, order)):
        field[:, ::2] *= even[:, None]
        field[:, 1::2] *= odd[:, None]
        factor = qr(field, mode="r", overwrite_a=True, check_finite=False)[0][: field.shape[1]]
        factor *= np.where(factor.diagonal() < 0, -1.0, 1.0)[:, None]
        degree = np.arange(m, order + 1)
        turn = np.where((degree - m) % 2, 1j, 1.0)
        for rows in {m, -m}:
            yield degree * degree + degree + rows, factor, turn


def _nodes(height: float, order: int) -> tuple[FloatArray, FloatArray]:
    """Return cosines (n,) between 0 and 1 and weights (n,) that integrate squares of the field."""
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    pieces = 1 + int((height + order) / _PHASE_LIMIT)
    cosine = (np.arange(pieces)[:, None] + 0.5 * (1.0 + node)) / pieces
    return cosine.ravel(), np.tile(0.5 * weight / pieces, pieces)


def polar_functions(cosine: FloatArray, order: int) -> Iterator[FloatArray]:
    """Yield, for m = 0 … order, associated Legendre functions (n, order − m + 1) of unit norm between −1 and 1."""
    sine, sectoral = np.sqrt(1.0 - cosine**2), np.full(len(cosine), np.sqrt(0.5))
    for m in range(order + 1):
        if m > 0:
            sectoral = sectoral * np.sqrt((2 * m + 1) / (2.0 * m)) * sine
        values = np.zeros((len(cosine), order - m + 1))
        values[:, 0] = sectoral
        below, b = np.zeros(len(cosine)), 0.0
        for l in range(m + 1, order + 1):
            a = np.sqrt((4.0 * l * l - 1.0) / (l * l - m * m))
            values[:, l - m] = a * (cosine * values[:, l - m - 1] - b * below)
            below, b = values[:, l - m - 1], 1.0 / a
        yield values
