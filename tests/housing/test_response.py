"""Forced response of a reduced housing."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain.housing.modes.response as response
from nvhchain.errors import InputError, ResourceError
from nvhchain.handoff import ForceSpectrum, ReducedHousing, Surface
from nvhchain.handoff import housing as velocity_fields
from nvhchain.housing import respond

TETRAHEDRON = Surface(
    vertices=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    triangles=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


@pytest.fixture
def housing():
    rng = np.random.default_rng(4)
    residual = rng.standard_normal((6, 6)) * 1e-10
    return ReducedHousing(
        natural_frequency=np.array([400.0, 900.0]),
        modal_damping=np.array([0.01, 0.03]),
        seat_shapes=rng.standard_normal((2, 2, 3)),
        normal_shapes=rng.standard_normal((2, 4)),
        seat_residual=(residual + residual.T).reshape(2, 3, 2, 3),
        face_residual=rng.standard_normal((2, 3, 4)) * 1e-10,
        names=("A1", "B1"),
        positions=np.zeros((2, 3)),
        surface=TETRAHEDRON,
    )


def spectrum(frequency, force, names=("A1", "B1")):
    return ForceSpectrum(frequency=frequency, force=force, names=names)


def test_velocity_is_the_modal_sum_plus_residual_times_j_omega(housing):
    rng = np.random.default_rng(5)
    frequency = np.array([0.0, 130.0, 399.0, 400.0, 2000.0])
    force = rng.standard_normal((5, 2, 3)) + 1j * rng.standard_normal((5, 2, 3))
    velocity = respond(housing, spectrum(frequency, force)).normal_velocity
    for f, F, v in zip(frequency, force.reshape(5, 6), velocity, strict=True):
        omega, u = 2 * np.pi * f, F @ housing.face_residual.reshape(6, 4)
        for r in range(2):
            natural = 2 * np.pi * housing.natural_frequency[r]
            gain = 1 / (natural**2 - omega**2 + 2j * housing.modal_damping[r] * natural * omega)
            u = u + (housing.seat_shapes[r].ravel() @ F) * gain * housing.normal_shapes[r]
        assert np.allclose(v, 1j * omega * u, rtol=1e-12, atol=0)


def test_time_domain_oscillator_has_the_same_phase(housing):
    # one mode, driven at 350 Hz below resonance: displacement follows the force, velocity leads it by 90°
    still = housing.replace(
        modal_damping=np.array([1e-6, 1e-6]),
        seat_residual=np.zeros((2, 3, 2, 3)),
        face_residual=np.zeros((2, 3, 4)),
        seat_shapes=np.ones((2, 2, 3)),
        normal_shapes=np.ones((2, 4)),
    )
    force = np.zeros((1, 2, 3))
    force[0, 0, 0] = 1.0
    velocity = respond(still, spectrum([350.0], force)).normal_velocity[0]
    assert np.angle(velocity) == pytest.approx(np.pi / 2, abs=1e-4)


def test_only_lines_with_force_are_computed(housing):
    force = np.zeros((4, 2, 3), dtype=complex)
    force[[1, 3], 1, 2] = 1.0
    velocity = respond(housing, spectrum([100.0, 200.0, 300.0, 400.0], force))
    assert velocity.frequency.tolist() == [200.0, 400.0]
    silent = respond(housing, spectrum([100.0, 200.0], np.zeros((2, 2, 3))))
    assert not silent.normal_velocity.any()


def test_lines_beyond_one_block_are_computed_alike(housing, monkeypatch):
    force = np.random.default_rng(6).standard_normal((50, 2, 3))
    frequency = np.linspace(10, 1000, 50)
    whole = respond(housing, spectrum(frequency, force)).normal_velocity
    for module in (response, velocity_fields):
        monkeypatch.setattr(module, "LINES_PER_PRODUCT", 7)
    assert np.allclose(respond(housing, spectrum(frequency, force)).normal_velocity, whole, rtol=1e-13)


def test_thousands_of_lines_take_a_handful_of_matrix_products(housing, monkeypatch):
    products = []
    times = response.times_real
    for module in (response, velocity_fields):
        monkeypatch.setattr(module, "times_real", lambda a, b: products.append(len(a)) or times(a, b))
    count = 4000
    force = np.random.default_rng(6).standard_normal((count, 2, 3))
    frequency = np.linspace(10, 1000, count)
    velocity = respond(housing, spectrum(frequency, force)).normal_velocity
    assert sum(products) == 2 * count  # forces on modes, then modes and residual on faces
    assert len(products) <= 16
    for line in (0, 511, 512, 3999):
        alone = respond(housing, spectrum(frequency[[line]], force[[line]])).normal_velocity
        assert np.allclose(velocity[line], alone, rtol=1e-12, atol=0)


def test_bearings_are_matched_by_name(housing):
    force = np.random.default_rng(7).standard_normal((1, 2, 3))
    one = respond(housing, spectrum([500.0], force)).normal_velocity
    other = respond(housing, spectrum([500.0], force[:, ::-1], names=("B1", "A1"))).normal_velocity
    assert np.allclose(one, other, rtol=1e-13)
    with pytest.raises(InputError, match="unknown to it: Z9; without force: B1"):
        respond(housing, spectrum([500.0], force, names=("A1", "Z9")))


def test_response_that_does_not_fit_into_memory_is_refused(housing, monkeypatch):
    monkeypatch.setattr(response, "free_memory", lambda: 100)
    with pytest.raises(ResourceError, match="narrow the band"):
        respond(housing, spectrum([500.0], np.ones((1, 2, 3))))


def test_faces_at_rest_stay_at_rest(reduced):
    from nvhchain.housing.casting.mesh import mounting_plane_faces

    names = reduced.names
    velocity = respond(reduced, spectrum([1000.0], np.ones((1, len(names), 3)), names=names))
    assert not velocity.normal_velocity[0, mounting_plane_faces(reduced.surface)].any()
    assert velocity.normal_velocity[0, ~mounting_plane_faces(reduced.surface)].all()


def test_case_data_are_not_changed_by_the_reduction(casting):
    assert replace(casting) == casting
