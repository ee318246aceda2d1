"""From bearing force to sound: linear in the force, and a delay is a phase; housings respond reciprocally."""

import numpy as np
import pytest

from nvhchain.acoustics import modal_transfer_vectors, noise_transfer_functions, radiate, transfer_vectors
from nvhchain.handoff import BearingForces, ReducedHousing
from nvhchain.housing import respond
from nvhchain.levels import decibel, overall
from nvhchain.spectrum import force_spectrum

RATE, COUNT = 8000.0, 1600
NAMES = ("A1", "B1")


@pytest.fixture(scope="module")
def housing(body):
    """Eight modes with smooth shapes on the egg, and a residual, all symmetric where physics wants it."""
    rng = np.random.default_rng(11)
    seats = 0.3 * rng.standard_normal((8, 2, 3))
    shapes = rng.standard_normal((8, 4)) @ np.vstack([np.ones(len(body.triangles)), 10 * body.centroids.T])
    flexibility = rng.standard_normal((6, 6))
    return ReducedHousing(
        natural_frequency=np.linspace(300.0, 2400.0, 8),
        modal_damping=np.full(8, 0.02),
        seat_shapes=seats,
        normal_shapes=shapes,
        seat_residual=(1e-9 * flexibility @ flexibility.T).reshape(2, 3, 2, 3),
        face_residual=1e-10 * rng.standard_normal((6, len(body.triangles))).reshape(2, 3, -1),
        names=NAMES,
        positions=np.array([[0.0, 0, 0], [0.02, 0, 0]]),
        surface=body,
    )


@pytest.fixture(scope="module")
def forces():
    """A periodic record with many lines on all channels."""
    rng = np.random.default_rng(2)
    time = np.arange(COUNT) / RATE
    lines = 5.0 * np.arange(30, 360)
    wave = np.cos(2 * np.pi * lines * time[:, None] + rng.uniform(0, 6.28, len(lines)))
    force = np.einsum("tl,lbi->tbi", wave, rng.standard_normal((len(lines), 2, 3)))
    return BearingForces(time, force, NAMES, np.zeros((2, 3)), 100.0, periodic=True)


@pytest.fixture(scope="module")
def sound(housing, points, air, fidelity):
    """bearing forces → (spectrum, pressure (n_f, n_point))."""
    vectors = transfer_vectors(housing.surface, points, np.linspace(140.0, 1900.0, 12), air=air, fidelity=fidelity)

    def heard(forces):
        spectrum = force_spectrum(forces, low=150.0, high=1800.0)
        return spectrum, radiate(vectors, respond(housing, spectrum), fidelity=fidelity).pressure

    return heard


def close(found, expected, tolerance):
    return np.abs(found - expected).max() < tolerance * np.abs(expected).max()


def test_twice_the_force_is_six_point_zero_two_decibels_more(forces, sound):
    spectrum, pressure = sound(forces)
    _, louder = sound(forces.replace(force=2 * forces.force))
    assert decibel(louder) - decibel(pressure) == pytest.approx(6.0206, abs=1e-4)
    assert overall(spectrum.frequency, louder) - overall(spectrum.frequency, pressure) == pytest.approx(
        6.0206, abs=1e-4
    )


def test_forces_of_two_bearings_sound_as_the_sum_of_each_alone(forces, sound):
    _, pressure = sound(forces)
    alone = [forces.force * np.eye(2)[bearing][None, :, None] for bearing in range(2)]
    parts = [sound(forces.replace(force=force))[1] for force in alone]
    assert close(sum(parts), pressure, 1e-10)


@pytest.mark.parametrize("samples", [1, 321])
def test_forces_that_come_later_turn_every_line_by_its_phase(forces, sound, samples):
    """x(t − τ) → X e^{−jωτ}, in force and pressure alike, and no level moves."""
    spectrum, pressure = sound(forces)
    later, delayed = sound(forces.replace(force=np.roll(forces.force, samples, axis=0)))
    phase = np.exp(-2j * np.pi * spectrum.frequency * samples / RATE)
    assert close(later.force, spectrum.force * phase[:, None, None], 1e-10)
    assert close(delayed, pressure * phase[:, None], 1e-10)


def test_forces_played_backwards_are_conjugate_lines_of_force(forces):
    lines = force_spectrum(forces, low=150.0, high=1800.0)
    back = forces.replace(force=np.roll(forces.force[::-1], 1, axis=0))
    assert close(force_spectrum(back, low=150.0, high=1800.0).force, lines.force.conj(), 1e-10)


def test_bearings_may_come_in_any_order(forces, sound):
    _, pressure = sound(forces)
    turned = forces.replace(force=forces.force[:, ::-1], names=NAMES[::-1])
    assert close(sound(turned)[1], pressure, 1e-12)


def test_a_unit_force_at_a_seat_sounds_as_its_noise_transfer_function_says(housing, points, air, fidelity, sound):
    """Dot product and forced response: the same operator two ways, per bearing and direction."""
    time = np.arange(COUNT) / RATE
    line = 700.0
    vectors = transfer_vectors(housing.surface, points, np.linspace(140.0, 1900.0, 12), air=air, fidelity=fidelity)
    functions = noise_transfer_functions(
        modal_transfer_vectors(vectors, housing, [line], fidelity=fidelity), housing
    ).functions[0]
    for bearing, direction in ((0, 0), (1, 2)):
        force = np.zeros((COUNT, 2, 3))
        force[:, bearing, direction] = np.cos(2 * np.pi * line * time)
        spectrum, pressure = sound(BearingForces(time, force, NAMES, np.zeros((2, 3)), 100.0, periodic=True))
        at = int(np.abs(spectrum.frequency - line).argmin())
        rows = np.abs(pressure).max(axis=1).argmax()
        assert len(pressure) == 1 or rows == at
        assert close(pressure[rows], functions[:, bearing, direction], 1e-9)
