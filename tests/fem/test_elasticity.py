"""Element matrices: patch test, rigid motion, mass, and beams in closed form."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from nvhchain.conventions import STEEL, Material
from nvhchain.errors import InputError
from nvhchain.fem import factorize, rigid_map, stiffness_and_mass
from nvhchain.fem.elements import hex20_shape, tet10_shape
from nvhchain.testing import elements as meshes

MESHES = {"tet10": meshes.tetrahedra, "hex20": meshes.brick}
KINDS = pytest.mark.parametrize("kind", ["tet10", "hex20"])


@pytest.mark.parametrize("shape", [tet10_shape, hex20_shape])
def test_shape_gradients_are_the_derivatives_and_sum_to_one(shape):
    points = np.random.default_rng(3).uniform(0.05, 0.3, (7, 3))
    value, gradient = shape(points)
    assert np.allclose(value.sum(axis=1), 1.0, atol=1e-14)
    step = 1e-6
    for axis in range(3):
        move = step * np.eye(3)[axis]
        difference = (shape(points + move)[0] - shape(points - move)[0]) / (2 * step)
        assert np.allclose(gradient[:, :, axis], difference, atol=1e-8)


@KINDS
def test_patch_of_distorted_elements_holds_any_constant_strain_exactly(kind):
    nodes, elements = MESHES[kind]((3, 3, 3), (0.3, 0.2, 0.25), distort=0.15)
    K, _ = stiffness_and_mass(nodes, elements, kind, STEEL, mass=False)
    gradient = 1e-4 * np.random.default_rng(5).standard_normal((3, 3))
    exact = (nodes @ gradient.T).ravel()
    inner = np.all((nodes > 1e-9) & (nodes < np.array([0.3, 0.2, 0.25]) - 1e-9), axis=1)
    free = np.repeat(inner, 3)
    u = exact.copy()
    u[free] = spsolve(K[free][:, free].tocsc(), -K[free][:, ~free] @ exact[~free])
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max() * 1e3
    lame = STEEL.young * STEEL.poisson / ((1 + STEEL.poisson) * (1 - 2 * STEEL.poisson))
    shear = STEEL.young / (2 * (1 + STEEL.poisson))
    strain = (gradient + gradient.T) / 2
    energy = 0.5 * (lame * np.trace(strain) ** 2 + 2 * shear * (strain**2).sum()) * 0.3 * 0.2 * 0.25
    assert 0.5 * u @ (K @ u) == pytest.approx(energy, rel=1e-10)


@KINDS
def test_rigid_motion_costs_no_energy_and_carries_the_inertia_of_the_box(kind):
    nodes, elements = MESHES[kind]((2, 3, 2), (0.3, 0.2, 0.25), distort=0.15)
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    motion = meshes.rigid_motions(nodes - nodes.mean(axis=0))
    assert np.abs(K @ motion).max() < 1e-12 * np.abs(K).max()
    assert abs(K - K.T).max() < 1e-12 * abs(K).max()
    centred = meshes.rigid_motions(nodes - np.array([0.15, 0.1, 0.125]))
    mass = STEEL.density * 0.3 * 0.2 * 0.25
    inertia = mass / 12 * np.array([0.2**2 + 0.25**2, 0.3**2 + 0.25**2, 0.3**2 + 0.2**2])
    expected = np.diag(np.concatenate([[mass] * 3, inertia]))
    assert np.allclose(centred.T @ (M @ centred), expected, rtol=1e-10, atol=1e-10 * mass)


@KINDS
def test_cantilever_deflects_as_timoshenko_beam(kind):
    length, width, height = 1.0, 0.05, 0.1
    nodes, elements = MESHES[kind]((12, 1, 2), (length, width, height))
    material = Material(young=210e9, poisson=0.0, density=7850.0)
    K, _ = stiffness_and_mass(nodes, elements, kind, material, mass=False)
    held, tip = (np.flatnonzero(np.isclose(nodes[:, 0], x)) for x in (0.0, length))
    T = rigid_map(nodes, [(held, None), (tip, np.array([length, width / 2, height / 2]))])
    reduced = (T.T @ K @ T).tocsr()
    load = np.zeros(reduced.shape[0])
    load[-4] = 1000.0  # translation z of the only reference point
    with factorize(reduced) as factor:
        tip_deflection = factor.solve(load)[-4]
    inertia, shear_area = width * height**3 / 12, width * height * 5 / 6
    # a clamp without warping and a rigid tip stiffen the beam by a little less than its shear share, 0.5 %
    expected = 1000.0 * (length**3 / (3 * 210e9 * inertia) + length / (105e9 * shear_area))
    assert tip_deflection == pytest.approx(expected, rel=4e-3)


@KINDS
def test_inverted_element_is_refused_by_number(kind):
    nodes, elements = MESHES[kind]((2, 1, 1), (0.2, 0.1, 0.1))
    mirrored = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]
    turned = [*range(4, 8), *range(4), *range(12, 16), *range(8, 12), *range(16, 20)]
    swap = {"tet10": mirrored, "hex20": turned}[kind]
    elements[1] = elements[1][swap]
    with pytest.raises(InputError, match=r"inverted element.*first 1 "):
        stiffness_and_mass(nodes, elements, kind, STEEL)


def test_wrong_kind_and_wrong_node_count_are_refused():
    nodes, elements = meshes.brick((1, 1, 1), (1.0, 1.0, 1.0))
    with pytest.raises(InputError, match="tet10 or hex20"):
        stiffness_and_mass(nodes, elements, "tet4", STEEL)
    with pytest.raises(InputError, match="tet10 has 10 nodes"):
        stiffness_and_mass(nodes, elements, "tet10", STEEL)
    with pytest.raises(InputError, match="refer to nodes"):
        stiffness_and_mass(nodes[:-1], elements, "hex20", STEEL)
