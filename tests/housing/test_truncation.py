"""Stated against true error of a reduced housing; Ritz vectors in place of excluded modes."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.handoff import HousingAccuracy
from nvhchain.housing.modes import seat_modes as seat_modes_module
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.modes.truncation import truncation_errors
from nvhchain.housing.reduction import reduce_mesh
from tests.housing.seat_motion import seat_displacement, seat_flexibility

F_MAX = 4000.0
"""Hz, the band for which conftest.py reduces the test housing."""

LINES = F_MAX * (1 / 8 + 7 / 8 * (np.arange(50) + 0.5) / 50)
"""Hz, over the three octaves that are judged."""


def relative(got, exact, weight=1.0):
    """RMS of a difference relative to RMS of the exact values; the last axis is weighted."""
    return np.sqrt((np.abs(got - exact) ** 2 * weight).sum() / (np.abs(exact) ** 2 * weight).sum())


def both(housing):
    """Velocity at seats and faces under unit forces at every seat, at all lines."""
    count = 3 * len(housing.names)
    force = np.tile(np.eye(count, dtype=complex), (len(LINES), 1))
    frequency = np.repeat(LINES, count)
    rate = 2j * np.pi * frequency[:, None]
    return rate * seat_displacement(housing, frequency, force), rate * face_displacement(housing, frequency, force)


def stated(housing):
    """Stated error of the faces, relative."""
    return 10 ** (housing.accuracy.truncation_error_db / 20) - 1


@pytest.fixture(scope="module")
def made(mesh, casting, surface, motion, fidelity):
    """The housing with modes to some multiple of the band, with terms of the static series."""

    def make(ratio, terms=2):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(seat_modes_module, "_TERMS", terms)
            return reduce_mesh(mesh, casting, surface, lambda: motion, F_MAX, replace(fidelity, mode_ratio=ratio))

    return make


@pytest.mark.parametrize("ratio", [0.8, 1.1, 1.4])
def test_stated_error_is_the_true_one_within_a_factor_of_two(made, rich, ratio):
    housing = made(ratio)
    truth = relative(both(housing)[1], both(rich)[1], rich.surface.areas)
    assert 0.5 < stated(housing) / truth < 2


def test_stated_error_at_every_line_follows_the_true_one(reduced, rich):
    faces, true = both(reduced)[1], both(rich)[1]
    by_line = [of.reshape(len(LINES), -1, of.shape[1]) for of in (faces, true)]
    truth = np.array([relative(got, exact, rich.surface.areas) for got, exact in zip(*by_line, strict=True)])
    estimate = truncation_errors(reduced, LINES)
    upper = LINES > F_MAX / 2  # below, both are some 1e-5
    assert ((estimate / truth)[upper] > 0.4).all()
    assert ((estimate / truth)[upper] < 2.5).all()
    assert (estimate[~upper] < 1e-3).all()
    assert estimate[-1] > 15 * estimate[len(LINES) // 8]


def test_ritz_vectors_of_two_terms_err_less_than_those_of_one_and_than_static_ones(made, rich):
    """At the seats and on the faces; modes to 1.2 times the band."""
    two, one = made(1.2), made(1.2, terms=1)
    gone = two.drop_ritz_vectors()
    static = gone.replace(
        seat_residual=(seat_flexibility(two) - modal_flexibility(gone)).reshape(gone.seat_residual.shape)
    )
    seats, faces = both(rich)
    errors = [relative(both(housing)[0], seats) for housing in (static, one, two)]
    assert errors[2] < 0.5 * errors[1] < 0.2 * errors[0]
    weight = rich.surface.areas
    assert relative(both(two)[1], faces, weight) < 0.5 * relative(both(one)[1], faces, weight)


def modal_flexibility(housing):
    """Static share of the modes and Ritz vectors alone, m/N."""
    omega2 = (2 * np.pi * housing.natural_frequency) ** 2
    return housing.flat_shapes.T @ (housing.flat_shapes / omega2[:, None])


@pytest.mark.slow
def test_static_flexibility_is_exact_with_any_number_of_modes(made, rich):
    force = np.eye(3 * len(rich.names), dtype=complex)
    still = np.zeros(len(force))
    for respond in (seat_displacement, face_displacement):
        exact = respond(rich, still, force)
        for ratio in (0.8, 1.4):
            assert np.abs(respond(made(ratio), still, force) - exact).max() < 1e-7 * np.abs(exact).max()


def test_vectors_far_above_the_band_move_statically(made, monkeypatch):
    """They move no line of the band."""
    housing = made(1.4)
    monkeypatch.setattr(seat_modes_module, "STATIC", np.inf)
    whole = made(1.4)
    assert whole.ritz_vectors > housing.ritz_vectors > 0
    assert not whole.seat_residual.any()
    lowest = housing.natural_frequency[housing.mode_count]
    assert housing.natural_frequency[-1] < 2.5 * lowest < whole.natural_frequency[-1]
    for found, exact in zip(both(housing), both(whole), strict=True):
        assert relative(found, exact) < 2e-3


def test_vectors_stay_above_the_modes_and_have_their_damping(reduced, casting):
    natural = reduced.mode_count
    assert reduced.natural_frequency[natural - 1] <= 1.4 * F_MAX < reduced.natural_frequency[natural]
    assert (reduced.modal_damping == casting.modal_damping).all()
    assert (reduced.accuracy.frequency_error[natural:] > 0).all()
    few = reduced.drop_ritz_vectors()
    assert (few.mode_count, few.ritz_vectors) == (natural, None)
    assert len(few.accuracy.frequency_error) == natural
    assert few.accuracy.truncation_error_db is None


def test_a_housing_that_states_no_error_is_refused(reduced):
    with pytest.raises(InputError, match="states no truncation error"):
        truncation_errors(reduced.replace(accuracy=HousingAccuracy()), LINES)
    with pytest.raises(InputError, match="ritz_vectors = 999: there are"):
        reduced.replace(ritz_vectors=999)
