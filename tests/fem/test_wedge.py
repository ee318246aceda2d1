"""The 15-node wedge."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from nvhchain.conventions import ALUMINIUM, STEEL
from nvhchain.fem import stiffness_and_mass
from nvhchain.fem.elements import wedge15_shape, wedge_rule
from nvhchain.fem.solid_model import EDGES
from nvhchain.testing.elements import brick, rigid_motions


def wedges(counts, lengths, distort=0.0):
    """wedge15 nodes and elements: two wedges for each brick."""
    nodes, bricks = brick(counts, lengths, distort)
    corners = bricks[:, [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]].reshape(-1, 6)
    used, corners = np.unique(corners, return_inverse=True)
    corners, nodes = corners.reshape(-1, 6), nodes[used]
    pairs = np.sort(corners[:, np.array(EDGES["wedge"])], axis=-1)
    edge, slot = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    return np.vstack([nodes, nodes[edge].mean(axis=1)]), np.hstack([corners, len(nodes) + slot.reshape(-1, 9)])


def test_shapes_are_one_at_their_node_and_gradients_are_derivatives():
    corners = np.array([[0, 0, -1], [1, 0, -1], [0, 1, -1], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]])
    first, second = np.array(EDGES["wedge"]).T
    nodes = np.vstack([corners, (corners[first] + corners[second]) / 2])
    assert np.allclose(wedge15_shape(nodes)[0], np.eye(15), atol=1e-15)
    points, step = np.random.default_rng(3).random((6, 3)) / 2, 1e-6
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (wedge15_shape(points + shift)[0] - wedge15_shape(points - shift)[0]) / (2 * step)
        assert np.allclose(slope, wedge15_shape(points)[1][:, :, axis], atol=1e-8)


def test_rule_integrates_polynomials_of_the_wedge():
    points, weight = wedge_rule(4, 3)
    r, s, t = points.T
    assert weight.sum() == pytest.approx(1.0, rel=1e-12)
    assert weight @ (r**2 * s * t**4) == pytest.approx(2 / 120 * 2 / 5, rel=1e-12)


def test_patch_of_distorted_wedges_holds_any_constant_strain_exactly():
    nodes, elements = wedges((2, 2, 2), (1.0, 0.8, 1.2), distort=0.15)
    K, _ = stiffness_and_mass(nodes, elements, "wedge15", STEEL)
    strain = np.random.default_rng(2).standard_normal((3, 3))
    u = (nodes @ strain).ravel()
    outside = ((nodes < 1e-9) | (nodes > np.array([1.0, 0.8, 1.2]) - 1e-9)).any(axis=1)
    inside = np.repeat(~outside, 3)
    assert inside.any()
    assert np.abs((K @ u)[inside]).max() < 1e-12 * np.abs(K @ u).max()


def test_rigid_motion_costs_no_energy_and_carries_the_mass_of_the_box():
    nodes, elements = wedges((2, 1, 1), (0.2, 0.1, 0.05))
    K, M = stiffness_and_mass(nodes, elements, "wedge15", ALUMINIUM)
    motion = rigid_motions(nodes)
    assert np.abs(K @ motion).max() < 1e-9 * np.abs(K).max()
    assert motion[:, 0] @ M @ motion[:, 0] == pytest.approx(ALUMINIUM.density * 0.2 * 0.1 * 0.05, rel=1e-12)


def test_cantilever_of_wedges_deflects_as_timoshenko_beam():
    length, height, width = 1.0, 0.1, 0.05
    nodes, elements = wedges((12, 2, 1), (length, height, width))
    K, _ = stiffness_and_mass(nodes, elements, "wedge15", STEEL)
    free = np.flatnonzero(np.repeat(nodes[:, 0] > 1e-9, 3))
    tip = np.flatnonzero(nodes[:, 0] > length - 1e-9)
    load = np.zeros(nodes.size)
    load[3 * tip + 1] = 1000.0 / len(tip)
    u = np.zeros(nodes.size)
    u[free] = spsolve(K[free][:, free].tocsc(), load[free])
    inertia, shear = width * height**3 / 12, STEEL.young / (2 * (1 + STEEL.poisson))
    exact = 1000 * length**3 / (3 * STEEL.young * inertia) + 1.2 * 1000 * length / (shear * width * height)
    assert u[3 * tip + 1].mean() == pytest.approx(exact, rel=0.015)  # the clamp also holds the width
