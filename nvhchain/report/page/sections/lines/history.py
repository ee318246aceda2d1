"""Sound pressure over time."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.errors import InputError
from nvhchain.handoff import FieldPressure, FloatArray
from nvhchain.plots.history import OVERSAMPLING
from nvhchain.report.page.blocks import Figure, colour, curve, grid, packed
from nvhchain.report.stored import Stored

TITLE = "Pressure over time"

TURNS = 2.0
"""Turns of the input that are drawn at constant speed."""

PARTS = 1500
"""Number of parts of a run-up whose extremes are drawn."""


def blocks(stored: Stored) -> list[Any]:
    """Return the sound pressure of every configuration at the first field point."""
    curves = []
    for number, run in enumerate(stored.runs):
        if run.pressure is not None and run.pressure.input_speed > 0:
            with suppress(InputError):  # lines without a common period
                curves.append((number, run.name, *_steady(run.pressure)))
        elif run.pressure_history is not None:
            history = run.pressure_history
            curves.append((number, run.name, *_extremes(history.time, history.pressure[:, 0])))
    if not curves:
        return []
    running = any(run.pressure_history is not None for run in stored.runs)
    titles = [f"{name}: {rms:.3g} Pa RMS" for _, name, _, _, rms in curves]
    layout = grid(titles, 1, "time / s" if running else "time / ms", "pressure / Pa")
    traces = []
    for place, (number, name, time, signal, _) in enumerate(curves):
        x, y, line = packed(time if running else 1e3 * time), packed(signal), {"color": colour(number), "width": 1}
        hover, style = "%{x:.4g}: %{y:.3g} Pa", {"line": line, "showlegend": False}
        traces.append(curve(number, name, x, y, hover, place=place) | style)
    what = "extremes of short parts of the run-up" if running else f"{TURNS:g} turns of the input"
    caption = f"Sound pressure at {stored.runs[0].point_name(0)}: {what}."
    return [Figure(caption, traces, layout, height=80 + 170 * len(curves))]


def _steady(field: FieldPressure) -> tuple[FloatArray, FloatArray, float]:
    """Return time (n,) s, signal (n,) Pa and RMS value (Pa) of a line spectrum."""
    time, signal = levels.time_history(
        field.frequency, field.pressure[:, 0], sample_rate=OVERSAMPLING * float(field.frequency[-1])
    )
    rms = float(np.sqrt(np.mean(signal**2)))
    shown = time <= TURNS * 2 * np.pi / field.input_speed
    return time[shown], signal[shown], rms


def _extremes(time: FloatArray, signal: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return lowest and highest value of every part, in turn."""
    length = max(1, len(time) // PARTS)
    count = len(time) // length
    parts = signal[: count * length].reshape(count, length)
    middle = time[: count * length].reshape(count, length).mean(axis=1)
    ends = np.stack([parts.min(axis=1), parts.max(axis=1)], axis=1).ravel()
    return np.repeat(middle, 2), ends, float(np.sqrt(np.mean(signal**2)))
