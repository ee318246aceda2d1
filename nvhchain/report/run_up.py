"""Comparison of run-ups: waterfalls, levels over speed, sound."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import levels, plots
from nvhchain.chain.result import Result
from nvhchain.handoff import FloatArray, PressureHistory
from nvhchain.interop import write_history_wav
from nvhchain.plots import OrderMarks
from nvhchain.plots.files import save
from nvhchain.report.limits import limits
from nvhchain.report.marks import order_marks
from nvhchain.spectrum import Waterfall, order_cut, order_waterfall, waterfall

ORDER_RESOLUTION = 0.15
"""Orders of the input that figures and order cuts resolve: windows of ten turns."""

HARMONICS = 3
"""Number of harmonics of each mesh order that are followed over speed."""

WINDOW_BANDWIDTH = 1.5
"""Noise bandwidth of a Hann window in lines.

The summed energy of amplitude-corrected lines is too high by this factor.
"""


def compare_run_ups(results: Mapping[str, Result], out: Path) -> dict[str, Any]:
    """Write figures and sound of run-ups at the first field point; return the summary of every configuration."""
    marks = order_marks([result.case for result in results.values()])
    histories = {name: result.pressure_history for name, result in results.items() if result.pressure_history}
    band = max(result.case.band.high for result in results.values() if hasattr(result.case, "band"))
    highest = (HARMONICS + 1) * max(marks.mesh.values())
    heard = {name: (of.pressure[:, 0], _rate(of), of.input_speed) for name, of in histories.items()}
    against_frequency = {name: input_frequency_waterfall(*signal, high=band) for name, signal in heard.items()}
    against_order = {name: input_order_waterfall(*signal, high=highest) for name, signal in heard.items()}
    save(plots.waterfall_maps(against_frequency, unit="Pa", marks=marks), out / "waterfall.png")
    save(plots.waterfall_maps(against_order, unit="Pa", marks=marks), out / "orders.png")
    profiles = {name: _profiles(against_frequency[name], against_order[name], marks) for name in histories}
    save(plots.levels_over_speed(profiles), out / "levels.png")
    full_scale = 1.05 * max(float(np.abs(history.pressure[:, 0]).max()) for history in histories.values())
    for name, history in histories.items():
        write_history_wav(history, out / f"sound-{name}.wav", full_scale=full_scale)
    return {name: _summarise(history, profiles[name]) | limits(results[name]) for name, history in histories.items()}


def input_frequency_waterfall(signal: FloatArray, rate: float, input_speed: FloatArray, *, high: float) -> Waterfall:
    """Return the waterfall of `signal` (n_t, …), sampled at `rate` (Hz), up to `high` (Hz).

    The input turns ten times in a window at the mean of `input_speed` (n_t,) rad/s.
    """
    turns = float(input_speed.mean()) / (2 * pi)
    return waterfall(signal, sample_rate=rate, input_speed=input_speed, resolution=ORDER_RESOLUTION * turns, high=high)


def input_order_waterfall(signal: FloatArray, rate: float, input_speed: FloatArray, *, high: float) -> Waterfall:
    """Return the waterfall of `signal` (n_t, …) against order of the input, up to order `high`.

    The input turns ten times in every window.
    """
    return order_waterfall(signal, sample_rate=rate, input_speed=input_speed, resolution=ORDER_RESOLUTION, high=high)


def _rate(history: PressureHistory) -> float:
    """Sample rate (Hz) of a history."""
    return (len(history.time) - 1) / float(history.time[-1] - history.time[0])


def _profiles(
    frequency_map: Waterfall, order_map: Waterfall, marks: OrderMarks
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the curves over speed: name → (speed (n,) rad/s, level (n,) dB).

    The first is the overall A-weighted level; the others are mesh orders.
    """
    lines = frequency_map.amplitude[:, 1:].T / np.sqrt(WINDOW_BANDWIDTH)
    profiles = {"overall, dB(A)": (frequency_map.input_speed, levels.overall(frequency_map.axis[1:], lines))}
    for stage, order in marks.mesh.items():
        nearest = np.abs(order_map.axis - order).argmin()
        cut = order_cut(order_map, [float(order_map.axis[nearest])])[:, 0]
        profiles[f"order {order:g} ({stage}), dB"] = (order_map.input_speed, levels.decibel(cut))
    return profiles


def _summarise(history: PressureHistory, profiles: Mapping[str, tuple[FloatArray, FloatArray]]) -> dict[str, Any]:
    """Return the speeds, the equivalent level of the whole record and the highest level of every curve over speed."""
    return {
        "start_speed_rpm": 30 / pi * float(history.input_speed[0]),
        "end_speed_rpm": 30 / pi * float(history.input_speed[-1]),
        "overall_dBA": float(levels.equivalent(history.pressure[:, 0], sample_rate=_rate(history))),
        "highest": {
            name: {"level_db": float(level.max()), "speed_rpm": 30 / pi * float(speed[level.argmax()])}
            for name, (speed, level) in profiles.items()
        },
    }
