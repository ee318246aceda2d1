"""Craig–Bampton matrices of the test housing against the full model and against grounded modes with residual."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import InputError
from nvhchain.housing.exchange.craig_bampton import craig_bampton
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.reduction import held_matrices
from tests.housing.seat_motion import seat_flexibility

F_MAX = 4000.0


@pytest.fixture(scope="module")
def matrices(mesh, casting, motion):
    K, M, T = held_matrices(mesh, casting)
    return K, M, sp.csr_matrix(motion @ T)


@pytest.fixture(scope="module")
def exchange(matrices, reduced):
    return craig_bampton(*matrices, 4.0 * F_MAX, names=reduced.names, positions=reduced.positions)


def translations(exchange):
    return np.concatenate([6 * seat + np.arange(3) for seat in range(len(exchange.names))])


@pytest.mark.slow
def test_static_flexibility_of_the_seats_is_exact(exchange, reduced):
    flexibility = np.linalg.inv(exchange.stiffness[exchange.seats, exchange.seats])
    at = translations(exchange)
    exact = seat_flexibility(reduced)
    assert np.abs(flexibility[np.ix_(at, at)] - exact).max() < 1e-8 * np.abs(exact).max()


def test_natural_frequencies_lie_above_those_of_the_full_model_by_little(exchange, reduced):
    values = scipy.linalg.eigh(exchange.stiffness, exchange.mass, eigvals_only=True)
    frequency = np.sqrt(values) / (2 * np.pi)
    band = reduced.natural_frequency[reduced.natural_frequency < F_MAX]
    excess = frequency[: len(band)] / band - 1
    assert (excess > -1e-9).all()
    assert excess.max() < 0.0025
    assert exchange.interface_frequency[0] > reduced.natural_frequency[0]


@pytest.mark.slow
def test_response_is_that_of_the_default_reduction_which_is_the_closer_one(exchange, matrices, reduced, rich):
    def error(exchange):
        at, K, M = translations(exchange), exchange.stiffness, exchange.mass
        difference = 0.0
        for f, load, face in zip(frequency, force, faces, strict=True):
            full = np.zeros(len(K), dtype=complex)
            full[at] = load
            u = np.linalg.solve(K * (1 + 1j * loss) - (2 * np.pi * f) ** 2 * M, full)
            difference += np.linalg.norm(exchange.motion @ u - face) ** 2
        return np.sqrt(difference) / np.linalg.norm(faces)

    frequency = np.linspace(0.08, 1.0, 25) * F_MAX
    force = np.random.default_rng(3).standard_normal((25, 3 * len(reduced.names))) + 0j
    loss = 2 * reduced.modal_damping[0]
    faces = face_displacement(rich, frequency, force, structural=True)
    few = craig_bampton(*matrices, 1.5 * F_MAX, names=reduced.names, positions=reduced.positions)
    default = np.linalg.norm(face_displacement(reduced, frequency, force, structural=True) - faces)
    assert error(exchange) < 0.04
    assert error(exchange) < error(few) / 5
    # with ten modes the default is closer than Craig–Bampton with 57
    assert default / np.linalg.norm(faces) < error(exchange) / 3


def test_seats_and_outputs_that_do_not_fit_are_refused(matrices):
    K, M, to_faces = matrices
    with pytest.raises(InputError, match="do not fit"):
        craig_bampton(K, M, to_faces[:, :-1], F_MAX, names=("A1",), positions=np.zeros((1, 3)))
    with pytest.raises(InputError, match="0 seats"):
        craig_bampton(K, M, to_faces, F_MAX, names=(), positions=np.zeros((0, 3)))
