"""GMRES and its patches against dense solutions."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import solve_direct, sphere, transfer_vectors
from nvhchain.acoustics.fused import engine
from nvhchain.acoustics.systems import iterative
from nvhchain.acoustics.systems.iterative import Patches, gmres
from nvhchain.errors import SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity
from nvhchain.testing import bodies

FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=4, solver="iterative")
DIRECT = replace(FIDELITY, solver="direct")


def well_conditioned(n=80, m=5):
    rng = np.random.default_rng(2)
    a = np.eye(n) + 0.3 * (rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n))) / np.sqrt(n)
    return a, rng.normal(size=(n, m)) + 1j * rng.normal(size=(n, m))


@pytest.fixture(scope="module")
def ribbed():
    """A box with a rib and a groove, 1000 vertices, at 1500 Hz: (surface, A)."""

    def taken_away(centre):
        x, y, z = centre
        return (z > 0.075 and not 0.1 < x < 0.125) or (z < 0.025 and y > 0.1)

    surface = bodies.box((0.25, 0.15, 0.1), 0.0125, remove=taken_away)
    a, _ = next(engine.systems(surface, [2 * np.pi * 1500.0 / 343.0], FIDELITY))
    return surface, a


@pytest.mark.parametrize("cycle", [4, 50])
def test_gmres_reaches_the_residual_in_every_column_also_after_restarts(monkeypatch, cycle):
    monkeypatch.setattr(iterative, "CYCLE", cycle)
    monkeypatch.setattr(iterative, "COLUMNS", 3)
    a, rhs = well_conditioned()
    rhs[:, 1] = 0.0
    rhs[:, 2] *= 1e-6
    x = gmres(lambda v: a @ v, lambda v: v, rhs, residual=1e-11, iterations=100)
    residual = np.linalg.norm(rhs - a @ x, axis=0)
    assert (residual <= 1e-11 * np.linalg.norm(rhs, axis=0)).all()
    assert (x[:, 1] == 0).all()
    one = gmres(lambda v: a @ v, lambda v: v, rhs[:, 0], residual=1e-11, iterations=100)
    assert one.shape == (80,)
    assert np.abs(one - x[:, 0]).max() < 1e-9


def test_gmres_ends_where_the_krylov_space_holds_the_solution():
    rhs = np.eye(6)[:, :2].astype(complex)
    assert np.abs(gmres(lambda v: 2 * v, lambda v: v, rhs, residual=1e-12, iterations=5) - rhs / 2).max() < 1e-15


@pytest.mark.parametrize("broken", ["slow", "singular", "nan"])
def test_gmres_that_does_not_converge_raises_with_residual_and_iterations(broken):
    a, rhs = well_conditioned()
    a = {"slow": a, "singular": np.zeros_like(a), "nan": np.full_like(a, np.nan)}[broken]
    with pytest.raises(SolverError, match=r"residual of .* in \d+ iterations, 1e-12 in 3 were asked for: choose"):
        gmres(lambda v: a @ v, lambda v: v, rhs, residual=1e-12, iterations=3)


def iterations(matrix, precondition, rhs):
    count = []
    x = gmres(lambda v: count.append(1) or matrix @ v, precondition, rhs, residual=1e-10, iterations=100)
    assert np.linalg.norm(rhs - matrix @ x) < 1e-10 * np.linalg.norm(rhs)
    return len(count)


def test_patches_make_gmres_converge_in_few_iterations_in_both_directions(ribbed):
    surface, a = ribbed
    patches = Patches(surface.vertices)
    for rows in np.array_split(np.random.default_rng(0).permutation(len(a)), 7):
        patches.fill(rows, a[rows])
    rhs = np.random.default_rng(1).normal(size=(len(a), 3)) + 0j
    for matrix, near in ((a, patches.apply), (a.T, patches.apply_transposed)):
        assert iterations(matrix, near, rhs) <= min(24, 0.5 * iterations(matrix, lambda v: v, rhs))


def test_a_body_smaller_than_a_patch_is_solved_in_one_step():
    surface = sphere(0.1, 1)
    a, _ = next(engine.systems(surface, [10.0], FIDELITY))
    patches = Patches(surface.vertices)
    patches.fill(np.arange(len(a)), a)
    x = patches.apply_transposed(np.ones((len(a), 1), dtype=complex))
    assert np.abs(a.T @ x - 1).max() < 1e-12


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_iterative_transfer_vectors_meet_the_identity_and_the_direct_ones(ribbed, air):
    surface, _ = ribbed
    points, frequency = bodies.shell(6, 0.8), np.array([150.0, 1500.0])
    atv = transfer_vectors(surface, points, frequency, air=air, fidelity=FIDELITY)
    direct = transfer_vectors(surface, points, frequency, air=air, fidelity=DIRECT)
    assert np.abs(atv.vectors - direct.vectors).max() < 1e-8 * np.abs(direct.vectors).max()
    rng = np.random.default_rng(3)
    velocity = SurfaceVelocity(frequency, rng.normal(size=(2, len(surface.triangles))) + 0j, surface)
    solved = solve_direct(velocity, points, air=air, fidelity=FIDELITY).pressure
    by_hand = np.einsum("fmi,fi->fm", atv.vectors, velocity.normal_velocity)
    assert np.abs(by_hand - solved).max() < 1e-8 * np.abs(solved).max()


@pytest.mark.slow
def test_a_hardly_open_chamber_near_its_resonance_still_converges(air):
    """A box around a chamber that a hole of two elements opens; its walls are two elements thick."""

    def taken_away(centre):
        x, y, z = np.abs(centre - [0.1, 0.075, 0.075])
        return max(x - 0.03, y, z) < 0.05 or (max(x, y) < 0.0125 and centre[2] > 0.075)

    surface = bodies.box((0.2, 0.15, 0.15), 0.0125, remove=taken_away)
    frequency, points = np.array([1072.0]), bodies.shell(3, 0.6)
    found = transfer_vectors(surface, points, frequency, air=air, fidelity=FIDELITY).vectors
    exact = transfer_vectors(surface, points, frequency, air=air, fidelity=DIRECT).vectors
    assert np.abs(found - exact).max() < 1e-7 * np.abs(exact).max()
