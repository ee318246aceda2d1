"""Bending and transverse shear of plates: discrete Kirchhoff–Mindlin triangles and quadrilaterals.

DKMT and DKMQ (Katili, Int. J. Numer. Meth. Eng. 36, 1993, pp. 1859 and 1885) have three unknowns per node: deflection w
and the slopes β of the normal, with shear strains γ = ∇w + β. Along side k of length L, the slope βₛ is quadratic:
linear between the nodes plus a bubble of height Δβ. Two conditions hold for each side. The first is the mean of γ = w,ₛ
+ βₛ; the second is equilibrium of the strip, γ = (D_b/D_s) βₛ,ₛₛ. They give

    Δβ = −3 / (2 L (1 + φ)) · [w_j − w_i + L/2 (βₛᵢ + βₛⱼ)],   γ = −⅔ φ Δβ,   φ = 12 D_b / (D_s L²).

For thin plates φ vanishes, and with it the shear strain: nothing locks. Within the element the shear strain is
interpolated from the sides in natural coordinates, as in MITC elements.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from nvhchain.handoff import FloatArray

Rule = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""Points (q, 2), weights (q,), shape functions (q, n), gradients (q, n, 2) of these and of the bubbles."""


@cache
def plane_rule(corners: int) -> Rule:
    """Return the tabulated linear element of three or four corners.

    corners : 3 for r, s of the unit triangle; 4 for the square −1 … 1.

    Bubble k belongs to the side from corner k to the next one; its height in the middle is one.
    """
    if corners == 3:
        points = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])
        L = np.column_stack([1 - points.sum(axis=1), points])
        dL = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
        following = np.roll(np.arange(3), -1)
        bubble = 4 * (L[:, :, None] * dL[following] + L[:, following, None] * dL)
        return points, np.full(3, 1 / 6), L, np.broadcast_to(dL, (3, 3, 2)).copy(), bubble
    g = 1 / np.sqrt(3)
    place = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points = g * place
    one = 1 + points[:, None] * place
    gradient = np.stack([place[:, 0] * one[..., 1], place[:, 1] * one[..., 0]], axis=-1) / 4
    x, y = points.T
    bubble = 0.5 * np.stack(
        [
            np.column_stack([-2 * x * (1 - y), -(1 - x**2)]),
            np.column_stack([1 - y**2, -2 * y * (1 + x)]),
            np.column_stack([-2 * x * (1 + y), 1 - x**2]),
            np.column_stack([-(1 - y**2), -2 * y * (1 - x)]),
        ],
        axis=1,
    )
    return points, np.ones(4), one.prod(axis=2) / 4, gradient, bubble


def jacobians(xy: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return inverse Jacobians (m, q, 2, 2), ∂ξ_b/∂x_a at [b, a], and determinants (m, q) of elements (m, n, 2) m."""
    jacobian = np.einsum("mna,qnb->mqab", xy, gradient)
    return np.linalg.inv(jacobian), np.linalg.det(jacobian)


def plate_stiffness(xy: FloatArray, bending: FloatArray, poisson: float, shear: FloatArray) -> FloatArray:
    """Return the stiffness of plates.

    xy (m, n, 2): three or four corners in the plane (m), counter-clockwise.
    bending (m,): bending stiffness D = E t³ / (12 (1 − ν²)) (N m).
    poisson: Poisson's ratio.
    shear (m,): shear stiffness κ G t (N/m); inf for a plate that does not shear.
    Returns (m, 3 n, 3 n): stiffness; unknowns are w (m), βₓ and β_y (rad) of each node.
    """
    m, n, _ = xy.shape
    points, weight, _, gradient, bubble = plane_rule(n)
    inverse, determinant = jacobians(xy, gradient)
    side = np.roll(xy, -1, axis=1) - xy
    length = np.linalg.norm(side, axis=2)
    direction = side / length[..., None]
    phi = 12 * (bending / shear)[:, None] / length**2
    bump = _bubble_heights(length, direction, phi)
    slope = np.einsum("qnb,mqba->mqna", gradient, inverse)
    bump_slope = np.einsum("qnb,mqba->mqna", bubble, inverse)
    nodal = np.zeros((m, len(weight), 3, n, 3))
    nodal[:, :, 0, :, 1] = slope[..., 0]
    nodal[:, :, 1, :, 2] = slope[..., 1]
    nodal[:, :, 2, :, 1], nodal[:, :, 2, :, 2] = slope[..., 1], slope[..., 0]
    curvature = nodal.reshape(m, len(weight), 3, 3 * n)
    c, s = direction[:, None, :, 0], direction[:, None, :, 1]
    bump_curvature = np.stack(
        [bump_slope[..., 0] * c, bump_slope[..., 1] * s, bump_slope[..., 1] * c + bump_slope[..., 0] * s], axis=2
    )
    curvature += np.einsum("mqck,mkd->mqcd", bump_curvature, bump, optimize=True)
    law = np.array([[1.0, poisson, 0.0], [poisson, 1.0, 0.0], [0.0, 0.0, (1 - poisson) / 2]])
    area = determinant * weight
    K = _quadratic(curvature, law, area * bending[:, None])
    strain = np.einsum("mqab,mqbd->mqad", inverse.swapaxes(2, 3), _natural_shear(points, length, phi, bump))
    finite = np.isfinite(shear)
    if finite.any():
        K[finite] += _quadratic(strain[finite], np.eye(2), area[finite] * shear[finite, None])
    return K


def _quadratic(strain: FloatArray, law: FloatArray, weight: FloatArray) -> FloatArray:
    """Return Σ_q weight · strainᵀ law strain of strains (m, q, c, d)."""
    weighted = np.matmul(law, strain) * weight[..., None, None]
    m, q, c, d = strain.shape
    return np.matmul(strain.reshape(m, q * c, d).swapaxes(1, 2), weighted.reshape(m, q * c, d))


def _bubble_heights(length: FloatArray, direction: FloatArray, phi: FloatArray) -> FloatArray:
    """Return Δβ (m, n, 3 n) of every side per unknown of the nodes."""
    m, n = length.shape
    bump = np.zeros((m, n, n, 3))
    for k in range(n):
        for node, sign in ((k, -1.0), ((k + 1) % n, 1.0)):
            bump[:, k, node, 0] = sign
            bump[:, k, node, 1:] = length[:, k, None] / 2 * direction[:, k]
    factor = -1.5 / (length * (1 + phi))
    return (factor[..., None, None] * bump).reshape(m, n, 3 * n)


def _natural_shear(points: FloatArray, length: FloatArray, phi: FloatArray, bump: FloatArray) -> FloatArray:
    """Return shear strains (m, q, 2, 3 n) along the natural coordinates, from the strains of the sides."""
    side = (-2 / 3 * phi * length)[..., None] * bump  # γ L of each side
    m, n, d = bump.shape
    strain = np.empty((m, len(points), 2, d))
    for q, (r, s) in enumerate(points.tolist()):
        if n == 3:
            first, second = side[:, 0], -side[:, 2]
            turn = second - first - side[:, 1]
            strain[:, q, 0], strain[:, q, 1] = first + s * turn, second - r * turn
        else:
            strain[:, q, 0] = ((1 - s) * side[:, 0] - (1 + s) * side[:, 2]) / 4
            strain[:, q, 1] = ((1 + r) * side[:, 1] - (1 - r) * side[:, 3]) / 4
    return strain
