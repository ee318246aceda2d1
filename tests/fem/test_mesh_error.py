"""What too few elements do to natural frequencies is told by the modes themselves."""

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.fem import frequency_errors, lowest_modes, stiffness_and_mass
from nvhchain.fem.mesh_error import _inverse_jacobians, _stresses
from nvhchain.testing import elements as meshes

SIDES = np.array([0.2, 0.1, 0.02])


def clamped_plate(cells, sides=SIDES, highest=6000.0):
    """Frequencies (Hz) up to the highest of a plate held at one end, and what is said to be their errors."""
    nodes, elements = meshes.tetrahedra(cells, sides)
    K, M = stiffness_and_mass(nodes, elements, "tet10", STEEL)
    free = np.repeat(nodes[:, 0] > 0, 3)
    frequency, part = lowest_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), highest)
    shapes = np.zeros((len(free), len(frequency)))
    shapes[free] = part
    return frequency, frequency_errors(nodes, elements, STEEL, shapes, frequency)


@pytest.mark.parametrize(
    ("sides", "highest", "coarse", "fine"),
    [
        ((0.2, 0.1, 0.01), 2500.0, [(6, 3, 1), (8, 4, 1)], (20, 10, 2)),
        ((0.1, 0.1, 0.05), 16e3, [(2, 2, 1), (3, 3, 2)], (7, 7, 4)),
    ],
    ids=["plate", "block"],
)
def test_frequencies_are_too_high_by_about_what_is_said(sides, highest, coarse, fine):
    exact, before = clamped_plate(fine, sides, highest)[0], np.inf
    for cells in coarse:
        frequency, said = clamped_plate(cells, sides, 1.1 * highest)
        true = frequency[: len(exact)] / exact - 1.0
        assert (true > 0).all()
        assert (said[: len(exact)] > 0.35 * true).all()
        assert (said[: len(exact)] < 2 * true).all()
        assert (said[: len(exact)] < before).all()  # the finer, the less
        before = said[: len(exact)]


def test_a_stress_that_is_the_same_everywhere_errs_by_nothing_and_so_does_a_rigid_motion():
    nodes, elements = meshes.tetrahedra((3, 2, 2), SIDES)
    stretched, turned = nodes @ np.diag([1.0, -0.3, 0.2]), np.cross([1.0, 2.0, 3.0], nodes)
    linear = np.column_stack([stretched.ravel(), turned.ravel()])
    assert frequency_errors(nodes, elements, STEEL, linear, np.array([100.0, 100.0])).max() < 1e-12
    bent = np.column_stack([nodes[:, 0] ** 4, 0 * nodes[:, 0], 0 * nodes[:, 0]]).reshape(-1, 1)
    assert frequency_errors(nodes, elements, STEEL, bent, np.array([100.0]))[0] > 1e-7
    assert frequency_errors(nodes, elements, STEEL, bent, np.array([0.0]))[0] == 0


def test_squares_of_stresses_are_the_energy_of_the_stiffness_matrix():
    """Of straight elements, under any displacement of the second order."""
    nodes, elements = meshes.tetrahedra((2, 1, 1), SIDES)
    K, _ = stiffness_and_mass(nodes, elements, "tet10", STEEL, mass=False)
    x, y, z = nodes.T
    motion = np.stack([x * y + 0.3 * z, y * y - x * z, 0.2 * x + z * y], axis=1)
    inverse, volume = _inverse_jacobians(nodes[elements])
    stress = _stresses(inverse, elements, STEEL, motion[:, :, None])[..., 0]
    squares = (stress**2).sum(axis=(1, 2)) + (stress.sum(axis=1) ** 2).sum(axis=1)
    energy = volume / 20 @ squares
    assert energy == pytest.approx(motion.ravel() @ K @ motion.ravel(), rel=1e-12)


def test_curved_elements_have_no_jumps_where_the_stress_is_the_same_everywhere():
    """Elements that are folded at a corner are taken as straight: their stress then differs."""
    nodes, elements = meshes.tetrahedra((3, 2, 2), SIDES)
    middle = np.setdiff1d(elements, elements[:, :4])
    curved, folded = nodes.copy(), nodes.copy()
    curved[middle] += 0.03 * min(SIDES) * np.random.default_rng(1).uniform(-1, 1, (len(middle), 3))
    folded[middle[0]] += 2.0 * max(SIDES)
    frequency = np.array([100.0])
    pull = [(at @ [[1.0, 0.2, 0.0], [0.1, 0.5, 0.0], [0.3, 0.0, 2.0]]).reshape(-1, 1) for at in (curved, folded)]
    scale = frequency_errors(nodes, elements, STEEL, (nodes**4).reshape(-1, 1) / max(SIDES) ** 3, frequency)[0]
    assert frequency_errors(curved, elements, STEEL, pull[0], frequency)[0] < 1e-20 * scale
    assert np.isfinite(frequency_errors(folded, elements, STEEL, pull[1], frequency)).all()


def test_modes_are_judged_one_by_one():
    """However many at once."""
    nodes, elements = meshes.tetrahedra((2, 2, 1), SIDES)
    shapes = np.random.default_rng(0).standard_normal((3 * len(nodes), 40))
    frequency = np.linspace(100.0, 200.0, 40)
    together = frequency_errors(nodes, elements, STEEL, shapes, frequency)
    alone = [frequency_errors(nodes, elements, STEEL, shapes[:, [i]], frequency[[i]])[0] for i in (0, 31, 32, 39)]
    assert together[[0, 31, 32, 39]] == pytest.approx(alone, rel=1e-12)
    assert frequency_errors(nodes, elements, STEEL, shapes[:, :0], frequency[:0]).shape == (0,)
