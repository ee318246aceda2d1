"""A rigid reflecting plane: its geometry, what it asks of body and points, and known fields above it."""

import numpy as np
import pytest

from nvhchain.acoustics import (
    PlaneWave,
    array_points,
    radiate,
    solve_direct,
    sound_power,
    sphere,
    surface_pressure,
    transfer_vectors,
)
from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane, append_images, check_plane
from nvhchain.acoustics.waves.incident import Reflected
from nvhchain.errors import InputError
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing import bodies
from nvhchain.testing import hand_offs as cases

TILTED = RigidPlane((0.3, -0.2, 0.1), (1.0, 2.0, 2.0))
FLOOR = RigidPlane((0.0, 0.0, 0.0), (0.0, 0.0, 5.0))


def test_mirror_keeps_distances_and_swaps_sides():
    points = np.random.default_rng(1).normal(size=(20, 3))
    images = TILTED.mirror(points)
    assert TILTED.normal == pytest.approx((1 / 3, 2 / 3, 2 / 3))
    assert TILTED.height(images) == pytest.approx(-TILTED.height(points))
    assert TILTED.mirror(images) == pytest.approx(points)
    assert TILTED.mirror_direction(points[1:] - points[:-1]) == pytest.approx(images[1:] - images[:-1])
    foot = 0.5 * (points + images)
    assert TILTED.height(foot) == pytest.approx(np.zeros(20), abs=1e-15)
    assert FLOOR.mirror(points) == pytest.approx(points * [1, 1, -1])


@pytest.mark.parametrize(
    ("point", "normal", "message"),
    [((0, 0), (0, 0, 1), "point"), ((0, 0, np.nan), (0, 0, 1), "point"), ((0, 0, 0), (0, 0, 0), "no length")],
)
def test_planes_that_are_none_are_refused(point, normal, message):
    with pytest.raises(InputError, match=message):
        RigidPlane(point, normal)


def test_bodies_and_points_must_lie_on_the_side_of_the_air():
    body = sphere(0.1, 2, (0.0, 0.0, 0.2))
    check_plane(FLOOR, body, np.array([[1.0, 0, 0], [0, 0, 1.0]]))  # a point on the plane is fine
    with pytest.raises(InputError, match=r"reaches .* mm behind"):
        check_plane(RigidPlane((0, 0, 0.2), (0, 0, 1)), body)
    with pytest.raises(InputError, match="turn the plane's normal"):
        check_plane(RigidPlane((0, 0, 0), (0, 0, -1)), body)
    with pytest.raises(InputError, match=r"mm above the rigid plane, at least .* mm"):
        check_plane(RigidPlane((0, 0, body.vertices[:, 2].min() - 1e-4), (0, 0, 1)), body)
    with pytest.raises(InputError, match=r"field point 1 .* 10 mm behind"):
        check_plane(FLOOR, body, np.array([[1.0, 0, 0], [0, 1, -0.01]]))


def relative(value, reference):
    return np.abs(value - reference).max() / np.abs(reference).max()


def pulsating(body, frequency):
    return SurfaceVelocity(frequency, np.ones((len(frequency), len(body.triangles))), body)


def test_body_above_a_plane_is_the_same_as_body_and_image_in_free_field(air, coarse):
    """The half-space problem has the field of the two bodies that move as mirror images."""
    plane = RigidPlane((0.0, 0.0, 0.02), (0.2, 0.0, 1.0))
    body = bodies.box((0.1, 0.15, 0.1), 0.025)
    body = Surface(body.vertices + np.array([0.0, 0.0, 0.12]), body.triangles)
    count = len(body.vertices)
    both = Surface(
        np.concatenate([body.vertices, plane.mirror(body.vertices)]),
        np.concatenate([body.triangles, body.triangles[:, ::-1] + count]),
    )
    frequency = np.array([300.0, 1500.0])
    velocity = bodies.source_velocity(body, (0.01, 0.02, 0.13), frequency, air).normal_velocity
    points = np.array([[0.4, 0.1, 0.2], [-0.3, 0.2, 0.5], [0.0, 0.6, 0.1]])
    above = solve_direct(SurfaceVelocity(frequency, velocity, body), points, air=air, fidelity=coarse, plane=plane)
    paired = solve_direct(
        SurfaceVelocity(frequency, np.tile(velocity, 2), both), points, air=air, fidelity=coarse
    )  # the coupling α of the pair is that of a larger body: equal up to discretisation where it matters
    free = solve_direct(SurfaceVelocity(frequency, velocity, body), points, air=air, fidelity=coarse)
    assert relative(above.pressure, paired.pressure) < 2e-3
    assert relative(free.pressure, paired.pressure) > 0.2


@pytest.mark.slow
def test_interior_source_and_its_image_are_reproduced_above_a_plane(air, coarse):
    """The velocity that a point source inside and its image give the body radiates their field: exact."""
    body = sphere(0.1, 3, (0.05, 0.0, 0.15))
    frequency = np.array([400.0, 1200.0])
    position = np.array([[0.04, 0.01, 0.17]])
    image = FLOOR.mirror(position)[0]
    velocity = sum(bodies.source_velocity(body, p, frequency, air).normal_velocity for p in (position[0], image))
    points = np.array([[0.5, 0.0, 0.0], [0.0, 0.7, 0.6], [-0.6, -0.3, 0.1]])
    exact = np.array(
        [
            sum(bodies.source_field(points, p, 2 * np.pi * f / air.speed_of_sound)[0] for p in (position[0], image))
            for f in frequency
        ]
    )
    moving = SurfaceVelocity(frequency, velocity, body)
    got = solve_direct(moving, points, air=air, fidelity=coarse, plane=FLOOR)
    assert relative(got.pressure, exact) < 5e-3
    atv = transfer_vectors(body, points, frequency, air=air, fidelity=coarse, plane=FLOOR)
    assert relative(radiate(atv, moving, fidelity=coarse).pressure, got.pressure) < 1e-8
    assert relative(np.einsum("fpn,fn->fp", atv.vectors, velocity), got.pressure) < 1e-8


