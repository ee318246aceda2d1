"""Normal modes against closed forms and against a dense solution; none missed."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

import nvhchain.fem._sparse as door
import nvhchain.fem.eigen as eigen
from nvhchain.conventions import STEEL
from nvhchain.errors import InputError, SolverError
from nvhchain.fem import factorize, lowest_modes, modes_and_ritz_vectors, stiffness_and_mass
from nvhchain.testing import elements as meshes


@pytest.fixture(params=["counted", "not counted"])
def counting(request, monkeypatch):
    """Modes by a solver that counts them, and by one that takes positive definite matrices only."""
    if request.param == "not counted":
        monkeypatch.setenv("NVHCHAIN_SPARSE", "cholmod")
        monkeypatch.setattr(door, "SUPERLU_UNKNOWNS", 0)


EITHER = pytest.mark.usefixtures("counting")


def membrane(n):
    """Square grid of springs and unit masses; every frequency is known and most are double."""
    line = sp.diags([2 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], [0, 1, -1])
    K = sp.kron(line, sp.identity(n)) + sp.kron(sp.identity(n), line)
    angle = np.arange(1, n + 1) * np.pi / (2 * (n + 1))
    values = 4 * (np.sin(angle)[:, None] ** 2 + np.sin(angle) ** 2)
    return K.tocsr(), sp.identity(n * n, format="csr"), np.sort(np.sqrt(values.ravel())) / (2 * np.pi)


@EITHER
def test_frequencies_of_a_spring_grid_match_the_closed_form_double_ones_included():
    K, M, exact = membrane(30)
    f_max = (exact[59] + exact[60]) / 2
    assert exact[60] - exact[59] > 1e-3 * f_max
    frequency, shapes = lowest_modes(K, M, f_max)
    assert len(frequency) == 60
    assert np.abs(frequency / exact[:60] - 1).max() < 1e-10
    assert np.abs(shapes.T @ (M @ shapes) - np.eye(60)).max() < 1e-10
    residual = K @ shapes - (M @ shapes) * (2 * np.pi * frequency) ** 2
    assert np.linalg.norm(residual, axis=0).max() < 1e-5 * np.linalg.norm(K @ shapes, axis=0).max()


@EITHER
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


def loaded_membrane(n):
    """A membrane with one load that almost repeats another; its eigenvalues and vectors; which lie above 0.13 Hz."""
    K, M, _ = membrane(n)
    load = np.zeros((n * n, 3))
    load[[7, 40], [0, 1]] = 1.0
    load[:, 2] = load[:, 0] + 1e-6 * load[:, 1]
    values, vectors = np.linalg.eigh(K.toarray())
    return K, M, load, values, vectors, values > (2 * np.pi * 0.13) ** 2


@EITHER
@pytest.mark.parametrize("n", [15, 30])
def test_ritz_vectors_carry_the_flexibility_of_the_modes_above_the_limit(n):
    """Few unknowns take dense algebra, more take Lanczos."""
    K, M, load, values, exact, above = loaded_membrane(n)
    frequency, shapes, found = modes_and_ritz_vectors(K, M, 0.13, load, (1, 2))
    assert 8 <= len(frequency) == (~above).sum()
    exact = (exact[:, above] / values[above]) @ exact[:, above].T @ load
    for ritz in found:
        assert ritz.frequency[0] > 0.13
        residual = ritz.shapes / (2 * np.pi * ritz.frequency) ** 2 @ (ritz.shapes.T @ load)
        assert np.abs(residual - exact).max() < 1e-8 * np.abs(exact).max()
        both = np.hstack([shapes, ritz.shapes])
        assert np.abs(both.T @ (M @ both) - np.eye(both.shape[1])).max() < 1e-6
        assert np.diff(ritz.frequency).min() > 0


@EITHER
@pytest.mark.parametrize("n", [15, 30])
def test_ritz_vectors_of_more_terms_hold_more_of_the_response_over_frequency(n):
    """Against all modes: p terms leave ω^(2p) of the motion of anything, and ω^(4p) of that of the loads."""
    K, M, load, values, exact, above = loaded_membrane(n)
    _, _, found = modes_and_ritz_vectors(K, M, 0.13, load[:, :2], (1, 2, 3))
    load, lowest = load[:, :2], np.sqrt(values[above][0])

    def response(squared, shapes, omega):
        return shapes / (squared - omega**2) @ (shapes.T @ load)

    def errors(ritz, omega):
        truth = response(values[above], exact[:, above], omega)
        missed = response((2 * np.pi * ritz.frequency) ** 2, ritz.shapes, omega) - truth
        return np.linalg.norm(missed) / np.linalg.norm(truth), np.linalg.norm(load.T @ missed)

    for terms, ritz in enumerate(found, start=1):
        (slow, at_loads), (fast, faster) = errors(ritz, 0.15 * lowest), errors(ritz, 0.3 * lowest)
        assert fast / slow == pytest.approx(4.0**terms, rel=0.2)
        if terms == 1:
            assert faster / at_loads == pytest.approx(4.0**2, rel=0.2)


@EITHER
def test_limit_on_a_natural_frequency_counts_its_modes():
    """The grid of three springs and the wall in line: ω² = 2 is exact in binary, and K − 2 M is singular."""
    K, M, exact = membrane(30)
    single = sp.diags([2.0], shape=(1, 1))
    K, M = sp.block_diag([K, single], format="csr"), sp.identity(901, format="csr")
    f_max = np.sqrt(2.0) / (2 * np.pi)
    assert (2 * np.pi * f_max) ** 2 == pytest.approx(2.0, rel=1e-15)
    frequency, _ = lowest_modes(K, M, f_max)
    assert frequency[-1] == pytest.approx(f_max, rel=1e-12)
    assert len(frequency) == 1 + (exact < f_max).sum()


@EITHER
def test_slow_modes_on_soft_springs_keep_their_digits():
    nodes, elements = meshes.brick((4, 2, 2), (0.2, 0.08, 0.06))
    K, M = stiffness_and_mass(nodes, elements, "hex20", STEEL)
    corners = np.ptp(nodes, axis=0).sum() - nodes.sum(axis=1) < 1e-9
    soft = sp.diags(np.repeat(np.where(corners | (nodes.sum(axis=1) < 1e-9), 1e3, 0.0), 3))
    K = sp.csr_matrix(K + soft + sp.diags(np.where(np.arange(K.shape[0]) % 3 == 2, 10.0, 0.0)))
    frequency, shapes = lowest_modes(K, M, 20e3)
    # the first six by inertia relief: the springs are far too soft to bend the block
    rigid = shapes[:, :6]
    values = scipy.linalg.eigvalsh(rigid.T @ (K @ rigid), rigid.T @ (M @ rigid))
    exact = np.sqrt(scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:6]) / (2 * np.pi)
    assert frequency[:6] == pytest.approx(exact, rel=1e-5)
    assert frequency[:6] == pytest.approx(np.sqrt(values) / (2 * np.pi), rel=1e-6)
    assert exact[5] < 1e-2 * frequency[6]


@EITHER
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


@EITHER
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


@EITHER
def test_no_mode_below_the_limit_is_an_empty_answer():
    K, M, _ = membrane(30)
    frequency, shapes = lowest_modes(K, M, 1e-3)
    assert frequency.shape == (0,)
    assert shapes.shape == (900, 0)


def test_sturm_count_of_a_spring_grid_is_that_of_the_closed_form():
    K, M, exact = membrane(30)
    with factorize(
        sp.csr_matrix(K - (np.pi * (exact[59] + exact[60])) ** 2 * M), symmetric_positive_definite=False
    ) as factor:
        assert factor.negative == 60


@pytest.mark.parametrize(("wrong", "message"), [(-1, "60 modes found"), (1, "60 of 61 modes")])
def test_missed_mode_is_an_error(monkeypatch, wrong, message):
    K, M, exact = membrane(30)

    def miscounted(*args, **options):
        factor = factorize(*args, **options)
        factor.negative += wrong
        return factor

    monkeypatch.setattr(eigen, "factorize", miscounted)
    with pytest.raises(SolverError, match=message):
        lowest_modes(K, M, (exact[59] + exact[60]) / 2)


@pytest.mark.parametrize("n", [15, 30])
def test_stiffness_with_a_negative_eigenvalue_is_an_error(n):
    K, M, _ = membrane(n)
    with pytest.raises(SolverError, match=r"stiffness matrix has the eigenvalue -0\.2"):
        lowest_modes(sp.csr_matrix(K - (0.2 + first(n)) * M), M, 0.13)


def first(n):
    """Lowest eigenvalue of the membrane."""
    return 8 * np.sin(np.pi / (2 * (n + 1))) ** 2


def test_f_max_must_be_positive():
    K, M, _ = membrane(5)
    with pytest.raises(InputError, match="f_max"):
        lowest_modes(K, M, 0.0)
