"""Spectra of bearing forces: single-sided complex peak amplitudes under e^{+jωt}, x(t) = Re(X e^{jωt})."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import rfft

from nvhchain.errors import InputError, require
from nvhchain.handoff import BearingForces, ComplexArray, FloatArray, ForceSpectrum

BAND_MARGIN = 2.56
"""Sampling rate over the highest frequency, at least; 2 is the limit of the sampling theorem and 2.56 the usual
margin of signal analysers, which leaves room between the band and what folds back into it."""


def amplitude_spectrum(signal: FloatArray, sample_rate: float, *, periodic: bool) -> tuple[FloatArray, ComplexArray]:
    """Frequencies (n_f,) Hz and single-sided complex peak amplitudes (n_f, …) of `signal` (n_t, …).

    periodic: the record covers whole periods, so no window (rectangular); otherwise a Hann window,
    amplitude-corrected by its mean, after removal of the mean value. The line at 0 Hz is the mean value; it and,
    for an even number of samples, the line at half the sampling rate are not doubled.
    """
    n = len(signal)
    if periodic:
        amplitude = rfft(signal, axis=0) / n
    else:
        window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)
        window = (window / window.sum()).reshape((n,) + (1,) * (signal.ndim - 1))
        mean = (window * signal).sum(axis=0)
        amplitude = rfft(window * (signal - mean), axis=0)
        amplitude[0] = mean
    last = -1 if n % 2 == 0 else None
    amplitude[1:last] *= 2.0
    return np.arange(len(amplitude), dtype=float) * (sample_rate / n), np.asarray(amplitude, dtype=complex)


def force_spectrum(
    bearing_forces: BearingForces,
    *,
    low: float,
    high: float,
    resolution: float | None = None,
    orders: Sequence[float] | None = None,
) -> ForceSpectrum:
    """Spectrum of all bearing forces between `low` and `high` (Hz, both included).

    Rectangular window for records of whole common periods, Hann with amplitude correction otherwise.
    resolution: Hz that must be resolved (line spacing, or 1.5 line spacings with the Hann window, its noise
    bandwidth).
    orders: keep only these orders of the input shaft; constant speed, and each must fall on a line of the record.
    Raises InputError when the sampling rate is below 2.56 `high`, or the record is too short for band or
    resolution.
    """
    require(0.0 <= low < high, f"band {low:g}…{high:g} Hz: low must not be negative and high must lie above low")
    rate, n = bearing_forces.sample_rate, len(bearing_forces.time)
    require(
        rate >= BAND_MARGIN * high * (1.0 - 1e-9),
        f"sampling rate {rate:g} Hz is below {BAND_MARGIN} × {high:g} Hz, what the band needs: sample at "
        f"{BAND_MARGIN * high:g} Hz or "
        f"lower the band to {rate / BAND_MARGIN:g} Hz",
    )
    spacing = rate / n
    reached = spacing * (1.0 if bearing_forces.periodic else 1.5)
    require(
        resolution is None or reached <= resolution * (1.0 + 1e-9),
        f"the record of {n / rate:.4g} s resolves {reached:.4g} Hz, but {resolution} Hz is asked for: record "
        f"{reached / spacing / (resolution or 1.0):.4g} s",
    )
    frequency, amplitude = amplitude_spectrum(bearing_forces.force, rate, periodic=bearing_forces.periodic)
    # a limit that falls on a line includes it whatever the rounding
    inside = np.flatnonzero((frequency >= low - 1e-6 * spacing) & (frequency <= high + 1e-6 * spacing))
    speed = bearing_forces.input_speed
    constant = bool(np.ptp(speed) <= 1e-9 * np.abs(speed).max())
    if orders is not None:
        require(constant, "an order cut needs constant input speed, but the speed varies over the record")
        inside = _lines_of(orders, float(speed[0]) / (2.0 * np.pi), spacing, inside)
    require(
        len(inside) > 0,
        f"no line of the record (spacing {spacing:.4g} Hz) lies in {low:g}…{high:g} Hz: record longer or widen "
        f"the band",
    )
    return ForceSpectrum(
        frequency=frequency[inside],
        force=amplitude[inside],
        names=bearing_forces.names,
        input_speed=float(speed[0]) if constant else 0.0,
    )


def _lines_of(orders: Sequence[float], turns_per_second: float, spacing: float, inside: np.ndarray) -> np.ndarray:
    """Indices of the lines at `orders`, those in the band; InputError when an order falls between lines."""
    place = np.unique(np.asarray(orders, dtype=float)) * turns_per_second / spacing
    off = np.abs(place - np.round(place))
    if len(place) and off.max() > 1e-3:
        worst = float(place[int(np.argmax(off))] * spacing / turns_per_second)
        raise InputError(
            f"order {worst:g} falls between the lines of the record (spacing {spacing / turns_per_second:.4g} "
            f"orders): "
            "record whole periods of it"
        )
    return np.intersect1d(np.round(place).astype(int), inside)
