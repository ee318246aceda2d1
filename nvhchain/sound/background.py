"""Background beside the predicted sound: a record, or noise with given levels of third octaves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.fft import irfft

from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.sound.signals import LEAST_RATE, LONGEST, Sound
from nvhchain.sound.wav import read_wav

SECONDS = 6.0
"""Duration (s) of made noise."""

LONGEST_RECORD = 30.0
"""Longest duration (s) of the loop of a record."""

_FADE = 0.25
"""Duration (s) over which the end of a loop fades into its beginning."""

_LEAST_ALIKE = -0.75
"""Least correlation for which a fade keeps the power: more gain would lift noise."""

_SEED = 3
"""Seed of the noise."""


@dataclass(frozen=True, eq=False)
class Background:
    """Noise with given levels of third octaves.

    frequency (n_band,): middle frequencies (Hz) of third octaves, rising.
    level (n_band,): levels (dB re 20 µPa).
    """

    frequency: FloatArray
    level: FloatArray


@checked
def background_sound(background: Background, *, seconds: float = SECONDS, rate: int = LEAST_RATE) -> Sound:
    """Return noise with the levels of third octaves, as a loop.

    seconds: duration (s).
    rate: sampling rate (Hz).
    Returns loop of normally distributed noise with exact levels. Its density is constant within a band.
    """
    frequency, level = np.asarray(background.frequency, dtype=float), np.asarray(background.level, dtype=float)
    require(
        frequency.ndim == 1 and len(frequency) == len(level) > 0,
        f"{len(frequency)} frequencies for {len(level)} levels of a background: give one level each",
    )
    require(
        bool((np.diff(frequency) > 0).all() and frequency[0] > 0 and np.isfinite(level).all()),
        "frequencies of the background must be positive and rise, levels finite",
    )
    require(0 < seconds <= LONGEST, f"seconds = {seconds:g} of background are outside 0…{LONGEST:g}")
    count = round(seconds * rate)
    axis = np.arange(count // 2 + 1) * (rate / count)
    random = np.random.default_rng(_SEED)
    drawn = random.normal(size=len(axis)) + 1j * random.normal(size=len(axis))
    spectrum = np.zeros(len(axis), dtype=complex)
    edge = 10 ** (1 / 20)
    for middle, decibels in zip(frequency, level, strict=True):
        low, high = middle / edge, min(middle * edge, 0.5 * rate)
        band = np.flatnonzero((axis >= low) & (axis < high))
        require(
            len(band) > 0,
            f"third octave at {middle:g} Hz of the background has no line in {seconds:g} s at {rate} Hz: leave it out",
        )
        part = drawn[band]
        wanted = REFERENCE_PRESSURE * 10 ** (decibels / 20)
        spectrum[band] = part * (wanted / np.sqrt(0.5 * (np.abs(part) ** 2).sum()))
    return Sound(np.asarray(irfft(0.5 * count * spectrum, count)), rate, True)


@checked
def recorded_background(
    path: str | Path, *, full_scale: float = 1.0, seconds: float = LONGEST_RECORD, rate: int = LEAST_RATE
) -> Sound:
    """Read a record of background as a loop.

    path: WAV file of any rate; its first channel counts.
    full_scale: pressure (Pa) of a sample of 1.0, or of full scale for integers.
    seconds: longest duration (s) of the loop; the rest of the record is excluded.
    rate: sampling rate (Hz) of the result; records of other rates are converted.
    Returns loop; the end of the record fades into its beginning at constant power.
    """
    record = read_wav(path, full_scale=full_scale)
    require(
        record.seconds >= 4 * _FADE,
        f"{path} lasts {record.seconds:.3g} s, too short for a background: {4 * _FADE:g} s are needed",
    )
    signal = record.resampled(rate).pressure[: round((seconds + _FADE) * rate)]
    return Sound(_faded(signal, round(_FADE * rate)), rate, True)


@checked
def background_beside(sound: Sound, background: Sound) -> Sound:
    """Return a background, a loop, with the duration and rate of a sound; beside a loop it is a loop, too."""
    signal = background.resampled(sound.rate).pressure
    fade = min(round(_FADE * sound.rate), len(sound.pressure)) if sound.loops else 0
    count = len(sound.pressure) + fade
    signal = np.tile(signal, -(-count // len(signal)))[:count]
    return Sound(_faded(signal, fade) if fade else signal, sound.rate, sound.loops)


def _faded(signal: FloatArray, fade: int) -> FloatArray:
    """Return a loop: the last samples, `fade` in number, fade into the first ones.

    The power is constant, also where both are alike: it is sin² + cos² + 2 c sin cos for a correlation c.
    """
    angle = 0.5 * np.pi * (np.arange(fade) + 0.5) / fade
    made, first, last = np.array(signal[:-fade]), signal[:fade], signal[-fade:]
    alike = float(first @ last) / max(float(np.linalg.norm(first) * np.linalg.norm(last)), 1e-300)
    power = 1.0 + max(alike, _LEAST_ALIKE) * np.sin(2 * angle)
    made[:fade] = (first * np.sin(angle) + last * np.cos(angle)) / np.sqrt(power)
    return made
