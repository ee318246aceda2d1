"""Local deflection against published values; the complementarity problem against its own conditions and limits."""

import numpy as np
import pytest
from scipy.optimize import minimize

from nvhchain.conventions import STEEL
from nvhchain.errors import SolverError
from nvhchain.gear.contact._slices import factorize, gaps, substitute
from nvhchain.gear.contact.local_law import contact_half_width, local_law
from nvhchain.gear.contact.slice_forces import slice_forces
from tests.gear.weber_banaschek import local_deflection

PAIR = (STEEL, STEEL)


def flattened(load, depths, materials=PAIR, curvature_radius=13.93e-3):
    """Local deflection of one slice, m."""
    law = local_law(np.array([curvature_radius]), tuple(np.array([h]) for h in depths), materials)
    return float(law.deflection(np.array([load]))[0])


@pytest.mark.parametrize(("torque", "width", "deflection"), [(50, 0.0693e-3, 0.707e-6), (300, 0.1697e-3, 3.316e-6)])
def test_weber_banaschek_pair_of_the_acceptance_table(torque, width, deflection):
    load = torque / 69.631e-3 / 23e-3
    assert contact_half_width(load, 13.93e-3, PAIR) == pytest.approx(width, rel=1e-3)
    assert flattened(load, (2.6e-3, 2.6e-3)) == pytest.approx(deflection, rel=1e-3)


def test_local_deflection_without_load_is_zero_and_unlike_materials_exchange():
    soft = STEEL.__class__(young=100e9, poisson=0.25, density=7000.0)
    assert flattened(0.0, (1e-3, 1e-3)) == 0.0
    one = flattened(3e5, (1e-3, 2e-3), (STEEL, soft))
    other = flattened(3e5, (2e-3, 1e-3), (soft, STEEL))
    assert one == pytest.approx(other, rel=1e-14)


def problem(n=24, seed=0):
    """A smooth positive compliance over n slices of two lines, with curvature and depth varying along them."""
    x = np.linspace(0, 1, n)
    C = 2.5e-9 * np.exp(-6 * np.abs(np.subtract.outer(x, x))) + 1e-9
    rho, depth = np.linspace(3e-3, 8e-3, n), np.linspace(1e-3, 2.4e-3, n)
    length = np.random.default_rng(seed).uniform(0.02e-3, 1.6e-3, n)
    return C, rho, (depth, depth[::-1].copy()), length


def test_forces_satisfy_all_complementarity_conditions_to_the_stated_residual():
    C, rho, depths, length = problem()
    law = local_law(rho, depths, PAIR)
    offset = np.random.default_rng(1).uniform(0, 20e-6, len(length))
    approach = np.geomspace(0.01e-6, 80e-6, 15)[:, None] - offset
    F = slice_forces(C, approach, length, law, tolerance=1e-10)
    gap = local_deflection(F / length, rho, depths, PAIR) + F @ C - approach
    scale = approach.max(axis=1, keepdims=True)
    assert (F >= 0).all()
    assert (gap >= -2e-10 * np.abs(scale)).all()
    assert (np.abs(gap) <= 2e-10 * np.abs(scale))[F > 0].all()
    assert 0 < (F[7] > 0).sum() < len(length)  # the active set is a real choice here
    assert not F[(approach <= 0).all(axis=1)].any()


def test_forces_minimise_the_potential_found_by_a_general_optimiser():
    C, rho, depths, length = problem(6)
    law = local_law(rho, depths, PAIR)
    approach = 12e-6 - np.array([0.0, 30e-6, 4e-6, 2e-6, 25e-6, 1e-6])

    def gradient(F):
        return 1e6 * (local_deflection(F / length, rho, depths, PAIR) + C @ F - approach)

    def potential(F):
        # ∫ δ_loc dF by quadrature, so that the closed form inside the solver is not used
        t, w = np.polynomial.legendre.leggauss(40)
        t, w = 0.5 * (t + 1), 0.5 * w
        local = sum(
            wi * (F * local_deflection(ti * F / length, rho, depths, PAIR)).sum() for ti, wi in zip(t, w, strict=True)
        )
        return 1e6 * (local + 0.5 * F @ C @ F - approach @ F)

    found = minimize(
        potential,
        np.full(6, 100.0),
        jac=gradient,
        bounds=[(0, None)] * 6,
        method="L-BFGS-B",
        options={"ftol": 1e-15, "gtol": 1e-10, "maxiter": 5000},
    ).x
    F = slice_forces(C, approach[None], length, law, tolerance=1e-12)[0]
    np.testing.assert_allclose(F, found, atol=2e-4 * F.max())


def test_one_slice_reproduces_the_closed_form():
    law = local_law(np.array([13.93e-3]), (np.array([2.6e-3]),) * 2, PAIR)
    q = 300 / 69.631e-3 / 23e-3
    approach = local_deflection(q, 13.93e-3, (2.6e-3, 2.6e-3), PAIR) + 2e-9 * q * 1e-3
    F = slice_forces(np.array([[2e-9]]), np.array([[approach]]), np.array([1e-3]), law, tolerance=1e-12)
    assert F[0, 0] == pytest.approx(q * 1e-3, rel=1e-9)


