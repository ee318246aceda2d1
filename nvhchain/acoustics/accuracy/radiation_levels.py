"""Expected errors of the cheaper radiation levels, against the size of the body over the wavelength."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.acoustics.surfaces.surface import real_numbers
from nvhchain.conventions import Air
from nvhchain.errors import require
from nvhchain.handoff import FloatArray, SoundAccuracy, Surface, warn_of
from nvhchain.kinds import checked


class LevelError(NamedTuple):
    """Errors (dB) up to a limit of the wavenumber times half size of the body.

    upper_limit : upper limit of the wavenumber times half size.
    housing : largest mean over points and motions of a box and of a gearbox.
    mean : largest mean of these and a sphere, from here to the highest frequency.
    single : largest RMS of levels at single points, and of the power of one motion.
    """

    upper_limit: float
    housing: float
    mean: float
    single: float


SMALLEST = 0.1
"""Wavenumber times half size at which the tables begin; below, errors grow by `SLOPES`."""

ERRORS = {
    "rayleigh": (
        LevelError(0.2, 11.8, 20.0, 21.5),
        LevelError(0.5, 10.4, 13.3, 16.0),
        LevelError(1.0, 5.1, 5.5, 13.0),
        LevelError(2.0, 1.9, 3.7, 12.0),
        LevelError(4.0, 0.8, 3.7, 11.5),
        LevelError(np.inf, 0.4, 3.6, 8.5),
    ),
    "equivalent_radiated_power": (
        LevelError(0.2, 33.5, 75.0, 80.0),
        LevelError(0.5, 29.6, 57.0, 62.0),
        LevelError(1.0, 16.8, 33.0, 38.0),
        LevelError(2.0, 10.8, 16.0, 20.0),
        LevelError(4.0, 5.5, 5.5, 7.5),
        LevelError(np.inf, 1.7, 1.7, 8.0),
    ),
}
"""Errors of each level of radiation: the worst of a box under bending waves, a gearbox and a sphere. The first two are
in docs/measured/acoustics/radiation.md. The sphere has v_n = P_0, P_1, P_2 (cos θ) (closed forms:
tests/acoustics/test_rayleigh.py). The values are no bounds: P_3 errs by more (`CANCELLING`), by 19 and 36 dB at ka = 1.
"""

SLOPES = {"rayleigh": 20.0, "equivalent_radiated_power": 60.0}
"""Growth (dB per decade) of the errors of a small sphere towards low frequencies, for P_2, the worst of the three."""

SHAKING = 13.5
"""Largest additional error (dB) of the Rayleigh integral for a plate or strip that shakes as a whole. It is 28 dB at ka
= 0.1 for plates of 0.3 × 0.2 × 0.02 and 0.3 × 0.3 × 0.01 m. It is 35 dB for a strip of 0.4 × 0.06 × 0.02 m, and 3 dB
above ka = 1."""

CANCELLING = {"rayleigh": 75.0, "equivalent_radiated_power": 112.0}
"""Error (dB) of the power of a sphere with v_n = P_3(cos θ) at ka = 0.11: the parts of the motion cancel."""

TOLERABLE = 3.0
"""Mean level error (dB), twice the power, above which a warning is given."""


@checked
def expected_radiation_error(radiation: str, ka: ArrayLike) -> FloatArray:
    """Return the expected RMS error of a level of radiation, for single points and the power of single motions.

    ka (n,): wavenumber times half size of the body, its diagonal over 2√3; positive.
    Returns (n,): error (dB).

    The error is that of the worst body measured up to each ka. Below 0.1, it grows by `SLOPES`.
    """
    require(radiation in ERRORS, f"radiation = {radiation!r} has no table of errors: choose from {', '.join(ERRORS)}")
    x = np.atleast_1d(real_numbers(ka, "wavenumbers times half size"))
    require(
        x.size > 0 and bool(((x > 0) & (x < np.inf)).all()),
        f"wavenumber times half size of {x.min(initial=np.inf):g} must be positive and finite: drop lines at 0 Hz",
    )
    return np.asarray(_errors(radiation, x)[2])


def size_in_waves(surface: Surface, frequency: FloatArray, air: Air) -> FloatArray:
    """Return the wavenumber times half the size of a body, its diagonal over 2√3, at frequencies (n_f,) Hz."""
    return 2 * np.pi * frequency / air.speed_of_sound * (0.5 * diameter(surface.vertices) / np.sqrt(3.0))


def _errors(radiation: str, ka: FloatArray | float) -> FloatArray:
    """Return housing, mean and single errors (3, …) dB."""
    rows = ERRORS[radiation]
    row = np.searchsorted([entry.upper_limit for entry in rows], ka, side="right")
    growth = SLOPES[radiation] * np.maximum(0.0, np.log10(SMALLEST / ka))
    return np.asarray(np.array([entry[1:] for entry in rows])[row].T + growth)


def level_accuracy(surface: Surface, frequency: FloatArray, air: Air, radiation: str) -> SoundAccuracy:
    """Return the accuracy of a cheaper level of radiation at the lowest frequency above 0 Hz.

    frequency : (n_f,) Hz.

    `expected_error_db` is the RMS of levels at single points and of the power of a single motion, each over its range
    of frequencies. A flat body that shakes as a whole adds `SHAKING`. `expected_mean_error_db` is the mean over points
    and many motions for the worst body, `housing_mean_error_db` for a box or a gearbox. An AccuracyWarning is given if
    the mean of the worst body exceeds `TOLERABLE`.

    A motion in phase on the whole surface may lose more at single frequencies. The Rayleigh integral yields no power
    for a pulsating sphere if its circumference is a multiple of the wavelength.
    """
    radiating = frequency[frequency > 0]
    if len(radiating) == 0:
        return SoundAccuracy()
    ka = float(size_in_waves(surface, radiating[0], air))
    housing, mean, single = _errors(radiation, ka).tolist()
    stated = SoundAccuracy(
        radiation=radiation,
        lowest_frequency=float(radiating[0]),
        size_in_waves=ka,
        expected_error_db=single,
        expected_mean_error_db=mean,
        asked_mean_error_db=TOLERABLE,
        housing_mean_error_db=housing,
        shaking_error_db=SHAKING if radiation == "rayleigh" else None,
        cancelling_error_db=CANCELLING[radiation],
    )
    warn_of(stated)
    return stated
