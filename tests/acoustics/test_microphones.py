"""Microphone arrays of ISO 3744 and ISO 3745: positions, power of known sources, and what the near field adds."""

import warnings

import numpy as np
import pytest

from nvhchain.acoustics import array_points, array_power, sound_power, sphere
from nvhchain.acoustics.radiation.microphones import source_dimension
from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.handoff import FieldPressure, SurfaceVelocity
from nvhchain.testing import bodies

# ISO 3744:2010, table B.1 (general case), and ISO 3745, tables of annexes D (sphere, upper half) and E (hemisphere).
ISO_3744 = """
-0.99 0 0.15, 0.50 -0.86 0.15, 0.50 0.86 0.15, -0.45 0.77 0.45, -0.45 -0.77 0.45, 0.89 0 0.45,
0.33 0.57 0.75, -0.66 0 0.75, 0.33 -0.57 0.75, 0 0 1, 0.99 0 0.15, -0.50 0.86 0.15, -0.50 -0.86 0.15,
0.45 -0.77 0.45, 0.45 0.77 0.45, -0.89 0 0.45, -0.33 -0.57 0.75, 0.66 0 0.75, -0.33 0.57 0.75, 0 0 1
"""
ISO_3745_SPHERE = """
-1.00 0 0.05, 0.49 -0.86 0.15, 0.48 0.84 0.25, -0.47 0.81 0.35, -0.45 -0.77 0.45, 0.84 0 0.55,
0.38 0.66 0.65, -0.66 0 0.75, 0.26 -0.46 0.85, 0.31 0 0.95
"""
ISO_3745_HEMISPHERE = """
-1.00 0 0.025, 0.50 -0.86 0.075, 0.50 0.86 0.125, -0.49 0.85 0.175, -0.49 -0.84 0.225, 0.96 0 0.275,
0.47 0.82 0.325, -0.93 0 0.375, 0.45 -0.78 0.425, 0.88 0 0.475, -0.43 0.74 0.525, -0.41 -0.71 0.575,
0.39 -0.68 0.625, 0.37 0.64 0.675, -0.69 0 0.725, -0.32 -0.55 0.775, 0.57 0 0.825, -0.24 0.42 0.875,
-0.38 0 0.925, 0.11 -0.19 0.975
"""


def decibel(ratio):
    return 10 * np.log10(ratio)


def published(table):
    return np.array([[float(number) for number in row.split()] for row in table.split(",")])


@pytest.mark.parametrize(
    ("standard", "half", "table"),
    [("ISO 3744", True, ISO_3744), ("ISO 3745", False, ISO_3745_SPHERE), ("ISO 3745", True, ISO_3745_HEMISPHERE)],
)
def test_positions_are_those_of_the_standard(standard, half, table):
    points, wanted = array_points(1.0, standard=standard, reflecting_plane=half), published(table)
    if not half:
        wanted = np.concatenate([wanted, -wanted])
    distance = np.linalg.norm(points[:, None] - wanted, axis=2)
    assert len(points) == len(wanted) == 20
    assert distance.min(axis=1).max() < 0.012  # the tables have two decimals
    assert distance.min(axis=0).max() < 0.012


def test_positions_lie_on_the_sphere_and_stand_for_equal_areas():
    centre = np.array([0.1, -0.2, 0.3])
    points = array_points(2.0, centre) - centre
    assert points.shape == (40, 3)
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(40, 2.0))
    assert points.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    hemisphere = array_points(2.0, reflecting_plane=True)
    assert hemisphere[:, 2].mean() == pytest.approx(1.0, rel=0.05)  # the mean height of a hemisphere of radius 2
    for precise in (array_points(1.0, standard="ISO 3745", reflecting_plane=half) for half in (False, True)):
        assert np.abs(precise.mean(axis=0)[:2]).max() < 0.08
        assert (precise**2).mean(axis=0) == pytest.approx(np.full(3, 1 / 3), abs=0.04)  # a dipole's power in any axis


