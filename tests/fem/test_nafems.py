"""NAFEMS benchmarks FV12, FV32 and FV52 (Selected Benchmarks for Natural Frequency Analysis, 1987)."""

import numpy as np
import pytest

from nvhchain.conventions import Material
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.testing import elements as meshes

STEEL = Material(young=200e9, poisson=0.3, density=8000.0)
MESHES = {"tet10": meshes.tetrahedra, "hex20": meshes.brick}


def fv12(kind, count):
    """Frequencies (Hz) of the plate by count × count bricks, or as many times six tetrahedra; the six rigid ones go."""
    nodes, elements = MESHES[kind]((count, count, 1), (10.0, 10.0, 0.05))
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    frequency, _ = lowest_modes(K, M, 8.0)
    assert (frequency[:6] < 0.01).all()
    return frequency[6:12]


@pytest.mark.parametrize(("kind", "counts"), [("hex20", (6, 12)), ("tet10", (12, 24))])
def test_fv12_free_thin_square_plate(kind, counts):
    """One element through a thickness of 1/200 of the side: flat tetrahedra need half the size of bricks."""
    coarse, fine = (fv12(kind, count) for count in counts)
    exact = np.array([1.622, 2.360, 2.922, 4.233, 4.233, 7.416])
    error = np.abs(fine / exact - 1)
    assert (error[:5] < 0.01).all()
    assert error[5] < 0.02
    assert (fine < coarse).all()  # too stiff, and the less the finer (Rayleigh's quotient)


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


def test_fv52_simply_supported_solid_square_plate():
    """One row of elements, as in the benchmark: finer ones turn at the edge, which plate theory does not."""
    nodes, elements = meshes.tetrahedra((8, 8, 1), (10.0, 10.0, 1.0))
    K, M = stiffness_and_mass(nodes, elements, "tet10", STEEL)
    free = np.ones((len(nodes), 3), dtype=bool)
    free[((nodes[:, :2] < 1e-9) | (nodes[:, :2] > 10 - 1e-9)).any(axis=1), 2] = False
    free = free.ravel()
    frequency, _ = lowest_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), 212.0)
    exact = [45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19]
    assert frequency[3:10] == pytest.approx(exact, rel=0.02)
