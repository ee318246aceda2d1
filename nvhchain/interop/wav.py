"""Sound pressure as a WAV file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import wavfile

from nvhchain.errors import require
from nvhchain.files.atomic_write import content_of, write_atomic
from nvhchain.handoff import FieldPressure, FloatArray, PressureHistory
from nvhchain.levels import time_history

SAMPLE_RATE = 48000.0
"""Sampling rate (Hz) of the period, approximately; the exact rate gives a whole number of samples per period."""


def write_wav(
    pressure: FieldPressure, path: str | Path, *, point: int = 0, seconds: float = 5.0, full_scale: float
) -> Path:
    """Write the steady signal at one field point, repeated.

    Parameters
    ----------
    pressure : FieldPressure
        Sound pressure.
    path : str or Path
        WAV file.
    point : int
        Index of the field point.
    seconds : float
        Duration (s).
    full_scale : float
        Pressure (Pa) of the largest sample; one value for several files keeps their loudness comparable.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        If the signal exceeds `full_scale` or the lines are not harmonic.
    """
    time, signal = time_history(pressure.frequency, pressure.pressure[:, point], sample_rate=SAMPLE_RATE)
    repeats = int(np.ceil(seconds / (len(time) * time[1])))
    return _write(np.tile(signal, repeats), 1.0 / time[1], Path(path), full_scale)


def write_history_wav(history: PressureHistory, path: str | Path, *, point: int = 0, full_scale: float) -> Path:
    """Write the record at one field point at its own sampling rate, rounded to whole hertz.

    Parameters
    ----------
    history : PressureHistory
        Sound pressure over time.
    path : str or Path
        WAV file.
    point, full_scale
        As in `write_wav`.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        If the signal exceeds `full_scale`.
    """
    return _write(history.pressure[:, point], 1.0 / float(np.diff(history.time).mean()), Path(path), full_scale)


def _write(signal: FloatArray, sample_rate: float, path: Path, full_scale: float) -> Path:
    peak = float(np.abs(signal).max())
    require(peak <= full_scale, f"signal peak {peak:g} Pa exceeds full scale {full_scale:g} Pa: raise full_scale")
    samples = np.rint(signal / full_scale * 32767).astype(np.int16)
    return write_atomic(path, content_of(lambda file: wavfile.write(file, round(sample_rate), samples)))
