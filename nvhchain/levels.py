"""Levels in decibels, A-weighting, overall and octave levels, and the time signal of a line spectrum."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import dct

from nvhchain.conventions import REFERENCE_POWER, REFERENCE_PRESSURE
from nvhchain.errors import counted, require
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.kinds import checked

__all__ = ["a_weighting", "decibel", "overall", "overall_power"]

_FLOOR = 1e-300
"""Least argument of a logarithm; keeps the level of an exact zero finite."""


def decibel(amplitude: ArrayLike, reference: float = REFERENCE_PRESSURE) -> FloatArray:
    """Return the level (dB) of complex peak amplitudes: 20 log10(|a| / (√2 reference)).

    Parameters
    ----------
    amplitude : array_like
        Complex or real peak amplitudes, unit of `reference`.
    reference : float
        RMS value of 0 dB.

    Returns
    -------
    array
        Levels (dB), shape of `amplitude`.
    """
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(amplitude), _FLOOR) / (np.sqrt(2.0) * reference)))


def number_text(value: float, form: str = ".1f") -> str:
    """Return a number as text with a true minus sign; a number that rounds to zero has no sign.

    value: number.
    form: format specification of Python, such as "+.1f".
    Returns text such as "−0.3".
    """
    text = format(value, form)
    return (text.lstrip("+-") if float(text) == 0.0 else text).replace("-", "−")


def place_text(position: ArrayLike) -> str:
    """Return a position (m) as text such as "(0.02, −0.01, 0.62)"."""
    return f"({', '.join(number_text(x, '.4g') for x in np.asarray(position, dtype=float).tolist())})"


def power_level(power: ArrayLike) -> FloatArray:
    """Return the sound power level: 10 log10(P / 1 pW).

    power: powers (W).
    Returns levels (dB re 1 pW), shape of `power`.
    """
    return np.asarray(10.0 * np.log10(np.maximum(power, _FLOOR) / REFERENCE_POWER))


def a_weighting(frequency: ArrayLike) -> FloatArray:
    """Return the A-weighting, 0 dB at 1 kHz.

    Parameters
    ----------
    frequency : array_like
        Frequencies (Hz).

    Returns
    -------
    array
        Weights (dB), shape of `frequency`.

    Notes
    -----
    Source: IEC 61672-1:2013, eqs. E.1 to E.6.
    """
    f2 = np.square(np.asarray(frequency, dtype=float))
    gain = (
        12194.217**2
        * f2**2
        / ((f2 + 20.598997**2) * np.sqrt((f2 + 107.65265**2) * (f2 + 737.86223**2)) * (f2 + 12194.217**2))
    )
    return np.asarray(20.0 * np.log10(np.maximum(gain, _FLOOR)) + 1.9997)


@checked
def overall(frequency: FloatArray, pressure: ComplexArray, *, weighted: bool = True) -> FloatArray:
    """Return the overall level of a line spectrum: energy sum over axis 0.

    Parameters
    ----------
    frequency : (n_f,) array
        Frequencies of the lines (Hz).
    pressure : (n_f, …) complex array
        Peak amplitudes of the lines (Pa).
    weighted : bool
        Apply A-weighting.

    Returns
    -------
    (…) array
        Level in dB(A), or in dB if not `weighted`.

    Raises
    ------
    InputError
        If the numbers of frequencies and lines differ.
    """
    require(
        len(frequency) == len(pressure),
        f"{len(frequency)} frequencies for {counted(len(pressure), 'line')} of pressure",
    )
    return _energy_sum(frequency, decibel(pressure), weighted)


@checked
def overall_power(frequency: FloatArray, power: FloatArray, *, weighted: bool = True) -> FloatArray:
    """Return the overall sound power level of a line spectrum, re 1 pW.

    Parameters
    ----------
    frequency : (n_f,) array
        Frequencies of the lines (Hz).
    power : (n_f, …) array
        Powers of the lines (W).
    weighted : bool
        Apply A-weighting.

    Returns
    -------
    (…) array
        Level in dB(A), or in dB if not `weighted`.

    Raises
    ------
    InputError
        If the numbers of frequencies and lines differ.
    """
    require(len(frequency) == len(power), f"{len(frequency)} frequencies for {counted(len(power), 'line')} of power")
    return _energy_sum(frequency, power_level(power), weighted)


def _energy_sum(frequency: FloatArray, level: FloatArray, weighted: bool) -> FloatArray:
    """Add the energies of levels (n_f, …) in dB over axis 0, A-weighted if `weighted`."""
    if weighted:
        level = level + a_weighting(frequency).reshape(-1, *(1,) * (level.ndim - 1))
    # levels count from the highest: energies far from 0 dB overflow or underflow
    highest = np.max(level, axis=0, initial=10.0 * np.log10(_FLOOR))
    return np.asarray(highest + 10.0 * np.log10(np.maximum((10.0 ** ((level - highest) / 10.0)).sum(axis=0), _FLOOR)))


@checked
def equivalent(signal: FloatArray, *, sample_rate: float, weighted: bool = True) -> FloatArray:
    """Return the equivalent continuous level of records, from their mean square.

    signal (n_t, …): sound pressure (Pa).
    sample_rate: sampling rate (Hz).
    Returns (…): level in dB(A), or in dB if not `weighted`.

    The weighting is applied in the frequency domain to the record and its mirror image, which follow each other without
    a jump. The mean square is that of the record (Parseval). A tone of 31.7 Hz that is cut off anywhere is up to 0.4 dB
    off in a record of 1 s, and 0.1 dB in 5 s. Without the mirror it is 9 and 5 dB, since the jump sounds at all
    frequencies.
    """
    frequency, line = _record_lines(signal, sample_rate)
    return overall(frequency, line, weighted=weighted)


def _record_lines(signal: ArrayLike, sample_rate: float) -> tuple[FloatArray, ComplexArray]:
    """Return frequencies (n_f,) above 0 and amplitudes (n_f, …) of a record with its mirror image."""
    signal = np.asarray(signal, dtype=float)
    require(signal.size > 0 and signal.ndim > 0, f"a signal of shape {signal.shape} has no level: give samples")
    require(isfinite(sample_rate) and sample_rate > 0.0, f"sample_rate = {sample_rate} Hz must be positive and finite")
    line = dct(signal, axis=0)[1:] / len(signal)
    frequency = np.asarray(0.5 * sample_rate / len(signal) * np.arange(1, len(signal)), dtype=float)
    return frequency, np.asarray(line, dtype=complex)


@dataclass(frozen=True, eq=False)
class OctaveBands:
    """Levels of octaves or parts of them.

    fraction: bands in an octave; 3 for third octaves.
    middle (n_band,): exact middle frequencies (Hz).
    level (n_band, …): levels (dB).
    """

    fraction: int
    middle: FloatArray
    level: FloatArray


@checked
def octave_bands(
    frequency: FloatArray, pressure: ComplexArray, *, fraction: int = 3, weighted: bool = False
) -> OctaveBands:
    """Return the levels of octaves, third octaves or other parts from the lines in them.

    frequency (n_f,): frequencies (Hz); a line at 0 Hz is in no band.
    pressure (n_f, …) complex array: peak amplitudes (Pa).
    fraction: bands in an octave, 1 to 48.
    Returns bands from the lowest to the highest line; a band without lines has the level of silence.

    IEC 61260-1: middles G^(x/b) · 1 kHz, or G^((2x+1)/(2b)) · 1 kHz for even b, with G = 10^(3/10) and b bands in an
    octave.
    """
    require(1 <= fraction <= 48, f"fraction = {fraction} bands in an octave is outside 1…48: 1 or 3 are usual")
    frequency, pressure = np.asarray(frequency, dtype=float), np.asarray(pressure, dtype=complex)
    heard = frequency > 0.0
    require(bool(heard.any()), "there is no line above 0 Hz: no band has a level")
    frequency, pressure = frequency[heard], pressure[heard]
    shift = 0.0 if fraction % 2 else 0.5
    # a line on an edge, by rounding on either side, belongs to the band above
    number = np.floor(np.log10(frequency / 1e3) * fraction / 0.3 - shift + 0.5 + 1e-9).astype(int)
    bands = np.arange(number.min(), number.max() + 1)
    level = np.array(
        [overall(frequency[lines], pressure[lines], weighted=weighted) for band in bands for lines in [number == band]]
    )
    return OctaveBands(fraction, 1e3 * 10.0 ** (0.3 * (bands + shift) / fraction), level)


@checked
def record_bands(signal: FloatArray, *, sample_rate: float, fraction: int = 3, weighted: bool = False) -> OctaveBands:
    """Return the levels of octaves, third octaves or other parts of a record, from its mean square in them.

    signal (n_t, …): sound pressure (Pa).
    sample_rate: sampling rate (Hz).
    fraction: bands in an octave, 1 to 48.
    Returns bands up to half of the sampling rate. Their energies add up to `equivalent` of the record.

    Bands are cut in the frequency domain of the record and its mirror image, as of `equivalent`: ideal filters, which
    IEC 61260-1 approaches.
    """
    frequency, line = _record_lines(signal, sample_rate)
    return octave_bands(frequency, line, fraction=fraction, weighted=weighted)


@checked
def time_history(frequency: FloatArray, pressure: ComplexArray, *, sample_rate: float) -> tuple[FloatArray, FloatArray]:
    """Return one period of the signal of harmonic lines: p(t) = Re Σ p_n e^{jω_n t}, by inverse FFT.

    frequency (n_f,): frequencies (Hz), rising, whole multiples of one spacing.
    pressure (n_f, …) complex array: peak amplitudes (Pa).
    sample_rate: lower bound of the sampling rate (Hz), above twice the highest frequency.
    Returns time (n_t,): times (s). signal (n_t, …): signal (Pa).
    """
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
