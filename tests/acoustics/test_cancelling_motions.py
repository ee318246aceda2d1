"""Motions whose parts cancel: `radiate` bounds what the mesh makes of them, from an estimated surface pressure."""

import warnings

import acoustics_bodies as bodies
import numpy as np
import pytest
import radiation_cases as cases

from nvhchain.acoustics import radiate, solve_direct, sphere, surface_pressure, transfer_vectors
from nvhchain.acoustics.cancellation import COMPACT, cancellation_of_motion, pressure_of_motion
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import Surface, SurfaceVelocity

CANCEL = "the parts of the motion cancel each other at 1 lines"


def plate(across=8):
    body = bodies.box((across, across, 1), 1.0)
    return Surface(body.vertices * [0.3 / across, 0.3 / across, 0.01], body.triangles)


def bending(body, along=3, across=3):
    """Half waves along both sides of 0.3 m."""
    x, y, _ = np.pi * (body.centroids.T / 0.3 + 0.5)
    return np.cos(along * x) * np.cos(across * y) * body.normals[:, 2]


def twisting(body):
    along = np.outer(body.centroids[:, 0], [1.0, 0.0, 0.0])
    return np.einsum("ij,ij->i", np.cross(along, body.centroids), body.normals)


PLATE, BLOCK, BALL = plate(), bodies.box((0.3, 0.2, 0.1), 0.05), sphere(0.1, 2)
POLAR = BALL.centroids[:, 2] / np.linalg.norm(BALL.centroids, axis=1)
MOTIONS = {
    "plate that heaves": (PLATE, PLATE.normals[:, 2]),
    "plate that bends": (PLATE, bending(PLATE, 1, 1)),
    "plate that bends in waves": (PLATE, bending(PLATE)),
    "block in torsion": (BLOCK, twisting(BLOCK)),
    "block that pulsates": (BLOCK, np.ones(len(BLOCK.triangles))),
    "block at random": (BLOCK, np.random.default_rng(0).standard_normal(len(BLOCK.triangles))),
    "sphere that pulsates": (BALL, np.ones(len(BALL.triangles))),
    "sphere that heaves": (BALL, POLAR),
    "sphere, third degree": (BALL, 2.5 * POLAR**3 - 1.5 * POLAR),
}


def moving(body, velocity, frequency):
    return SurfaceVelocity([frequency], velocity[None].astype(complex), body)


def silent(call, *arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        return call(*arguments, **options)


@pytest.mark.parametrize("of_limit", [0.01, 0.3, 0.9])
@pytest.mark.parametrize("motion", MOTIONS)
def test_pressure_on_the_surface_is_estimated_within_a_factor_of_three(air, motion, of_limit):
    """Root mean square over the faces, against boundary elements."""
    body, velocity = MOTIONS[motion]
    wavenumber = of_limit * COMPACT / (0.5 * np.linalg.norm(np.ptp(body.vertices, axis=0)))
    frequency = wavenumber * air.speed_of_sound / (2 * np.pi)
    exact = (
        silent(surface_pressure, moving(body, velocity, frequency), air=air).pressure[0, body.triangles].mean(axis=1)
    )
    found = pressure_of_motion(body, np.array([wavenumber]), velocity[:, None].astype(complex), air)[:, 0]
    sizes = [np.sqrt(body.areas @ np.abs(one) ** 2) for one in (found, exact)]
    assert 0.6 < sizes[0] / sizes[1] < 3.0


@pytest.mark.parametrize(
    ("body", "velocity", "frequency", "distance", "least", "most"),
    [(PLATE, bending(PLATE), 200.0, 1.0, 0.8, 1.2), (BLOCK, twisting(BLOCK), 1.0, 1000.0, 10.0, 14.0)],
    ids=["bending", "twisting"],
)
def test_errors_beyond_that_of_the_mesh_are_bounded_as_solve_direct_bounds_them(
    air, body, velocity, frequency, distance, least, most
):
    """Nothing was said where four elements to a wave err by 1 dB and a block in torsion by 12, 0.03 and 0.07 stated."""
    points, fine = bodies.shell(30, distance), bodies.quartered(bodies.quartered(body))
    exact = silent(solve_direct, moving(fine, np.repeat(velocity, 16), frequency), points, air=air).pressure
    direct = silent(solve_direct, moving(body, velocity, frequency), points, air=air)
    atv = transfer_vectors(body, points, [frequency], air=air)
    with pytest.warns(AccuracyWarning, match=CANCEL):
        heard = radiate(atv, moving(body, velocity, frequency))
    true = 20 * np.log10(1 + np.abs(heard.pressure - exact).max() / np.abs(exact).max())
    assert least < true < most
    assert atv.provenance["expected_error_dB"] < 0.1
    stated = heard.provenance["cancellation_error_dB"]
    assert true < stated
    size, of_direct = (10 ** (of.provenance["cancellation_error_dB"] / 20) - 1 for of in (heard, direct))
    assert 0.7 < size / of_direct < 3.0
    assert heard.provenance["cancellation_frequency"] == frequency


def test_motions_that_are_heard_and_bodies_that_are_not_compact_give_no_alarm(air):
    limit = COMPACT * air.speed_of_sound / (np.pi * np.linalg.norm(np.ptp(BLOCK.vertices, axis=0)))
    lines = np.array([20.0, 0.99 * limit, 1.01 * limit])
    atv = silent(transfer_vectors, BLOCK, bodies.shell(10, 1.0), lines, air=air)
    heaving = SurfaceVelocity(lines, np.tile(BLOCK.normals[:, 2], (3, 1)), BLOCK)
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        heard = radiate(atv, heaving)
        assert 0 < heard.provenance["cancellation_error_dB"] < 0.6
        left = cancellation_of_motion(heaving, atv.points, air, None, 0.0)
        assert (left > 0).tolist() == [True, True, False]
        above = SurfaceVelocity(lines[2:], twisting(BLOCK)[None], BLOCK)
        assert "cancellation_error_dB" not in radiate(atv, above).provenance


def test_vectors_that_are_not_those_of_a_mesh_state_nothing(air):
    atv = cases.monopoles(BLOCK, bodies.shell(10, 1.0), [100.0], air)
    assert "cancellation_error_dB" not in radiate(atv, moving(BLOCK, twisting(BLOCK), 100.0)).provenance


def test_a_large_body_at_rest_hides_nothing_of_a_small_one(air):
    """Each has the half diagonal of its own."""
    away = bodies.box((3.0, 2.0, 1.0), 0.5)
    both = bodies.united(BLOCK, Surface(away.vertices - [0.0, 0.0, 15.0], away.triangles))
    twist, points = twisting(BLOCK), bodies.shell(10, 1.0)
    alone = cancellation_of_motion(moving(BLOCK, twist, 100.0), points, air, None, 0.0)
    one = moving(both, np.concatenate([twist, np.zeros(len(away.triangles))]), 100.0)
    assert cancellation_of_motion(one, points, air, None, 0.0) == pytest.approx(alone)