@pytest.mark.parametrize(("height", "array_radius"), [(0.021, None), (0.021, 0.5), (0.2, None), (0.2, 2.0)])
@pytest.mark.filterwarnings("ignore:array radius")
def test_sound_power_of_a_monopole_on_and_above_a_plane_within_a_tenth_of_a_decibel(air, coarse, height, array_radius):
    """A small pulsating sphere of volume flow Q: P = (1 + sin 2kh / 2kh) ρ c k² Q² / 8π, twice the free one on the
    plane (ISO 3744 hemisphere; Pierce, Acoustics, 4.10)."""
    body = sphere(0.02, 2, (0.1, 0.2, 0.3 + height))
    frequency = np.array([100.0, 300.0])
    k = 2 * np.pi * frequency / air.speed_of_sound
    flow = 4 * np.pi * 0.02**2
    exact = (1 + np.sinc(2 * k * height / np.pi)) * air.impedance * k**2 * flow**2 / (8 * np.pi)
    plane = RigidPlane((0.0, 0.0, 0.3), (0.0, 0.0, 1.0))
    power = sound_power(pulsating(body, frequency), air=air, fidelity=coarse, plane=plane, array_radius=array_radius)
    assert 10 * np.log10(power.power / exact) == pytest.approx(np.zeros(2), abs=0.1)


def test_array_stands_on_a_tilted_plane():
    points = array_points(2.0, (1.0, 1.0, 1.0), reflecting_plane=TILTED)
    foot = np.array([1.0, 1.0, 1.0]) - TILTED.height(np.ones((1, 3)))[0] * np.asarray(TILTED.normal)
    upright = array_points(2.0, reflecting_plane=True)
    assert np.linalg.norm(points - foot, axis=1) == pytest.approx(np.full(20, 2.0))
    assert TILTED.height(points) == pytest.approx(upright[:, 2])
    apart = [np.linalg.norm(p[:, None] - p[None], axis=2) for p in (points, upright)]
    assert apart[0] == pytest.approx(apart[1])


def test_scattered_field_with_its_reflection_has_no_velocity_at_the_plane():
    wave = Reflected(PlaneWave((1.0, 0.3, -0.2), 2.0), TILTED)
    points = np.random.default_rng(2).normal(size=(9, 3))
    foot = 0.5 * (points + TILTED.mirror(points))
    _, gradient = wave.pressure_and_gradient(foot, 7.0)
    assert gradient @ np.asarray(TILTED.normal) == pytest.approx(np.zeros(9), abs=1e-12)
    step = 1e-5 * np.array([0.3, -0.5, 0.8])
    _, gradient = wave.pressure_and_gradient(points, 7.0)
    rise = wave.pressure_and_gradient(points + step, 7.0)[0] - wave.pressure_and_gradient(points - step, 7.0)[0]
    assert rise == pytest.approx(2 * gradient @ step, rel=1e-6)


def test_rigid_sphere_above_a_plane_scatters_like_the_pair_with_its_image(air, coarse):
    """An oblique wave: the pair of spheres in free field, in the wave and its reflection."""
    body = sphere(0.1, 2, (0.0, 0.0, 0.16))
    count = len(body.vertices)
    both = Surface(
        np.concatenate([body.vertices, FLOOR.mirror(body.vertices)]),
        np.concatenate([body.triangles, body.triangles[:, ::-1] + count]),
    )
    frequency = np.array([600.0])
    still = [SurfaceVelocity(frequency, np.zeros((1, len(s.triangles))), s) for s in (body, both)]
    wave = PlaneWave((1.0, 0.0, -0.7))
    above = surface_pressure(still[0], air=air, fidelity=coarse, plane=FLOOR, incident=wave).pressure
    pair = surface_pressure(still[1], air=air, fidelity=coarse, incident=Reflected(wave, FLOOR)).pressure
    assert relative(above, pair[:, :count]) < 5e-3


@pytest.mark.filterwarnings("ignore:interpolation between")
def test_each_path_loses_its_own_phase_between_masters(air, coarse):
    """High above the plane the reflected path is 20 wavelengths longer than the spacing of the masters resolves."""
    body = sphere(0.1, 1, (0.0, 0.0, 10.0))
    points = np.array([[2.0, 0.0, 10.0], [0.0, 3.0, 11.0]])
    masters, lines = np.linspace(200.0, 2000.0, 12), np.array([333.0, 1111.0, 1717.0])
    ends = append_images(points, FLOOR)

    def at(frequency):
        parts = cases.monopoles(body, ends, frequency, air).vectors
        return cases.monopoles(
            body, points, frequency, air, plane=FLOOR, image_vectors=parts[:, 2:], vectors=parts[:, :2] + parts[:, 2:]
        )

    got = radiate(at(masters), pulsating(body, lines), fidelity=coarse).pressure
    exact = at(lines).vectors.sum(axis=2)
    assert relative(got, exact) < 1e-9
    blind = at(masters).replace(plane=None, image_vectors=None)
    assert relative(radiate(blind, pulsating(body, lines), fidelity=coarse).pressure, exact) > 0.1
