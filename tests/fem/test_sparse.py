"""The direct solver: residual, inertia, refusals, and the fallback against PARDISO."""

import sys

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

import nvhchain.fem._sparse as door
from nvhchain.conventions import STEEL
from nvhchain.errors import InputError, ResourceError, SolverError
from nvhchain.fem import factorize, stiffness_and_mass
from nvhchain.testing import elements as meshes

COUNTING = (["pardiso"] if door._has_pardiso() else []) + ["superlu"]
ENGINES = pytest.mark.parametrize("engine", [*COUNTING, "cholmod"])


@pytest.fixture(scope="module")
def matrices():
    nodes, elements = meshes.tetrahedra((5, 4, 3), (0.1, 0.08, 0.06))
    K, M = stiffness_and_mass(nodes, elements, "tet10", STEEL)
    free = np.repeat(nodes[:, 0] > 0, 3)
    return K[free][:, free].tocsr(), M[free][:, free].tocsr()


@ENGINES
@pytest.mark.parametrize("columns", [None, 1, 3, 70])
def test_solution_leaves_no_residual_and_keeps_the_shape(matrices, engine, columns):
    K, _ = matrices
    shape = (K.shape[0],) if columns is None else (K.shape[0], columns)
    rhs = np.random.default_rng(0).standard_normal(shape)
    with factorize(K, engine=engine) as factor:
        solution = factor.solve(rhs)
    assert solution.shape == shape
    assert np.linalg.norm(K @ solution - rhs) < 1e-9 * np.linalg.norm(rhs)


@ENGINES
def test_hermitian_matrix_leaves_no_residual(matrices, engine):
    """K with unknowns of other phases, of which the upper triangle is given."""
    K, _ = matrices
    phase = sp.diags(np.exp(1j * np.arange(K.shape[0])))
    hermitian = (phase @ K @ phase.conj()).tocsr()
    rhs = np.random.default_rng(0).standard_normal((K.shape[0], 3)) * (1.0 + 0.5j)
    with factorize(sp.triu(hermitian), engine=engine, upper=True) as factor:
        solution = factor.solve(rhs)
    assert np.linalg.norm(hermitian @ solution - rhs) < 1e-9 * np.linalg.norm(rhs)


@ENGINES
@pytest.mark.parametrize("columns", [None, 3, 70])
@pytest.mark.parametrize("hermitian", [False, True])
def test_unknowns_that_alone_are_loaded_and_read_move_as_in_the_whole(matrices, engine, columns, hermitian):
    K, _ = matrices
    rng, size = np.random.default_rng(0), K.shape[0]
    if hermitian:
        phase = sp.diags(np.exp(1j * np.arange(size)))
        K = (phase @ K @ phase.conj()).tocsr()
    loaded = rng.permutation(size)[: size // 7]
    rhs = np.zeros(size if columns is None else (size, columns), K.dtype)
    rhs[loaded] = rng.standard_normal((len(loaded), *rhs.shape[1:])) * (1.0 + 0.5j if hermitian else 1.0)
    with factorize(sp.triu(K), engine=engine, upper=True) as factor:
        whole = factor.solve(rhs)
    with factorize(sp.triu(K), engine=engine, upper=True, loaded=loaded) as factor:
        found = factor.solve(rhs[loaded])
        with pytest.raises(InputError, match="does not fit"):
            factor.solve(rhs)
        real = factor.solve(rhs[loaded].real)
    assert found.shape == rhs[loaded].shape
    np.testing.assert_allclose(found, whole[loaded], atol=1e-10 * np.abs(whole).max())
    assert real.dtype == K.dtype
    if not hermitian:
        np.testing.assert_array_equal(real, found)
    with pytest.raises(InputError, match="positive definite"):
        factorize(K, engine=engine, symmetric_positive_definite=False, loaded=loaded)


@pytest.mark.parametrize("engine", COUNTING)
def test_negative_pivots_count_the_eigenvalues_below_the_shift(matrices, engine):
    K, M = matrices
    exact = scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)
    for count in (0, 1, 7, 20):
        shift = 0.5 * exact[0] if count == 0 else (exact[count - 1] + exact[count]) / 2
        with factorize(K - shift * M, symmetric_positive_definite=False, engine=engine) as factor:
            assert factor.negative == count
            rhs = np.ones(K.shape[0])
            assert np.linalg.norm((K - shift * M) @ factor.solve(rhs) - rhs) < 1e-7 * np.linalg.norm(rhs)


