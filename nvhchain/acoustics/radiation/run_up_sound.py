"""Sound pressure in time: bearing force histories convolved with the impulse responses of noise transfer functions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import irfft, next_fast_len, rfft

from nvhchain.acoustics.radiation.projection import check_memory
from nvhchain.conventions import Progress
from nvhchain.errors import require
from nvhchain.handoff import (
    BearingForces,
    FloatArray,
    IntArray,
    NoiseTransferFunctions,
    PressureHistory,
    ReducedHousing,
)
from nvhchain.kinds import checked

FADE = 0.1
"""Share of the band over which the upper end of the transfer functions is faded out, as a sharp end would ring."""

FADE_PERIODS = 15.0
"""Periods of the fade's width after which its ringing is below `DECAY`; measured, 8 are just enough."""

EARLY = 0.25
"""Share of an impulse response's record before the first arrival, where only ringing remains."""

DECAY = 1e-3
"""Largest value at the end of an impulse response's record, relative to its peak; the end wraps to the start."""


@checked
def convolution_lines(sample_rate: float, high: float, duration: float) -> FloatArray:
    """Return the frequencies at which `run_up_pressure` needs noise transfer functions.

    sample_rate: sampling rate of the force histories (Hz).
    high: upper frequency (Hz).
    duration: duration of the impulse responses (s).
    Returns (n_f,): lines (Hz) from 0 to `high`. Their spacing divides `sample_rate` into a whole number of samples.
    """
    require(
        0 < duration < np.inf and 0 < high <= 0.5 * sample_rate < np.inf,
        f"lines up to {high:g} Hz for records of {duration:g} s at {sample_rate:g} samples per second: the duration "
        "must be positive, the sampling at least twice the upper frequency, and both finite",
    )
    subject = f"{duration * high:.3g} lines up to {high:g} Hz for records of {duration:g} s"
    check_memory(8.0 * duration * high, subject, "take shorter records or a lower upper frequency")
    samples = next_fast_len(int(np.ceil(duration * sample_rate)), real=True)
    return np.arange(int(high * samples / sample_rate * (1 + 1e-12)) + 1) * (sample_rate / samples)


@checked
def decay_time(housing: ReducedHousing, high: float) -> float:
    """Return the required duration of an impulse response's record.

    high: upper frequency of the transfer functions (Hz).
    Returns duration (s). Within it, the slowest mode of the housing falls to a tenth of `DECAY`. The ringing of the
    faded upper end, which falls with the third power of time, is over as well.
    """
    require(0 < high < np.inf, f"upper frequency {high:g} Hz must be positive and finite")
    rate = 2 * np.pi * housing.natural_frequency * housing.modal_damping
    slowest = int(rate.argmin())
    require(
        rate[slowest] > 0,
        f"housing mode {slowest} ({housing.natural_frequency[slowest]:g} Hz) is not damped and rings for ever: "
        "give it modal damping",
    )
    ring, fade = -np.log(0.1 * DECAY) / rate[slowest], FADE_PERIODS / (FADE * high)
    return float(max(ring, fade) / (1.0 - EARLY))


