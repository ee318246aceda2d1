"""Radiation resistance in modal coordinates against the power of one velocity at a time, and closed forms."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import spherical_jn, spherical_yn

from nvhchain.acoustics import equivalent_radiated_power, sound_power, sphere
from nvhchain.acoustics.radiation.modal_power import (
    loaded_bearings,
    modal_power,
    power_from_waves,
)
from nvhchain.acoustics.solutions import quantities
from nvhchain.acoustics.solutions.functions import Adaptive, radiation_resistance
from nvhchain.acoustics.solutions.quantities import SurfaceShapes, housing_shapes
from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane
from nvhchain.acoustics.waves.multipoles import waves_from_middle
from nvhchain.errors import AccuracyWarning, InputError, ResourceError, SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity
from nvhchain.housing import respond
from nvhchain.testing import bodies
from nvhchain.testing import hand_offs as cases

MASTERS = np.linspace(100.0, 2000.0, 16)
LINES = np.linspace(110.0, 1990.0, 23)

pytestmark = pytest.mark.filterwarnings("ignore:the parts of the motion cancel")


def decibel(ratio):
    return 10 * np.log10(ratio)


def harmonics(body):
    """Real spherical harmonics up to the second degree at the centroids, (n_face, 9)."""
    x, y, z = (body.centroids / np.linalg.norm(body.centroids, axis=1, keepdims=True)).T
    return np.stack([0 * x + 1, x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1], axis=1)


@pytest.fixture(scope="module")
def ball():
    return sphere(0.1, 2)


@pytest.fixture(scope="module")
def resistance(ball, air, coarse):
    return radiation_resistance(SurfaceShapes(ball, harmonics(ball)), MASTERS, air=air, fidelity=coarse)


def random_velocity(lines, columns, seed=2):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((len(lines), columns)) + 1j * rng.standard_normal((len(lines), columns))


def test_power_at_the_masters_is_that_of_the_velocity_itself(ball, resistance, air, coarse):
    velocity = random_velocity(MASTERS, 9)
    exact = sound_power(SurfaceVelocity(MASTERS, velocity @ harmonics(ball).T, ball), air=air, fidelity=coarse).power
    assert power_from_waves(resistance, MASTERS, velocity, fidelity=coarse).power == pytest.approx(exact, rel=1e-8)


@pytest.mark.filterwarnings("ignore:interpolation between")
def test_error_of_motions_that_cancel_is_that_of_the_velocity_itself(ball, air, coarse):
    """At the masters but for the extent and area that carry the pressure, which are those of every shape by itself (6 %
    less here); half way between two within what a straight line over f⁴ leaves."""
    masters = np.array([300.0, 500.0, 700.0, 900.0])
    shapes = np.where(ball.centroids[:, :1] + 0.5 * ball.centroids[:, 1:2] > 0, 1.0, 0.2) * harmonics(ball)[:, :4]
    found = radiation_resistance(SurfaceShapes(ball, shapes), masters, air=air, fidelity=coarse)
    velocity = random_velocity(masters, 4)[:1]
    for line, within in ((300.0, 0.1), (900.0, 0.1), (600.0, 0.3)):
        at = np.array([line])
        direct = sound_power(SurfaceVelocity(at, velocity @ shapes.T, ball), air=air, fidelity=coarse)
        told = power_from_waves(found, at, velocity, fidelity=coarse).accuracy.cancellation_error_db
        assert told == pytest.approx(direct.accuracy.cancellation_error_db, rel=within)


def error_between_masters(body, masters, lines, plane, air, coarse):
    """Largest error of the power between masters, dB, and its estimate."""
    few = radiation_resistance(SurfaceShapes(body, harmonics(body)), masters, air=air, fidelity=coarse, plane=plane)
    velocity = random_velocity(lines, 9)
    moving = SurfaceVelocity(lines, velocity @ harmonics(body).T, body)
    exact = sound_power(moving, air=air, fidelity=coarse, plane=plane).power
    got = power_from_waves(few, lines, velocity, fidelity=coarse)
    return np.abs(decibel(got.power / exact)).max(), got.accuracy.interpolation_error_db


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:interpolation between")
@pytest.mark.parametrize("plane", [None, RigidPlane((0, 0, -0.15), (0, 0, 1))], ids=["free", "plane"])
def test_power_between_masters_within_its_estimate(ball, air, coarse, plane):
    masters = np.linspace(100.0, 2000.0, 8 if plane is None else 16)
    truth, estimate = error_between_masters(ball, masters, LINES, plane, air, coarse)
    assert truth < 0.05
    assert truth / 10 < estimate < max(10 * truth, 1e-3)


@pytest.mark.filterwarnings("ignore:interpolation between")
@pytest.mark.parametrize("masters", [(50.0, 90.0), (500.0, 900.0), (2000.0, 2600.0)], ids=str)
def test_two_masters_say_what_a_body_of_that_size_lets_expect(ball, air, coarse, masters):
    """A pulsating ball, whose sound turns on its way, and a quadrupole, which grows with f³ where the ball is small."""
    shapes, lines = harmonics(ball)[:, [0, 4]], np.linspace(*masters, 7)
    few, truth = (
        radiation_resistance(SurfaceShapes(ball, shapes), at, air=air, fidelity=coarse) for at in (masters, lines)
    )
    for column in np.eye(2, dtype=complex):
        velocity = np.tile(column, (7, 1))
        exact = power_from_waves(truth, lines, velocity, fidelity=coarse)
        got = power_from_waves(few, lines, velocity, fidelity=coarse)
        error = 2 * np.abs(decibel(got.power / exact.power)).max()
        assert exact.accuracy.interpolation_error_db == 0.0
        assert 0.4 * error < got.accuracy.interpolation_error_db < 30 * error
    alone = power_from_waves(few, np.array(masters[:1]), np.eye(2)[:1], fidelity=coarse)
    assert alone.accuracy.interpolation_error_db == 0.0


def test_power_high_above_a_plane_between_masters_within_its_estimate(air, coarse):
    """There the waves are those of body and image, which must be smooth in frequency down to 0 Hz too."""
    plane, body = RigidPlane((0, 0, -0.5), (0, 0, 1)), sphere(0.1, 1)
    assert waves_from_middle(body, plane)
    masters, lines = np.linspace(50.0, 1000.0, 24), np.linspace(60.0, 990.0, 12)
    truth, estimate = error_between_masters(body, masters, lines, plane, air, coarse)
    assert truth < 0.03
    assert truth / 10 < estimate < max(10 * truth, 1e-3)


def test_harmonics_of_a_sphere_radiate_with_the_efficiency_of_their_degree(resistance, air, coarse):
    """σ_n = 1/|ka h_n'(ka)|² for each of the 2n + 1 harmonics of a degree."""
    frequency = np.array([150.0, 1000.0])
    ka = 2 * np.pi * frequency * 0.1 / air.speed_of_sound
    for column, degree in enumerate((0, 1, 1, 1, 2, 2, 2, 2, 2)):
        velocity = np.tile(np.eye(9)[column], (2, 1))
        power = power_from_waves(resistance, frequency, velocity, fidelity=coarse).power
        efficiency = power / (0.5 * resistance.plane_wave_resistance[column, column])
        slope = spherical_jn(degree, ka, True) - 1j * spherical_yn(degree, ka, True)
        assert decibel(efficiency * np.abs(ka * slope) ** 2) == pytest.approx(np.zeros(2), abs=0.15)
        if degree == 0:
            exact = 0.5 * air.impedance * 4 * np.pi * 0.01 * ka**2 / (1 + ka**2)
            assert decibel(power[0] / exact[0]) == pytest.approx(0.0, abs=0.05)