@ENGINES
def test_matrix_that_is_not_positive_definite_is_refused(matrices, engine):
    K, M = matrices
    with pytest.raises(SolverError, match="positive definite"):
        factorize(K - 1e12 * M, engine=engine)


@ENGINES
def test_empty_row_is_an_error_not_a_crash(engine):
    with pytest.raises(SolverError):
        factorize(sp.csr_matrix(np.diag([1.0, 0.0, 2.0])), engine=engine)


@ENGINES
def test_closed_factor_and_unfitting_right_hand_side_are_refused(matrices, engine):
    factor = factorize(matrices[0], engine=engine)
    with pytest.raises(InputError, match="does not fit"):
        factor.solve(np.ones(5))
    factor.close()
    factor.close()
    with pytest.raises(InputError, match="closed"):
        factor.solve(np.ones(factor.unknowns))


def test_superlu_refuses_sizes_it_cannot_do():
    size = door.SUPERLU_UNKNOWNS + 1
    with pytest.raises(ResourceError, match=f"{size} unknowns are too many for SuperLU"):
        factorize(sp.identity(size, format="csr"), engine="superlu")


@pytest.mark.parametrize("engine", ["pardiso", "cholmod"])
def test_factor_that_does_not_fit_into_memory_is_refused_before_it_is_made(matrices, monkeypatch, engine):
    monkeypatch.setattr(door, "free_memory", lambda: 1024)
    with pytest.raises(ResourceError, match="GB are free"):
        factorize(matrices[0], engine=engine)


@ENGINES
def test_a_factor_does_not_search_the_installation_for_its_library(matrices, engine, monkeypatch):
    def search(*_, **__):
        raise AssertionError("searched")

    monkeypatch.setattr("glob.glob", search)
    with factorize(matrices[0], engine=engine) as factor:
        assert factor.unknowns == matrices[0].shape[0]


def test_cholmod_is_taken_where_pardiso_does_not_exist_and_superlu_where_neither_can(monkeypatch):
    monkeypatch.setattr(door.platform, "machine", lambda: "aarch64")
    one = sp.identity(3, format="csr")
    with factorize(one) as factor, factorize(-one, symmetric_positive_definite=False) as indefinite:
        assert isinstance(factor, door._CholmodFactor)
        assert isinstance(indefinite, door._SuperluFactor)
    monkeypatch.setattr(door, "_has_cholmod", lambda: False)
    with factorize(one) as factor:
        assert isinstance(factor, door._SuperluFactor)


def test_the_environment_names_the_solver(monkeypatch):
    monkeypatch.setenv("NVHCHAIN_SPARSE", "cholmod")
    with factorize(sp.identity(3, format="csr")) as factor:
        assert isinstance(factor, door._CholmodFactor)
    monkeypatch.setenv("NVHCHAIN_SPARSE", "umfpack")
    with pytest.raises(InputError, match="NVHCHAIN_SPARSE = 'umfpack' is none of pardiso, cholmod, superlu"):
        factorize(sp.identity(3, format="csr"))


@pytest.mark.parametrize(
    ("preferred", "absent", "taken"),
    [("pardiso", "pypardiso", "cholmod"), ("cholmod", "cvxopt", COUNTING[0]), ("cholmod", "pypardiso", "cholmod")],
)
def test_the_environment_prefers_a_solver_and_others_follow_where_it_is_absent(monkeypatch, preferred, absent, taken):
    monkeypatch.setenv("NVHCHAIN_SPARSE", preferred)
    monkeypatch.setitem(sys.modules, absent, None)
    monkeypatch.setitem(sys.modules, f"{absent}.cholmod", None)
    with factorize(sp.identity(3, format="csr")) as factor:
        assert type(factor).__name__ == f"_{taken.title()}Factor"


def test_cholmod_refuses_what_is_not_positive_definite_by_request(matrices):
    with pytest.raises(InputError, match="positive definite matrices only"):
        factorize(matrices[0], symmetric_positive_definite=False, engine="cholmod")
