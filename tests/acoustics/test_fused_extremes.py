"""Extremes of the fused engine: sizes, wavenumbers, needles, gaps and several bodies, each against something exact."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from nvhchain.acoustics import sphere
from nvhchain.acoustics.fused import engine
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface
from nvhchain.testing.bodies import box, source_field, twice, united
from tests.acoustics.closure_error import closure_error

FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=2)


@dataclass(frozen=True)
class Floor:
    """The plane z = height."""

    height: float

    def mirror(self, points):
        return points * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * self.height]

    def mirror_direction(self, vectors):
        return vectors * [1.0, 1.0, -1.0]


def relative(value, reference):
    return np.abs(value - reference).max() / np.abs(reference).max()


def source_error(surface, source, k, fidelity=FIDELITY):
    """Error of the surface pressure of a source inside the body, relative, RMS."""
    gradient = np.einsum("fj,fj->f", source_field(surface.centroids, source, k)[1], surface.normals)
    exact = source_field(surface.vertices, source, k)[0]
    a, b = next(engine.systems(surface, [k], fidelity))
    return np.linalg.norm(np.linalg.solve(a, b @ gradient) - exact) / np.linalg.norm(exact)


def stacked(gap, edge):
    return twice(box((0.12, 0.12, 0.12), edge), (0.0, 0.0, 0.12 + gap))


@pytest.mark.parametrize("size", [1e-3, 10.0, 1e4])
def test_matrices_of_a_body_of_any_size_are_those_of_one_metre_scaled(size):
    body, k = sphere(1.0, 2), np.array([1e-3, 2.0])
    scaled = Surface(body.vertices * size, body.triangles)
    for (a, b), (a_one, b_one) in zip(
        engine.systems(scaled, k / size, FIDELITY), engine.systems(body, k, FIDELITY), strict=True
    ):
        assert relative(a, a_one * size**2) < 1e-12
        assert relative(b, b_one * size**3) < 1e-12


def test_the_error_is_flat_from_a_millionth_of_a_radian_per_metre_up_and_grows_to_the_mesh_limit():
    surface = sphere(0.1, 2)
    limit = np.pi / surface.longest_edges.mean()  # two elements per wavelength
    errors = [source_error(surface, (0.02, 0.01, -0.03), k) for k in (1e-6, 1e-3, 1.0, 0.25 * limit, limit)]
    assert max(errors[:3]) < 1.02 * min(errors[:3])
    assert errors[0] < 0.03
    assert errors[3] < 0.05
    assert errors[0] < errors[3] < errors[4] < 0.2


@pytest.mark.parametrize(("aspect", "limit"), [(1, 2e-4), (10, 6e-3), (30, 4e-2)])
def test_needles_lose_accuracy_gradually_and_the_closure_error_says_so(aspect, limit):
    body = box((0.1, 0.1, 0.1), 0.05)
    needles = Surface(body.vertices * [1.0, 1.0, aspect], body.triangles)
    assert 0.01 * limit < closure_error(needles, FIDELITY) < limit


def test_touching_needles_take_a_higher_order_that_leaves_a_sixth_of_the_error():
    body = box((0.1, 0.1, 0.1), 0.05)
    needles = Surface(body.vertices * [1.0, 1.0, 10.0], body.triangles)
    as_others = replace(FIDELITY, needle_aspect=1e6)
    assert closure_error(needles, as_others) > 6 * closure_error(needles, FIDELITY)


@pytest.mark.parametrize(("gap", "halvings", "low", "high"), [(0.004, 5, 0.0, 3e-4), (0.004, 0, 3e-3, 1.0)])
def test_closure_error_tells_a_thin_gap_that_is_resolved_from_one_that_is_not(gap, halvings, low, high):
    assert low < closure_error(stacked(gap, 0.04), replace(FIDELITY, gap_halvings=halvings)) < high


def test_closure_error_over_a_near_plane_is_as_small_as_without_and_sees_a_plane_that_is_too_near():
    body = box((0.12, 0.12, 0.12), 0.04)
    free = closure_error(body, FIDELITY)
    assert free < 2e-4
    assert closure_error(body, FIDELITY, Floor(-0.06 - 0.004)) < 1.5 * free
    assert closure_error(body, replace(FIDELITY, gap_halvings=0), Floor(-0.06 - 0.001)) > 20 * free


def test_two_bodies_of_very_different_size_radiate_as_their_sources():
    large, small = sphere(0.1, 2), sphere(0.01, 2, (0.16, 0.0, 0.0))
    surface = united(large, small)
    k, sources = 10.0, ((0.0, 0.0, 0.02), (0.16, 0.0, 0.001))
    gradient = sum(source_field(surface.centroids, each, k)[1] for each in sources)
    exact = sum(source_field(surface.vertices, each, k)[0] for each in sources)
    a, b = next(engine.systems(surface, [k], FIDELITY))
    pressure = np.linalg.solve(a, b @ np.einsum("fj,fj->f", gradient, surface.normals))
    for body in (slice(0, len(large.vertices)), slice(len(large.vertices), None)):
        assert np.linalg.norm(pressure[body] - exact[body]) / np.linalg.norm(exact[body]) < 0.03
