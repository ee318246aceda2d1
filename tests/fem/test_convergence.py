"""Rates at which quadratic elements converge on a free block and on a bar in shear, both with exact solutions."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from nvhchain.conventions import STEEL
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.testing import elements as meshes

MESHES = {"tet10": meshes.tetrahedra, "hex20": meshes.brick}
EDGE, HEIGHT = 0.1, 0.04
SHEAR_SPEED = np.sqrt(STEEL.young / (2 * (1 + STEEL.poisson)) / STEEL.density)


def lame_error(kind, count):
    """Relative error of the Lamé mode of a free block of square cross-section, f = c_s / (√2 a) (Lamé, 1852).

    u = (cos kx sin ky, −sin kx cos ky, 0) with k = π/a keeps its volume and leaves every side free of traction.
    """
    nodes, elements = MESHES[kind]((count, count, 1), (EDGE, EDGE, HEIGHT))
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    x, y = np.pi / EDGE * nodes[:, 0], np.pi / EDGE * nodes[:, 1]
    exact = np.column_stack([np.cos(x) * np.sin(y), -np.sin(x) * np.cos(y), np.zeros(len(nodes))]).ravel()
    frequency, shapes = lowest_modes(K, M, 1.25 * SHEAR_SPEED / (np.sqrt(2) * EDGE))
    share = np.abs(shapes.T @ (M @ exact)) / np.sqrt(exact @ (M @ exact))
    assert share.max() > 0.99
    return frequency[share.argmax()] * np.sqrt(2) * EDGE / SHEAR_SPEED - 1


@pytest.mark.parametrize("kind", ["tet10", "hex20"])
def test_frequency_of_a_free_block_converges_with_the_fourth_power_of_the_element_size(kind):
    counts = np.array([4, 6, 8])
    errors = np.array([lame_error(kind, count) for count in counts])
    assert (errors > 0).all()
    assert errors[-1] < 2e-4
    rates = np.diff(np.log(errors)) / np.diff(np.log(1 / counts))
    assert (rates > 3.5).all()
    assert (rates < 4.5).all()


def manufactured_error(kind, count):
    """Relative L² error of a block under the body force of u = (sin ky sin kz, 0, 0), with u given on its boundary.

    That shear has no volume strain: f = 2 G k² u.
    """
    k, side = np.pi, (0.7, 1.1, 0.9)
    nodes, elements = MESHES[kind]((count, count, count), side, distort=0.1)
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    shear = STEEL.young / (2 * (1 + STEEL.poisson))
    exact = np.zeros((len(nodes), 3))
    exact[:, 0] = np.sin(k * nodes[:, 1]) * np.sin(k * nodes[:, 2])
    exact = exact.ravel()
    load = 2 * shear * k**2 / STEEL.density * (M @ exact)
    inner = np.all((nodes > 1e-9) & (nodes < np.array(side) - 1e-9), axis=1)
    free = np.repeat(inner, 3)
    u = exact.copy()
    u[free] = spsolve(K[free][:, free].tocsc(), load[free] - K[free][:, ~free] @ exact[~free])
    return np.sqrt((u - exact) @ (M @ (u - exact)) / (exact @ (M @ exact)))


@pytest.mark.parametrize("kind", ["tet10", "hex20"])
def test_displacement_converges_with_the_third_power_of_the_element_size(kind):
    errors = [manufactured_error(kind, count) for count in (3, 6)]
    assert np.log2(errors[0] / errors[1]) > 2.7
    assert errors[1] < 3e-3
