"""What too few elements do to natural frequencies is told by the modes themselves."""

import numpy as np
import pytest

from nvhchain.conventions import ALUMINIUM, STEEL
from nvhchain.fem import frequency_errors, lowest_modes, stiffness_and_mass
from nvhchain.fem.elements import TET10_EDGES
from nvhchain.fem.mesh_error import _inverse_jacobians, _stresses, inner_edges
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
    return frequency, frequency_errors(nodes, elements, STEEL, shapes, frequency)[0]


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


def bracket(layers, wall=8e-3):
    """Nodes (m) and tetrahedra of an angle bracket; edges of its elements are the wall over the layers."""
    nodes, elements = meshes.tetrahedra((8 * layers, 8 * layers, 2 * layers), wall * np.array([8.0, 8.0, 2.0]))
    inside = (nodes[elements[:, :4], :2].mean(axis=1) < wall).any(axis=1)
    used, elements = np.unique(elements[inside], return_inverse=True)
    return nodes[used], elements.reshape(-1, 10)


@pytest.mark.slow
def test_walls_that_meet_at_a_sharp_edge_miss_what_is_said():
    """Limit of the frequencies: errors fall with h^1.09 (energy of a stress r^-0.4555 at an inner edge of 270°)."""
    found = {}
    for layers in (2, 3, 4):
        nodes, elements = bracket(layers)
        frequency, shapes = lowest_modes(*stiffness_and_mass(nodes, elements, "tet10", ALUMINIUM), 9e3)
        elastic = np.flatnonzero(frequency > 50.0)[:4]
        said, at_edge = frequency_errors(nodes, elements, ALUMINIUM, shapes[:, elastic], frequency[elastic])
        assert (at_edge < said).all()
        assert at_edge[0] > 0.7 * said[0]  # bent at the edge
        found[layers] = frequency[elastic], said
    falls = 3**-1.09 - 4**-1.09
    limit = found[4][0] - (found[3][0] - found[4][0]) / falls * 4**-1.09
    frequency, said = found[2]
    true = frequency / limit - 1.0
    assert (true > 1e-3).all()
    assert (np.abs(said / true - 1.0) < 0.25).all()
    assert np.abs(frequency * np.sqrt(1.0 - 2.0 * said) / limit - 1.0).max() < 0.0025


def test_sharp_inner_edges_are_found_and_outer_edges_are_not():
    nodes, elements = bracket(2)
    edges = inner_edges(nodes, elements)
    assert len(edges) == 4
    np.testing.assert_allclose(nodes[edges][..., :2], 8e-3)
    assert not len(inner_edges(*meshes.tetrahedra((3, 2, 2), SIDES)))
    leaning = nodes.copy()
    leaning[:, 0] -= 2.2 * np.maximum(
        nodes[:, 1] - 8e-3, 0.0
    )  # one wall by 66°: the inner edge moves to its other side
    moved = inner_edges(leaning, elements)
    assert len(moved) == 4
    np.testing.assert_allclose(leaning[moved][..., 0], 0.0, atol=1e-12)


def test_faces_of_a_rounded_corner_have_no_sharp_edges_and_chords_in_their_place_do():
    """Two elements in a quarter turn: 45° between chords, none between arcs."""
    nodes, elements = meshes.tetrahedra((2, 1, 1), np.array([np.pi / 2, 4e-3, 8e-3]))
    radius = 6e-3 + nodes[:, 1]
    arcs = np.column_stack([radius * np.cos(nodes[:, 0]), -radius * np.sin(nodes[:, 0]), nodes[:, 2]])
    assert np.linalg.det(arcs[elements[:, 1:4]] - arcs[elements[:, :1]]).min() > 0.0
    chords = arcs.copy()
    for middle, (first, second) in zip(elements[:, 4:].T, TET10_EDGES, strict=True):
        chords[middle] = (arcs[elements[:, first]] + arcs[elements[:, second]]) / 2
    assert not len(inner_edges(arcs, elements))
    found = inner_edges(chords, elements)
    assert len(found) == 1
    np.testing.assert_allclose(np.linalg.norm(chords[found][..., :2], axis=-1), 6e-3)


def test_edges_of_the_whole_body_count_in_each_of_its_parts():
    nodes, elements = bracket(1)
    upright = nodes[elements[:, :4], 0].mean(axis=1) < 8e-3
    shapes, frequency = np.column_stack([nodes[:, 0] ** 4, 0 * nodes[:, :2]]).reshape(-1, 1), np.array([100.0])
    parts = elements[upright], elements[~upright]
    alone = [frequency_errors(nodes, of, STEEL, shapes, frequency)[1] for of in parts]
    edges = inner_edges(nodes, elements)
    together = [frequency_errors(nodes, of, STEEL, shapes, frequency, edges)[1] for of in parts]
    assert max(alone) == 0.0
    assert min(together) > 0.0


def test_a_stress_that_is_the_same_everywhere_errs_by_nothing_and_so_does_a_rigid_motion():
    nodes, elements = meshes.tetrahedra((3, 2, 2), SIDES)
    stretched, turned = nodes @ np.diag([1.0, -0.3, 0.2]), np.cross([1.0, 2.0, 3.0], nodes)
    linear = np.column_stack([stretched.ravel(), turned.ravel()])
    assert frequency_errors(nodes, elements, STEEL, linear, np.array([100.0, 100.0]))[0].max() < 1e-12
    bent = np.column_stack([nodes[:, 0] ** 4, 0 * nodes[:, 0], 0 * nodes[:, 0]]).reshape(-1, 1)
    assert frequency_errors(nodes, elements, STEEL, bent, np.array([100.0]))[0][0] > 1e-7
    assert frequency_errors(nodes, elements, STEEL, bent, np.array([0.0]))[0][0] == 0


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
    scale = frequency_errors(nodes, elements, STEEL, (nodes**4).reshape(-1, 1) / max(SIDES) ** 3, frequency)[0][0]
    assert frequency_errors(curved, elements, STEEL, pull[0], frequency)[0][0] < 1e-20 * scale
    assert np.isfinite(frequency_errors(folded, elements, STEEL, pull[1], frequency)[0]).all()


def test_modes_are_judged_one_by_one():
    """However many at once."""
    nodes, elements = meshes.tetrahedra((2, 2, 1), SIDES)
    shapes = np.random.default_rng(0).standard_normal((3 * len(nodes), 40))
    frequency = np.linspace(100.0, 200.0, 40)
    together, _ = frequency_errors(nodes, elements, STEEL, shapes, frequency)
    alone = [frequency_errors(nodes, elements, STEEL, shapes[:, [i]], frequency[[i]])[0][0] for i in (0, 31, 32, 39)]
    assert together[[0, 31, 32, 39]] == pytest.approx(alone, rel=1e-12)
    assert frequency_errors(nodes, elements, STEEL, shapes[:, :0], frequency[:0])[0].shape == (0,)
