"""What `radiate` says about its own interpolation."""

import warnings

import numpy as np
import pytest

from nvhchain.acoustics import radiate, sphere, transfer_vectors
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import RigidPlane, SurfaceVelocity
from nvhchain.testing import hand_offs as cases
from nvhchain.testing.bodies import twice

POINTS = np.array([[1.0, 0.2, 0.0], [0.0, -1.3, 0.4]])


def test_interpolation_that_errs_more_than_asked_is_warned_of_with_the_number(air, coarse):
    """A detour of 0.5 m between masters 200 Hz apart, which turns by 1.8 rad."""
    body, masters, lines = sphere(0.1, 1), np.linspace(1000.0, 2000.0, 6), np.linspace(1000.0, 2000.0, 41)
    turn = np.exp(-2j * np.pi * 0.5 / air.speed_of_sound * masters)[:, None, None]
    atv = cases.monopoles(body, POINTS, masters, air)
    atv = atv.replace(vectors=atv.vectors * turn)
    velocity = SurfaceVelocity(lines, np.ones((41, len(body.triangles))), body)
    exact = cases.monopoles(body, POINTS, lines, air).vectors.sum(axis=2)
    exact = exact * np.exp(-2j * np.pi * 0.5 / air.speed_of_sound * lines)[:, None]
    with pytest.warns(
        AccuracyWarning, match=r"errs by an estimated [\d.]+ dB .* 0\.1 dB asked: take more masters"
    ) as said:
        field = radiate(atv, velocity, fidelity=coarse)
    told = float(str(said[0].message).split("estimated ")[1].split(" dB")[0])
    relative = np.abs(field.pressure - exact).max(axis=0) / np.abs(exact).max(axis=0)
    truth = 20 * np.log10(1 + relative.max())
    assert truth / 3 < told < truth * 3
    assert told == pytest.approx(20 * np.log10(1 + max(field.accuracy.interpolation_error)), rel=0.02)


def test_interpolation_as_good_as_asked_is_quiet(air, coarse):
    body, masters, lines = sphere(0.1, 1), np.linspace(100.0, 2000.0, 11), np.linspace(100.0, 2000.0, 41)
    velocity = SurfaceVelocity(lines, np.ones((41, len(body.triangles))), body)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        radiate(cases.monopoles(body, POINTS, masters, air), velocity, fidelity=coarse)


def test_two_masters_say_what_a_body_of_that_size_lets_expect(air, coarse):
    """A detour of a radius between masters 800 Hz apart: 2.2 rad, which no third master shows."""
    body, masters, lines = sphere(0.15, 1), np.array([900.0, 1700.0]), np.linspace(900.0, 1700.0, 9)

    def vectors(frequency):
        turn = np.exp(-2j * np.pi * 0.15 / air.speed_of_sound * frequency)[:, None, None]
        atv = cases.monopoles(body, POINTS, frequency, air)
        return atv.replace(vectors=atv.vectors * turn)

    velocity = SurfaceVelocity(lines, np.ones((9, len(body.triangles))), body)
    exact = vectors(lines).vectors.sum(axis=2)
    with pytest.warns(AccuracyWarning, match=r"errs by an estimated [\d.]+ dB"):
        field = radiate(vectors(masters), velocity, fidelity=coarse)
    truth = np.abs(field.pressure - exact).max(axis=0) / np.abs(exact).max(axis=0)
    told = np.array(field.accuracy.interpolation_error)
    assert ((told > 0.9 * truth) & (told < 3 * truth)).all(), told / truth


@pytest.mark.filterwarnings("ignore:interpolation between", "ignore:the parts of the motion cancel")
def test_two_masters_say_how_fast_a_quadrupole_grows(air, coarse):
    """With f³ far from a small body, ten times faster than its sound turns."""
    body, masters, lines = sphere(0.1, 2), np.array([50.0, 90.0]), np.linspace(50.0, 90.0, 5)
    far = np.array([[10.0, 8.0, 6.0]])
    velocity = SurfaceVelocity(lines, np.tile(body.normals[:, 0] * body.normals[:, 1], (5, 1)), body)
    few, truth = (transfer_vectors(body, far, at, air=air, fidelity=coarse) for at in (masters, lines))
    exact, field = (radiate(atv, velocity, fidelity=coarse) for atv in (truth, few))
    error = np.abs(field.pressure - exact.pressure).max() / np.abs(exact.pressure).max()
    assert error < max(field.accuracy.interpolation_error) < 30 * error


def test_echo_from_a_high_plane_that_no_master_shows_is_told(air, coarse):
    """Masters as far apart as the echo takes to turn once see it as a constant: 1.5 % of the pressure, 0.13 dB."""
    body, plane = sphere(0.15, 1), RigidPlane((0.0, 0.0, -5.0), (0.0, 0.0, 1.0))

    def vectors(frequency):
        echo = 1 + 0.015 * np.exp(-2j * np.pi * 10.0 / air.speed_of_sound * frequency)[:, None, None]
        ends = (POINTS, plane.mirror(POINTS))
        direct, image = (cases.monopoles(body, end, frequency, air).vectors * echo for end in ends)
        return cases.monopoles(body, POINTS, frequency, air, vectors=direct + image, image_vectors=image, plane=plane)

    masters = 200.0 + 34.3 * np.arange(12)
    lines = np.linspace(200.0, 500.0, 61)
    velocity = SurfaceVelocity(lines, np.ones((61, len(body.triangles))), body)
    exact = vectors(lines).vectors.sum(axis=2)
    with pytest.warns(AccuracyWarning, match=r"estimated 0\.1\d dB"):
        field = radiate(vectors(masters), velocity, fidelity=coarse)
    truth = np.abs(field.pressure - exact).max(axis=0) / np.abs(exact).max(axis=0)
    told = np.array(field.accuracy.interpolation_error)
    assert ((told > truth / 3) & (told < 3 * truth)).all(), told / truth
    closer = radiate(vectors(200.0 + 8.0 * np.arange(40)), velocity, fidelity=coarse)
    assert max(closer.accuracy.interpolation_error) < 1e-3


@pytest.mark.filterwarnings("ignore:interpolation between")
def test_a_point_in_the_middle_of_two_bodies_has_the_error_of_one_beside_it(air, coarse):
    """The bound of an echo that no master shows falls with distance from the middle, but not within the body's reach:
    it was 0/0 there."""
    bodies, plane = twice(sphere(0.05, 1), (0.0, 0.2, 0.0)), RigidPlane((0.0, 0.0, -5.0), (0.0, 0.0, 1.0))
    between = np.array([[0.0, 0.1, 0.0], [0.001, 0.1, 0.0]])
    lines = np.linspace(500.0, 1000.0, 11)
    velocity = SurfaceVelocity(lines, np.ones((11, len(bodies.triangles))), bodies)
    atv = transfer_vectors(bodies, between, np.linspace(500.0, 1000.0, 15), air=air, fidelity=coarse, plane=plane)
    middle, beside = radiate(atv, velocity, fidelity=coarse).accuracy.interpolation_error
    assert middle == pytest.approx(beside, rel=0.05)
    assert middle > 1e-3
