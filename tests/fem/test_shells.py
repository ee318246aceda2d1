"""Flat shells and beams: patch test, closed forms of plate, cantilever and cylinder, and NAFEMS benchmarks."""

import numpy as np
import pytest

from nvhchain.conventions import Material
from nvhchain.fem import lowest_modes
from nvhchain.fem.structural.assembly import structure_matrices
from nvhchain.fem.structural.model import BeamBlock, ShellBlock, Structure
from nvhchain.fem.structural.sections import rectangle

STEEL = Material(young=200e9, poisson=0.3, density=8000.0)
BOTH = pytest.mark.parametrize("triangles", [False, True])


def sheet(counts, triangles=False, sides=(1.0, 1.0)):
    """Nodes (n, 3) and shells of a rectangle from the origin."""
    x, y = np.meshgrid(*(np.linspace(0, side, n + 1) for side, n in zip(sides, counts, strict=True)), indexing="ij")
    i, j = (axis.ravel() for axis in np.meshgrid(*map(np.arange, counts), indexing="ij"))
    first, across = i * (counts[1] + 1) + j, counts[1] + 1
    quads = np.column_stack([first, first + across, first + across + 1, first + 1])
    shells = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]) if triangles else quads
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), shells


def block(shells, thickness, offset=0.0, **section):
    ones = np.ones(len(shells))
    return ShellBlock(shells, STEEL, np.arange(1, len(shells) + 1), thickness * ones, offset * ones, **section)


def matrices(nodes, shells, thickness, offset=0.0):
    return structure_matrices(nodes, Structure(shells=(block(shells, thickness, offset),)))


def frequencies(K, M, held, top):
    free = ~held.ravel()
    return lowest_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), top)[0]


def in_plane(count):
    """Held freedoms of a plate that only bends."""
    held = np.zeros((count, 6), dtype=bool)
    held[:, [0, 1, 5]] = True
    return held


@BOTH
def test_fv12_free_thin_square_plate(triangles):
    nodes, shells = sheet((24, 24), triangles, (10.0, 10.0))
    found = frequencies(*matrices(nodes, shells, 0.05), np.zeros((len(nodes), 6), dtype=bool), 8.0)
    assert (found[:6] < 1e-3).all()
    assert found[6:12] == pytest.approx([1.622, 2.360, 2.922, 4.233, 4.233, 7.416], rel=0.012)


@BOTH
def test_fv16_cantilevered_thin_square_plate(triangles):
    nodes, shells = sheet((16, 16), triangles, (10.0, 10.0))
    held = np.repeat(nodes[:, :1] == 0, 6, axis=1)
    found = frequencies(*matrices(nodes, shells, 0.05), held, 7.0)
    assert found[:6] == pytest.approx([0.421, 1.029, 2.582, 3.306, 3.753, 6.555], rel=0.011)


@BOTH
def test_fv22_clamped_thick_rhombic_plate(triangles):
    """Triangles along the shorter diagonal, as meshers make them."""
    nodes, shells = sheet((36, 36), triangles, (10.0, 10.0))
    rim = ((nodes[:, :2] == 0) | (nodes[:, :2] == 10.0)).any(axis=1)
    nodes = nodes @ np.array([[1.0, 0.0, 0.0], [-np.sqrt(0.5), np.sqrt(0.5), 0.0], [0.0, 0.0, 1.0]])
    held = in_plane(len(nodes))
    held[rim] = True
    found = frequencies(*matrices(nodes, shells, 1.0), held, 360.0)
    assert found[:5] == pytest.approx([133.95, 201.41, 265.81, 283.68, 334.45], rel=0.015)


@BOTH
def test_constant_strain_and_curvature_on_any_facets(triangles):
    nodes, shells = sheet((4, 3), triangles, (0.4, 0.3))
    inside = ((nodes[:, :2] > 1e-9) & (nodes[:, :2] < [0.4 - 1e-9, 0.3 - 1e-9])).all(axis=1)
    nodes[inside, :2] += np.random.default_rng(2).uniform(-0.02, 0.02, (int(inside.sum()), 2))
    x, y = nodes[:, 0], nodes[:, 1]
    exact = np.zeros((len(nodes), 6))
    exact[:, 0], exact[:, 1] = 1e-3 * x + 2e-3 * y, 5e-4 * y - 1e-3 * x
    exact[:, 5] = (-1e-3 - 2e-3) / 2
    w = np.column_stack([x * x + 0.5 * y * y + 0.3 * x * y, 2 * x + 0.3 * y, y + 0.3 * x])
    exact[:, 2], exact[:, 3], exact[:, 4] = w[:, 0], w[:, 2], -w[:, 1]
    K, _ = matrices(nodes, shells, 0.002)
    free = np.repeat(inside, 6)
    found = exact.ravel().copy()
    found[free] = np.linalg.solve(K[free][:, free].toarray(), -(K[free][:, ~free] @ found[~free]))
    assert found == pytest.approx(exact.ravel(), abs=2e-9 * np.abs(exact).max())


@BOTH
def test_simply_supported_plate_in_closed_form(triangles):
    nodes, shells = sheet((32, 32), triangles, (0.5, 0.4))
    held = in_plane(len(nodes))
    held[(np.isclose(nodes[:, :2], 0) | np.isclose(nodes[:, :2], [0.5, 0.4])).any(axis=1), 2] = True
    found = frequencies(*matrices(nodes, shells, 0.002), held, 330.0)
    root = np.sqrt(200e9 * 0.002**2 / (12 * (1 - 0.3**2) * 8000.0))
    waves = [(m / 0.5) ** 2 + (n / 0.4) ** 2 for m in range(1, 9) for n in range(1, 9)]
    exact = np.pi / 2 * root * np.sort(waves)
    assert found[:5] == pytest.approx(exact[:5], rel=0.01)


