"""Radiation efficiency, equivalent radiated power and directivity of spheres with exact solutions."""

import warnings

import numpy as np
import pytest
from scipy.special import spherical_jn, spherical_yn

from nvhchain.acoustics import (
    directivity_index,
    equivalent_pressure,
    equivalent_radiated_power,
    mean_square_velocity,
    radiation_efficiency,
    solve_direct,
    sound_power,
    sphere,
    spread_power,
)
from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.handoff import SoundPower, SurfaceVelocity

pytestmark = pytest.mark.filterwarnings("ignore:equivalent radiated power")

FREQUENCY = np.array([300.0, 900.0, 1715.0])
LEGENDRE = [lambda x: np.ones_like(x), lambda x: x, lambda x: 0.5 * (3 * x * x - 1)]


def vibrating(n, radius=0.1, subdivisions=3, frequency=FREQUENCY):
    """A sphere with v_n = P_n(cos θ) about z."""
    body = sphere(radius, subdivisions)
    cosine = body.centroids[:, 2] / np.linalg.norm(body.centroids, axis=1)
    return SurfaceVelocity(frequency, np.tile(LEGENDRE[n](cosine), (len(frequency), 1)), body)


def hankel_slope(n, ka):
    """h_n'(ka) of the second kind: h = j − jy under e^{+jωt}."""
    return spherical_jn(n, ka, derivative=True) - 1j * spherical_yn(n, ka, derivative=True)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_radiation_efficiency_of_a_sphere_within_a_tenth_of_a_decibel(air, coarse, n):
    """σ_n = 1/|ka h_n'(ka)|² (Fahy & Gardonio, Sound and Structural Vibration, 3.4)."""
    velocity = vibrating(n)
    ka = 2 * np.pi * FREQUENCY * 0.1 / air.speed_of_sound
    exact = 1.0 / np.abs(ka * hankel_slope(n, ka)) ** 2
    power = sound_power(velocity, air=air, fidelity=coarse)
    error = 10 * np.log10(radiation_efficiency(power, velocity, air) / exact)
    assert error == pytest.approx(np.zeros(3), abs=0.1)


def test_equivalent_radiated_power_is_that_of_a_plane_wave_from_every_face(air):
    velocity = vibrating(1)
    area = 4 * np.pi * 0.1**2
    assert mean_square_velocity(velocity) == pytest.approx(np.full(3, 1 / 6), rel=0.01)  # ½⟨cos²⟩
    power = equivalent_radiated_power(velocity, air).power
    assert power == pytest.approx(np.full(3, air.impedance * area / 6), rel=0.01)
    assert radiation_efficiency(equivalent_radiated_power(velocity, air), velocity, air) == pytest.approx(np.ones(3))


def test_equivalent_pressure_carries_the_power_through_a_sphere_or_a_hemisphere(air):
    velocity = vibrating(0)
    power = equivalent_radiated_power(velocity, air).power
    points = np.array([[2.0, 0.0, 0.0], [0.0, 0.0, 4.0]])
    free = equivalent_pressure(velocity, points, air).pressure
    assert not free.imag.any()
    through = 4 * np.pi * np.array([2.0, 4.0]) ** 2 * np.abs(free) ** 2 / (2 * air.impedance)
    assert through == pytest.approx(np.stack([power, power], axis=1), rel=1e-6)
    half = equivalent_pressure(velocity, points, air, plane=RigidPlane((0, 0, -0.2), (0, 0, 1))).pressure
    assert half / free == pytest.approx(np.full((3, 2), np.sqrt(2)))


def test_equivalent_pressure_has_no_level_inside_the_body(air):
    """Its spread power is finite there, but there is no air."""
    with pytest.raises(InputError, match=r"field point 1 .* lies inside the body: move it outside"):
        equivalent_pressure(vibrating(0), [[1.0, 0.0, 0.0], [0.02, -0.01, 0.0]], air)


def test_equivalent_power_and_pressure_state_what_they_let_expect_and_warn_where_the_body_is_small(air):
    """Over ka = 4 only single levels are off; a ratio of powers is no estimate and says nothing."""
    for lowest, mean, single in ((55.0, 75.0, 80.0), (819.0, 16.0, 20.0), (4000.0, 1.7, 8.0)):
        velocity = vibrating(0, frequency=np.array([0.0, lowest, 5000.0]))
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            power = equivalent_radiated_power(velocity, air)
            made = [power, equivalent_pressure(velocity, [[1.0, 0, 0]], air)]
            radiation_efficiency(power, velocity, air)
        said = [w for w in said if issubclass(w.category, AccuracyWarning)]
        assert len(said) == (2 if mean > 3 else 0)
        for warning in said:
            assert f"equivalent radiated power at {lowest:g} Hz" in str(warning.message)
            assert f"up to {mean:.2g} dB too high in the mean" in str(warning.message)
        for result in made:
            assert result.accuracy.expected_mean_error_db == mean
            assert result.accuracy.expected_error_db == single


