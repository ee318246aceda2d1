"""Dense systems: LU factors in both directions and precisions, and when iterating is the cheaper way."""

from dataclasses import replace
from threading import get_ident

import numpy as np
import pytest

from nvhchain.acoustics.systems import linear_system
from nvhchain.acoustics.systems.iterative import CheapestSystem, dense_system, iteration_pays
from nvhchain.acoustics.systems.linear_system import DenseMatrix, DirectSystem
from nvhchain.errors import SolverError
from nvhchain.fidelity import STANDARD
from nvhchain.runtime.threads import blas_threads

DIRECT = replace(STANDARD.acoustics, solver="direct")


def random_system(n=60, n_face=110, m=4):
    rng = np.random.default_rng(5)

    def array(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    return array(n, n) + 3 * np.sqrt(n) * np.eye(n), array(n, n_face), array(n, m), rng.normal(size=(n, 3))


@pytest.mark.parametrize(("kind", "limit"), [(np.complex128, 1e-13), (np.complex64, 1e-5)])
def test_direct_solutions_match_numpy_in_both_directions_and_precisions(kind, limit):
    a, b, rhs, _ = random_system()
    system = DirectSystem(a.astype(kind), b.astype(kind))
    for columns in (rhs, rhs[:, 0]):
        for found, exact in (
            (system.solve(columns), np.linalg.solve(a, columns)),
            (system.adjoint(columns), b.T @ np.linalg.solve(a.T, columns)),
        ):
            assert found.dtype == complex
            assert found.shape == exact.shape
            assert np.abs(found - exact).max() < limit * np.abs(exact).max()
    assert np.abs(system.apply_b(b[0]) - b @ b[0]).max() < limit * np.abs(b @ b[0]).max()


@pytest.mark.parametrize("kind", [np.complex128, np.complex64])
def test_products_dealt_out_to_threads_are_those_of_one(kind, monkeypatch):
    _, b, rhs, _ = random_system()
    matrix, callers = b.astype(kind), set()
    monkeypatch.setattr(linear_system, "THREAD_ENTRIES", matrix.size // 5)
    monkeypatch.setattr(linear_system, "blas_threads", lambda most: callers.add(get_ident()) or blas_threads(most))
    for columns, product in ((matrix.T, "apply_transposed"), (matrix, "apply")):
        x = np.ones((columns.shape[1], 1)) @ rhs[:1]
        for some in (x, x[:, 0]):
            monkeypatch.setattr(linear_system, "threads", lambda: 3)
            found = getattr(DenseMatrix(matrix), product)(some)
            monkeypatch.setattr(linear_system, "threads", lambda: 1)
            alone = getattr(DenseMatrix(matrix), product)(some)
            assert found.dtype == complex
            assert found.shape == alone.shape
            assert np.abs(found - alone).max() < (1e-14 if kind == np.complex128 else 1e-6) * np.abs(alone).max()
    assert callers
    assert get_ident() not in callers


@pytest.mark.parametrize("value", [0.0, 1.0, np.nan])
@pytest.mark.parametrize("kind", [np.complex128, np.complex64])
def test_singular_matrices_and_values_that_are_not_finite_raise(value, kind):
    with pytest.raises(SolverError):
        DirectSystem(np.full((50, 50), value, dtype=kind), np.ones((50, 90), dtype=kind)).solve(np.ones(50))


def test_factorising_overwrites_the_matrix_instead_of_copying_it():
    a, b, _, _ = random_system()
    before = a.copy()
    DirectSystem(a, b).solve(np.ones(len(a)))
    assert not np.array_equal(a, before)


def test_iterating_pays_for_few_right_sides_of_large_systems_only():
    assert iteration_pays(3250, 10)
    assert iteration_pays(1000, 1)
    assert not iteration_pays(600, 1)
    assert not iteration_pays(3250, 128)
    assert iteration_pays(15000, 128)


def test_the_cheapest_system_factorises_where_the_iteration_does_not_converge(monkeypatch):
    a, b, rhs, positions = random_system(300, 500)
    monkeypatch.setattr("nvhchain.acoustics.systems.iterative.iteration_pays", lambda unknowns, columns: True)
    exact = b.T @ np.linalg.solve(a.T, rhs)
    for iterations in (1, 200):
        knobs = replace(STANDARD.acoustics, solver="auto", solver_iterations=iterations)
        system = dense_system(a.copy(), b, positions, knobs)
        assert isinstance(system, CheapestSystem)
        assert np.abs(system.adjoint(rhs) - exact).max() < 1e-8 * np.abs(exact).max()
        assert (system._direct is None) == (iterations == 200)
    assert isinstance(dense_system(a, b, positions, DIRECT), DirectSystem)


@pytest.mark.parametrize("n", [60, 600])  # in one piece, and with its rows on two threads
def test_single_precision_holds_columns_of_any_size(monkeypatch, n):
    monkeypatch.setattr(linear_system, "threads", lambda: 2)
    a, b, rhs, _ = random_system(n)
    sizes = np.array([1e-160, 0.0, 1.0, 1e160])
    single = DirectSystem(a.astype(np.complex64), b.astype(np.complex64))
    x = rhs * sizes
    for found, exact in (
        (DenseMatrix(a.astype(np.complex64)).apply(x), a @ x),
        (single.solve(x), np.linalg.solve(a, x)),
    ):
        assert (np.abs(found - exact).max(axis=0) <= 1e-5 * np.abs(exact).max(axis=0)).all()
