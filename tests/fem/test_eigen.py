"""Normal modes against closed forms and against a dense solution; none missed."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

import nvhchain.fem.eigen as eigen
from nvhchain.conventions import STEEL
from nvhchain.errors import InputError, SolverError
from nvhchain.fem import factorize, lowest_modes, modes_below, stiffness_and_mass
from nvhchain.testing import elements as meshes


def membrane(n):
    """Square grid of springs and unit masses; every frequency is known and most are double."""
    line = sp.diags([2 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], [0, 1, -1])
    K = sp.kron(line, sp.identity(n)) + sp.kron(sp.identity(n), line)
    angle = np.arange(1, n + 1) * np.pi / (2 * (n + 1))
    values = 4 * (np.sin(angle)[:, None] ** 2 + np.sin(angle) ** 2)
    return K.tocsr(), sp.identity(n * n, format="csr"), np.sort(np.sqrt(values.ravel())) / (2 * np.pi)


def test_frequencies_of_a_spring_grid_match_the_closed_form_double_ones_included():
    K, M, exact = membrane(30)
    f_max = (exact[59] + exact[60]) / 2
    assert exact[60] - exact[59] > 1e-3 * f_max
    frequency, shapes = lowest_modes(K, M, f_max)
    assert len(frequency) == 60 == modes_below(K, M, f_max)
    assert np.abs(frequency / exact[:60] - 1).max() < 1e-10
    assert np.abs(shapes.T @ (M @ shapes) - np.eye(60)).max() < 1e-10
    residual = K @ shapes - (M @ shapes) * (2 * np.pi * frequency) ** 2
    assert np.linalg.norm(residual, axis=0).max() < 1e-5 * np.linalg.norm(K @ shapes, axis=0).max()


def test_a_frequency_that_more_modes_share_than_a_block_has_vectors_is_found_as_often():
    """Pairs of masses, all alike: ω² = k/m (3 ∓ √5)/2, half of the modes each; shift-invert ends after two blocks."""
    pairs = 205
    K = sp.block_diag([np.array([[2.0, -1.0], [-1.0, 1.0]])] * pairs, format="csr")
    M = sp.identity(2 * pairs, format="csr")
    exact = np.sqrt((3 - 5**0.5) / 2) / (2 * np.pi)
    frequency, shapes = lowest_modes(K, M, 1.0001 * exact)
    assert len(frequency) == pairs
    assert np.abs(frequency / exact - 1).max() < 1e-10
    assert np.abs(shapes.T @ (M @ shapes) - np.eye(pairs)).max() < 1e-10


def test_factor_of_the_stiffness_can_be_handed_in():
    K, M, exact = membrane(30)
    with factorize(K) as factor:
        frequency, _ = lowest_modes(K, M, 0.1, factor=factor)
    assert np.abs(frequency / exact[: len(frequency)] - 1).max() < 1e-10
    assert exact[len(frequency)] > 0.1


def test_free_block_has_six_rigid_modes_at_zero_and_matches_the_dense_solution():
    nodes, elements = meshes.brick((4, 2, 2), (0.2, 0.08, 0.06))
    K, M = stiffness_and_mass(nodes, elements, "hex20", STEEL)
    values = scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:16]
    exact = np.sqrt(values[6:].clip(0)) / (2 * np.pi)
    f_max = (exact[8] + exact[9]) / 2
    frequency, _ = lowest_modes(K, M, f_max)
    assert len(frequency) == 15
    assert (frequency[:6] == 0).all()
    assert np.abs(frequency[6:] / exact[:9] - 1).max() < 1e-8


def test_slender_free_beam_has_the_bending_frequencies_of_euler():
    length, width, height = 1.0, 0.02, 0.01
    nodes, elements = meshes.tetrahedra((24, 1, 1), (length, width, height))
    K, M = stiffness_and_mass(nodes, elements, "tet10", STEEL)
    frequency, _ = lowest_modes(K, M, 110.0)
    slow = np.sqrt(210e9 / (12 * 7850.0)) / (2 * np.pi * length**2)
    exact = sorted(beta**2 * slow * h for beta in (4.730041, 7.853205) for h in (width, height))
    exact = [f for f in exact if f < 110.0]
    assert (frequency[:6] == 0).all()
    assert frequency[6:] == pytest.approx(exact, rel=5e-3)


def test_no_mode_below_the_limit_is_an_empty_answer():
    K, M, _ = membrane(30)
    frequency, shapes = lowest_modes(K, M, 1e-3)
    assert frequency.shape == (0,)
    assert shapes.shape == (900, 0)


def test_missed_mode_is_an_error(monkeypatch):
    K, M, exact = membrane(30)
    f_max = (exact[59] + exact[60]) / 2
    monkeypatch.setattr(eigen, "modes_below", lambda *_: 59)
    with pytest.raises(SolverError, match="60 modes found"):
        lowest_modes(K, M, f_max)
    monkeypatch.setattr(eigen, "modes_below", lambda *_: 61)
    with pytest.raises(SolverError, match="60 of 61 modes"):
        lowest_modes(K, M, f_max)


def test_f_max_must_be_positive():
    K, M, _ = membrane(5)
    with pytest.raises(InputError, match="f_max"):
        lowest_modes(K, M, 0.0)