def test_hemisphere_stands_on_a_plane_of_any_direction():
    plane = RigidPlane((0.5, 0.0, 0.2), (1.0, -2.0, 2.0))
    centre = np.array([3.0, 1.0, 1.0])
    points = array_points(2.0, centre, reflecting_plane=plane)
    foot = centre - plane.height(centre[None])[0] * np.array(plane.normal)
    assert np.linalg.norm(points - foot, axis=1) == pytest.approx(np.full(20, 2.0))
    assert np.sort(plane.height(points)) == pytest.approx(np.repeat([0.3, 0.9, 1.5, 2.0], [6, 6, 6, 2]))


@pytest.mark.parametrize("standard", ["ISO 3744", "ISO 3745"])
def test_pulsating_sphere_in_a_free_field(standard, air, coarse):
    frequency = np.array([100.0, 200.0, 1715.0])
    body = sphere(0.1, 3)
    velocity = SurfaceVelocity(frequency, np.ones((3, len(body.triangles))), body)
    ka = 2 * np.pi * frequency * 0.1 / air.speed_of_sound
    exact = 0.5 * air.impedance * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2)
    power = sound_power(velocity, air=air, fidelity=coarse, array_radius=1.0, array_standard=standard)
    assert decibel(power.power / exact) == pytest.approx(np.zeros(3), abs=0.02)
    assert power.accuracy.array_sampling_db < 0.01
    assert power.provenance["engine"] == "fused"
    assert power.accuracy.array_radius == 1.0
    assert power.provenance["array_standard"] == standard


def test_monopole_on_a_reflecting_plane_within_a_tenth_of_a_decibel(air, coarse):
    """On the plane source and image coincide: the pressure doubles, the hemisphere is half, the power doubles."""
    points = array_points(1.0, reflecting_plane=True)
    frequency = np.array([100.0, 1000.0])
    pressure = [2 * bodies.source_field(points, (0, 0, 0), 2 * np.pi * f / air.speed_of_sound)[0] for f in frequency]
    power = array_power(FieldPressure(frequency, points, np.array(pressure)), 1.0, air, reflecting_plane=True).power
    free = 1.0 / (8 * np.pi * air.impedance)
    assert decibel(power / (2 * free)) == pytest.approx(np.zeros(2), abs=1e-9)
    plane, small = RigidPlane((0, 0, 0), (0, 0, 1)), sphere(0.02, 2, (0.3, 0.1, 0.0203))
    velocity = SurfaceVelocity(frequency, np.ones((2, len(small.triangles))), small)
    k = 2 * np.pi * frequency / air.speed_of_sound
    exact = (1 + np.sinc(2 * k * 0.0203 / np.pi)) * air.impedance * k**2 * (4 * np.pi * 0.02**2) ** 2 / (8 * np.pi)
    for radius in (None, 2.0):
        got = sound_power(velocity, air=air, fidelity=coarse, plane=plane, array_radius=radius).power
        assert decibel(got / exact)[0] == pytest.approx(0.0, abs=0.1)


def test_near_field_of_a_dipole_is_warned_of_with_its_number(air):
    """|p|² of a dipole falls as (1 + 1/(kr)²)/r²."""
    frequency, radius = np.array([20.0, 500.0]), 1.0
    points = array_points(radius, standard="ISO 3745")
    k = 2 * np.pi * frequency[:, None] / air.speed_of_sound
    pressure = (1j * k + 1 / radius) * points[:, 2]
    exact = k[:, 0] ** 2 * 4 * np.pi / 3 / (2 * air.impedance)
    with pytest.warns(
        AccuracyWarning, match=r"0\.058 wavelengths at 20 Hz, 0.25 are needed .* 9\.3 dB too high"
    ) as said:
        power = array_power(FieldPressure(frequency, points, pressure), radius, air)
    assert len(said) == 1
    assert power.accuracy.array_near_field_db == pytest.approx(decibel(power.power / exact)[0], abs=0.05)
    assert decibel(power.power / exact)[1] == pytest.approx(0.0, abs=0.1)
    assert power.accuracy.array_sampling_db == pytest.approx(0.79, abs=0.05)  # std cos²θ/√20


