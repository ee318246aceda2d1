"""Rows in stripes, and a rigid plane against the doubled body and against a source and its image."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.acoustics import sphere
from nvhchain.acoustics.fused import engine
from nvhchain.errors import ResourceError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface
from nvhchain.testing.bodies import box, notched_box, source_field

FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=2)


@dataclass(frozen=True)
class Tilted:
    """A plane through `point` with unit `normal`."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]

    def mirror(self, points):
        return self.mirror_direction(points - np.array(self.point)) + np.array(self.point)

    def mirror_direction(self, vectors):
        normal = np.array(self.normal)
        return vectors - 2.0 * np.outer(vectors @ normal, normal)


FLOOR = Tilted((0.0, 0.0, -0.08), (0.0, 0.6, 0.8))


def relative(value, reference):
    return np.abs(value - reference).max() / np.abs(reference).max()


def doubled(surface, plane):
    """The body and its mirror image, whose triangles turn round to stay outward."""
    return Surface(
        np.vstack([surface.vertices, plane.mirror(surface.vertices)]),
        np.vstack([surface.triangles, surface.triangles[:, ::-1] + len(surface.vertices)]),
    )


@pytest.mark.parametrize("plane", [None, FLOOR])
@pytest.mark.parametrize("memory", [1, 250_000, 2**30])
def test_stripes_are_the_rows_of_the_whole_matrices(plane, memory):
    surface, k = sphere(0.05, 2), [20.0, 40.0]
    whole = list(engine.systems(surface, k, FIDELITY, plane))
    found = np.zeros(len(surface.vertices), dtype=int)
    for rows, a, b in engine.stripes(surface, k, FIDELITY, plane, memory=memory):
        found[rows] += 1
        for ik, (a_whole, b_whole) in enumerate(whole):
            assert relative(a[ik], a_whole[rows]) < 1e-13
            assert relative(b[ik], b_whole[rows]) < 1e-13
    assert (found == 1).all()


def test_stripes_that_do_not_fit_are_refused_with_numbers(monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(available=1e6))
    with pytest.raises(ResourceError, match=r"stripes of 1280 triangles and 1 wavenumbers take .* GB are free"):
        next(engine.stripes(sphere(0.1, 3), [1.0], FIDELITY))


@pytest.mark.parametrize(
    ("surface", "normal", "gap", "alike"),
    [(notched_box(), (0.0, 0.0, 1.0), 0.02, 1e-12), (sphere(0.1, 2), (0.6, 0.0, 0.8), 0.001, 1e-5)],
    ids=["notched box", "sphere over a narrow gap"],
)
def test_a_rigid_plane_does_what_the_mirrored_body_does(surface, normal, gap, alike, monkeypatch):
    """To rounding; where triangles are cut beside the plane, to 1e-5: of edges equally long the one that comes first is
    halved, which is another one on the mirrored body (5e-6, and the quadrature itself keeps to 1e-4 there)."""
    # The doubled body is larger and would take another coupling.
    monkeypatch.setattr(engine, "coupling", lambda surface, k: -1j / np.hypot(k, 10.0))
    lowest = (surface.vertices @ np.array(normal)).min()
    plane = Tilted(tuple(np.array(normal) * (lowest - gap)), normal)
    two, n, k = doubled(surface, plane), len(surface.vertices), [0.3, 12.0]
    gradient = np.random.default_rng(1).normal(size=len(surface.triangles))
    for (a, b), (a_two, b_two) in zip(
        engine.systems(surface, k, FIDELITY, plane), engine.systems(two, k, FIDELITY), strict=True
    ):
        assert relative(a, a_two[:n, :n] + a_two[:n, n:]) < alike
        assert relative(b, b_two[:n, : len(gradient)] + b_two[:n, len(gradient) :]) < alike
        pressure_two = np.linalg.solve(a_two, b_two @ np.tile(gradient, 2))
        assert relative(np.linalg.solve(a, b @ gradient), pressure_two[:n]) < 1e-3


def test_source_in_a_body_over_a_rigid_plane_radiates_with_its_image():
    surface, k, source = box((0.2, 0.2, 0.2), 0.04), 2 * np.pi / 0.4, np.array([[0.01, 0.02, 0.0]])
    plane = Tilted((0.0, 0.0, -0.14), (0.0, 0.0, 1.0))
    both = [source[0], plane.mirror(source)[0]]
    gradient = sum(source_field(surface.centroids, each, k)[1] for each in both)
    exact = sum(source_field(surface.vertices, each, k)[0] for each in both)
    a, b = next(engine.systems(surface, [k], replace(FIDELITY, quadrature_order=4), plane))
    pressure = np.linalg.solve(a, b @ np.einsum("fj,fj->f", gradient, surface.normals))
    assert np.linalg.norm(pressure - exact) / np.linalg.norm(exact) < 0.03
    free, b = next(engine.systems(surface, [k], FIDELITY))
    assert np.linalg.norm(np.linalg.solve(free, b @ np.ones(len(surface.triangles))) - exact) > 0.2
