"""Single precision: half the memory, at an error that is stated and does not grow with the number of wavenumbers."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import sphere
from nvhchain.acoustics.fused import engine
from nvhchain.errors import InputError
from nvhchain.fidelity import AcousticsFidelity

FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=2)
SINGLE = replace(FIDELITY, precision="single")


@pytest.mark.slow
def test_single_precision_pressure_is_within_1e_5_of_double_after_forty_wavenumber_steps():
    surface = sphere(0.1, 2)
    k = np.linspace(1.0, 60.0, 40)
    gradient = np.exp(1j * 20.0 * surface.centroids @ [0.6, 0.0, 0.8])
    worst = []
    for (a, b), (a32, b32) in zip(
        engine.systems(surface, k, FIDELITY), engine.systems(surface, k, SINGLE), strict=True
    ):
        assert a32.dtype == b32.dtype == np.complex64
        pressure = np.linalg.solve(a, b @ gradient)
        narrow = np.linalg.solve(a32.astype(complex), b32.astype(complex) @ gradient)
        worst.append(np.abs(narrow - pressure).max() / np.abs(pressure).max())
    assert max(worst) < 1e-5


@pytest.mark.slow
def test_single_precision_is_as_good_far_from_the_origin_and_on_a_millimetre_body():
    gradient = np.random.default_rng(1).normal(size=320)
    for radius, centre, k in ((0.1, (30.0, -20.0, 10.0), 20.0), (1e-3, (0.0, 0.0, 0.0), 2e3)):
        a, b = next(engine.systems(sphere(radius, 2), [k], FIDELITY))
        a32, b32 = next(engine.systems(sphere(radius, 2, centre), [k], SINGLE))
        pressure, narrow = np.linalg.solve(a, b @ gradient), np.linalg.solve(a32, b32 @ gradient)
        assert np.abs(narrow - pressure).max() / np.abs(pressure).max() < 2e-5


def test_an_unknown_precision_is_refused():
    with pytest.raises(InputError, match="acoustics precision = 'half' is unknown: choose from double, single"):
        replace(FIDELITY, precision="half")
