"""Quadrature errors that are stated beforehand, and what fine quadrature costs: needles, sharp edges, narrow gaps."""

import time
import warnings
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import Bempp, solve_direct, sphere, transfer_vectors
from nvhchain.acoustics.accuracy import mesh_error as accuracy
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.fused.closure_check import gap_cost, suspect_error
from nvhchain.acoustics.fused.engine import systems
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.scene.radiation import _SECONDS_PER_PAIR
from nvhchain.testing import bodies
from tests.acoustics.closure_error import closure_error

KNOBS = AcousticsFidelity(elements_per_wavelength=1.0, masters=4, coarsest_elements_per_wavelength=1.0)


def needles(aspect):
    body = bodies.box((0.1, 0.1, 0.1), 0.05)
    return Surface(body.vertices * [1.0, 1.0, aspect], body.triangles)


def test_quadrature_error_from_some_rows_of_needles_is_that_of_all(air):
    for aspect in (10, 30):
        assert suspect_error(needles(aspect), KNOBS) == pytest.approx(closure_error(needles(aspect), KNOBS), rel=0.3)
    assert suspect_error(bodies.box((0.1, 0.1, 0.1), 0.05), KNOBS) is None


def layer(aspect):
    """A cube of 100 mm with one layer of triangles so many times as long as high."""
    plain = bodies.box((0.1, 0.1, 0.1), 0.025)
    layers = np.unique(np.round(plain.vertices[:, 2], 9))
    thin = layers.copy()
    thin[2] = thin[1] + (thin[2] - thin[1]) / aspect
    vertices = plain.vertices.copy()
    vertices[:, 2] = np.interp(vertices[:, 2], layers, thin)
    return Surface(vertices, plain.triangles)


@pytest.mark.parametrize(("aspect", "least"), [(100, 5e-4), pytest.param(300, 2e-3, marks=pytest.mark.slow)])
def test_quadrature_error_of_very_slender_needles_is_true(aspect, least):
    """A constant pressure alone, which the double layer takes, would state 5e-5 at any aspect ratio."""
    body, k, source = layer(aspect), 10.0, (0.005, -0.005, -0.003)
    gradient = np.einsum("fj,fj->f", bodies.source_field(body.centroids, source, k)[1], body.normals)
    found, exact = (
        np.linalg.solve(a, b @ gradient)
        for knobs in (KNOBS, replace(KNOBS, singular_order=6))
        for a, b in systems(body, [k], knobs)
    )
    true = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    stated = suspect_error(body, KNOBS)
    assert stated > least
    assert stated / 3 < true < 8 * stated


def test_lists_of_close_orders_and_distances_count_as_tuples():
    listed = replace(KNOBS, close_distances=[1.5, 3.0], close_orders=[6, 4])
    assert listed == KNOBS
    assert suspect_error(needles(10), listed) == suspect_error(needles(10), KNOBS)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:surface mesh with elements of")
def test_needles_are_reported_and_warned_of_with_their_quadrature_error_and_other_meshes_are_not(air):
    with pytest.warns(AccuracyWarning, match=r"needles, .* relative quadrature error of 0.02\d on the surface, 0.002"):
        vectors = transfer_vectors(needles(30), [[1.0, 0.0, 0.0]], [10.0], air=air, fidelity=KNOBS)
    assert vectors.accuracy.quadrature_error == suspect_error(needles(30), KNOBS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        vectors = transfer_vectors(needles(1), [[1.0, 0.0, 0.0]], [10.0], air=air, fidelity=KNOBS)
    assert vectors.accuracy.quadrature_error is None


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [5, 10, 20])
def test_quadrature_error_at_the_edge_of_a_wedge_is_true(degrees):
    """Its sides are near each other where they touch, which no needle and no gap tells of."""
    body, k, source = bodies.wedge(degrees), 5.0, (0.06, 0.01, 0.0005)
    gradient = np.einsum("fj,fj->f", bodies.source_field(body.centroids, source, k)[1], body.normals)
    better = replace(KNOBS, singular_order=10, close_orders=(10, 8), gap_halvings=7)
    found, exact = (np.linalg.solve(a, b @ gradient) for knobs in (KNOBS, better) for a, b in systems(body, [k], knobs))
    true = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    assert true / 3 < suspect_error(body, replace(KNOBS, needle_aspect=1e6), KNOBS) < 10 * true


