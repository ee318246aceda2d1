"""Rational interpolation of vectors that share their poles: barycentric weights from the vectors' inner products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev

from nvhchain.handoff import ComplexArray, FloatArray

ROUNDING = 4.0 * float(np.sqrt(np.finfo(float).eps))
"""Relative size of a divided difference below which it is zero within the rounding of inner products."""


@dataclass(frozen=True, eq=False)
class Window:
    """Neighbouring nodes and the denominator of the rational function through the values there.

    nodes : frequencies (Hz).
    denominator : polynomial q; a polynomial interpolates q times the values.
    """

    nodes: FloatArray
    denominator: Chebyshev

    def weights(self, frequency: FloatArray) -> ComplexArray:
        """Return weights (n, m) of nodal values for the value at each `frequency` (n,) Hz: ℓ_j(f) q(f_j)/q(f)."""
        distance = frequency[:, None] - self.nodes
        coincident = distance == 0
        distance[coincident] = 1.0
        weights = np.asarray(barycentric(self.nodes) * self.denominator(self.nodes) / distance, dtype=complex)
        weights[coincident.any(axis=1)] = coincident[coincident.any(axis=1)]
        return weights / weights.sum(axis=1, keepdims=True)

    def resonances(self) -> tuple[ComplexArray, ComplexArray]:
        """Return poles f_p (n,) Hz and the weights (n, m) of the values at the nodes for the residues R_p there.

        Near a pole, the values are R_p/(f − f_p) plus a smooth function.
        """
        poles = np.asarray(self.denominator.roots(), dtype=complex)
        shares = barycentric(self.nodes) * self.denominator(self.nodes) / (poles[:, None] - self.nodes)
        slope = -(shares / (poles[:, None] - self.nodes)).sum(axis=1, keepdims=True)
        return poles, shares / slope


def barycentric(nodes: FloatArray) -> FloatArray:
    """Return Lagrange's barycentric weights 1/Π(f_j − f_i) of nodes (m,), with frequencies in units of their range."""
    difference = (nodes[:, None] - nodes) / (float(np.ptp(nodes)) or 1.0)
    np.fill_diagonal(difference, 1.0)
    return np.asarray(1.0 / np.prod(difference, axis=1), dtype=float)


def window(nodes: FloatArray, gram: ComplexArray | None, poles: int) -> Window:
    """Return the window for nodes (m,) Hz and inner products (m, m) of the values there, conjugate first.

    The denominator minimises the highest divided difference of q times the values among all of its degree. That
    difference is Σ_j w_j q(f_j) g_j with the weights w of `barycentric`. It is zero if the values are a rational
    function of that degree. Poles are added one by one, up to `poles`, until only rounding remains. All values share
    the denominator, as all transfer vectors of one body share the poles of the scattering problem. Source: minimal
    rational interpolation, Pradovera (2020), with a denominator of limited degree.
    """
    domain = [float(nodes[0]), float(nodes[-1])] if len(nodes) > 1 else [float(nodes[0]) - 1.0, float(nodes[0]) + 1.0]
    best = Chebyshev([1.0], domain=domain)
    if gram is None or poles == 0:
        return Window(nodes, best)
    weight = barycentric(nodes)
    scale = float(np.sqrt(weight**2 @ gram.diagonal().real))
    centre, half = 0.5 * (domain[0] + domain[1]), 0.5 * (domain[1] - domain[0])
    for degree in range(poles + 1):
        basis, triangle = np.linalg.qr(chebyshev.chebvander((nodes - centre) / half, degree))
        weighted = weight[:, None] * basis
        value, vector = np.linalg.eigh(weighted.T @ gram @ weighted)
        best = Chebyshev(np.linalg.solve(triangle, vector[:, 0]), domain=domain)
        if value[0] <= (ROUNDING * scale) ** 2:
            break
    return Window(nodes, best)
