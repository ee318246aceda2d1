"""Points inside and outside bodies, and how near: against closed forms and triangles that are sampled."""

import time

import numpy as np
import pytest

from nvhchain.acoustics import check_points, sphere
from nvhchain.acoustics.surfaces import clearance
from nvhchain.acoustics.surfaces.clearance import clearances, winding_numbers
from nvhchain.errors import InputError
from nvhchain.testing import bodies

BRACKET = bodies.box((0.2, 0.2, 0.1), 0.025, remove=lambda c: c[0] > 0.1 and c[1] > 0.1)


def scattered(count, seed=0):
    return np.random.default_rng(seed).uniform([-0.12, -0.12, -0.07], [0.12, 0.12, 0.07], (count, 3))


@pytest.mark.parametrize("away", [0.0, 1e4])
def test_winding_numbers_are_one_inside_a_bracket_and_zero_outside_wherever_it_stands(away):
    points = scattered(500)
    inside = (np.abs(points) < [0.1, 0.1, 0.05]).all(axis=1) & ~((points[:, 0] > 0) & (points[:, 1] > 0))
    corners = BRACKET.vertices[BRACKET.triangles]
    assert winding_numbers(corners + away, points + away) == pytest.approx(inside.astype(float), abs=1e-6)
    assert 100 < inside.sum() < 400


def test_clearances_are_those_of_the_triangle_that_is_nearest_in_edges_of_its_own():
    """From below: of 2000 points on every triangle one is at most a twenty-fifth of an edge from the nearest."""
    points, body = scattered(40, seed=1), bodies.wedge(20)
    u, v = np.random.default_rng(2).uniform(size=(2, 2000, 1, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = (body.vertices[body.triangles[:, i]] for i in range(3))
    on_faces = a + u * (b - a) + v * (c - a)
    sampled = np.array([(np.linalg.norm(on_faces - x, axis=2).min(axis=0) / body.longest_edges).min() for x in points])
    found = clearances(body, points)
    assert (found <= sampled + 1e-12).all()
    assert (found > sampled - 0.04).all()


@pytest.mark.parametrize("reach", [1e-3, 0.5, 2.0])
def test_clearances_beyond_reach_are_infinite_and_all_others_as_without_it(reach, monkeypatch):
    beside = [BRACKET.centroids[::9] + 1e-5 * BRACKET.normals[::9], BRACKET.vertices[::9] * (1.0 + 1e-5)]
    points = np.concatenate([scattered(60), *beside])
    whole = clearances(BRACKET, points)
    monkeypatch.setattr(clearance, "_PAIRS", 7)
    near = clearances(BRACKET, points, reach)
    assert (near == np.where(whole < reach, whole, np.inf)).all()
    assert np.isfinite(near).any()


def test_points_about_a_sphere_are_as_far_as_they_are_put():
    body = sphere(0.1, 3)
    points = bodies.shell(100, 0.3)
    far = clearances(body, points) * body.longest_edges.mean()
    assert far == pytest.approx(np.full(100, 0.2), rel=0.1)


@pytest.mark.slow
def test_ten_thousand_points_within_the_hollow_of_a_fine_body_are_checked_in_seconds():
    """A map of the field in the opening of a bracket; one after the other they took half a minute."""
    fine = bodies.quartered(bodies.quartered(BRACKET))
    assert len(fine.triangles) > 7000
    points = np.random.default_rng(3).uniform([0.01, 0.01, -0.049], [0.099, 0.099, 0.049], (10_000, 3))
    start = time.perf_counter()
    assert check_points(fine, points).shape == (10_000, 3)
    assert time.perf_counter() - start < 15.0
    points[7123] = [-0.05, 0.02, 0.0]
    with pytest.raises(InputError, match=r"field point 7123 at .* lies inside the body"):
        check_points(fine, points)
