"""Efficiency and directivity as hand-offs: spheres in closed form, lines at rest, points that are too near."""

import numpy as np
import pytest

from nvhchain.acoustics import directivity, solve_direct, sound_power, sphere, surface_efficiency
from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity

BODY, RADIUS = sphere(0.1, 2), 0.1
FREQUENCY = np.array([150.0, 600.0, 1500.0])
COSINE = BODY.normals[:, 2]
FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=8)
FAR = 40.0 * np.array([[np.sin(a), 0.0, np.cos(a)] for a in np.radians([0.0, 30.0, 60.0, 80.0, 180.0])])

pytestmark = pytest.mark.filterwarnings("ignore:the parts of the motion cancel")


def moving(shape):
    return SurfaceVelocity(FREQUENCY, np.tile(shape, (len(FREQUENCY), 1)), BODY)


def test_efficiency_of_pulsating_and_oscillating_spheres(air):
    """(ka)²/(1 + (ka)²) and (ka)⁴/(4 + (ka)⁴)."""
    x = 2 * np.pi * FREQUENCY / air.speed_of_sound * RADIUS
    for shape, exact in ((0 * COSINE + 1, x**2 / (1 + x**2)), (COSINE, x**4 / (4 + x**4))):
        velocity = moving(shape)
        found = surface_efficiency(sound_power(velocity, air=air, fidelity=FIDELITY), velocity, air)
        assert found.efficiency == pytest.approx(exact, rel=0.05)


def test_lines_at_rest_have_no_efficiency(air):
    velocity = moving(0 * COSINE + 1)
    normal = velocity.normal_velocity.copy()
    normal[1] = 0.0
    some = velocity.replace(normal_velocity=normal)
    power = sound_power(some, air=air, fidelity=FIDELITY)
    assert surface_efficiency(power, some, air).frequency.tolist() == [150.0, 1500.0]
    rest = some.replace(normal_velocity=0 * normal)
    with pytest.raises(InputError, match="at rest at all lines"):
        surface_efficiency(power, rest, air)


@pytest.mark.parametrize("plane", [None, RigidPlane((0, 0, -0.4), (0, 0, 1))], ids=["free", "plane"])
def test_directivity_of_an_oscillating_sphere(air, plane):
    """3 cos² θ in a free field.  Above a plane a dipole along the normal and its image, of the opposite sense, give
    cos θ · 2j sin(kh cos θ); what the sphere scatters of its image is excluded, 0.4 dB at the lower two lines."""
    velocity = moving(COSINE)
    x = FAR if plane is None else FAR[:3]
    where = {"air": air, "fidelity": FIDELITY, "plane": plane}
    pressure, power = solve_direct(velocity, x, **where), sound_power(velocity, **where)
    found = directivity(pressure, power, BODY, air, plane=plane)
    cosine = np.abs(x[:, 2]) / 40.0
    exact = np.tile(3 * cosine**2, (3, 1))
    if plane is not None:
        foot = x - [0.0, 0.0, -0.4]
        cosine = foot[:, 2] / np.linalg.norm(foot, axis=1)
        kh = 2 * np.pi * FREQUENCY[:, None] / air.speed_of_sound * 0.4
        c = (np.arange(4000) + 0.5) / 4000
        even = 3 * (c**2 * np.sin(kh * c) ** 2).mean(axis=1, keepdims=True)
        exact = 3 * cosine**2 * np.sin(kh * cosine) ** 2 / even
    level = 10 * np.log10(exact)
    lines = slice(3 if plane is None else 2)
    assert found.index[lines] == pytest.approx(level[lines], abs=0.2 if plane is None else 0.4)
    assert found.accuracy.near_field_db < 0.01


def test_points_in_the_near_field_are_warned_of_with_what_a_dipole_gains(air):
    velocity = moving(COSINE)
    near = np.array([[0.0, 0.0, 0.3]])
    pressure, power = (
        solve_direct(velocity, near, air=air, fidelity=FIDELITY),
        sound_power(velocity, air=air, fidelity=FIDELITY),
    )
    with pytest.warns(AccuracyWarning, match="field point 0 is 0.3 m"):
        found = directivity(pressure, power, BODY, air)
    kr = 2 * np.pi * FREQUENCY / air.speed_of_sound * 0.3
    assert found.index[:, 0] == pytest.approx(10 * np.log10(3 * (1 + kr**-2)), abs=0.2)
    assert found.accuracy.near_field_db == pytest.approx(10 * np.log10(1 + kr[0] ** -2))


def test_silent_lines_have_no_directivity(air):
    velocity = moving(COSINE)
    normal = velocity.normal_velocity.copy()
    normal[0] = 0.0
    some = velocity.replace(normal_velocity=normal)
    pressure, power = (
        solve_direct(some, FAR, air=air, fidelity=FIDELITY),
        sound_power(some, air=air, fidelity=FIDELITY),
    )
    assert directivity(pressure, power, BODY, air).frequency.tolist() == [600.0, 1500.0]
    with pytest.raises(InputError, match="nothing is radiated"):
        directivity(pressure, power.replace(power=0 * power.power), BODY, air)