def test_an_approach_history_does_not_change_the_answer():
    C, rho, depths, length = problem()
    law = local_law(rho, depths, PAIR)
    approach = np.outer(np.linspace(1e-6, 60e-6, 9), np.ones(len(length)))
    up = slice_forces(C, approach, length, law, tolerance=1e-12)
    down = slice_forces(C, approach[::-1].copy(), length, law, tolerance=1e-12)[::-1]
    np.testing.assert_allclose(up, down, rtol=1e-8, atol=1e-8 * up.max())


def test_law_beyond_its_range_continues_on_its_tangent_and_stays_solvable():
    """A load that flattens deeper than half the tooth: the formula alone would fall with load there."""
    rho, depth = np.array([20e-3]), np.array([0.5e-3])
    law = local_law(rho, (depth, depth), PAIR)
    assert contact_half_width(law.limit, rho, PAIR) == pytest.approx(0.25e-3, rel=1e-12)
    at_limit = float(local_deflection(law.limit, rho, (depth, depth), PAIR)[0])
    approach = np.array([[0.999], [1.001], [2.0], [3.0]]) * at_limit
    q = slice_forces(np.zeros((1, 1)), approach, np.ones(1), law, tolerance=1e-12)[:, 0]
    slope = np.diff(q) / np.diff(approach[:, 0])
    assert slope[2] == pytest.approx(slope[1], rel=1e-6)
    assert slope[0] == pytest.approx(slope[1], rel=2e-3)


def test_the_potential_that_guards_each_step_has_the_gap_as_its_slope():
    C, rho, depths, length = problem(8)
    law = local_law(rho, depths, PAIR)
    approach = np.full(8, 15e-6)
    F = np.linspace(20.0, 900.0, 8) * length / 1e-3
    F[-1] = 2.0 * law.limit[-1] * length[-1]  # on the tangent

    def potential(F):
        gap = np.empty(8)
        pieces = law.level, law.half_slope, law.offset, law.energy
        return gaps(C, approach, length, np.log(law.limit), 1 / np.log(law.ratio), *pieces, F, gap)[0], gap

    gap = potential(F)[1]
    for i in range(8):
        h = 1e-4 * F[i] * np.eye(8)[i]
        slope = (potential(F + h)[0] - potential(F - h)[0]) / (2 * h[i])
        assert slope == pytest.approx(gap[i], rel=1e-5, abs=1e-12)


def test_hard_random_problems_all_converge():
    """Slices from a nanometre to millimetres long, stiff to soft bodies, wide gaps, loads in any order."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        n = int(rng.integers(1, 50))
        x = np.sort(rng.uniform(0, 1, n))
        C = rng.choice([0, 1e-10, 2e-9, 2e-8]) * np.exp(-rng.uniform(1, 60) * np.abs(np.subtract.outer(x, x)))
        C += rng.choice([0, 1e-9, 1e-8])
        depth = rng.uniform(0.8e-3, 3e-3, n)
        law = local_law(rng.uniform(2e-3, 20e-3, n), (depth, depth), PAIR)
        offset = rng.uniform(0, rng.choice([0, 1e-6, 50e-6]), n)
        approach = rng.permutation(10 ** rng.uniform(-9, -4.2, 12))[:, None] - offset
        slice_forces(C, approach, 10 ** rng.uniform(-9, -2.5, n), law, tolerance=1e-10)


def test_a_compliance_that_is_not_positive_raises():
    C, rho, depths, length = problem()
    law = local_law(rho, depths, PAIR)
    with pytest.raises(SolverError, match="residual"):
        slice_forces(-20 * C, np.full((1, len(length)), 20e-6), length, law, tolerance=1e-10)


def test_an_unreachable_tolerance_raises():
    C, rho, depths, length = problem()
    law = local_law(rho, depths, PAIR)
    with pytest.raises(SolverError, match="did not converge"):
        slice_forces(C, np.full((1, len(length)), 20e-6), length, law, tolerance=1e-30)


@pytest.mark.parametrize("size", [4, 8, 20, 96])
def test_elimination_by_tiles_solves_as_numpy_does(size):
    """Newton's steps would converge with a wrong elimination too, only more slowly."""
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size))
    matrix, right = root @ root.T + 1e-2 * np.eye(size), rng.normal(size=size)
    solved, factor = right.copy(), np.tril(matrix)
    assert factorize(factor, size)
    substitute(factor, solved, size)
    np.testing.assert_allclose(solved, np.linalg.solve(matrix, right), rtol=1e-6, atol=1e-9 * np.abs(solved).max())
    np.testing.assert_allclose(np.tril(factor), np.linalg.cholesky(matrix), atol=1e-9 * np.abs(matrix).max())
    assert not factorize(-np.eye(size), size)
