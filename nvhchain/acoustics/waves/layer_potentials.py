"""Pressure at field points from pressure and pressure gradient on the surface."""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import ComplexArray, FloatArray, Surface

# Seven-point rule of degree 5 on the triangle (Radon 1948; Strang & Fix 1973, table 4.1).
_ROOT = np.sqrt(15.0)
_A, _B = (6.0 - _ROOT) / 21.0, (6.0 + _ROOT) / 21.0
RULE_BARYCENTRIC = np.array(
    [[1 / 3, 1 / 3, 1 / 3]] + [[1 - 2 * t if i == j else t for j in range(3)] for t in (_A, _B) for i in range(3)]
)
RULE_WEIGHT = np.array([9 / 40] + 3 * [(155 - _ROOT) / 1200] + 3 * [(155 + _ROOT) / 1200])


def layer_potentials(
    surface: Surface, points: FloatArray, wavenumber: float, cut_ratio: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return potentials D (n_point, n_v) and S (n_point, n_face) of both layers: p(x) = D p − S ∂p/∂n outside the body.

    points : (n_point, 3) m.
    wavenumber : rad/m, not negative.
    cut_ratio : longest triangle that is not cut, as a multiple of its distance from the point.

    A triangle longer than that, or longer than one radian of phase, is cut into four repeatedly. Each piece has a rule
    of degree 5. The pressure p is linear on triangles. The gradient ∂p/∂n along the outward normal is constant on
    triangles. G = e^{−jkr}/(4πr).
    """
    from nvhchain.acoustics.waves._layers import layers  # compiled

    double, single = layers(
        points,
        surface.vertices,
        surface.triangles,
        surface.normals,
        surface.areas,
        wavenumber,
        cut_ratio,
        RULE_BARYCENTRIC,
        RULE_WEIGHT,
    )
    return double, single