@pytest.mark.parametrize("degrees", [5, 20])
def test_what_a_coarse_edge_of_a_wedge_costs_is_in_the_expected_error(air, degrees):
    """Without the quadrature error of the edge less than half of the truth was stated."""
    body, points, frequency = bodies.wedge(degrees), bodies.shell(20, 0.5), [100.0]
    pressure = []
    for surface in (body, bodies.quartered(bodies.quartered(body))):
        heaving = SurfaceVelocity(frequency, surface.normals[None, :, 2], surface)
        with pytest.warns(AccuracyWarning, match="needles, sharp edges"):
            pressure.append(solve_direct(heaving, points, air=air, fidelity=KNOBS).pressure[0])
    with pytest.warns(AccuracyWarning, match="needles, sharp edges"):
        told = expected_accuracy(body, points, frequency[0], air, KNOBS)
    true = 20 * np.log10(1 + np.abs(pressure[0] - pressure[1]).max() / np.abs(pressure[1]).max())
    assert true / 2 < told.expected_error_low_db < 2.4 * true


def test_quadrature_across_a_gap_does_not_grow_with_the_distance_of_a_third_body(air):
    """It was measured in the extent of all bodies together: 5.9 instead of 0.1 at 100 m."""
    cube, tiny = bodies.box((0.1, 0.1, 0.1), 0.02), bodies.box((0.04, 0.04, 0.04), 0.02)
    two = bodies.twice(cube, (0.1 + 0.03 * 0.0283, 0.0, 0.0))
    stated = []
    for far in (1.0, 100.0):
        three = bodies.united(two, Surface(tiny.vertices + np.array([0.0, far, 0.0]), tiny.triangles))
        with pytest.warns(AccuracyWarning, match="quadrature error"):
            told = expected_accuracy(three, None, 10.0, air, replace(KNOBS, gap_halvings=1))
        stated.append(told.quadrature_error)
    assert stated[1] == pytest.approx(stated[0], rel=0.2)


def stacked(gap):
    return bodies.twice(bodies.box((0.12, 0.12, 0.12), 0.04), (0.0, 0.0, 0.12 + gap))


def test_a_gap_below_what_is_resolved_is_reported_and_a_wider_one_is_not():
    wide, narrow = (stacked(ratio * 0.04 * np.sqrt(2)) for ratio in (0.1, 0.02))
    knobs = replace(KNOBS, gap_halvings=3)
    assert suspect_error(wide, knobs) is None
    assert 5e-4 < suspect_error(narrow, knobs) < 0.1
    assert suspect_error(narrow, KNOBS) is None


def test_engine_bempp_which_cuts_no_triangles_tells_its_error_across_gaps_and_at_needles(air):
    """Its static double layer is the fused engine's without halved triangles and with one order for all pairs."""
    with pytest.warns(AccuracyWarning, match=r"thin gaps .* or use engine fused") as said:
        told = expected_accuracy(stacked(0.03 * 0.04 * np.sqrt(2)), None, 500.0, air, KNOBS, Bempp())
    assert len(said) == 1
    assert 0.005 < told.quadrature_error < 0.5
    assert expected_accuracy(stacked(0.04), None, 500.0, air, KNOBS, Bempp()).quadrature_error is None
    with pytest.warns(AccuracyWarning, match="use engine fused"):
        told = expected_accuracy(needles(10), None, 10.0, air, KNOBS, Bempp())
    assert told.quadrature_error > 2 * suspect_error(needles(10), KNOBS)