@pytest.mark.filterwarnings("ignore:equivalent radiated power")
def test_plane_wave_resistance_gives_the_equivalent_radiated_power(ball, resistance, air):
    velocity = random_velocity(LINES, 9)
    exact = equivalent_radiated_power(SurfaceVelocity(LINES, velocity @ harmonics(ball).T, ball), air).power
    form = np.einsum("fi,ij,fj->f", velocity.conj(), resistance.plane_wave_resistance, velocity)
    assert 0.5 * form.real == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("modes", [12, 0])
def test_housing_under_bearing_forces_is_response_and_sound_power(air, coarse, modes):
    reduced, load = cases.housing(modes), cases.forces(LINES, names=("B1", "A1", "A2"))
    got = modal_power(
        radiation_resistance(housing_shapes(reduced), MASTERS, air=air, fidelity=coarse), reduced, load, fidelity=coarse
    )
    exact = sound_power(respond(reduced, load), air=air, fidelity=coarse)
    assert got.frequency == pytest.approx(exact.frequency)
    assert np.abs(decibel(got.power / exact.power)).max() < 0.01
    assert got.accuracy.interpolation_error_db < 0.1


def test_too_few_masters_are_warned_of_and_enough_are_quiet(resistance, coarse):
    few = resistance.replace(
        frequency=MASTERS[::3], waves=resistance.waves[::3], cancellation=resistance.cancellation[::3]
    )
    velocity = random_velocity(LINES, 9)
    exact = power_from_waves(resistance, LINES, velocity, fidelity=coarse).power
    with pytest.warns(AccuracyWarning, match=r"errs by an estimated .* dB at [\d.]+ Hz, 0\.1 dB asked"):
        got = power_from_waves(few, LINES, velocity, fidelity=coarse)
    truth = np.abs(decibel(got.power / exact)).max()
    assert 0.05 < truth < 10 * got.accuracy.interpolation_error_db
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        power_from_waves(resistance, LINES, velocity, fidelity=coarse)