@checked
def run_up_pressure(
    functions: NoiseTransferFunctions, bearing_forces: BearingForces, *, progress: Progress | None = None
) -> PressureHistory:
    """Compute sound pressure in time under bearing force histories: p(t) = ∫ h(τ) F(t − τ) dτ, summed over bearings.

    functions: functions at equally spaced lines (`convolution_lines`) that start at 0 Hz or a multiple of the spacing.
    bearing_forces: force histories (N).
    progress: function that receives the finished and the total number of blocks.
    Returns sound pressure (Pa) over time.

    The convolution is overlap-add in the frequency domain. The pressure has no content below the first and above the
    last line; the last tenth of the band is faded out. The sound travels from the bearings to the points with the delay
    of the shortest path, which may exceed the impulse response. Forces are constant before the record; a constant force
    makes no sound.
    """
    rate = bearing_forces.sample_rate
    force = bearing_forces.sort_bearings(functions.names, functions.functions.shape[3])
    force = np.ascontiguousarray((force - force[0]).T)
    samples, bins = _record(functions.frequency, rate)
    delay = _delays(functions, bearing_forces, rate)
    early = int(EARLY * samples)
    length = next_fast_len(max(4 * samples, 2**13), real=True)
    block = length - samples + 1
    points, channels = len(functions.points), len(force)
    check_memory(
        16 * (length // 2 + 1) * channels * (points + 1),
        f"impulse responses of {points} points and {channels} forces",
        "take fewer points at once or a wider line spacing",
    )
    response = np.empty((points, channels, length // 2 + 1), dtype=complex)
    for point in range(points):
        shape = functions.functions[:, point].reshape(len(bins), channels)
        impulse = _impulse_responses(shape, bins, samples, int(delay[point]), early)
        _check_decay(impulse, early, rate, point)
        response[point] = rfft(impulse, length, axis=1)

    total = force.shape[1]
    pressure = np.zeros((points, total))
    report = progress or (lambda done, steps: None)
    starts = range(0, total, block)
    report(0, len(starts))
    for done, start in enumerate(starts):
        spectrum = rfft(force[:, start : start + block], length, axis=1)
        for point in range(points):
            heard = irfft(np.einsum("cf,cf->f", response[point], spectrum), length)
            first = start + int(delay[point]) - early  # start of the block's convolution in the record
            low, high = max(first, 0), min(first + length, total)
            if low < high:
                pressure[point, low:high] += heard[low - first : high - first]
        report(done + 1, len(starts))
    return PressureHistory(
        bearing_forces.time,
        functions.points,
        pressure.T,
        bearing_forces.input_speed,
        functions.accuracy,
        provenance=functions.provenance | {"stage": "acoustics.run_up_pressure"},
    )


def _record(frequency: FloatArray, rate: float) -> tuple[int, IntArray]:
    """Return the samples of an impulse response at `rate` samples per second, and the bins (n_f,) of the lines (Hz)."""
    remedy = "make the noise transfer functions at convolution_lines(...)"
    require(len(frequency) >= 2, f"{len(frequency)} line makes no impulse response: {remedy}")
    step = float((frequency[-1] - frequency[0]) / (len(frequency) - 1))
    bins = np.rint(frequency / step).astype(np.int64)
    require(
        float(np.abs(frequency - bins * step).max()) <= 1e-6 * step * max(1.0, float(bins[-1]) * 1e-3),
        f"lines {frequency[0]:g}…{frequency[-1]:g} Hz are not whole multiples of one spacing ({step:g} Hz): {remedy}",
    )
    samples = round(rate / step)
    require(
        abs(rate / step - samples) <= 1e-4,
        f"line spacing {step:.9g} Hz and {rate:.9g} samples per second give records of {rate / step:.6g} samples, "
        f"not a whole number: {remedy}",
    )
    require(
        2 * bins[-1] <= samples,
        f"lines reach {frequency[-1]:g} Hz, more than half of {rate:g} samples per second: "
        "cut the band or sample faster",
    )
    return samples, bins


def _delays(functions: NoiseTransferFunctions, bearing_forces: BearingForces, rate: float) -> IntArray:
    """Return the shortest delay (n_point,) of sound from the nearest bearing to each point, in whole samples."""
    way = np.linalg.norm(functions.points[:, None] - bearing_forces.positions[None], axis=2).min(axis=1)
    return np.asarray(np.floor(way / functions.air.speed_of_sound * rate), dtype=np.int64)


def _impulse_responses(functions: ArrayLike, bins: IntArray, samples: int, delay: int, early: int) -> FloatArray:
    """Return responses (n_force, samples) Pa/N per sample, with `early` samples before the delay."""
    spectrum = np.zeros((samples // 2 + 1, np.shape(functions)[1]), dtype=complex)
    # the record begins `early` samples before the first arrival
    advance = np.exp(2j * np.pi * ((bins * (delay - early)) % samples) / samples)
    top = bins[-1]
    fade_position = np.clip((bins - (1 - FADE) * top) / (FADE * top), 0.0, 1.0)
    spectrum[bins] = functions * (advance * np.cos(0.5 * np.pi * fade_position) ** 2)[:, None]
    return np.asarray(irfft(spectrum, samples, axis=0).T)


def _check_decay(impulse: FloatArray, early: int, rate: float, point: int) -> None:
    """Raise InputError unless the last part of the record has decayed before it wraps."""
    samples = impulse.shape[1]
    peak = float(np.abs(impulse).max())
    last = float(np.abs(impulse[:, -max(1, samples // 20) :]).max())
    require(
        last <= DECAY * peak,
        f"the impulse response at point {point} has only fallen to {last / max(peak, 1e-300):.2g} of its peak after "
        f"{(samples - early) / rate:.3g} s, {DECAY:g} is needed: make the noise transfer functions at a finer spacing "
        f"than {rate / samples:.3g} Hz",
    )