def test_what_narrow_gaps_cost_is_said_before_it_is_spent(air):
    edge = 0.04 * np.sqrt(2)
    count, width, slender, seconds, once = gap_cost(stacked(0.02 * edge), KNOBS)
    assert (count, width, slender) == (36, pytest.approx(0.02, rel=1e-6), 0)
    assert seconds == pytest.approx(36 * 7e-6 / 0.02**2, rel=1e-6)
    assert once == 0.0  # this gap is resolved: there is nothing to check
    unresolved = gap_cost(stacked(0.02 * edge), replace(KNOBS, gap_halvings=3))
    assert unresolved[4] == unresolved[3] > 0.0  # the check's vertices are all those of the gap
    assert gap_cost(stacked(0.2 * edge), KNOBS)[2:] == (0, 0.0, 0.0)
    pair = bodies.twice(bodies.box((0.2, 0.2, 0.1), 0.0125), (0.0, 0.0, 0.1 + 2e-4))
    with pytest.warns(
        RuntimeWarning,
        match=r"1024 triangles face .* down to 0.011 .* about 5\d s of .* more, 2\d s where .* 0 s once",
    ):
        expected_accuracy(pair, None, 100.0, air, KNOBS)


def test_needles_side_by_side_are_counted_by_what_they_are_cut_into():
    """0.52 s and 0.063 s of processor time measured at a frequency alone; touching pairs would be 0.22 s and 0.04 s."""
    assert 0.26 < gap_cost(needles(30), KNOBS)[3] < 1.0
    assert 0.045 < gap_cost(needles(10), KNOBS)[3] < 0.12


def fan(count):
    """Two cones of so many needles each, base to base."""
    angle, i = 2 * np.pi * np.arange(count) / count, np.arange(count)
    rim = 0.1 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    up = np.stack([i, (i + 1) % count, np.full(count, count)], axis=1)
    return Surface(np.vstack([rim, [[0, 0, 0.05], [0, 0, -0.05]]]), np.vstack([up, up[:, [1, 0, 2]] + [[0, 0, 1]]]))


@pytest.mark.slow
def test_what_fans_of_needles_cost_is_said_and_true(air, monkeypatch):
    body, plain = fan(60), replace(KNOBS, needle_aspect=1e6, gap_ratio=0.0)
    alone, four = [1.0], [1.0, 2.0, 3.0, 4.0]

    def processor_seconds(surface, knobs, batch):
        start = time.process_time()
        list(systems(surface, batch, knobs))
        return (time.process_time() - start) / len(batch)

    def needle_seconds(surface):
        return processor_seconds(surface, KNOBS, alone) - processor_seconds(surface, plain, alone)

    needle_seconds(fan(30))  # kernels and rules are ready
    small, taken, ball = (
        min(of(surface) for _ in range(3))
        for of, surface in (
            (needle_seconds, fan(30)),
            (needle_seconds, body),
            (lambda surface: processor_seconds(surface, plain, four), sphere(0.1, 3)),
        )
    )
    *_, seconds, once = gap_cost(body, KNOBS)
    assert taken / small == pytest.approx(seconds / gap_cost(fan(30), KNOBS)[3], rel=0.5)
    # This machine against the one that seconds are said for: by a ball, which waits for memory where needles do not.
    # Needles took 0.7 to 1.0 of what is said on one machine, 0.47 on another with memory half as fast.
    slow = ball / (_SECONDS_PER_PAIR * 1280**2)
    assert taken / 4 < slow * seconds < 4 * taken
    assert seconds / 2 < once <= seconds
    monkeypatch.setattr(accuracy, "SLOW_SECONDS", 0.5 * seconds)
    with pytest.warns(RuntimeWarning, match=r"120 triangles are more than 5 times .* fans of needles"):
        expected_accuracy(body, None, 100.0, air, KNOBS)
