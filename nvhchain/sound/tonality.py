"""Prominence of tones of known frequency before a background: tone-to-noise ratio and prominence ratio."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import log2

import numpy as np

from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.sound.signals import Sound

LOWEST, HIGHEST = 89.1, 11220.0
"""Frequencies (Hz) between which the standard judges tones."""


@dataclass(frozen=True)
class ToneProminence:
    """Prominence of one tone.

    frequency: frequency (Hz).
    tone_to_noise: level of the tone over that of the background in its critical band (dB).
    prominence_ratio: level of the critical band with the tone over the mean of both adjacent bands (dB).
    prominent: True where either ratio reaches the limit of the standard.
    """

    frequency: float
    tone_to_noise: float
    prominence_ratio: float
    prominent: bool


@checked
def tone_prominence(frequency: float, level: float, background: Sound) -> ToneProminence:
    """Compute tone-to-noise ratio and prominence ratio of a tone before a background.

    frequency: frequency of the tone (Hz).
    level: level of the tone (dB re 20 µPa).
    Returns ratios, and whether the tone is prominent.

    ECMA-418-1:2021. The tone and the background are known apart, so that no peaks need to be found in a spectrum. Other
    tones in a critical band count neither as noise nor with the tone.
    """
    require(
        LOWEST <= frequency <= HIGHEST,
        f"tone at {frequency:g} Hz: its prominence is defined from {LOWEST:g} to {HIGHEST:g} Hz",
    )
    low, high = critical_band(frequency)
    below, above = _band_that_ends(low), _band_that_begins(high)
    energy = [_energy(background, *edges) for edges in ((low, high), (below, low), (high, above))]
    tone = REFERENCE_PRESSURE**2 * 10 ** (level / 10)
    noise = max(energy[0], 1e-300)
    adjacent = max(0.5 * (_full(energy[1], below, low) + energy[2]), 1e-300)
    noise_ratio, ratio = 10 * np.log10(tone / noise), 10 * np.log10((tone + noise) / adjacent)
    limits = prominence_limits(frequency)
    prominent = noise_ratio >= limits[0] or ratio >= limits[1]
    return ToneProminence(frequency, float(noise_ratio), float(ratio), bool(prominent))


def prominence_limits(frequency: float) -> tuple[float, float]:
    """Return the tone-to-noise ratio and the prominence ratio (dB) at which a tone is prominent, ECMA-418-1:2021.

    frequency: frequency of the tone (Hz). From 1 kHz on the limits are 8 and 9 dB; they rise by 8.33 and 10 dB an
    octave towards lower frequencies.
    """
    octaves = max(0.0, log2(1000.0 / frequency))
    return 8.0 + 8.33 * octaves, 9.0 + 10.0 * octaves


def critical_bandwidth(frequency: float) -> float:
    """Return the width (Hz) of the critical band about a frequency (Hz)."""
    return float(25.0 + 75.0 * (1.0 + 1.4 * (frequency / 1000.0) ** 2) ** 0.69)


def critical_band(frequency: float) -> tuple[float, float]:
    """Return the edges (Hz) of the critical band about a frequency (Hz): arithmetic up to 500 Hz, then geometric."""
    width = critical_bandwidth(frequency)
    if frequency <= 500.0:
        return frequency - 0.5 * width, frequency + 0.5 * width
    low = -0.5 * width + 0.5 * float(np.sqrt(width**2 + 4.0 * frequency**2))
    return low, low + width


def _band_that_ends(edge: float) -> float:
    """Return the lower edge (Hz) of the critical band that ends at `edge` (Hz), 20 Hz at least."""
    if edge <= 20.0 + critical_bandwidth(20.0):
        return 20.0
    middles = np.linspace(20.0, edge, 2000)
    return max(20.0, critical_band(float(middles[_nearest([critical_band(float(f))[1] for f in middles], edge)]))[0])


def _band_that_begins(edge: float) -> float:
    """Return the upper edge (Hz) of the critical band that begins at `edge` (Hz)."""
    middles = np.linspace(edge, 1.4 * edge + 100.0, 2000)
    return critical_band(float(middles[_nearest([critical_band(float(f))[0] for f in middles], edge)]))[1]


def _nearest(values: list[float], wanted: float) -> int:
    return int(np.abs(np.array(values) - wanted).argmin())


def _full(energy: float, low: float, high: float) -> float:
    """Return the energy of a band cut at 20 Hz as that of a band of 100 Hz, as the standard asks for."""
    return energy * max(1.0, 100.0 / (high - low)) if low <= 20.0 else energy


def _energy(sound: Sound, low: float, high: float) -> float:
    """Return the mean square pressure (Pa²) between two frequencies (Hz)."""
    energy, spacing = _energy_below(sound)
    first, end = (min(int(np.ceil(edge / spacing - 1e-9)), len(energy) - 1) for edge in (low, high))
    return float(energy[end] - energy[first])


@lru_cache(maxsize=2)
def _energy_below(sound: Sound) -> tuple[FloatArray, float]:
    """Return the mean square pressure (Pa²) below each line of a spectrum (n_f + 1,), and the spacing of lines (Hz)."""
    signal: FloatArray = np.asarray(sound.pressure)
    power = 2.0 * np.abs(np.fft.rfft(signal)) ** 2 / len(signal) ** 2
    return np.concatenate([[0.0], np.cumsum(power)]), sound.rate / len(signal)
