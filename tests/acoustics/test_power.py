"""Sound power of sources whose power is known."""

import acoustics_bodies as bodies
import numpy as np
import pytest

from nvhchain.acoustics import array_points, array_power, sound_power, sphere
from nvhchain.errors import InputError
from nvhchain.handoff import FieldPressure, SurfaceVelocity


@pytest.mark.parametrize(
    ("array_radius", "standard"),
    [(None, "ISO 3744"), (1.0, "ISO 3744"), (1.0, "ISO 3745")],
    ids=["surface", "ISO 3744", "ISO 3745"],
)
def test_sound_power_of_a_pulsating_sphere_in_free_field(air, coarse, array_radius, standard):
    frequency = np.array([1.0, 200.0, 1715.0])
    body = sphere(0.1, 3)
    velocity = SurfaceVelocity(frequency, np.ones((3, len(body.triangles))), body)
    ka = 2 * np.pi * frequency * 0.1 / air.speed_of_sound
    exact = 0.5 * air.impedance * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2)
    power = sound_power(velocity, air=air, fidelity=coarse, array_radius=array_radius, array_standard=standard).power
    assert 10 * np.log10(power / exact) == pytest.approx(np.zeros(3), abs=0.02)


def test_surface_and_array_agree_on_a_body_without_symmetry(air, coarse):
    body = bodies.box((0.15, 0.15, 0.1), 0.025, remove=lambda c: c[0] > 0.075 and c[1] > 0.075)
    velocity = bodies.source_velocity(body, (-0.035, -0.035, 0.0), np.array([400.0, 800.0]), air)
    surface = sound_power(velocity, air=air, fidelity=coarse).power
    array = sound_power(velocity, air=air, fidelity=coarse, array_radius=2.0).power
    exact = 1.0 / (8 * np.pi * air.impedance)  # G = e^{−jkr}/(4πr): p² r² S/(2ρc)
    assert 10 * np.log10(surface / exact) == pytest.approx(np.zeros(2), abs=0.1)
    assert 10 * np.log10(array / exact) == pytest.approx(np.zeros(2), abs=0.1)


def test_monopole_on_a_reflecting_plane_by_the_hemisphere(air):
    """On the plane source and image coincide: the pressure doubles, the hemisphere is half, the power doubles."""
    points = array_points(1.0, reflecting_plane=True)
    frequency = np.array([100.0, 1000.0])
    pressure = [2 * bodies.source_field(points, (0, 0, 0), 2 * np.pi * f / air.speed_of_sound)[0] for f in frequency]
    power = array_power(FieldPressure(frequency, points, np.array(pressure)), 1.0, air, reflecting_plane=True).power
    free = 1.0 / (8 * np.pi * air.impedance)
    assert 10 * np.log10(power / (2 * free)) == pytest.approx(np.zeros(2), abs=1e-9)


def test_array_positions_lie_on_the_sphere_and_stand_for_equal_areas():
    centre = np.array([0.1, -0.2, 0.3])
    points = array_points(2.0, centre) - centre
    assert points.shape == (40, 3)
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(40, 2.0))
    assert points.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    hemisphere = array_points(2.0, reflecting_plane=True)
    assert hemisphere.shape == (20, 3)
    assert hemisphere[:, 2].min() > 0
    assert hemisphere[:, 2].mean() == pytest.approx(1.0, rel=0.05)  # the mean height of a hemisphere of radius 2
    with pytest.raises(InputError, match="radius"):
        array_points(0.0)


def test_precision_positions_have_equally_spaced_heights_and_no_direction():
    sphere_points = array_points(1.0, standard="ISO 3745")
    hemisphere = array_points(1.0, standard="ISO 3745", reflecting_plane=True)
    assert np.sort(sphere_points[:, 2]) == pytest.approx(np.linspace(-0.95, 0.95, 20))
    assert np.sort(hemisphere[:, 2]) == pytest.approx(np.linspace(0.025, 0.975, 20))
    for points in (sphere_points, hemisphere):
        assert np.linalg.norm(points, axis=1) == pytest.approx(np.ones(20))
        assert np.abs(points.mean(axis=0)[:2]).max() < 0.08
        assert (points**2).mean(axis=0) == pytest.approx(np.full(3, 1 / 3), abs=0.04)  # a dipole's power in any axis
    with pytest.raises(InputError, match="ISO 9999"):
        array_points(1.0, standard="ISO 9999")