def test_band_from_0_hz(ball, air, coarse):
    """Below the first master above 0 Hz the waves go to zero with frequency, those of a volume flow in proportion."""
    found = radiation_resistance(
        SurfaceShapes(ball, harmonics(ball)), np.linspace(0.0, 1000.0, 9), air=air, fidelity=coarse
    )
    lines = np.array([1.0, 60.0])
    power = power_from_waves(found, lines, np.eye(9)[[0, 0]], fidelity=coarse).power
    ka = 2 * np.pi * lines * 0.1 / air.speed_of_sound
    exact = 0.5 * air.impedance * 4 * np.pi * 0.01 * ka**2 / (1 + ka**2)
    assert decibel(power / exact) == pytest.approx(np.zeros(2), abs=0.05)


def test_silent_lines_and_0_hz_have_no_power(resistance, coarse):
    lines = np.array([0.0, 150.0, 1000.0])
    velocity = random_velocity(lines, 9)
    velocity[1] = 0.0
    power = power_from_waves(resistance, lines, velocity, fidelity=coarse).power
    assert power[:2].tolist() == [0.0, 0.0]
    assert power[2] > 0


def test_what_does_not_belong_together_is_refused(ball, resistance, air, coarse, monkeypatch):
    velocity = random_velocity(LINES, 9)
    with pytest.raises(InputError, match=r"1 line \(2500…2500 Hz\) outside the master frequencies 100…2000 Hz"):
        power_from_waves(resistance, np.append(LINES, 2500.0), random_velocity(range(24), 9), fidelity=coarse)
    with pytest.raises(InputError, match=r"\(23, 9\) is needed"):
        power_from_waves(resistance, LINES, velocity[:, :5], fidelity=coarse)
    with pytest.raises(InputError, match=r"another housing \(none\)"):
        modal_power(resistance, cases.housing(), cases.forces(LINES), fidelity=coarse)
    for shapes, said in (
        (np.ones(320), "shape"),
        (np.full((320, 1), np.nan), "not finite"),
        (np.ones((320, 0)), "no c"),
    ):
        with pytest.raises(InputError, match=said):
            SurfaceShapes(ball, shapes)

    class Full:
        available = 2**20

    monkeypatch.setattr("psutil.virtual_memory", Full)
    with pytest.raises(ResourceError, match="GiB are free"):
        radiation_resistance(SurfaceShapes(ball, harmonics(ball)), MASTERS, air=air, fidelity=coarse)


@pytest.mark.slow
@pytest.mark.parametrize(("tolerance", "fewest", "most"), [(1.0, 8, 12), (0.01, 13, 24)])
def test_masters_are_chosen_from_a_tolerance(ball, air, coarse, tolerance, fewest, most):
    knobs = replace(coarse, master_tolerance_db=tolerance, masters=64)
    chosen = radiation_resistance(SurfaceShapes(ball, harmonics(ball)), Adaptive(50.0, 2400.0), air=air, fidelity=knobs)
    told = chosen.provenance
    assert max(chosen.accuracy.estimated_error_db, chosen.accuracy.tested_error_db) <= tolerance
    assert told["stage"] == "acoustics.radiation_resistance"
    assert f"master_tolerance_db={tolerance}" in told["fidelity"]
    assert told["solver"] == "direct"
    some = np.arange(0, len(chosen.frequency), 5)
    alone = radiation_resistance(SurfaceShapes(ball, harmonics(ball)), chosen.frequency[some], air=air, fidelity=coarse)
    assert np.abs(chosen.cancellation[some] - alone.cancellation).max() < 1e-9 * np.abs(alone.cancellation).max()
    assert fewest <= len(chosen.frequency) <= most
    velocity = random_velocity(LINES, 9)
    exact = sound_power(SurfaceVelocity(LINES, velocity @ harmonics(ball).T, ball), air=air, fidelity=coarse).power
    truth = np.abs(decibel(power_from_waves(chosen, LINES, velocity, fidelity=knobs).power / exact)).max()
    assert truth < tolerance


