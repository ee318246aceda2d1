"""Pressure in time from noise transfer functions: known delays, steady tones, decaying modes."""

import numpy as np
import pytest

from nvhchain.acoustics.radiation.modal_transfer import (
    modal_transfer_vectors,
    noise_transfer_functions,
    transfer_pressure,
)
from nvhchain.acoustics.radiation.run_up_sound import convolution_lines, run_up_pressure
from nvhchain.errors import InputError, ResourceError
from nvhchain.handoff import BearingForces, ForceSpectrum, NoiseTransferFunctions
from nvhchain.testing import hand_offs as cases

RATE = 20_000.0
TIME = np.arange(30_000) / RATE


def history(force, names=cases.NAMES):
    return BearingForces(TIME, force, names, np.zeros((len(names), 3)), 100.0)


def test_monopole_hears_the_delayed_rate_of_the_force_near_and_far(air):
    """H = jω e^{−jωr/c}/r in every direction: p(t) = F'(t − r/c)/r, also where r/c exceeds the impulse response."""
    lines = convolution_lines(RATE, 8000.0, 0.05)
    points = np.array([[1.0, 0, 0], [0, 200.0, 0]])
    r = np.array([1.0, 200.0])
    omega = 2 * np.pi * lines[:, None]
    shape = 1j * omega * np.exp(-1j * omega * r / air.speed_of_sound) / r
    functions = NoiseTransferFunctions(
        lines, points, shape[:, :, None, None] * np.array([[[[1.0, 0.0, 0.0]]]]), ("A1",), air
    )

    def pulse(t, slope=False):  # a run through 500 … 2500 Hz
        arg, width = t - 0.4, 0.12
        phase = 2 * np.pi * (1500 * arg + 4000 * arg**2)
        envelope = np.exp(-((arg / width) ** 2))
        rate = 2 * np.pi * (1500 + 8000 * arg)
        return envelope * ((-2 * arg / width**2) * np.sin(phase) + rate * np.cos(phase) if slope else np.sin(phase))

    force = np.zeros((len(TIME), 1, 3))
    force[:, 0, 0] = 70.0 + pulse(TIME)
    got = run_up_pressure(functions, history(force, ("A1",))).pressure
    exact = np.stack([pulse(TIME - d / air.speed_of_sound, slope=True) / d for d in r], axis=1)
    assert np.abs(got - exact).max(axis=0) / np.abs(exact).max(axis=0) == pytest.approx(np.zeros(2), abs=1e-4)


@pytest.fixture(scope="module")
def reduced():
    return cases.housing(low=600.0, high=3000.0, damping=0.05)


@pytest.fixture(scope="module")
def atv(reduced, air):
    return cases.monopoles(
        reduced.surface, np.array([[1.0, 0.5, 0.0], [0.0, -4.0, 1.0]]), np.linspace(0, 6000, 33), air
    )


def test_steady_tone_settles_to_its_line(atv, reduced, coarse):
    lines = convolution_lines(RATE, 6000.0, 0.2)
    functions = noise_transfer_functions(modal_transfer_vectors(atv, reduced, lines, fidelity=coarse), reduced)
    at = 257
    tone = ForceSpectrum(lines[[at]], cases.forces(lines[[at]]).force, cases.NAMES)
    wave = np.exp(2j * np.pi * lines[at] * TIME)
    force = (wave[:, None, None] * tone.force[0]).real
    got = run_up_pressure(functions, history(force)).pressure
    exact = (wave[:, None] * transfer_pressure(functions, tone).pressure[0]).real
    settled = slice(len(TIME) // 2, None)
    assert np.abs(got - exact)[settled].max() / np.abs(exact).max() < 1e-3


def test_lines_that_do_not_suit_are_refused(atv, reduced, coarse):
    def functions(lines):
        return noise_transfer_functions(modal_transfer_vectors(atv, reduced, lines, fidelity=coarse), reduced)

    forces = history(np.ones((len(TIME), 3, 3)))
    with pytest.raises(InputError, match="finer spacing"):
        run_up_pressure(functions(convolution_lines(RATE, 6000.0, 0.01)), forces)
    with pytest.raises(InputError, match="whole number"):
        run_up_pressure(functions(np.arange(1, 500) * 7.3), forces)
    with pytest.raises(InputError, match="multiples of one spacing"):
        run_up_pressure(functions(np.geomspace(100.0, 5000.0, 40)), forces)
    with pytest.raises(InputError, match="twice the upper frequency"):
        convolution_lines(RATE, 11_000.0, 0.1)
    with pytest.raises(ResourceError, match=r"1e\+17 lines up to 1e\+08 Hz .* take shorter records"):
        convolution_lines(1e9, 1e8, 1e9)
    with pytest.raises(InputError, match="unknown to it: X"):
        run_up_pressure(functions(convolution_lines(RATE, 6000.0, 0.2)), history(forces.force, ("A1", "A2", "X")))
