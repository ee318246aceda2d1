"""Levels of third octaves at the first microphone."""

from __future__ import annotations

import numpy as np

from nvhchain import levels
from nvhchain.report.page.blocks import Figure, axes, level_bars
from nvhchain.report.stored import Stored, StoredRun

HEIGHT = 225
"""Height (pixels) of the figure."""


def octave_figure(stored: Stored) -> Figure | None:
    """Return the A-weighted levels of third octaves, of a record over its whole length."""
    heard = stored.having(_third_octaves)
    if not heard:
        return None
    found: dict[int, dict[int, float]] = {}
    for number, _, third_octaves in heard:
        numbers = np.rint(10 * np.log10(third_octaves.middle)).astype(int)
        found[number] = dict(zip(numbers.tolist(), third_octaves.level.tolist(), strict=True))
    top = max(max(band_levels.values()) for band_levels in found.values())
    floor = float(5 * np.floor(top / 5) - 45)
    bands = sorted({band for band_levels in found.values() for band, level in band_levels.items() if level > floor})
    bands = list(range(bands[0], bands[-1] + 1)) if bands else []
    names, hover = [_nominal(band) for band in bands], "%{x} Hz: %{customdata} dB(A)"
    traces = [
        level_bars(number, run.name, names, [found[number].get(band) for band in bands], floor, hover)
        for number, run, _ in heard
    ]
    layout = axes("third octave / Hz", "level / dB(A)", xaxis={"type": "category"}, bargap=0.25)
    whole = ", over the whole record" if any(run.pressure is None for _, run, _ in heard) else ""
    return Figure(f"A-weighted levels of third octaves{whole}.", traces, layout, height=HEIGHT)


def _third_octaves(run: StoredRun) -> levels.OctaveBands | None:
    """Return the A-weighted third octaves of a run at the first microphone."""
    if run.pressure is not None:
        return levels.octave_bands(run.pressure.frequency, run.pressure.pressure[:, 0], weighted=True)
    if run.pressure_history is None:
        return None
    time, sound = run.pressure_history.time, run.pressure_history.pressure[:, 0]
    rate = (len(time) - 1) / float(time[-1] - time[0])
    return levels.record_bands(sound, sample_rate=rate, weighted=True)


def _nominal(band: int) -> str:
    """Return the nominal frequency of third octave number `band` (Hz)."""
    value = float(("1", "1.25", "1.6", "2", "2.5", "3.15", "4", "5", "6.3", "8")[band % 10]) * 10.0 ** (band // 10)
    return f"{value / 1000:.3g}k" if value >= 1000 else f"{value:.3g}"
