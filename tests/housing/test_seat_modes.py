"""Modes and Ritz vectors of a small block with two rigid seats, held or free, against dense algebra."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from nvhchain.conventions import ALUMINIUM
from nvhchain.fem import rigid_map, stiffness_and_mass
from nvhchain.housing.modes.seat_modes import seat_modes, seat_unknowns
from nvhchain.housing.reduction import held_matrices
from nvhchain.testing.elements import brick


def block(held):
    """Matrices of a block of hexahedra: rigid seats on two opposite sides, one end face held or nothing."""
    lengths = (0.25, 0.08, 0.06)
    nodes, elements = brick((5, 2, 2), lengths)
    K, M = stiffness_and_mass(nodes, elements, "hex20", ALUMINIUM)
    inner = (nodes[:, 0] > 1e-6) & (nodes[:, 0] < lengths[0] - 1e-6)
    sides = [np.flatnonzero(inner & np.isclose(nodes[:, 1], y) & (nodes[:, 0] > 0.1)) for y in (0.0, lengths[1])]
    sets = [(side, nodes[side].mean(axis=0)) for side in sides]
    if held:
        sets.insert(0, (np.flatnonzero(nodes[:, 0] < 1e-6), None))
    T = rigid_map(nodes, sets)
    return (T.T @ K @ T).tocsr(), (T.T @ M @ T).tocsr(), T, nodes


def dynamic_flexibility(K, M, seats, omega):
    """(K − ω²M)⁻¹ at the seats."""
    load = np.zeros((K.shape[0], len(seats)))
    load[seats, np.arange(len(seats))] = 1.0
    return scipy.linalg.solve((K - omega**2 * M).toarray(), load, assume_a="sym")[seats]


def of_modes(modes, omega):
    """The same from modes and Ritz vectors."""
    every = ((modes.frequency, modes.shapes), (modes.ritz.frequency, modes.ritz.shapes))
    parts = [(shapes[modes.seats], (2 * np.pi * frequency) ** 2) for frequency, shapes in every]
    return sum((shapes / (omega2 - omega**2)) @ shapes.T for shapes, omega2 in parts)


@pytest.mark.parametrize("held", [True, False])
def test_flexibility_below_the_first_elastic_mode_is_that_of_all_modes(held):
    K, M, _, _ = block(held)
    modes = seat_modes(K, M, 2, 12e3)
    elastic = modes.frequency[modes.frequency > 0]
    assert len(elastic) >= 3
    # Ritz vectors of two terms are exact to the fourth power of the frequency
    omega = 2 * np.pi * 0.02 * elastic[0]
    exact = dynamic_flexibility(K, M, modes.seats, omega)
    assert np.abs(of_modes(modes, omega) - exact).max() < 1e-6 * np.abs(exact - of_rigid(modes, omega)).max()


def of_rigid(modes, omega):
    """Share of the rigid modes."""
    shapes = modes.shapes[modes.seats][:, modes.frequency == 0]
    return shapes @ shapes.T / -(omega**2)


def test_free_block_has_six_rigid_modes_and_an_elastic_flexibility_without_them():
    K, M, _, _ = block(held=False)
    modes = seat_modes(K, M, 2, 12e3)
    assert (modes.frequency[:6] == 0).all()
    assert modes.frequency[6] > 500.0
    values, shapes = scipy.linalg.eigh(K.toarray(), M.toarray())
    elastic, omega2 = shapes[modes.seats][:, 6:], values[6:]
    exact = (elastic / omega2) @ elastic.T
    elastic = replace(modes, frequency=modes.frequency[6:], shapes=modes.shapes[:, 6:])
    got = of_modes(elastic, 0.0)
    assert np.abs(got - exact).max() < 1e-8 * np.abs(exact).max()
    # no Ritz vector moves the whole body
    rigid = modes.shapes[:, :6]
    assert np.abs(rigid.T @ (M @ modes.ritz.shapes)).max() < 1e-9


def test_block_on_a_hinge_keeps_its_one_rigid_mode():
    K, M, T, nodes = block(held=False)
    axis = np.isclose(nodes[:, 0], 0.0) & np.isclose(nodes[:, 2], 0.0)
    first = np.flatnonzero((T[np.flatnonzero(np.repeat(axis, 3))] != 0).sum(axis=0))
    free = np.setdiff1d(np.arange(K.shape[0]), first)
    modes = seat_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), 2, 12e3)
    assert (modes.frequency == 0).sum() == 1


def test_rigid_modes_alone_are_an_answer_where_the_band_ends_below_the_first_elastic_mode():
    K, M, _, _ = block(held=False)
    modes = seat_modes(K, M, 2, 300.0)
    assert modes.frequency.tolist() == [0.0] * 6
    omega = 2 * np.pi * 300.0
    exact = dynamic_flexibility(K, M, modes.seats, omega)
    assert np.abs(of_modes(modes, omega) - exact).max() < 1e-2 * np.abs(exact - of_rigid(modes, omega)).max()


def test_band_below_the_first_mode_of_a_held_block_leaves_its_static_flexibility():
    K, M, _, _ = block(held=True)
    modes = seat_modes(K, M, 2, 100.0)
    assert len(modes.frequency) == 0
    exact = dynamic_flexibility(K, M, modes.seats, 0.0)
    assert np.abs(of_modes(modes, 0.0) - exact).max() < 1e-9 * np.abs(exact).max()


def test_coincident_modes_of_a_square_block_come_in_pairs():
    nodes, elements = brick((6, 2, 2), (0.3, 0.05, 0.05))
    K, M = stiffness_and_mass(nodes, elements, "hex20", ALUMINIUM)
    end = np.flatnonzero(np.isclose(nodes[:, 0], 0.3))
    T = rigid_map(nodes, [(np.flatnonzero(nodes[:, 0] < 1e-6), None), (end, np.array([0.3, 0.025, 0.025]))])
    K, M = (T.T @ K @ T).tocsr(), (T.T @ M @ T).tocsr()
    modes = seat_modes(K, M, 1, 6e3)
    pairs = modes.frequency[:2]
    assert pairs[1] / pairs[0] - 1 < 1e-9
    values, shapes = scipy.linalg.eigh(K.toarray(), M.toarray(), subset_by_index=(0, len(modes.frequency)))
    assert modes.frequency == pytest.approx(np.sqrt(values[:-1]) / (2 * np.pi), rel=1e-8)
    # the plane of a pair is unique, the shapes in it are not
    projector = modes.shapes[:, :2] @ (modes.shapes[:, :2].T @ (M @ shapes[:, :2]))
    assert np.abs(projector - shapes[:, :2]).max() < 1e-6 * np.abs(shapes[:, :2]).max()


def test_band_far_below_the_first_elastic_mode_leaves_the_elastic_flexibility():
    """At 5 Hz the loads move the free block as a rigid body, a million times as far as they bend it."""
    K, M, _, _ = block(held=False)
    modes, wide = seat_modes(K, M, 2, 5.0), seat_modes(K, M, 2, 300.0)
    assert modes.frequency.tolist() == [0.0] * 6
    found, exact = (
        of_modes(replace(of, frequency=of.frequency[6:], shapes=of.shapes[:, 6:]), 0.0) for of in (modes, wide)
    )
    assert np.abs(found - exact).max() < 1e-6 * np.abs(exact).max()


def test_seat_unknowns_are_the_translations_of_the_last_reference_points():
    assert seat_unknowns(20, 2).tolist() == [8, 9, 10, 14, 15, 16]


def test_motions_of_a_seat_are_three_translations_and_tilts_about_x_and_y(mesh, casting):
    _, _, T = held_matrices(mesh, casting)
    unknowns = seat_unknowns(T.shape[1], len(casting.bores), 5).reshape(-1, 5)
    for nodes, bore, own in zip(mesh.seats, casting.bores, unknowns, strict=True):
        arm = mesh.nodes[nodes] - np.array(bore.centre)
        expected = [np.tile(axis, (len(arm), 1)) for axis in np.eye(3)] + [
            np.cross(axis, arm) for axis in np.eye(3)[:2]
        ]
        moved = T[:, own].toarray().reshape(-1, 3, 5)[nodes]
        np.testing.assert_allclose(np.moveaxis(moved, 2, 0), expected, atol=1e-12)