def test_directivity_of_an_oscillating_sphere_is_that_of_a_dipole(air, coarse):
    """DI = 10 lg 3 cos² θ in the far field."""
    velocity = vibrating(1)
    angle = 2 * np.pi * np.arange(24) / 24
    points = 50.0 * np.stack([np.cos(angle), np.zeros(24), -np.sin(angle)], axis=1)
    field = solve_direct(velocity, points, air=air, fidelity=coarse)
    power = sound_power(velocity, air=air, fidelity=coarse)
    cosine = points[:, 2] / 50.0
    loud = np.abs(cosine) > 0.2
    got = directivity_index(field, power, (0, 0, 0), air)
    exact = np.tile(10 * np.log10(3 * cosine[loud] ** 2), (3, 1))
    assert got[:, loud] == pytest.approx(exact, abs=0.1)
    assert got[:, ~loud].max() < -8.0


def test_lines_without_velocity_or_power_and_other_lines_are_refused(air):
    velocity = vibrating(0)
    still = velocity.replace(normal_velocity=velocity.normal_velocity * [[1.0], [0.0], [1.0]])
    power = equivalent_radiated_power(still, air)
    with pytest.raises(InputError, match="at rest at 900 Hz"):
        radiation_efficiency(power, still, air)
    with pytest.raises(InputError, match="same lines"):
        radiation_efficiency(SoundPower(FREQUENCY[:2], np.ones(2)), velocity, air)
    field = equivalent_pressure(still, [[1.0, 0, 0]], air)
    with pytest.raises(InputError, match="nothing is radiated at 1 line:"):
        directivity_index(field, power, (0, 0, 0), air)
    with pytest.raises(InputError, match="behind"):
        equivalent_pressure(velocity, [[0, 0, -1.0]], air, plane=RigidPlane((0, 0, -0.2), (0, 0, 1)))
    with pytest.raises(InputError, match=r"surface reaches .* behind the rigid plane"):
        equivalent_pressure(velocity, [[0, 0, 1.0]], air, plane=RigidPlane((0, 0, 0), (0, 0, 1)))


def test_points_of_a_spread_power_are_checked(air):
    power = SoundPower(FREQUENCY, np.ones(3))
    plane = RigidPlane((0.3, -0.2, 0.1), (1.0, 2.0, 3.0))
    along = np.cross(np.eye(3), plane.normal)
    points = np.concatenate([plane.point + s * along for s in (0.3, 1.7, 23.0)])
    assert plane.height(points).min() < 0  # by rounding
    centre = np.array(plane.point) + 0.1 * np.array(plane.normal)
    assert spread_power(power, points, centre, air, plane=plane).pressure.shape == (3, 9)
    beyond = centre - 0.101 * np.array(plane.normal)
    with pytest.raises(InputError, match=r"field point 9 at .* lies 1 mm behind"):
        spread_power(power, [*points, beyond], centre, air, plane=plane)
    for bad in ([[0.0, 1.0]], [[[1.0, 0.0, 0.0]]], [[np.nan, 0.0, 1.0]], [[np.inf, 0.0, 1.0]], np.zeros((0, 3))):
        with pytest.raises(InputError, match="field points of shape"):
            spread_power(power, bad, centre, air)
    for bad in ([0.0, np.nan, 0.0], [0.0, 1.0], points[:2]):
        with pytest.raises(InputError, match="centre"):
            spread_power(power, points, bad, air)
    with pytest.raises(InputError, match="negative at 1 line:"):
        spread_power(SoundPower(FREQUENCY, [1.0, -1e-9, 1.0]), points, centre, air)


def test_directivity_above_a_plane_counts_half_the_directions(air, coarse):
    """A pulsating sphere a quarter wavelength above a plane: |1 + e^{−j2kh cos θ}|² over its mean."""
    frequency = np.array([343.0])
    height, k = 0.25, 2 * np.pi
    plane = RigidPlane((0, 0, 0), (0, 0, 1))
    body = sphere(0.03, 2, (0, 0, height))
    velocity = SurfaceVelocity(frequency, np.ones((1, len(body.triangles))), body)
    cosine = np.array([0.0, 0.3, 0.7, 0.9])
    points = 200.0 * np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine], axis=1)
    field = solve_direct(velocity, points, air=air, fidelity=coarse, plane=plane)
    power = sound_power(velocity, air=air, fidelity=coarse, plane=plane)
    exact = (1 + np.cos(2 * k * height * cosine)) / (1 + np.sinc(2 * k * height / np.pi))
    got = directivity_index(field, power, (0, 0, 0), air, plane=plane)[0]
    assert got == pytest.approx(10 * np.log10(exact), abs=0.1)


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_radiation_efficiency_of_a_dipole_over_three_decades(air, coarse):
    """ka = 0.01 … 5; σ₁ = (ka)⁴/(4 + (ka)⁴)."""
    ka = np.array([0.01, 0.1, 1.0, 5.0])
    velocity = vibrating(1, frequency=ka * air.speed_of_sound / (2 * np.pi * 0.1))
    sigma = radiation_efficiency(sound_power(velocity, air=air, fidelity=coarse), velocity, air)
    assert 10 * np.log10(sigma / (ka**4 / (4 + ka**4))) == pytest.approx(np.zeros(4), abs=0.1)
