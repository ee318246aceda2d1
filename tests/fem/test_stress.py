"""Recovered stress against fields in closed form."""

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError
from nvhchain.fem.stress import nodal_stress, von_mises_of_stress
from nvhchain.testing import elements as meshes

E, NU = STEEL.young, STEEL.poisson


@pytest.fixture(params=["hex20", "tet10"])
def block(request):
    make = meshes.brick if request.param == "hex20" else meshes.tetrahedra
    return (*make((3, 2, 2), (0.03, 0.02, 0.01), distort=0.2), request.param)


def test_any_uniform_strain_gives_its_stress_at_every_node(block):
    nodes, elements, kind = block
    slope = 1e-4 * np.array([[1.0, 0.4, -0.3], [0.2, -0.5, 0.7], [0.1, -0.6, 0.3]])
    stress = nodal_stress(nodes, elements, kind, STEEL, nodes @ slope.T)
    strain = 0.5 * (slope + slope.T)
    exact = E / (1 + NU) * (strain + NU / (1 - 2 * NU) * np.trace(strain) * np.eye(3))
    np.testing.assert_allclose(
        stress, np.tile(exact[[0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]], (len(nodes), 1)), rtol=1e-9
    )
    deviator = exact - np.trace(exact) / 3 * np.eye(3)
    np.testing.assert_allclose(von_mises_of_stress(stress), np.sqrt(1.5 * (deviator**2).sum()), rtol=1e-9)


def test_pure_bending_gives_a_stress_in_proportion_to_the_height(block):
    """With u = κ (x y, −(x² + ν y² − ν z²)/2, −ν y z) all stresses vanish but σ_x = E κ y; the mesh is undistorted."""
    kind = block[2]
    nodes, elements = (meshes.brick if kind == "hex20" else meshes.tetrahedra)((3, 2, 2), (0.03, 0.02, 0.01))
    x, y, z = (nodes - [0.0, 0.01, 0.005]).T
    bent = 0.5 * np.stack([x * y, -0.5 * (x**2 + NU * (y**2 - z**2)), -NU * y * z], axis=1)
    stress = nodal_stress(nodes, elements, kind, STEEL, bent)
    exact = np.zeros((len(nodes), 6))
    exact[:, 0] = E * 0.5 * y
    np.testing.assert_allclose(stress, exact, atol=1e-9 * np.abs(exact).max())
    np.testing.assert_allclose(von_mises_of_stress(stress), np.abs(exact[:, 0]), atol=1e-7 * np.abs(exact).max())


def test_thick_ring_under_pressure_has_the_stress_of_lame():
    """Plane strain under inner pressure; curved bricks come nearer with the square of their size."""
    inner, outer, pressure = 0.02, 0.04, 1e8
    B = pressure / (1 / inner**2 - 1 / outer**2)
    A = B / outer**2
    worst = []
    for rows in (3, 6):
        nodes, elements = meshes.brick((rows, 2 * rows, 1), (outer - inner, np.pi / 2, 0.005))
        r, phi = inner + nodes[:, 0], nodes[:, 1].copy()
        nodes[:, 0], nodes[:, 1] = r * np.cos(phi), r * np.sin(phi)
        radial = (1 + NU) / E * ((1 - 2 * NU) * A * r + B / r)
        moved = np.stack([radial * np.cos(phi), radial * np.sin(phi), 0 * r], axis=1)
        found = von_mises_of_stress(nodal_stress(nodes, elements, "hex20", STEEL, moved))
        exact = np.sqrt((1 - 2 * NU) ** 2 * A**2 + 3 * (B / r**2) ** 2)
        worst.append(np.abs(found / exact - 1).max())
    assert worst[0] < 0.05
    assert worst[1] < 0.35 * worst[0]


def test_other_elements_are_refused():
    with pytest.raises(InputError, match="use hex20 or tet10"):
        nodal_stress(np.zeros((1, 3)), np.zeros((1, 15), int), "wedge15", STEEL, np.zeros((1, 3)))
