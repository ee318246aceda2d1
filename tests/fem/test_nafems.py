"""NAFEMS benchmarks FV12 and FV32 (Selected Benchmarks for Natural Frequency Analysis, 1987)."""

import fem_meshes as meshes
import numpy as np
import pytest

from nvhchain.conventions import Material
from nvhchain.fem import lowest_modes, stiffness_and_mass

STEEL = Material(young=200e9, poisson=0.3, density=8000.0)
MESHES = {"tet10": meshes.tetrahedra, "hex20": meshes.brick}


def test_fv12_free_thin_square_plate():
    nodes, elements = meshes.brick((12, 12, 1), (10.0, 10.0, 0.05))
    K, M = stiffness_and_mass(nodes, elements, "hex20", STEEL)
    frequency, _ = lowest_modes(K, M, 8.0)
    assert (frequency[:6] < 0.01).all()
    exact = np.array([1.622, 2.360, 2.922, 4.233, 4.233, 7.416])
    error = np.abs(frequency[6:12] / exact - 1)
    assert (error[:5] < 0.01).all()
    assert error[5] < 0.02


@pytest.mark.parametrize("kind", ["hex20", "tet10"])
def test_fv32_cantilevered_tapered_membrane(kind):
    # half the thickness on its plane of symmetry is exactly plane stress for the in-plane modes
    nodes, elements = MESHES[kind]((16, 8, 1), (10.0, 5.0, 0.025))
    x = nodes[:, 0]
    nodes[:, 1] = 2.5 + (nodes[:, 1] - 2.5) * (1 - 0.8 * x / 10.0)
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    free = np.ones((len(nodes), 3), dtype=bool)
    free[x < 1e-9, :2] = False
    free[nodes[:, 2] < 1e-9, 2] = False
    free = free.ravel()
    frequency, _ = lowest_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), 395.0)
    exact = np.array([44.623, 130.03, 162.70, 246.05, 379.90, 391.44])
    assert len(frequency) == 6
    error = np.abs(frequency / exact - 1)
    assert (error[:5] < 0.01).all()
    assert error[5] < 0.02
