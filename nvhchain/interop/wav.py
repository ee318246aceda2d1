"""Sound pressure → a WAV file to listen to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import wavfile

from nvhchain.errors import require
from nvhchain.files.whole import in_memory, write_whole
from nvhchain.handoff import FieldPressure, FloatArray, PressureHistory
from nvhchain.levels import time_history

SAMPLE_RATE = 48000.0
"""Hz, near which the period is sampled; the exact rate holds a whole number of samples per period."""


def write_wav(
    pressure: FieldPressure, path: str | Path, *, point: int = 0, seconds: float = 5.0, full_scale: float
) -> Path:
    """Repeat the steady signal at one field point for `seconds`; `full_scale` Pa become the largest sample.

    The same `full_scale` for several files keeps their loudness comparable.  Raises InputError where the signal
    exceeds it or the lines are not harmonic.
    """
    time, signal = time_history(pressure.frequency, pressure.pressure[:, point], sample_rate=SAMPLE_RATE)
    repeats = int(np.ceil(seconds / (len(time) * time[1])))
    return _write(np.tile(signal, repeats), 1.0 / time[1], Path(path), full_scale)


def write_history_wav(history: PressureHistory, path: str | Path, *, point: int = 0, full_scale: float) -> Path:
    """The record at one field point at its own sampling rate, rounded to whole hertz; else as `write_wav`."""
    return _write(history.pressure[:, point], 1.0 / float(np.diff(history.time).mean()), Path(path), full_scale)


def _write(signal: FloatArray, sample_rate: float, path: Path, full_scale: float) -> Path:
    peak = float(np.abs(signal).max())
    require(peak <= full_scale, f"signal peak {peak:g} Pa exceeds full scale {full_scale:g} Pa: raise full_scale")
    samples = np.rint(signal / full_scale * 32767).astype(np.int16)
    return write_whole(path, in_memory(lambda file: wavfile.write(file, round(sample_rate), samples)))
