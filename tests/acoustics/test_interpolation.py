"""Transfer vectors between their masters."""

import numpy as np
import pytest

from nvhchain.acoustics import project, radiate, sphere, vectors_at
from nvhchain.conventions import Air
from nvhchain.errors import InputError, ResourceError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity, TransferVectors

LINES = np.array([210.0, 333.3, 500.0, 777.0, 1490.0])


@pytest.fixture(scope="module")
def fidelity():
    return AcousticsFidelity(elements_per_wavelength=2.0, masters=16)


@pytest.fixture(scope="module")
def detour():
    """Any response with conjugate symmetry that is smooth without its phase: two arrivals per face and point."""
    body, air = sphere(0.1, 1), Air(343.0, 1.21)
    points = np.array([[0.0, 0.0, 1.0], [0.0, 2.0, 0.0]])
    r = np.linalg.norm(points[:, None] - body.centroids, axis=2)
    masters = np.linspace(200.0, 1500.0, 16)
    k = 2 * np.pi * masters[:, None, None] / air.speed_of_sound
    return TransferVectors(masters, points, 1j * k * (np.exp(-1j * k * r) + np.exp(-1j * k * (r + 0.1))), body, air)


@pytest.mark.parametrize("interpolation", ["phase_removed", "linear"])
def test_projection_and_vectors_at_lines_give_the_pressure_that_radiate_gives(detour, interpolation):
    fidelity = AcousticsFidelity(elements_per_wavelength=2.0, masters=16, interpolation=interpolation)
    shapes = np.random.default_rng(1).normal(size=(len(detour.surface.triangles), 3))
    amplitude = np.array([1.0, 0.5 - 2.0j, 0.3j])
    velocity = SurfaceVelocity(LINES, np.tile(shapes @ amplitude, (len(LINES), 1)), detour.surface)
    pressure = radiate(detour, velocity, fidelity=fidelity).pressure
    scale = np.abs(pressure).max()
    seen = []
    for columns in (shapes, shapes + 0j):
        product = project(detour, columns, LINES, fidelity=fidelity, progress=lambda *step: seen.append(step))
        assert np.abs(product @ amplitude - pressure).max() < 1e-12 * scale
    assert seen[1] == (5, 5)
    at = vectors_at(detour, LINES, fidelity=fidelity)
    assert np.abs(np.einsum("fmi,fi->fm", at.vectors, velocity.normal_velocity) - pressure).max() < 1e-12 * scale


def test_shapes_of_another_surface_and_lines_outside_the_masters_are_refused(detour, fidelity):
    with pytest.raises(InputError, match=r"\(80, n_column\) is needed"):
        project(detour, np.ones((79, 2)), LINES, fidelity=fidelity)
    with pytest.raises(InputError, match="outside the master frequencies"):
        vectors_at(detour, [100.0], fidelity=fidelity)


def test_results_that_do_not_fit_into_memory_are_refused_before_any_is_computed(detour, fidelity, monkeypatch):
    monkeypatch.setattr(
        "nvhchain.acoustics.projection.psutil.virtual_memory", lambda: type("M", (), {"available": 2**10})
    )
    with pytest.raises(ResourceError, match="fewer lines"):
        vectors_at(detour, LINES, fidelity=fidelity)
    with pytest.raises(ResourceError, match="fewer lines"):
        project(detour, np.ones((80, 9)), LINES, fidelity=fidelity)
