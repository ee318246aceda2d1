"""Membrane stiffness of flat shells, with a rotation about the normal at every node.

Quadrilaterals have two incompatible modes per direction (Taylor, Beresford & Wilson, Int. J. Numer. Meth. Eng. 10,
1976), which bend in their plane without locking. Their rotation θ follows that of the membrane, ½ (∂v/∂x − ∂u/∂y), by a
weak spring (Hughes & Brezzi, Comput. Methods Appl. Mech. Eng. 72, 1989).

Triangles are Felippa's optimal ones with drilling rotations (Comput. Methods Appl. Mech. Eng. 192, 2003): α = 3/2,
β₀ = ½ (1 − 4ν²) and β = 1, 2, 1, 0, 1, −1, −1, −1, −2.
"""

from __future__ import annotations

import numpy as np

from nvhchain.fem.structural.plates import jacobians, plane_rule
from nvhchain.handoff import FloatArray

_DRILLING = 1e-2
"""Stiffness of the rotation of quadrilaterals about their normal over that in shear; it moves no result by 1e-3."""


def membrane_stiffness(xy: FloatArray, thickness: FloatArray, young: float, poisson: float) -> FloatArray:
    """Return the membrane stiffness with drilling rotations.

    xy (m, n, 2): three or four corners in the plane (m), counter-clockwise.
    thickness (m,): thickness (m).
    young: Young's modulus (Pa).
    poisson: Poisson's ratio.
    Returns (m, 3 n, 3 n): stiffness; unknowns are u, v (m) and θ (rad) of each node.
    """
    law = young / (1 - poisson**2) * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
    if xy.shape[1] == 3:
        return _optimal_triangle(xy, thickness, law, poisson)
    return _incompatible(xy, thickness, law)


def _incompatible(xy: FloatArray, thickness: FloatArray, law: FloatArray) -> FloatArray:
    m, n, _ = xy.shape
    points, weight, shape, gradient, _ = plane_rule(n)
    inverse, determinant = jacobians(xy, gradient)
    slope = np.einsum("qnb,mqba->mqna", gradient, inverse)
    centre = np.array([[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]]) / 4
    middle, middle_determinant = jacobians(xy, centre)
    modes = np.zeros((len(points), 2, 2))
    modes[:, 0, 0], modes[:, 1, 1] = -2 * points[:, 0], -2 * points[:, 1]
    extra = np.einsum("qnb,mba->mqna", modes, middle[:, 0]) * (middle_determinant / determinant)[..., None, None]
    volume = determinant * weight * thickness[:, None]
    outer, inner = _strains(slope), _strains(extra)
    weighted = np.matmul(law, outer) * volume[..., None, None]
    inside = np.matmul(law, inner) * volume[..., None, None]
    full, mixed = (np.einsum("mqca,mqcb->mab", one, weighted, optimize=True) for one in (outer, inner))
    own = np.einsum("mqca,mqcb->mab", inner, inside, optimize=True)
    plane = full - np.matmul(mixed.swapaxes(1, 2), np.linalg.solve(own, mixed))
    K = np.zeros((m, n, 3, n, 3))
    K[:, :, :2, :, :2] = plane.reshape(m, n, 2, n, 2)
    turn = np.zeros((m, len(points), n, 3))
    turn[..., 0], turn[..., 1], turn[..., 2] = slope[..., 1] / 2, -slope[..., 0] / 2, shape
    spin = turn.reshape(m, len(points), 3 * n)
    drilling = _DRILLING * law[2, 2] * np.einsum("mq,mqa,mqb->mab", volume, spin, spin, optimize=True)
    return K.reshape(m, 3 * n, 3 * n) + drilling


def _strains(slope: FloatArray) -> FloatArray:
    """Return ε_x, ε_y, γ_xy (m, q, 3, 2 n) per displacement from slopes (m, q, n, 2) of shape functions."""
    m, q, n, _ = slope.shape
    strain = np.zeros((m, q, 3, n, 2))
    strain[:, :, 0, :, 0] = strain[:, :, 2, :, 1] = slope[..., 0]
    strain[:, :, 1, :, 1] = strain[:, :, 2, :, 0] = slope[..., 1]
    return strain.reshape(m, q, 3, 2 * n)


