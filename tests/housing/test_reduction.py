"""The reduced housing against the full finite element model, both with structural damping η = 2ζ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, gmres

import nvhchain as nvh
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fem import RitzVectors, factorize
from nvhchain.fidelity import DRAFT, STANDARD, HousingFidelity
from nvhchain.housing import reduce_housing
from nvhchain.housing.casting.mesh import mounting_plane_faces
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.modes.seat_modes import SeatModes, seat_unknowns
from nvhchain.housing.reduction import (
    bending_wavelength,
    check_bending_resolution,
    check_thin_walls,
    held_matrices,
    left_uncorrected,
    reduce_mesh,
    state_errors,
)
from nvhchain.testing.bodies import reference_casting
from tests.housing.seat_motion import seat_displacement, seat_flexibility

F_MAX = 4000.0
"""Hz, the band for which conftest.py reduces the test housing."""


@pytest.fixture(scope="module")
def full(mesh, casting):
    K, M, T = held_matrices(mesh, casting)
    return K, M, T, seat_unknowns(K.shape[0], len(casting.bores))


def full_response(K, M, seats, force, frequency, loss_factor):
    """Displacement of the full model, (K(1 + jη) − ω²M) u = f, to a residual of 1e-9 of the load."""
    A = (K - (2 * np.pi * frequency) ** 2 * M).tocsr()
    load = np.zeros(K.shape[0], dtype=complex)
    load[seats] = force
    with factorize(A, symmetric_positive_definite=False) as factor:

        def undamped(x):
            real_and_imaginary = factor.solve(np.column_stack([x.real, x.imag]))
            return real_and_imaginary[:, 0] + 1j * real_and_imaginary[:, 1]

        # the undamped model as preconditioner: all but the resonant modes lie within η of one
        damped = A + 1j * loss_factor * K
        u, failed = gmres(damped, load, M=LinearOperator(A.shape, undamped, dtype=complex), rtol=1e-10, restart=60)
    assert not failed
    assert np.linalg.norm(damped @ u - load) < 1e-7 * np.linalg.norm(load)
    return u


@pytest.mark.slow
def test_forced_response_of_reduced_and_full_housing_agree_within_one_percent(full, casting, motion, reduced):
    K, M, T, seats = full
    rng = np.random.default_rng(8)
    faces = rng.choice(np.flatnonzero(~mounting_plane_faces(reduced.surface)), 40, replace=False)
    frequency = np.linspace(0.08, 1.0, 5) * F_MAX
    force = rng.standard_normal((5, len(seats))) + 1j * rng.standard_normal((5, len(seats)))
    at_seats = seat_displacement(reduced, frequency, force, structural=True)
    at_faces = face_displacement(reduced, frequency, force, structural=True)[:, faces]
    pick = (motion @ T)[faces]
    loss = 2 * casting.modal_damping
    u = np.array([full_response(K, M, seats, *line, loss) for line in zip(force, frequency, strict=True)])
    for got, exact in ((at_seats, u[:, seats]), (at_faces, (pick @ u.T).T)):
        assert np.linalg.norm(got - exact) < 0.01 * np.linalg.norm(exact)


def test_excluded_modes_are_needed_for_that_accuracy(full, casting, reduced):
    K, M, _, seats = full
    force = np.random.default_rng(8).standard_normal((1, len(seats))) + 0j
    exact = full_response(K, M, seats, force[0], 500.0, 2 * casting.modal_damping)[seats]
    bare = reduced.drop_ritz_vectors().replace(seat_residual=np.zeros_like(reduced.seat_residual))
    got = seat_displacement(bare, np.array([500.0]), force, structural=True)[0]
    assert np.linalg.norm(got - exact) > 0.1 * np.linalg.norm(exact)


def test_static_seat_flexibility_is_that_of_the_full_model(full, reduced):
    K, _, _, seats = full
    load = np.zeros((K.shape[0], len(seats)))
    load[seats, np.arange(len(seats))] = 1.0
    with factorize(K) as factor:
        exact = factor.solve(load)[seats]
    assert np.abs(seat_flexibility(reduced) - exact).max() < 1e-8 * np.abs(exact).max()


@pytest.mark.slow
def test_forces_and_moments_at_the_seats_move_the_reduced_housing_as_the_full_one(
    full, mesh, casting, surface, motion, reduced, fidelity
):
    K, M, T, _ = full
    finer = replace(fidelity, mode_ratio=2.0)
    tilting = reduce_mesh(replace(mesh, motions=5), casting, surface, lambda: motion, F_MAX, finer)
    seats = seat_unknowns(K.shape[0], len(casting.bores), 5)
    load = np.zeros((K.shape[0], len(seats)))
    load[seats, np.arange(len(seats))] = 1.0
    with factorize(K) as factor:
        exact = factor.solve(load)[seats]
    size = np.sqrt(np.outer(exact.diagonal(), exact.diagonal()))
    assert np.abs((seat_flexibility(tilting) - exact) / size).max() < 1e-7
    rng = np.random.default_rng(8)
    frequency = np.linspace(0.08, 1.0, 12) * F_MAX
    force = rng.standard_normal((12, len(seats))) * np.tile([1.0, 1.0, 1.0, 0.05, 0.05], len(casting.bores)) + 0j
    faces = rng.choice(np.flatnonzero(~mounting_plane_faces(reduced.surface)), 40, replace=False)
    loss = 2 * casting.modal_damping
    u = np.array([full_response(K, M, seats, *line, loss) for line in zip(force, frequency, strict=True)])
    expected = ((motion @ T)[faces] @ u.T).T
    found = face_displacement(tilting, frequency, force, structural=True)[:, faces]
    assert np.linalg.norm(found - expected) < 0.01 * np.linalg.norm(expected)
    pushed = np.delete(np.arange(len(seats)), [3, 4, 8, 9])
    alone = face_displacement(reduced, frequency, force[:, pushed], structural=True)[:, faces]
    assert np.linalg.norm(alone - expected) > 0.1 * np.linalg.norm(expected)
    same = seat_flexibility(reduced)
    assert np.abs(seat_flexibility(tilting.drop_tilts()) - same).max() < 1e-8 * same.max()


def test_modes_of_the_reduced_housing_are_mass_normalised_modes_of_the_full_one(full, reduced):
    K, M, _, seats = full
    frequency = reduced.natural_frequency[: reduced.mode_count]
    assert (np.diff(frequency) > 0).all()
    assert 1.4 * F_MAX * 0.8 < frequency[-1] < 1.4 * F_MAX
    # Rayleigh quotient of the static deflection under a seat force lies above the lowest mode, by not much
    load = np.zeros(K.shape[0])
    load[seats] = reduced.seat_shapes[0].ravel()
    with factorize(K) as factor:
        u = factor.solve(load)
    quotient = np.sqrt(u @ (K @ u) / (u @ (M @ u))) / (2 * np.pi)
    assert frequency[0] <= quotient < 1.1 * frequency[0]


def test_residual_flexibility_is_symmetric_and_has_no_negative_direction(reduced):
    count = len(reduced.names)
    residual = reduced.seat_residual.reshape(3 * count, -1)
    assert np.array_equal(residual, residual.T)
    values = np.linalg.eigvalsh(residual)
    assert values[0] > -1e-9 * values[-1]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:housing elements")
def test_corrected_frequencies_of_large_elements_are_those_of_smaller_ones():
    """Elements of 13 and 9 mm differ by 1.2 % (RMS) and, corrected, by 0.5 %. The correction is that of an infinitely
    fine mesh: both move by more than 2 %."""
    case = nvh.load_case(Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml")
    found = {}
    for size in (13e-3, 9e-3):
        for corrected in (False, True):
            knobs = HousingFidelity(
                element_size=size, mode_ratio=1.0, samples_per_face=1, corrected_frequencies=corrected
            )
            found[size, corrected] = reduce_housing(case.housing, f_max=6e3, surface_size=0.025, fidelity=knobs)
    frequency = {key: housing.natural_frequency[: housing.mode_count] for key, housing in found.items()}
    apart = {kind: rms(frequency[13e-3, kind] / frequency[9e-3, kind] - 1.0) for kind in (False, True)}
    assert apart[True] < 0.5 * apart[False]
    for size in (13e-3, 9e-3):
        moved = 1.0 - frequency[size, True] / frequency[size, False]
        assert (moved > 0.0).all()
        assert rms(moved) > 0.02
        assert 0.13 < rms(found[size, True].accuracy.frequency_error[: len(moved)]) / rms(moved) < 0.26


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_a_correction_keeps_rigid_modes_and_the_order_of_frequencies_with_their_shapes():
    shapes, none = np.arange(12.0).reshape(3, 4), RitzVectors(np.zeros(0), np.zeros((3, 0)))
    modes = SeatModes(np.array([0.0, 100.0, 101.0, 200.0]), shapes, none, none, none, np.arange(3), 200.0)
    errors = np.array([0.0, 0.005, 0.05, 0.0])
    lower, left = state_errors(modes, errors, errors, 1.5, corrected=True)
    np.testing.assert_allclose(lower.frequency, [0.0, 101 * np.sqrt(0.9), 100 * np.sqrt(0.99), 200.0])
    np.testing.assert_array_equal(lower.shapes, shapes[:, [0, 2, 1, 3]])
    moved = 1.0 - np.sqrt([1.0, 0.9, 0.99, 1.0])
    np.testing.assert_allclose(left, 0.15 * moved)
    _, left = state_errors(modes, errors, errors, 2.1, corrected=True)
    np.testing.assert_allclose(left, 0.22 * moved)
    _, left = state_errors(modes, errors, 0.75 * errors, 1.5, corrected=True)
    np.testing.assert_allclose(left, np.hypot(0.75 * 0.15, 0.25 * 0.4) * moved)
    wild, left = state_errors(modes, np.array([0.0, 0.0, 0.0, 0.7]), np.zeros(4), 1.5, corrected=True)
    np.testing.assert_allclose(wild.frequency[3], 200.0 * np.sqrt(0.4))  # not 0 Hz, which a rigid mode has
    np.testing.assert_allclose(left[3], 0.4 * (1.0 - np.sqrt(0.4)) + 0.4)
    same, left = state_errors(modes, errors, 0.0 * errors, 1.5, corrected=False)
    assert same is modes
    np.testing.assert_allclose(left, 1.4 * (1.0 - np.sqrt([1.0, 0.99, 0.9, 1.0])))


def test_ritz_vectors_are_corrected_as_modes_are_and_stay_above_them():
    shapes = np.arange(6.0).reshape(3, 2)
    ritz = RitzVectors(np.array([210.0, 220.0]), shapes)
    modes = SeatModes(np.array([100.0, 200.0]), shapes, ritz, ritz, ritz, np.arange(3), 205.0)
    lower, left = state_errors(modes, *[np.array([0.0, 0.0, 0.025, 0.095])] * 2, 1.5, corrected=True)
    np.testing.assert_allclose(lower.ritz.frequency, [200.0, 210 * np.sqrt(0.95)])
    np.testing.assert_array_equal(lower.ritz.shapes, shapes[:, ::-1])
    np.testing.assert_allclose(left[2:], 0.15 * (1 - np.sqrt([0.81, 0.95])))
    assert lower.plain is ritz


def test_long_elements_leave_more_of_the_correction():
    """Measured on walls of 2 to 8 mm up to 6.7 times."""
    found = [left_uncorrected(ratio) for ratio in (0.5, 1.6, 2.1, 2.6, 5.0)]
    assert found == pytest.approx([0.15, 0.15, 0.22, 0.29, 0.5])


def test_bending_wavelength_of_an_aluminium_plate():
    # B = 70e9 · 0.0055³ / (12 · (1 − 0.33²)) = 1089.1 N m, m'' = 14.85 kg/m²: c_B at 5 kHz = 518.6 m/s
    assert bending_wavelength(reference_casting(), 5000.0) == pytest.approx(0.10372, rel=1e-3)


def test_mesh_too_coarse_for_the_band_is_warned_of_with_the_frequency_it_is_good_for(recwarn):
    coarse = HousingFidelity(element_size=0.03)
    message = r"30 mm give 3\.5 .* 5000 Hz, 4 are needed: refine to 25\.9 mm or lower f_max to 37\d\d Hz, up to which"
    with pytest.warns(AccuracyWarning, match=message):
        check_bending_resolution(reference_casting(), 5000.0, coarse)
    check_bending_resolution(reference_casting(), 3700.0, coarse)
    assert not recwarn.list


def test_elements_much_longer_than_the_wall_is_thick_are_warned_of_with_the_error_and_the_size(recwarn):
    """Walls of 1 mm at standard fidelity: 803 Hz for a first mode of 497 Hz with elements of 4 mm, not corrected."""
    thin = replace(reference_casting(), wall=0.001)
    message = r"of 10\.5 mm in walls of 1 mm are 1\d times as long .* may come out {} % too high: refine to {} times"
    with pytest.warns(AccuracyWarning, match=message.format(77, 5)):
        check_thin_walls(thin, STANDARD.housing)
    with pytest.warns(AccuracyWarning, match=message.format(77, "3.5")):
        check_thin_walls(thin, replace(STANDARD.housing, corrected_frequencies=False))
    check_thin_walls(thin, HousingFidelity(element_size=0.005))
    check_thin_walls(reference_casting(), DRAFT.housing)
    assert not recwarn.list


def test_mesh_without_bending_waves_is_refused_with_remedy():
    with pytest.warns(AccuracyWarning):
        check_bending_resolution(
            reference_casting(), 14_900.0, HousingFidelity(element_size=0.03)
        )  # 2.03 per wavelength
    with pytest.raises(InputError, match=r"give 1\.\d+ per bending wavelength .* 16000 Hz, 4 are needed: refine to"):
        check_bending_resolution(reference_casting(), 16_000.0, HousingFidelity(element_size=0.03))
    with pytest.raises(InputError, match="refine to"):
        reduce_housing(reference_casting(), f_max=500e3, surface_size=0.02, fidelity=STANDARD.housing)


@pytest.mark.parametrize(("f_max", "size", "message"), [(-1.0, 0.02, "f_max"), (5e3, 0.0, "surface_size")])
def test_bad_arguments_are_refused(f_max, size, message):
    with pytest.raises(InputError, match=message):
        reduce_housing(reference_casting(), f_max=f_max, surface_size=size, fidelity=STANDARD.housing)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:housing elements of 30 mm")
def test_reduce_housing_reports_its_progress_and_names_the_seats(casting, fidelity):
    steps = []
    reduced = reduce_housing(
        casting,
        f_max=1700.0,
        surface_size=0.03,
        fidelity=fidelity,
        progress=lambda done, total: steps.append((done, total)),
    )
    assert [done for done, _ in steps] == list(range(6))
    assert {total for _, total in steps} == {5}
    assert reduced.names == ("A1", "A2")
    assert reduced.positions.tolist() == [list(bore.centre) for bore in casting.bores]
    assert (reduced.modal_damping == 0.015).all()