def test_masters_that_do_not_suffice_are_refused(ball, air, coarse):
    knobs = replace(coarse, master_tolerance_db=1e-4, masters=8)
    with pytest.raises(SolverError, match=r"8 masters leave an estimated error of .* dB near .* 0\.0001 dB asked"):
        radiation_resistance(SurfaceShapes(ball, harmonics(ball)), Adaptive(50.0, 2400.0), air=air, fidelity=knobs)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the air in openings")
def test_a_resonating_cavity_is_kept_within_the_tolerance_between_masters(air):
    """A resonance at 257 Hz with a Q of 210 in a band of 1 kHz, a master at its predicted peak."""
    body = bodies.resonator()
    knobs = AcousticsFidelity(
        elements_per_wavelength=2.0, masters=60, master_tolerance_db=0.3, coarsest_elements_per_wavelength=1.5
    )
    motion = SurfaceShapes(body, body.normals)
    chosen = radiation_resistance(motion, Adaptive(50.0, 1050.0), air=air, fidelity=knobs)
    lines = np.array([130.0, 245.0, 253.0, 255.5, 256.2, 256.6, 257.0, 258.0, 261.0, 275.0, 420.0, 777.0, 1003.0])
    truth = radiation_resistance(motion, lines, air=air, fidelity=knobs)
    for column in np.eye(3):
        got, exact = (
            power_from_waves(r, lines, np.tile(column + 0j, (13, 1)), fidelity=knobs).power for r in (chosen, truth)
        )
        assert np.abs(decibel(got / exact)).max() < 0.3
    assert len(chosen.frequency) <= 28
    assert np.abs(chosen.frequency - 256.6).min() < 1.5


@pytest.mark.parametrize(("low", "high"), [(50.0, np.inf), (np.nan, 100.0), (100.0, 100.0)])
def test_a_band_that_is_empty_or_has_no_finite_end_is_refused(ball, air, coarse, low, high):
    with pytest.raises(InputError, match="is empty: give 0 ≤ low < high, finite"):
        radiation_resistance(SurfaceShapes(ball, harmonics(ball)), Adaptive(low, high), air=air, fidelity=coarse)


def test_bearings_and_axes_without_load_are_left_out_and_asked_for_later_refused(air, coarse, monkeypatch):
    """Right-hand sides are counted: 12 modes and what carries a force, B1 nowhere and no axial force."""
    body = cases.housing()
    lines = np.array([400.0, 900.0])
    load = cases.forces(lines)
    force = load.force.copy()
    force[:, load.names.index("B1")] = 0.0
    force[:, :, 2] = 0.0
    some = load.replace(force=force)
    solved = []
    systems = quantities.systems

    def counted(*arguments):
        for batch in systems(*arguments):
            for system in batch:
                solve = system.solve
                monkeypatch.setattr(system, "solve", lambda rhs, solve=solve: solved.append(rhs.shape[1]) or solve(rhs))
            yield batch

    monkeypatch.setattr(quantities, "systems", counted)
    where = {"air": air, "fidelity": coarse}
    part = radiation_resistance(housing_shapes(body, loaded_bearings(body, some)), lines, **where)
    assert solved == [12 + 4] * 2
    whole = radiation_resistance(housing_shapes(body), lines, **where)
    assert solved[2:] == [12 + 9] * 2
    found, exact = (modal_power(of, body, some, fidelity=coarse) for of in (part, whole))
    assert found.power == pytest.approx(exact.power, rel=1e-9)
    assert found.accuracy.cancellation_error_db == pytest.approx(exact.accuracy.cancellation_error_db)
    with pytest.raises(InputError, match="bearing A1 carries a force along z that the radiation resistance leaves out"):
        modal_power(part, body, load, fidelity=coarse)
    with pytest.raises(InputError, match=r"loaded has shape \(3,\), but \(3, 3\) is needed"):
        housing_shapes(body, [True, False, True])
