"""Sound pressure as a signal: loops of steady lines, records of run-ups."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, gcd

import numpy as np
from scipy.fft import irfft, rfft

from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray, IntArray, PressureHistory
from nvhchain.kinds import checked

RATES = (8000, 16000, 24000, 48000, 96000, 192000)
"""Sampling rates (Hz) that players support."""

LEAST_RATE = 48000
"""Smallest sampling rate (Hz) of files; programs and sound cards use it."""

HEADROOM = 2.2
"""Smallest ratio of the sampling rate to the highest frequency."""

SECONDS = 4.0
"""Shortest duration (s) of a loop."""

LONGEST = 60.0
"""Longest duration (s) of a loop."""

_SEED = 20
"""Seed of random phases; equal lines have equal phases in all designs and runs."""


_LENGTHS = 2000
"""Number of lengths of a padded record, of which the one is taken that is nearest to whole samples at both rates."""


@dataclass(frozen=True, eq=False)
class Sound:
    """Sound pressure over time at one place.

    Parameters
    ----------
    pressure : (n_t,) array
        Sound pressure (Pa).
    rate : int
        Sampling rate (Hz).
    loops : bool
        True where the end continues in the beginning.
    """

    pressure: FloatArray
    rate: int
    loops: bool = False

    @property
    def rms(self) -> float:
        """Root mean square (Pa)."""
        return float(np.sqrt(np.mean(np.square(self.pressure))))

    @property
    def peak(self) -> float:
        """Largest magnitude (Pa)."""
        return float(np.abs(self.pressure).max(initial=0.0))

    @property
    def seconds(self) -> float:
        """Duration (s)."""
        return len(self.pressure) / self.rate

    def resampled(self, rate: int) -> Sound:
        """Return the sound at another sampling rate; frequencies above half of it are lost."""
        if rate == self.rate:
            return self
        if self.loops:
            count = round(len(self.pressure) * rate / self.rate)
            return Sound(_resampled(self.pressure, count), rate, True)
        record = np.asarray(self.pressure)
        step = self.rate // gcd(self.rate, rate)
        padded = step * ceil((len(record) + step) / step)  # a whole number of samples at both rates
        whole = np.concatenate([record, np.zeros(padded - len(record))])
        made = _resampled(whole, padded * rate // self.rate)
        return Sound(made[: round(len(record) * rate / self.rate)], rate)


@dataclass(frozen=True, eq=False)
class Loop:
    """Lines that all have a whole number of periods in a loop.

    count: number of samples.
    rate: sampling rate (Hz).
    line (n_f,): number of periods of every line.
    amplitude (n_f,): complex peak amplitudes (Pa).
    """

    count: int
    rate: int
    line: IntArray
    amplitude: ComplexArray

    @property
    def sound(self) -> Sound:
        """Sound of all lines."""
        spectrum = np.zeros(self.count // 2 + 1, dtype=complex)
        spectrum[self.line] = 0.5 * self.count * self.amplitude
        return Sound(np.asarray(irfft(spectrum, self.count)), self.rate, True)


def steady_sound(
    pressure: FieldPressure, *, point: int = 0, seconds: float = SECONDS, rate: int | None = None
) -> Sound:
    """Return the steady signal at one field point as a loop without a click.

    Parameters
    ----------
    pressure : FieldPressure
        Sound pressure.
    point : int
        Index of the field point.
    seconds : float
        Shortest duration (s) of the loop.
    rate : int, optional
        Sampling rate (Hz); by default `LEAST_RATE` or the next one that covers the lines.

    Returns
    -------
    Sound
        Loop; its root mean square is that of the lines above 0 Hz.

    Raises
    ------
    InputError
        If lines are closer than a loop of `LONGEST` seconds resolves, or no sampling rate covers them.

    Notes
    -----
    p(t) = Re Σ p_n exp(jω_n t). The phases are those of the lines, which the chain computes. Lines without phases (all
    real and positive, as of the equivalent radiated power) have random ones of a fixed seed.

    The loop has a whole number of periods of every line. Harmonic lines move by at most half a sample in the loop,
    0.003 per mille of their frequency. Other lines move to the next multiple of one over the loop's duration.
    """
    return steady_loop(pressure, point=point, seconds=seconds, rate=rate).sound


@checked
def steady_loop(pressure: FieldPressure, *, point: int = 0, seconds: float = SECONDS, rate: int | None = None) -> Loop:
    """Return the lines of `steady_sound`.

    Returns lines with a whole number of periods.
    """
    require(0 < seconds <= LONGEST, f"seconds = {seconds:g} of a loop are outside 0…{LONGEST:g}")
    heard = pressure.frequency > 0
    frequency, amplitude = pressure.frequency[heard], np.array(pressure.pressure[heard, point])
    if not amplitude.imag.any() and (amplitude.real >= 0).all() and len(amplitude) > 1:
        amplitude = amplitude * np.exp(2j * np.pi * np.random.default_rng(_SEED).random(len(amplitude)))
    rate = rate or audible_rate(float(frequency.max(initial=0.0)))
    count, line = _periods(frequency, seconds, rate)
    return Loop(count, rate, line, amplitude)


@checked
def run_up_sound(history: PressureHistory, *, point: int = 0, rate: int | None = None) -> Sound:
    """Return the record at one field point at a sampling rate of players.

    rate: sampling rate (Hz); by default `LEAST_RATE`.
    Returns record of the same duration.

    The conversion of the rate keeps all frequencies below half of both rates, and with them the mean square.
    """
    rate = rate or LEAST_RATE
    given = (len(history.time) - 1) / float(history.time[-1] - history.time[0])
    signal = np.ascontiguousarray(history.pressure[:, point])
    count = round(len(signal) * rate / given)
    tail = max(1, len(signal) // 50)  # silence, into which the end rings
    lengths = len(signal) + tail + np.arange(_LENGTHS)
    converted = lengths * (rate / given)
    length = int(lengths[np.abs(converted - np.rint(converted)).argmin()])
    made = _resampled(np.concatenate([signal, np.zeros(length - len(signal))]), round(length * rate / given))
    return Sound(made[:count], rate)


def audible_rate(highest: float, least: int = LEAST_RATE) -> int:
    """Return the smallest sampling rate (Hz) of players, at least `least`, that covers frequencies up to `highest`.

    InputError if none does.
    """
    rate = next((rate for rate in RATES if rate >= max(least, HEADROOM * highest)), 0)
    require(rate > 0, f"lines up to {highest:g} Hz have no sound: {RATES[-1] / HEADROOM:.0f} Hz is the most")
    return rate


def _periods(frequency: FloatArray, seconds: float, rate: int) -> tuple[int, IntArray]:
    """Return the number of samples of a loop and the whole number of periods (n_f,) that every line has in it."""
    if len(frequency) == 0:
        return round(seconds * rate), np.zeros(0, dtype=np.int64)
    gaps = np.diff(frequency, prepend=0.0)
    spacing = float(gaps.min())
    harmonic = np.rint(frequency / spacing)
    if spacing * LONGEST >= 1.0 and np.abs(frequency - harmonic * spacing).max() < 1e-3 * spacing:
        count = round(ceil(seconds * spacing) * rate / spacing)
        line = harmonic * ceil(seconds * spacing)
    else:
        closest = float(gaps[1:].min(initial=frequency[0]))
        duration = max(seconds, 2.0 / closest)
        require(
            duration <= LONGEST,
            f"lines {closest:.3g} Hz apart need a loop of {duration:.3g} s, {LONGEST:g} s at most: join such lines",
        )
        count = round(duration * rate)
        line = np.rint(frequency * count / rate)
    return count, line.astype(np.int64)


def _resampled(signal: FloatArray, count: int) -> FloatArray:
    """Return one period of a signal at another number of samples, by its Fourier series."""
    spectrum = np.asarray(rfft(signal))
    made = np.zeros(count // 2 + 1, dtype=complex)
    kept = min(len(spectrum), len(made))
    made[:kept] = spectrum[:kept]
    if count % 2 == 0 and count < len(signal):
        made[-1] = 0.0  # half of the sampling rate has no phase
    return np.asarray(irfft(made, count) * (count / len(signal)))
