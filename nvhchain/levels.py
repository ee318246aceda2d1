"""Levels: decibels, A-weighting, overall values, orders, and the time signal behind a line spectrum."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.conventions import REFERENCE_POWER, REFERENCE_PRESSURE
from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.kinds import check_arguments

_FLOOR = 1e-300
"""Keeps the logarithm of an exact zero finite."""


def decibel(amplitude: ArrayLike, reference: float = REFERENCE_PRESSURE) -> FloatArray:
    """Level in dB of complex peak amplitudes re `reference` (RMS): 20 log10(|a| / (√2 reference))."""
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(amplitude), _FLOOR) / (np.sqrt(2.0) * reference)))


def power_level(power: ArrayLike) -> FloatArray:
    """Sound power level in dB re 1 pW of powers in W: 10 log10(P / 1e-12)."""
    return np.asarray(10.0 * np.log10(np.maximum(power, _FLOOR) / REFERENCE_POWER))


def a_weighting(frequency: ArrayLike) -> FloatArray:
    """A-weighting in dB at `frequency` (Hz), IEC 61672-1:2013 eq. E.1 to E.6; 0 dB at 1 kHz."""
    f2 = np.square(np.asarray(frequency, dtype=float))
    gain = (
        12194.217**2
        * f2**2
        / ((f2 + 20.598997**2) * np.sqrt((f2 + 107.65265**2) * (f2 + 737.86223**2)) * (f2 + 12194.217**2))
    )
    return np.asarray(20.0 * np.log10(np.maximum(gain, _FLOOR)) + 1.9997)


def overall(frequency: FloatArray, pressure: ComplexArray, *, weighted: bool = True) -> FloatArray:
    """Overall level in dB(A) (dB if not `weighted`) of lines `pressure` (n_f, ...) Pa peak: energy sum over axis 0."""
    check_arguments(overall, locals())
    require(len(frequency) == len(pressure), f"{len(frequency)} frequencies for {len(pressure)} lines of pressure")
    return _energy_sum(frequency, decibel(pressure), weighted)


def overall_power(frequency: FloatArray, power: FloatArray, *, weighted: bool = True) -> FloatArray:
    """Sound power level of all lines `power` (n_f, ...) W in dB(A) (dB if not `weighted`) re 1 pW."""
    check_arguments(overall_power, locals())
    require(len(frequency) == len(power), f"{len(frequency)} frequencies for {len(power)} lines of power")
    return _energy_sum(frequency, power_level(power), weighted)


def _energy_sum(frequency: FloatArray, level: FloatArray, weighted: bool) -> FloatArray:
    if weighted:
        level = level + a_weighting(frequency).reshape(-1, *(1,) * (level.ndim - 1))
    highest = np.max(level, axis=0, initial=10.0 * np.log10(_FLOOR))  # whose energy need not be a number
    return np.asarray(highest + 10.0 * np.log10(np.maximum((10.0 ** ((level - highest) / 10.0)).sum(axis=0), _FLOOR)))


def equivalent(signal: FloatArray, *, sample_rate: float, weighted: bool = True) -> FloatArray:
    """Equivalent continuous level in dB(A) (dB if not `weighted`) of records (n_t, ...) Pa, by their mean square.

    sample_rate: Hz.  Weighted in the frequency domain, the record taken as periodic (Parseval).
    """
    check_arguments(equivalent, locals())
    signal = np.asarray(signal, dtype=float)
    require(signal.size > 0 and signal.ndim > 0, f"a signal of shape {signal.shape} has no level: give samples")
    require(isfinite(sample_rate) and sample_rate > 0.0, f"sample_rate = {sample_rate} Hz must be positive and finite")
    line = np.asarray(np.fft.rfft(signal, axis=0) / len(signal), dtype=complex)
    line[1 : (len(signal) + 1) // 2] *= 2.0
    frequency = np.asarray(np.fft.rfftfreq(len(signal), 1.0 / sample_rate), dtype=float)
    return overall(frequency[1:], line[1:], weighted=weighted)


def time_history(frequency: FloatArray, pressure: ComplexArray, *, sample_rate: float) -> tuple[FloatArray, FloatArray]:
    """One period of the signal p(t) = Re Σ p_n e^{jω_n t} of harmonic lines, by inverse FFT.

    frequency: (n_f,) Hz, whole multiples of one spacing.  pressure: (n_f, ...) peak.  sample_rate: Hz, a lower bound.
    Returns time (n_t,) s and the signal (n_t, ...).  Raises InputError where the lines are not harmonic.
    """
    check_arguments(time_history, locals())
    frequency, pressure = np.asarray(frequency, dtype=float), np.asarray(pressure, dtype=complex)
    require(
        frequency.ndim == 1 and pressure.ndim > 0 and len(frequency) == len(pressure) > 0,
        f"frequencies of shape {frequency.shape} for lines of pressure of shape {pressure.shape}: give one line each",
    )
    require(
        bool(np.isfinite(frequency).all() and (np.diff(frequency) > 0).all()) and frequency[0] >= 0.0 < frequency[-1],
        f"frequencies {frequency[0]:g}…{frequency[-1]:g} Hz must rise from 0 or more, and not be 0 Hz alone",
    )
    require(isfinite(sample_rate), f"sample_rate = {sample_rate} Hz must be finite")
    spacing = float(np.diff(frequency).min() if len(frequency) > 1 else frequency[0])
    index = np.rint(frequency / spacing).astype(int)
    require(
        bool(np.abs(frequency - index * spacing).max() < 1e-3 * spacing),
        f"lines are not whole multiples of their spacing {spacing:g} Hz: a period needs harmonic lines",
    )
    require(
        sample_rate > 2 * frequency[-1],
        f"sample rate {sample_rate:g} Hz does not cover {frequency[-1]:g} Hz: use more than {2 * frequency[-1]:g} Hz",
    )
    count = int(np.ceil(sample_rate / spacing))
    spectrum = np.zeros((count // 2 + 1, *pressure.shape[1:]), dtype=complex)
    spectrum[index] = pressure * (count / 2)
    if index[0] == 0:
        spectrum[0] *= 2.0
    signal = np.fft.irfft(spectrum, n=count, axis=0)
    return np.arange(count) / (count * spacing), np.asarray(signal)
