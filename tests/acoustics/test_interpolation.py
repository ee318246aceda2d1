"""Transfer vectors between their masters."""

from importlib import import_module

import numpy as np
import pytest
from numpy.polynomial import Chebyshev

from nvhchain.acoustics import interpolate_vectors, interpolation_error, radiate, sphere
from nvhchain.acoustics.interpolation.nodes import interpolant
from nvhchain.acoustics.interpolation.rational import Window, window
from nvhchain.acoustics.radiation.projection import products
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


def test_projection_and_vectors_at_lines_give_the_pressure_that_radiate_gives(detour, fidelity):
    shapes = np.random.default_rng(1).normal(size=(len(detour.surface.triangles), 3))
    amplitude = np.array([1.0, 0.5 - 2.0j, 0.3j])
    velocity = SurfaceVelocity(LINES, np.tile(shapes @ amplitude, (len(LINES), 1)), detour.surface)
    pressure = radiate(detour, velocity, fidelity=fidelity).pressure
    scale = np.abs(pressure).max()
    seen, smooth = [], interpolant(detour, fidelity)
    for columns in (shapes, shapes + 0j):
        product = products(smooth, columns, LINES, len(detour.points), lambda *step: seen.append(step))
        assert np.abs(product @ amplitude - pressure).max() < 1e-12 * scale
    assert seen[1] == (5, 5)
    at = interpolate_vectors(detour, LINES, fidelity=fidelity)
    assert np.abs(np.einsum("fmi,fi->fm", at.vectors, velocity.normal_velocity) - pressure).max() < 1e-12 * scale


def test_lines_outside_the_masters_are_refused(detour, fidelity):
    with pytest.raises(InputError, match="outside the master frequencies"):
        interpolate_vectors(detour, [100.0], fidelity=fidelity)


def test_results_that_do_not_fit_into_memory_are_refused_before_any_is_computed(detour, fidelity, monkeypatch):
    smooth = interpolant(detour, fidelity)
    monkeypatch.setattr("psutil.virtual_memory", lambda: type("M", (), {"available": 2**10}))
    with pytest.raises(ResourceError, match="fewer lines"):
        interpolate_vectors(detour, LINES, fidelity=fidelity)
    with pytest.raises(ResourceError, match="fewer lines"):
        products(smooth, np.ones((80, 9)), LINES, len(detour.points), None)


def resonating(frequency, points, poles, body, air):
    """Vectors jω e^{−jkr} (1 + detour + resonances), resonances being conjugate at negative frequency."""
    f = frequency[:, None, None]
    r = np.linalg.norm(points[:, None] - body.centroids, axis=2)
    wavenumber = 2 * np.pi * f / air.speed_of_sound
    rng = np.random.default_rng(2)
    response = 1.0 + 0.5 * np.exp(-1j * wavenumber * rng.uniform(0.05, 0.2, len(body.triangles)))
    for pole in poles:
        residue = 50.0 * (rng.normal(size=(2, len(body.triangles))).T @ [1.0, 1.0j])
        response = response + residue / (1j * (f - pole)) + residue.conj() / (1j * (f + np.conj(pole)))
    return TransferVectors(frequency, points, 1j * wavenumber * np.exp(-1j * wavenumber * r) * response, body, air)


@pytest.mark.parametrize("start", [0.0, 20.0, 900.0])
def test_resonances_between_masters_are_reproduced_by_rational_functions_and_not_by_polynomials(start, fidelity):
    """Half widths of 2 and 5 Hz, masters 60 Hz apart; from 0 Hz on, the vectors at −f close the lower end."""
    body, points, air = sphere(0.1, 1), np.array([[0.0, 0.0, 1.0], [5.0, 0.0, 0.0]]), Air()
    poles = [start + 193.0 + 2.0j, start + 409.0 + 5.0j]
    masters, lines = np.arange(start, start + 620.0, 60.0), np.arange(start + 1.0, start + 590.0, 2.0)
    atv = resonating(masters, points, poles, body, air)
    truth = resonating(lines, points, poles, body, air).vectors
    size = np.linalg.norm(truth, axis=2)
    error = np.linalg.norm(interpolate_vectors(atv, lines, fidelity=fidelity).vectors - truth, axis=2) / size
    assert error.max() < 2e-3
    velocity = SurfaceVelocity(lines, np.random.default_rng(8).normal(size=(len(lines), len(body.triangles))), body)
    exact = np.einsum("fmi,fi->fm", truth, velocity.normal_velocity)
    wrong = np.abs(radiate(atv, velocity, fidelity=fidelity).pressure - exact).max(axis=0)
    estimate = interpolation_error(atv, velocity, fidelity=fidelity).max(axis=0)
    assert ((estimate > wrong / 10) & (estimate < wrong * 10)).all(), estimate / wrong


def test_rational_functions_of_low_degree_are_exact_and_vectors_of_rank_one_make_no_false_poles():
    nodes, lines = np.linspace(1.0, 2.0, 8), np.linspace(1.0, 2.0, 101)
    rng = np.random.default_rng(5)

    def error(function):
        values = function(nodes)
        return np.abs(window(nodes, values.conj() @ values.T, 6).weights(lines) @ values - function(lines)).max()

    shapes = rng.normal(size=(4, 40))
    poles = np.array([1.3 + 0.001j, 1.62 + 0.01j])
    assert error(lambda f: shapes[0] + f[:, None] * shapes[1] + (1 / (f[:, None] - poles)) @ shapes[2:]) < 1e-8 * 1e3
    assert error(lambda f: np.outer(np.exp(-3j * f), shapes[0])) < 1e-5
    assert error(lambda f: np.outer(np.ones_like(f), shapes[0])) < 1e-12


def test_lines_at_nodes_1_hz_apart_divide_nothing_by_zero():
    """The weights there are those of the node alone, before they are divided by their sum."""
    nodes = np.array([256.0, 257.0])
    with np.errstate(all="raise"):
        found = Window(nodes, Chebyshev([1.0], domain=nodes)).weights(np.array([256.0, 256.5, 257.0]))
    assert found == pytest.approx(np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]))


def test_pressure_does_not_depend_on_how_points_are_put_together(detour, fidelity, monkeypatch):
    velocity = SurfaceVelocity(LINES, np.ones((len(LINES), len(detour.surface.triangles))), detour.surface)
    pressure = radiate(detour, velocity, fidelity=fidelity).pressure
    monkeypatch.setattr(import_module("nvhchain.acoustics.radiation.radiate"), "_BLOCK_BYTES", 1)
    assert np.array_equal(radiate(detour, velocity, fidelity=fidelity).pressure, pressure)
