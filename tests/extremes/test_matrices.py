"""Matrices whose entries span many decades: solutions and modes against closed forms, or refused."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from nvhchain.acoustics import radiate, sphere, transfer_vectors
from nvhchain.fem import factorize, lowest_modes
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity
from nvhchain.testing.scales import powers

BALL = sphere(1.0, 2)


def chain(stiffness):
    """Springs (n,) N/m one after the other from a wall: the matrix of their ends."""
    diagonal = stiffness + np.append(stiffness[1:], 0.0)
    return sp.csr_matrix(sp.diags([-stiffness[1:], diagonal, -stiffness[1:]], [-1, 0, 1]))


@given(
    count=st.integers(2, 400), scale=powers(1e-9, 1e15), decades=st.floats(0.0, 8.0), seed=st.integers(0, 999),
    engine=st.sampled_from(["auto", "superlu"]),
)  # fmt: skip
def test_a_chain_of_springs_of_any_stiffness_is_as_long_as_its_springs_say(tried, count, scale, decades, seed, engine):
    """u = F Σ 1/k.  Sums of neighbouring stiffnesses are rounded, which the condition of the chain enlarges: (4n/π)²
    for equal springs (eigenvalues 4 k sin²(π (2i − 1)/(4n + 2))), times the ratio of the largest to the smallest."""
    stiffness = scale * 10 ** (decades * np.random.default_rng(seed).random(count))
    factor = tried(factorize, chain(stiffness), engine=engine)
    if factor is None:
        return
    with factor:
        moved = factor.solve(np.append(np.zeros(count - 1), 1.0))
    exact = np.cumsum(1.0 / stiffness)
    lost = np.finfo(float).eps * (4 * count / np.pi) ** 2 * stiffness.max() / stiffness.min()
    assert np.abs(moved - exact).max() < (1e-12 + lost) * exact[-1]


@given(
    pairs=st.integers(1, 300), decades=st.floats(0.0, 6.0), mass=powers(1e-9, 1e6), lowest=powers(1e-3, 1e5),
    seed=st.integers(0, 999),
)  # fmt: skip
def test_pairs_of_masses_over_many_decades_have_their_frequencies(tried, pairs, decades, mass, lowest, seed):
    """Each a mass m on a spring k to the wall with another m on another k: ω² = k/m (3 ∓ √5)/2."""
    rng = np.random.default_rng(seed)
    masses = mass * 10 ** (decades * rng.random(pairs))
    omega = 2 * np.pi * lowest * 10 ** (decades * rng.random(pairs))
    stiffness = masses * omega**2
    K = sp.block_diag([k * np.array([[2.0, -1.0], [-1.0, 1.0]]) for k in stiffness], format="csr")
    M = sp.diags(np.repeat(masses, 2), format="csr")
    exact = np.sort(np.concatenate([omega * np.sqrt((3 + way * 5**0.5) / 2) for way in (-1, 1)]) / (2 * np.pi))
    wanted = rng.integers(1, min(2 * pairs, 24) + 1)
    top = exact[wanted - 1] * 1.0001
    wanted = int((exact <= top).sum())
    found = tried(lowest_modes, K, M, top)
    if found is None:
        return
    frequency, shapes = found
    assert len(frequency) == wanted
    assert np.abs(frequency - exact[:wanted]).max() < 1e-6 * exact[wanted - 1]
    assert np.abs(shapes.T @ (M @ shapes) - np.eye(wanted)).max() < 1e-6


@pytest.mark.slow
@given(ka=powers(1e-3, 4.0), scale=powers(1e-4, 1e3), away=powers(0.05, 1e4), amplitude=powers(1e-9, 1e9))
def test_single_precision_is_double_precision_to_four_digits(tried, ka, scale, away, amplitude):
    """What a source inside the ball's velocity pattern gives: a monopole and a dipole, of one size."""
    surface = BALL.replace(vertices=scale * BALL.vertices)
    frequency = [ka * 343.0 / (2 * np.pi * scale)]
    pattern = amplitude * (1.0 + BALL.normals[:, 2] / max(ka, 0.1))[None, :].astype(complex)
    velocity = SurfaceVelocity(frequency, pattern, surface)
    point = scale * (1 + away) * np.array([[0.6, 0.0, 0.8]])
    pressures = []
    for precision in ("double", "single"):
        knobs = AcousticsFidelity(elements_per_wavelength=4.5, masters=8, precision=precision)
        vectors = tried(transfer_vectors, surface, point, frequency, fidelity=knobs)
        if vectors is None:
            return
        pressures.append(radiate(vectors, velocity, fidelity=knobs).pressure)
    assert np.abs(pressures[1] - pressures[0]).max() < 1e-4 * np.abs(pressures[0]).max()
