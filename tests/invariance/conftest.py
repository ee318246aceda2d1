"""A lopsided body, a pattern of velocity on it, points round it; motions of space."""

import numpy as np
import pytest

from nvhchain.acoustics import sphere
from nvhchain.conventions import Air
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface, SurfaceVelocity

AIR = Air(343.0, 1.21)
LINES = np.array([150.0, 700.0, 1900.0])


@pytest.fixture(scope="session")
def fidelity():
    return AcousticsFidelity(elements_per_wavelength=3.0, masters=16)


@pytest.fixture(scope="session")
def body():
    """An egg with a dent, without any symmetry."""
    ball = sphere(0.1, 2)
    x, y, z = ball.vertices.T
    bulge = 1.0 + 1.5 * z + 20.0 * x * y - 0.2 * np.exp(-300.0 * ((x - 0.07) ** 2 + (y - 0.06) ** 2))
    return Surface(np.stack([1.3 * x * bulge, y * bulge, 0.8 * z + 0.2 * x], axis=1), ball.triangles)


@pytest.fixture(scope="session")
def points():
    return np.array([[0.5, 0.2, 0.3], [-0.1, -0.9, 0.4], [0.05, 0.1, -0.25]])


@pytest.fixture(scope="session")
def velocity(body):
    """Complex and different on every face at every line."""
    rng = np.random.default_rng(3)
    smooth = rng.standard_normal((3, 3)) @ body.centroids.T + 1j * (rng.standard_normal((3, 3)) @ body.centroids.T)
    return SurfaceVelocity(LINES, 0.3 + 10.0 * smooth, body)


@pytest.fixture(scope="session")
def rotation():
    """An orthogonal matrix of determinant +1 without zeros."""
    q, _ = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))
    return q * np.linalg.det(q)


@pytest.fixture(scope="session")
def air():
    return AIR
