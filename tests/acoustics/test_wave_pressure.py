"""Sound pressure from the waves of the sound power is that of another boundary element solution."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import (
    RigidPlane,
    enclosing_sphere,
    housing_shapes,
    radiate,
    radiation_resistance,
    solve_direct,
    transfer_vectors,
    wave_pressure,
)
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import ForceSpectrum
from nvhchain.housing import respond
from nvhchain.testing import ball_with_modes

FINE = replace(DRAFT.acoustics, multipole_digits=6.0)
AT_LINES = np.array([300.0, 980.0, 1000.0, 1600.0])
FLOOR, FAR_FLOOR = (RigidPlane((0.0, 0.0, -height), (0.0, 0.2, 1.0)) for height in (0.15, 0.9))
POINTS = np.array([[0.0, 0.2, 0.98], [1.0, 0.0, 0.1], [-0.3, 0.6, 0.7]])


@pytest.fixture(scope="module")
def housing():
    return ball_with_modes.housing(ball_with_modes.case())


def forces(lines):
    random = np.random.default_rng(0)
    force = np.zeros((len(lines), 4, 3), dtype=complex)
    force[:, 0] = random.normal(size=(len(lines), 3)) + 1j * random.normal(size=(len(lines), 3))
    return ForceSpectrum(lines, force, ball_with_modes.BEARINGS, input_speed=188.5)


@pytest.mark.parametrize("plane", [None, FLOOR, FAR_FLOOR], ids=["free", "on a floor", "high above a floor"])
def test_waves_give_the_pressure_of_boundary_elements(housing, plane):
    load = forces(AT_LINES)
    waves = radiation_resistance(housing_shapes(housing), AT_LINES, fidelity=FINE, plane=plane)
    found = wave_pressure(waves, housing, load, POINTS, fidelity=FINE)
    exact = solve_direct(respond(housing, load), POINTS, fidelity=FINE, plane=plane)
    error = 20 * np.log10(np.abs(found.pressure / exact.pressure))
    assert np.abs(error).max() < 0.05
    assert np.abs(np.angle(found.pressure / exact.pressure)).max() < 0.005
    assert found.input_speed == 188.5


@pytest.mark.parametrize("plane", [None, FLOOR], ids=["free", "on a floor"])
def test_points_alone_have_the_pressure_that_they_have_among_many(housing, plane):
    load = forces(np.array([300.0, 700.0, 990.0, 1400.0]))
    waves = radiation_resistance(housing_shapes(housing), np.linspace(200.0, 1800.0, 9), fidelity=FINE, plane=plane)
    many = np.concatenate([POINTS, np.random.default_rng(1).uniform([-2, -2, 0.5], 2, (200, 3))])
    alone, among = (wave_pressure(waves, housing, load, points, fidelity=FINE) for points in (POINTS, many))
    assert alone.pressure == pytest.approx(among.pressure[:, :3], rel=1e-10)
    assert alone.accuracy.interpolation_error == pytest.approx(among.accuracy.interpolation_error[:3], rel=0.02)


def test_lines_between_masters_state_their_error(housing):
    load = forces(np.array([700.0, 990.0, 1400.0]))
    waves = radiation_resistance(housing_shapes(housing), np.linspace(200.0, 1800.0, 9), fidelity=FINE)
    found = wave_pressure(waves, housing, load, POINTS, fidelity=FINE)
    exact = solve_direct(respond(housing, load), POINTS, fidelity=FINE)
    assert np.abs(20 * np.log10(np.abs(found.pressure / exact.pressure))).max() < 0.05
    error = np.abs(found.pressure - exact.pressure).max(axis=0) / np.abs(exact.pressure).max(axis=0)
    assert (error < 1e-4 + found.accuracy.interpolation_error).all()


def test_waves_keep_to_solved_vectors_where_few_masters_make_interpolated_ones_differ(housing):
    load, fidelity = forces(np.array([700.0, 990.0, 1400.0])), FINE
    exact = solve_direct(respond(housing, load), POINTS, fidelity=fidelity).pressure
    waves = radiation_resistance(housing_shapes(housing), np.linspace(200.0, 1800.0, 9), fidelity=fidelity)
    found = wave_pressure(waves, housing, load, POINTS, fidelity=fidelity).pressure
    vectors = transfer_vectors(housing.surface, POINTS, [200.0, 700.0, 1250.0, 1800.0], fidelity=fidelity)
    between = radiate(vectors, respond(housing, load), fidelity=fidelity).pressure
    of_waves, of_vectors = (np.abs(20 * np.log10(np.abs(of / exact))) for of in (found, between))
    assert of_waves.max() < 0.05 < of_vectors.max()
    assert of_vectors[0].max() < 0.02  # solved at 700 Hz


def test_points_inside_the_sphere_or_behind_the_floor_are_refused_with_the_radius(housing):
    waves = radiation_resistance(housing_shapes(housing), AT_LINES, fidelity=FINE, plane=FLOOR)
    centre, radius = enclosing_sphere(housing.surface, plane=FLOOR)
    with pytest.raises(InputError, match=f"inside the sphere of {radius:.4g} m around the body"):
        wave_pressure(waves, housing, forces(AT_LINES), [centre + 0.99 * radius * np.array([1.0, 0, 0])])
    with pytest.raises(InputError, match="behind the reflecting plane"):
        wave_pressure(waves, housing, forces(AT_LINES), [[0.0, 0.0, -2.0]])