def _optimal_triangle(xy: FloatArray, thickness: FloatArray, law: FloatArray, poisson: float) -> FloatArray:
    x, y = xy[..., 0], xy[..., 1]
    x12, x23, x31 = x[:, 0] - x[:, 1], x[:, 1] - x[:, 2], x[:, 2] - x[:, 0]
    y12, y23, y31 = y[:, 0] - y[:, 1], y[:, 1] - y[:, 2], y[:, 2] - y[:, 0]
    x21, x32, x13, y21, y32, y13 = -x12, -x23, -x31, -y12, -y23, -y31
    area = (x21 * y31 - x31 * y21) / 2
    l21, l32, l13 = x21**2 + y21**2, x32**2 + y32**2, x13**2 + y13**2
    a = 1.5 / 6
    o = np.zeros_like(area)
    lumping = np.array(
        [
            [y23, o, x32],
            [o, x32, y23],
            [a * y23 * (y13 - y21), a * x32 * (x31 - x12), 2 * a * (x31 * y13 - x12 * y21)],
            [y31, o, x13],
            [o, x13, y31],
            [a * y31 * (y21 - y32), a * x13 * (x12 - x23), 2 * a * (x12 * y21 - x23 * y32)],
            [y12, o, x21],
            [o, x21, y12],
            [a * y12 * (y32 - y13), a * x21 * (x23 - x31), 2 * a * (x23 * y32 - x31 * y13)],
        ]
    ).transpose(2, 0, 1)
    basic = np.matmul(np.matmul(lumping, law), lumping.swapaxes(1, 2)) * (thickness / (4 * area))[:, None, None]
    natural = (
        np.array(
            [
                [y23 * y13 * l21, y31 * y21 * l32, y12 * y32 * l13],
                [x23 * x13 * l21, x31 * x21 * l32, x12 * x32 * l13],
                [(y23 * x31 + x32 * y13) * l21, (y31 * x12 + x13 * y21) * l32, (y12 * x23 + x21 * y32) * l13],
            ]
        ).transpose(2, 0, 1)
        / (4 * area**2)[:, None, None]
    )
    law_natural = np.matmul(natural.swapaxes(1, 2), np.matmul(law, natural))
    ones, four = np.ones_like(area), 4 * area
    hierarchical = (
        np.array(
            [
                [x32, y32, four, x13, y13, o, x21, y21, o],
                [x32, y32, o, x13, y13, four, x21, y21, o],
                [x32, y32, o, x13, y13, o, x21, y21, four],
            ]
        ).transpose(2, 0, 1)
        / four[:, None, None]
    )
    b = (1.0, 2.0, 1.0, 0.0, 1.0, -1.0, -1.0, -1.0, -2.0)
    sides = np.stack([ones / l21, ones / l32, ones / l13], axis=1) * (2 * area / 3)[:, None]
    q1 = sides[:, :, None] * np.array([[b[0], b[1], b[2]], [b[3], b[4], b[5]], [b[6], b[7], b[8]]])
    q2 = sides[:, :, None] * np.array([[b[8], b[6], b[7]], [b[2], b[0], b[1]], [b[5], b[3], b[4]]])
    q3 = sides[:, :, None] * np.array([[b[4], b[5], b[3]], [b[7], b[8], b[6]], [b[1], b[2], b[0]]])
    turned = sum(
        np.matmul(q.swapaxes(1, 2), np.matmul(law_natural, q)) for q in ((q1 + q2) / 2, (q2 + q3) / 2, (q3 + q1) / 2)
    )
    share = 0.75 * max(0.5 * (1 - 4 * poisson**2), 0.01)
    higher = np.matmul(hierarchical.swapaxes(1, 2), np.matmul(turned, hierarchical))
    return np.asarray(basic + (share * thickness * area)[:, None, None] * higher)
