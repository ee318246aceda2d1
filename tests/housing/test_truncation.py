"""Estimated against true error of a reduced housing; the number of modes that a tolerance asks for."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError, SolverError
from nvhchain.fem import factorize
from nvhchain.handoff import HousingAccuracy
from nvhchain.housing import reduce_housing, reduction
from nvhchain.housing.casting.mesh import mesh_casting
from nvhchain.housing.modes.response import face_displacement, seat_displacement
from nvhchain.housing.modes.seat_modes import seat_unknowns
from nvhchain.housing.modes.truncation import (
    exclude_modes,
    fewest_modes,
    truncation_error,
    truncation_errors,
    truncation_report,
    worst_level,
)
from nvhchain.housing.reduction import held_matrices

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


def test_estimate_lies_within_a_factor_of_2_of_the_true_error(reduced, rich):
    (seats, faces), (true_seats, true_faces) = both(reduced), both(rich)
    estimate = truncation_error(reduced, F_MAX)
    assert 0.5 < estimate.faces / relative(faces, true_faces, reduced.surface.areas) < 2
    assert 0.8 < estimate.seats / relative(seats, true_seats) < 1.25


@pytest.mark.parametrize("keep", [2, 4, 6, 8])
def test_estimate_of_a_part_of_the_modes_is_within_a_quarter(reduced, rich, keep):
    few = exclude_modes(reduced, keep)
    (seats, faces), (true_seats, true_faces) = both(few), both(rich)
    estimate = truncation_error(reduced, F_MAX, modes=keep)
    assert relative(faces, true_faces, few.surface.areas) == pytest.approx(estimate.faces, rel=0.25)
    assert relative(seats, true_seats) == pytest.approx(estimate.seats, rel=0.25)
    # when those left out are known by two moments only, it is still of the right order
    assert 0.25 < truncation_error(few, F_MAX).faces / relative(faces, true_faces, few.surface.areas) < 2.1


def test_estimate_at_every_line_follows_the_true_error(reduced, rich):
    faces, true = both(reduced)[1], both(rich)[1]
    by_line = [of.reshape(len(LINES), -1, of.shape[1]) for of in (faces, true)]
    weight = reduced.surface.areas
    truth = np.array([relative(got, exact, weight) for got, exact in zip(*by_line, strict=True)])
    estimate = truncation_errors(reduced, LINES)
    ratio = estimate / truth
    assert ((ratio > 0.4) & (ratio < 2.5)).all()
    assert estimate[-1] > 10 * estimate[len(LINES) // 8]
    # over the band the lines add up as energies do
    level = np.array([np.sqrt((np.abs(exact) ** 2 * weight).sum()) for exact in by_line[1]])
    total = np.sqrt(((estimate * level) ** 2).sum() / (level**2).sum())
    assert total == pytest.approx(truncation_error(reduced, F_MAX).faces, rel=0.1)  # 50 lines of 350


def test_static_flexibility_does_not_change_when_modes_are_left_out(reduced):
    few = exclude_modes(reduced, 3)
    force = np.eye(3 * len(reduced.names), dtype=complex)
    still = np.zeros(len(force))
    for respond in (seat_displacement, face_displacement):
        exact = respond(reduced, still, force)
        assert np.abs(respond(few, still, force) - exact).max() < 1e-12 * np.abs(exact).max()


def test_residual_mass_of_what_is_left_is_that_of_the_full_model(reduced, mesh, casting):
    few = exclude_modes(reduced, 5)
    K, M, _ = held_matrices(mesh, casting)
    seats = seat_unknowns(K.shape[0], len(casting.bores))
    load = np.zeros((K.shape[0], len(seats)))
    load[seats, np.arange(len(seats))] = 1.0
    with factorize(K) as factor:
        static = factor.solve(load)
    kept = few.seat_shapes.reshape(5, -1) / (2 * np.pi * few.natural_frequency[:, None]) ** 2
    exact = static.T @ (M @ static) - kept.T @ kept
    assert np.abs(few.accuracy.residual_mass.reshape(exact.shape) - exact).max() < 1e-6 * np.abs(exact).max()


def test_fewest_modes_meet_the_tolerance_and_one_less_does_not(reduced):
    tolerance = 1.5 * worst_level(reduced, F_MAX)
    keep = fewest_modes(reduced, F_MAX, tolerance)
    in_band = (reduced.natural_frequency <= F_MAX).sum()
    assert in_band < keep < len(reduced.natural_frequency)
    report = truncation_report(reduced, F_MAX, modes=keep)
    assert max(report.truncation_error_db, *report.truncation_error_at_db) <= tolerance
    assert worst_level(reduced, F_MAX, modes=keep - 1) > tolerance
    assert fewest_modes(reduced, F_MAX, 1e-6) is None


def test_modes_in_the_band_are_kept_whatever_the_tolerance(reduced):
    in_band = (reduced.natural_frequency <= F_MAX).sum()
    assert in_band > 1
    assert fewest_modes(reduced, F_MAX, 20.0) == in_band


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:housing elements of 30 mm")
def test_free_housing_keeps_its_surface_velocity_to_the_tolerance_at_every_line(casting, fidelity, monkeypatch):
    free = replace(casting, bolts=0)
    mesh = mesh_casting(free, fidelity)
    monkeypatch.setattr(reduction, "mesh_casting", lambda *_: mesh)
    exact = reduce_housing(free, f_max=F_MAX, surface_size=0.03, fidelity=replace(fidelity, mode_ratio=2.0))
    tolerance = 2.0
    asked = replace(fidelity, mode_ratio=0.5, truncation_tolerance_db=tolerance)
    found = reduce_housing(free, f_max=F_MAX, surface_size=0.03, fidelity=asked)
    assert (found.natural_frequency <= F_MAX).sum() == (exact.natural_frequency <= F_MAX).sum() > 6
    velocity, true = both(found)[1], both(exact)[1]
    weight = exact.surface.areas
    level = [10 * np.log10((np.abs(v) ** 2 @ weight).reshape(len(LINES), -1).sum(axis=1)) for v in (velocity, true)]
    assert np.abs(level[0] - level[1]).max() < tolerance
    assert 20 * np.log10(1 + relative(velocity, true, weight)) < tolerance
    estimate, truth = truncation_error(found, F_MAX).faces, relative(velocity, true, weight)
    assert 0.5 < estimate / truth < 2


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:housing elements of 30 mm")
def test_tolerance_in_decibel_decides_how_many_modes_a_reduction_takes(casting, fidelity, mesh, surface, monkeypatch):
    monkeypatch.setattr(reduction, "mesh_casting", lambda *_: mesh)
    monkeypatch.setattr(reduction, "radiating_surface", lambda *_: surface)
    f_max = 1700.0
    found = {}
    for tolerance in (1.0, 0.3):
        asked = replace(fidelity, mode_ratio=2.5, truncation_tolerance_db=tolerance)
        reduced = reduce_housing(casting, f_max=f_max, surface_size=0.022, fidelity=asked)
        at = reduced.accuracy.truncation_error_at_db
        assert reduced.accuracy.truncation_frequency.tolist() == pytest.approx([212.5, 425.0, 850.0, 1700.0])
        assert 0 < at[0] < at[1] < at[2]  # no mode in the band: 1700 Hz is nearly resonant
        assert max(reduced.accuracy.truncation_error_db, *at) <= tolerance
        found[tolerance] = len(reduced.natural_frequency)
    assert found[1.0] < found[0.3]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:housing elements of 30 mm")
def test_tolerance_that_no_number_of_modes_reaches_is_an_error(casting, fidelity, reduced, monkeypatch):
    monkeypatch.setattr(reduction, "reduce_mesh", lambda *_, **__: reduced)
    asked = replace(fidelity, truncation_tolerance_db=1e-9)
    with pytest.raises(SolverError, match="not reached with modes to"):
        reduce_housing(casting, f_max=1700.0, surface_size=0.03, fidelity=asked)


def test_residual_flexibility_that_is_not_positive_is_an_error_of_the_solver(reduced):
    with pytest.raises(SolverError, match="is not positive: is the housing a mechanism"):
        truncation_error(reduced.replace(seat_residual=-reduced.seat_residual), F_MAX)


def test_housing_reduced_elsewhere_and_rigid_modes_are_refused(reduced):
    with pytest.raises(InputError, match="states no residual_mass"):
        truncation_error(reduced.replace(accuracy=HousingAccuracy()), F_MAX)
    free = reduced.replace(natural_frequency=np.concatenate([[0.0], reduced.natural_frequency[1:]]))
    with pytest.raises(InputError, match="rigid mode"):
        exclude_modes(free, 0)