def test_array_next_to_the_source_is_warned_of_and_one_inside_refused(air, coarse):
    box = bodies.box((0.3, 0.2, 0.4), 0.1)
    assert source_dimension(box, None) == pytest.approx(0.5 * np.sqrt(0.3**2 + 0.2**2 + 0.4**2))
    plane = RigidPlane((0, 0, -0.3), (0, 0, 1))
    assert source_dimension(box, plane) == pytest.approx(np.sqrt(0.15**2 + 0.1**2 + 0.5**2))
    velocity = SurfaceVelocity([500.0], box.normals[:, :1].T, box)
    with pytest.warns(AccuracyWarning, match=r"1\.3 times .* 0\.269 m, 2 times are needed .* take 0\.539 m"):
        sound_power(velocity, air=air, fidelity=coarse, array_radius=0.35)
    with pytest.warns(AccuracyWarning), pytest.raises(InputError, match="inside"):
        sound_power(velocity, air=air, fidelity=coarse, array_radius=0.1)


def test_lobes_that_fall_between_the_positions_are_warned_of(air, coarse):
    """A monopole 2 m over a plane: cos²(kh cos θ) at four heights, which at kh = 11 all lie next to its zeros."""
    plane, radius, height = RigidPlane((0, 0, 0), (0, 0, 1)), 0.02, 2.0
    body = sphere(radius, 2, (0, 0, height))

    def error(frequency, standard):
        k = 2 * np.pi * frequency / air.speed_of_sound
        moving = SurfaceVelocity([frequency], np.ones((1, len(body.triangles))), body)
        ways = {"array_radius": 30.0, "array_standard": standard, "plane": plane}
        power = sound_power(moving, air=air, fidelity=coarse, **ways).power[0]
        return decibel(
            power / ((1 + np.sinc(2 * k * height / np.pi)) * air.impedance * k**2 * body.areas.sum() ** 2 / (8 * np.pi))
        )

    with pytest.warns(AccuracyWarning, match=r"0.3 radii apart .* of 2.02 m up to 212.2 Hz; 300 Hz .* ISO 3745 or"):
        assert error(300.0, "ISO 3744") < -9.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert abs(error(300.0, "ISO 3745")) < 0.2
        assert abs(error(212.0, "ISO 3744")) < 0.5


def test_radius_standard_and_centre_are_checked(air):
    field = FieldPressure([100.0], array_points(1.0), np.ones((1, 40)))
    for radius in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="radius"):
            array_points(radius)
        with pytest.raises(InputError, match="radius"):
            array_power(field, radius, air)
    with pytest.raises(InputError, match=r"lie 1 to 1 m from .* not 1.1 m: take the pressure at array_points"):
        array_power(field, 1.1, air)
    half = FieldPressure([100.0], array_points(1.0, (5.0, 3.0, 1.0), reflecting_plane=True), np.ones((1, 20)))
    with pytest.raises(InputError, match=r"mean is 0\.505 radii .* over all of it: .* or give reflecting_plane"):
        array_power(half, 1.0, air)
    assert array_power(half, 1.0, air, reflecting_plane=True).power > 0
    with pytest.raises(InputError, match="1 positions make no array"):
        array_power(FieldPressure([100.0], [[1.0, 0, 0]], [[1.0]]), 1.0, air)
    with pytest.raises(InputError, match="ISO 9999"):
        array_points(1.0, standard="ISO 9999")
    with pytest.raises(InputError, match="three finite"):
        array_points(1.0, [0.0, np.nan, 0.0])