def sanders(radius, length, thickness, m, n):
    """Lowest frequency (Hz) of a cylinder on diaphragms, m half waves and n waves around (Sanders' shell theory)."""
    a, nu = m * np.pi * radius / length, 0.3
    strains = np.array([[-a, 0, 0], [0, n, 1], [-n, a, 0], [0, 0, a * a], [0, n, n * n], [n / 2, 1.5 * a, 2 * a * n]])
    plane = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    law = np.zeros((6, 6))
    law[:3, :3], law[3:, 3:] = plane, thickness**2 / (12 * radius**2) * plane
    root = np.linalg.eigvalsh(strains.T @ law @ strains)[0]
    return np.sqrt(root * 200e9 / (8000.0 * (1 - nu**2))) / (2 * np.pi * radius)


@BOTH
def test_cylinder_on_diaphragms_in_closed_form(triangles):
    radius, length, thickness = 0.15, 0.3, 0.003
    flat, shells = sheet((48, 16), triangles, (np.pi, length))
    nodes = np.column_stack([radius * np.cos(flat[:, 0]), radius * np.sin(flat[:, 0]), flat[:, 1]])
    held = np.zeros((len(nodes), 6), dtype=bool)
    held[(nodes[:, 2] == 0) | (nodes[:, 2] == length), :2] = True
    held[np.abs(nodes[:, 1]) < 1e-9] |= np.array([0, 1, 0, 1, 0, 1], dtype=bool)  # one half: a plane of symmetry
    found = frequencies(*matrices(nodes, shells, thickness), held, 1900.0)
    found = found[found > 1.0]
    exact = np.sort([sanders(radius, length, thickness, m, n) for m in (1, 2) for n in range(1, 9)])
    assert found[:5] == pytest.approx(exact[:5], rel=0.01)


def test_a_warped_shell_moves_rigidly_without_force():
    nodes = np.array([[0.0, 0, 0.1], [1, 0.1, -0.1], [1.2, 1, 0.2], [0, 0.9, -0.2]])
    K, M = matrices(nodes, np.array([[0, 1, 2, 3]]), 0.02, offset=0.05)
    turns = np.eye(3)
    motion = np.zeros((4, 6, 6))
    motion[:, :3, :3], motion[:, 3:, 3:] = np.eye(3), np.eye(3)
    for axis in range(3):
        motion[:, :3, 3 + axis] = np.cross(turns[axis], nodes)
    motion = motion.reshape(24, 6)
    assert np.abs(K @ motion).max() < 1e-10 * np.abs(K).max()
    assert np.linalg.matrix_rank(K.toarray(), tol=1e-9 * np.abs(K).max()) == 18
    assert motion[:, 0] @ M @ motion[:, 0] == pytest.approx(8000 * 0.02 * area_of(nodes), rel=1e-9)


def area_of(nodes):
    """Area (m²) of a quadrilateral on its mean plane."""
    return float(np.linalg.norm(np.cross(nodes[2] - nodes[0], nodes[3] - nodes[1]))) / 2


def test_an_offset_adds_the_bending_of_a_stiff_arm():
    """A strip with its middle surface a distance from the nodes, held in its shift, bends with D + E t d²."""
    nodes, shells = sheet((40, 1), False, (1.0, 0.02))
    t, d = 0.01, 0.02
    K, _ = matrices(nodes, shells, t, offset=d)
    held = np.repeat(nodes[:, :1] == 0, 6, axis=1)
    held[:, 0] = True
    force = np.zeros((len(nodes), 6))
    force[nodes[:, 0] == 1.0, 2] = 0.5
    free = ~held.ravel()
    moved = np.linalg.solve(K[free][:, free].toarray(), force.ravel()[free])
    full = np.zeros(6 * len(nodes))
    full[free] = moved
    stiffness = 200e9 * 0.02 * (t**3 / 12 + t * d**2)
    assert full.reshape(-1, 6)[-1, 2] == pytest.approx(1 / (3 * stiffness), rel=0.01)


def test_a_cantilever_beam_vibrates_and_twists_as_in_closed_form():
    turned = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    nodes = np.column_stack([np.linspace(0, 1, 21), np.zeros((21, 2))]) @ turned.T
    ends = np.column_stack([np.arange(20), np.arange(1, 21)])
    section, ones = rectangle(0.02, 0.01), np.ones((20, 1))
    beams = BeamBlock(
        ends, STEEL, section, np.arange(20), ones * turned[:, 1], np.zeros((20, 2, 3)), np.zeros((20, 12), dtype=bool)
    )
    held = np.repeat(np.arange(21)[:, None] == 0, 6, axis=1)
    found = frequencies(*structure_matrices(nodes, Structure(beams=(beams,))), held, 1100.0)
    roots = np.array([1.87510407, 4.69409113, 7.85475744])

    def bending(second):
        return roots**2 / (2 * np.pi) * np.sqrt(200e9 * second / (8000.0 * 2e-4))

    assert found[:2] == pytest.approx([bending(section.bending_y)[0], bending(section.bending_z)[0]], rel=1e-3)
    for exact in (*bending(section.bending_y)[1:2], *bending(section.bending_z)[1:2]):
        assert np.abs(found / exact - 1).min() < 4e-3
    shear = 200e9 / 2.6
    twist = 0.25 * np.sqrt(shear * section.torsion / (8000.0 * (section.bending_z + section.bending_y)))
    assert np.abs(found / twist - 1).min() < 1e-3
