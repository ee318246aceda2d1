"""Solids and housings: where and how they lie does not matter, size and stiffness scale, points answer each other."""

import numpy as np
import pytest

from nvhchain.conventions import STEEL, Material
from nvhchain.errors import InputError
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.handoff import ReducedHousing
from tests.housing.seat_motion import seat_displacement

EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]


@pytest.fixture(scope="module")
def solid():
    """Nodes and elements of two bent quadratic tetrahedra, without any symmetry, held at one face."""
    corners = np.array([[0, 0, 0], [0.05, 0, 0.01], [0.01, 0.06, 0], [0.02, 0.01, 0.08], [0.07, 0.06, 0.09]])
    cells = [[0, 1, 2, 3], [1, 2, 3, 4]]
    nodes, number = [*corners], {}
    elements = []
    for cell in cells:
        p = corners[cell]
        if np.linalg.det(p[1:] - p[0]) < 0:
            cell = [cell[0], cell[2], cell[1], cell[3]]
        middles = []
        for a, b in EDGES:
            key = tuple(sorted((cell[a], cell[b])))
            if key not in number:
                number[key] = len(nodes)
                nodes.append(corners[list(key)].mean(axis=0) + 1e-3 * np.sin([7.0 * sum(key), 3.0, 5.0 * key[0]]))
            middles.append(number[key])
        elements.append([*cell, *middles])
    return np.array(nodes), np.array(elements)


def frequencies(nodes, elements, material=STEEL, top=2e5):
    """Of the free solid but for its six rigid motions."""
    K, M = stiffness_and_mass(nodes, elements, "tet10", material)
    found = lowest_modes(K, M, top)[0]
    return found[6:]


def test_a_solid_that_is_turned_and_moved_keeps_its_frequencies(solid, rotation):
    nodes, elements = solid
    found = frequencies(nodes @ rotation.T + [0.3, -0.2, 0.5], elements)
    assert found == pytest.approx(frequencies(nodes, elements), rel=1e-6)


def test_a_mirrored_solid_keeps_its_frequencies(solid):
    """Corners two and three change places, so that volumes stay positive."""
    nodes, elements = solid
    mirrored = elements[:, [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
    with pytest.raises(InputError, match="inverted"):
        frequencies(nodes * [-1.0, 1.0, 1.0], elements)
    found = frequencies(nodes * [-1.0, 1.0, 1.0], mirrored)
    assert found == pytest.approx(frequencies(nodes, elements), rel=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_a_solid_of_another_size_and_material_has_frequencies_of_its_wave_speed_over_its_length(solid, scale):
    nodes, elements = solid
    other = Material(4 * STEEL.young, STEEL.poisson, STEEL.density / 4)
    found = frequencies(scale * nodes, elements, other, 8e5 / scale)
    assert scale / 4 * found == pytest.approx(frequencies(nodes, elements), rel=1e-6)


@pytest.fixture(scope="module")
def housing(body):
    rng = np.random.default_rng(4)
    flexibility = rng.standard_normal((9, 9))
    return ReducedHousing(
        natural_frequency=np.linspace(300.0, 2400.0, 5),
        modal_damping=np.full(5, 0.03),
        seat_shapes=rng.standard_normal((5, 3, 3)),
        normal_shapes=rng.standard_normal((5, len(body.triangles))),
        seat_residual=(1e-9 * flexibility @ flexibility.T).reshape(3, 3, 3, 3),
        face_residual=1e-10 * rng.standard_normal((3, 3, len(body.triangles))),
        names=("A1", "B1", "C1"),
        positions=np.zeros((3, 3)),
        surface=body,
    )


def test_a_force_at_one_seat_moves_another_as_the_force_there_moves_this_one(housing):
    """Maxwell, Betti, Rayleigh: u_i from F_j is u_j from F_i, in amplitude and phase, with damping too."""
    lines = np.array([250.0, 300.0, 1234.0, 3000.0])
    unit = np.eye(9)
    moved = np.stack(
        [seat_displacement(housing, lines, np.tile(force.reshape(1, 3, 3), (4, 1, 1)).astype(complex).reshape(4, 9))
         for force in unit], axis=1,
    ).reshape(4, 9, 9)  # fmt: skip
    size = np.abs(moved).max(axis=(1, 2), keepdims=True)
    assert (np.abs(moved - moved.transpose(0, 2, 1)) < 1e-12 * size).all()
    assert (np.abs(moved[:, 0, 1:]) > 1e-4 * size[:, 0]).all()


def test_a_force_that_lags_by_an_angle_moves_the_seats_later_by_it_and_two_forces_add_up(housing):
    lines = np.array([250.0, 1234.0])
    rng = np.random.default_rng(0)
    one, two = (rng.standard_normal((2, 9)) + 1j * rng.standard_normal((2, 9)) for _ in range(2))
    both = seat_displacement(housing, lines, one + 2 * np.exp(-0.7j) * two)
    parts = [seat_displacement(housing, lines, force) for force in (one, two)]
    expected = parts[0] + 2 * np.exp(-0.7j) * parts[1]
    assert np.abs(both - expected).max() < 1e-12 * np.abs(expected).max()
