"""The Rayleigh integral: exact for a piston in a baffle, and what it leaves out."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import eval_legendre, j1, spherical_jn, spherical_yn

from nvhchain.acoustics import radiate, solve_direct, sound_power, sphere, transfer_vectors
from nvhchain.acoustics.accuracy.radiation_levels import CANCELLING, SHAKING, expected_radiation_error, level_accuracy
from nvhchain.acoustics.radiation.efficiency import equivalent_radiated_power
from nvhchain.acoustics.radiation.rayleigh import rayleigh_field
from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane
from nvhchain.errors import AccuracyWarning, InputError, ResourceError
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing.bodies import box, shell

RADIUS = 0.1

pytestmark = pytest.mark.filterwarnings("ignore:rayleigh at", "ignore:equivalent radiated power")


@pytest.fixture(scope="module")
def rayleigh(coarse):
    return replace(coarse, radiation="rayleigh")


@pytest.fixture(scope="module")
def disc():
    """A flat cylinder, top at z = 0: rings of triangles on top and bottom, one row of them on the side."""
    rings, sides = 12, 72
    angle = 2 * np.pi * np.arange(sides) / sides
    true = RADIUS * np.sqrt(2 * np.pi / (sides * np.sin(2 * np.pi / sides)))  # the polygon has the area of the disc
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    flat = np.concatenate([np.zeros((1, 2))] + [true * (i + 1) / rings * circle for i in range(rings)])
    following = np.roll(np.arange(sides), -1)
    own = np.arange(sides)
    top = [np.stack([np.zeros(sides, int), 1 + own, 1 + following], axis=1)]
    for i in range(rings - 1):
        a, b = 1 + i * sides, 1 + (i + 1) * sides
        top.append(np.stack([a + own, b + own, b + following], axis=1))
        top.append(np.stack([a + own, b + following, a + following], axis=1))
    top = np.concatenate(top)
    count, rim = len(flat), 1 + (rings - 1) * sides
    side = np.concatenate(
        [
            np.stack([rim + own, count + rim + own, count + rim + following], axis=1),
            np.stack([rim + own, count + rim + following, rim + following], axis=1),
        ]
    )
    vertices = np.concatenate([np.insert(flat, 2, 0.0, axis=1), np.insert(flat, 2, -0.02, axis=1)])
    return Surface(vertices, np.concatenate([top, top[:, ::-1] + count, side]))


def piston(disc, frequency):
    top = (disc.centroids[:, 2] > -1e-9).astype(float)
    return SurfaceVelocity(frequency, np.tile(top, (len(frequency), 1)), disc)


def test_baffled_piston_on_its_axis_is_exact(disc, air, rayleigh):
    """p = ρc v (e^{−jkz} − e^{−jk√(z²+a²)}) (Pierce, Acoustics, eq. 5-7.3)."""
    frequency = np.array([0.0, 100.0, 1000.0, 4000.0])
    z = np.array([0.02, 0.1, 0.5, 3.0])
    points = np.stack([0 * z, 0 * z, z], axis=1)
    atv = transfer_vectors(disc, points, frequency, air=air, fidelity=rayleigh)
    got = radiate(atv, piston(disc, frequency), fidelity=rayleigh).pressure
    k = 2 * np.pi * frequency[:, None] / air.speed_of_sound
    exact = air.impedance * (np.exp(-1j * k * z) - np.exp(-1j * k * np.hypot(z, RADIUS)))
    assert np.abs(got - exact).max(axis=0) / np.abs(exact).max(axis=0) == pytest.approx(np.zeros(4), abs=2e-3)


def test_baffled_piston_far_away_has_its_directivity(disc, air, rayleigh):
    """p = jωρ v a² e^{−jkr}/(2r) · 2J₁(ka sin θ)/(ka sin θ)."""
    frequency, r = np.array([3000.0]), 60.0
    theta = np.radians([10.0, 30.0, 50.0, 80.0])
    points = r * np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=1)
    atv = transfer_vectors(disc, points, frequency, air=air, fidelity=rayleigh)
    omega = 2 * np.pi * frequency[0]
    x = omega / air.speed_of_sound * RADIUS * np.sin(theta)
    axis = omega * air.density * RADIUS**2 / (2 * r)
    got = np.abs(radiate(atv, piston(disc, frequency), fidelity=rayleigh).pressure[0])
    assert got / axis == pytest.approx(np.abs(2 * j1(x) / x), abs=2e-3)


def test_faces_that_look_away_are_silent_and_a_plane_adds_its_image(disc, air, rayleigh):
    frequency = np.array([500.0])
    plane = RigidPlane((0, 0, -0.5), (0, 0, 1))
    above, below = [0.0, 0.0, 0.4], [0.0, 0.0, -0.4]
    free = transfer_vectors(disc, [above, below, [0, 0, -1.4]], frequency, air=air, fidelity=rayleigh)
    top = disc.centroids[:, 2] > -1e-9
    assert not free.vectors[0, 1:][:, top].any()
    assert free.vectors[0, 0, top].all()
    mirrored = transfer_vectors(disc, [above], frequency, air=air, fidelity=rayleigh, plane=plane)
    assert mirrored.vectors[0, 0] == pytest.approx(free.vectors[0, 0] + free.vectors[0, 2])
    assert mirrored.image_vectors[0, 0] == pytest.approx(free.vectors[0, 2])


@pytest.mark.filterwarnings("ignore:the positions of ISO 3744")
def test_pulsating_sphere_has_its_power_where_it_is_small_and_where_it_is_large(air, rayleigh):
    """Half of a small pulsating sphere is seen, with doubled pressure, which is right; at high frequency the
    power is that of equivalent radiated power."""
    frequency = np.array([20.0, 4000.0])
    body = sphere(0.1, 4)
    velocity = SurfaceVelocity(frequency, np.ones((2, len(body.triangles))), body)
    ka = 2 * np.pi * frequency * 0.1 / air.speed_of_sound
    exact = 0.5 * air.impedance * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2)
    got = sound_power(velocity, air=air, fidelity=rayleigh, array_radius=5.0).power
    error = 10 * np.log10(got / exact)
    assert error[0] == pytest.approx(0.0, abs=0.2)
    assert error[1] == pytest.approx(0.0, abs=1.0)
    equivalent = sound_power(velocity, air=air, fidelity=replace(rayleigh, radiation="equivalent_radiated_power"))
    assert equivalent.power == pytest.approx(equivalent_radiated_power(velocity, air).power)
    assert 10 * np.log10(equivalent.power / exact) == pytest.approx(-10 * np.log10(ka**2 / (1 + ka**2)), abs=0.02)


def test_levels_that_cannot_give_what_is_asked_are_refused(disc, air, coarse, rayleigh):
    velocity = piston(disc, np.array([500.0]))
    with pytest.raises(InputError, match="give array_radius"):
        sound_power(velocity, air=air, fidelity=rayleigh)
    with pytest.raises(InputError, match="equivalent_pressure"):
        transfer_vectors(
            disc, [[0, 0, 1.0]], [500.0], air=air, fidelity=replace(coarse, radiation="equivalent_radiated_power")
        )
    with pytest.raises(InputError, match="radiation = 'guess' is unknown"):
        replace(coarse, radiation="guess")


def sphere_errors(n, ka):
    """dB by which the Rayleigh integral and plane waves overrate the power of a sphere with v_n = P_n(cos θ).

    Over the half sphere that a far point sees, P_n averages round the line of sight to P_n(cos θ) P_n(t), so that
    p/p_exact = (ka)² |h_n'(ka)| |∫₀¹ P_n(t) e^{jkat} dt| in all directions; plane waves: 1/σ_n = |ka h_n'(ka)|².
    """
    t, weight = np.polynomial.legendre.leggauss(60)
    t, weight = 0.5 * (t + 1), 0.5 * weight
    seen = np.abs(np.exp(1j * np.outer(ka, t)) @ (weight * eval_legendre(n, t)))
    slope = np.abs(spherical_jn(n, ka, derivative=True) - 1j * spherical_yn(n, ka, derivative=True))
    return {
        "rayleigh": 20 * np.log10(ka**2 * slope * seen),
        "equivalent_radiated_power": 20 * np.log10(ka * slope),
    }


def pulsating(ka, air, subdivisions=3):
    body = sphere(0.1, subdivisions)
    half_size = 0.5 * np.linalg.norm(np.ptp(body.vertices, axis=0)) / np.sqrt(3)
    frequency = np.atleast_1d(ka) * air.speed_of_sound / (2 * np.pi * half_size)
    return SurfaceVelocity(frequency, np.ones((len(frequency), len(body.triangles))), body)


def test_power_of_a_pulsating_sphere_errs_as_the_closed_form_says(air, rayleigh):
    """4 sin²(ka/2) (1 + (ka)²)/(ka)²: 4.3 dB at ka = 1.5, 6.5 dB at 3, nothing is left at 2π."""
    ka = np.array([0.3, 1.5, 3.0, 4.0])
    closed = 10 * np.log10(4 * np.sin(ka / 2) ** 2 * (1 + ka**2) / ka**2)
    assert sphere_errors(0, ka)["rayleigh"] == pytest.approx(closed, abs=1e-9)
    velocity = pulsating(ka, air)
    exact = 0.5 * air.impedance * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2)
    power = sound_power(velocity, air=air, fidelity=rayleigh, array_radius=3.0)
    assert 10 * np.log10(power.power / exact) == pytest.approx(closed, abs=0.2)


@pytest.mark.parametrize("radiation", ["rayleigh", "equivalent_radiated_power"])
def test_stated_errors_hold_for_the_motions_of_a_sphere_at_any_size(air, radiation):
    """Three decades of ka; above 4 single frequencies may lose any amount, and RMS is stated."""
    body = sphere(0.1, 1)
    half_size = 0.5 * np.linalg.norm(np.ptp(body.vertices, axis=0)) / np.sqrt(3)
    ka = np.concatenate([np.geomspace(0.01, 4.0, 200, endpoint=False), np.linspace(4.0, 16.0, 601)])
    errors = np.array([sphere_errors(n, ka)[radiation] for n in range(3)])
    mean = 10 * np.log10((10 ** (errors / 10)).mean(axis=0))
    stated = [
        level_accuracy(body, np.array([x * air.speed_of_sound / (2 * np.pi * half_size)]), air, radiation) for x in ka
    ]
    single = np.array([row.expected_error_db for row in stated])
    assert (np.abs(mean) <= [row.expected_mean_error_db for row in stated]).all()
    assert (errors <= single).all()
    assert (-errors <= single)[:, ka < 4].all()
    assert np.sqrt((errors[:, ka >= 4] ** 2).mean(axis=1)).max() <= single[-1]
    # not by being far too large either
    assert (single - np.abs(errors).max(axis=0))[ka < 0.1].max() < 2.5
    assert (np.diff([row.expected_mean_error_db for row in stated]) <= 0).all()


@pytest.mark.parametrize(("size", "axis"), [((0.3, 0.2, 0.02), 2), ((0.4, 0.06, 0.02), 2), ((0.12, 0.08, 0.06), 0)])
def test_what_bodies_that_shake_as_a_whole_err_by_is_told(air, rayleigh, size, axis):
    """Strips err most: 35 dB where 21.5 are expected of bodies that bend and of spheres."""
    body, ka = box(size, 0.02), np.array([0.1, 0.2, 0.5, 1.0])
    half_size = 0.5 * np.linalg.norm(size) / np.sqrt(3)
    frequency = ka * air.speed_of_sound / (2 * np.pi * half_size)
    velocity = SurfaceVelocity(frequency, np.tile(body.normals[:, axis].astype(complex), (4, 1)), body)
    exact = solve_direct(velocity, shell(200, 3.0), air=air, fidelity=rayleigh)
    found = radiate(transfer_vectors(body, shell(200, 3.0), frequency, air=air, fidelity=rayleigh), velocity)
    power = [(np.abs(one.pressure) ** 2).mean(axis=1) for one in (found, exact)]
    error = 10 * np.log10(power[0] / power[1])
    assert (error < expected_radiation_error("rayleigh", ka - 1e-9) + SHAKING).all()
    assert (error > 10.0)[0]
    with pytest.warns(AccuracyWarning, match=r"13\.5 dB more where it is flat and shakes as a whole"):
        level_accuracy(body, frequency, air, "rayleigh")


@pytest.mark.parametrize("radiation", CANCELLING)
def test_what_motions_err_by_whose_parts_cancel_is_told(air, radiation):
    ka = np.array([0.11])
    assert sphere_errors(3, ka)[radiation] == pytest.approx([CANCELLING[radiation]], abs=0.5)
    with pytest.warns(AccuracyWarning, match=rf"cancel \({CANCELLING[radiation]:g} dB for P_3 of a sphere"):
        level_accuracy(sphere(0.1, 1), ka * air.speed_of_sound / (2 * np.pi * 0.1), air, radiation)


def test_vectors_fields_and_power_carry_what_the_level_lets_expect(air, rayleigh):
    """The numbers by wavenumber times half size, at the lowest frequency that radiates, and a warning."""
    body = sphere(0.1, 2)
    for ka, mean, single in ((0.15, 20, 21.5), (0.3, 13.3, 16), (0.8, 5.5, 13), (3.0, 3.7, 11.5)):
        lowest = pulsating(ka, air, 2).frequency[0]
        frequency = np.array([0.0, lowest, 2400.0])
        velocity = SurfaceVelocity(frequency, np.ones((3, len(body.triangles))), body)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            made = [
                transfer_vectors(body, [[1.0, 0, 0]], frequency, air=air, fidelity=rayleigh),
                sound_power(velocity, air=air, fidelity=rayleigh, array_radius=30.0),
            ]
        said = [str(w.message) for w in said if issubclass(w.category, AccuracyWarning)]
        assert len(said) == 2
        assert all(f"up to {mean:.2g} dB too high in the mean" in text for text in said)
        assert all(f"{single:.2g} dB off at single points and in the power of a single" in text for text in said)
        for result in made:
            assert result.accuracy.expected_mean_error_db == mean
            assert result.accuracy.expected_error_db == single


def test_vectors_that_do_not_fit_into_memory_are_refused(disc, air, rayleigh, monkeypatch):
    class Full:
        available = 30 * 2**20

    monkeypatch.setattr("psutil.virtual_memory", Full)
    points = np.random.default_rng(0).normal((0.0, 0.0, 10.0), size=(300, 3))
    velocity = piston(disc, np.array([500.0]))
    assert transfer_vectors(disc, points[:3], [500.0], air=air, fidelity=rayleigh).vectors.any()
    with pytest.raises(ResourceError, match=r"Rayleigh integrals need .* GiB are free: ask for fewer frequencies"):
        transfer_vectors(disc, points, [500.0], air=air, fidelity=rayleigh)
    with pytest.raises(ResourceError, match="Rayleigh integrals need"):
        rayleigh_field(velocity, points, air, 0.5, None)


def test_expected_error_of_a_level_is_the_table_at_every_ka_and_grows_below_it():
    """dB: the steps of the table, and 20 or 60 dB a decade below 0.1."""
    ka = np.array([0.001, 0.01, 0.1, 0.19, 0.2, 0.7, 10.0])
    rayleigh = expected_radiation_error("rayleigh", ka)
    assert rayleigh == pytest.approx([61.5, 41.5, 21.5, 21.5, 16.0, 13.0, 8.5])
    assert expected_radiation_error("equivalent_radiated_power", 0.01) == pytest.approx([140.0])
    with pytest.raises(InputError, match="choose from rayleigh"):
        expected_radiation_error("boundary_elements", ka)
    with pytest.raises(InputError, match="must be positive"):
        expected_radiation_error("rayleigh", [0.0, 1.0])
