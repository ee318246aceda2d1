"""Sound to listen to: designs at the same instant, with and without single orders, before a background."""

from __future__ import annotations

import base64
from contextlib import suppress
from typing import Any

import numpy as np

from nvhchain.errors import InputError
from nvhchain.handoff import PressureHistory
from nvhchain.report.page.blocks import Figure, Table, Text, colour, packed
from nvhchain.report.page.sections.speed.run_up import kind_of_record
from nvhchain.report.sound.write import BACKGROUND
from nvhchain.report.stored import Stored, StoredRun
from nvhchain.sound import Loop, Sound, order_track, read_wav, run_up_sound, steady_loop
from nvhchain.sound.orders import LEAST_TURNS
from nvhchain.sound.signals import RATES, audible_rate
from nvhchain.sound.wav import encoded_16_bit

TITLE = "Sound"

EMBEDDED = 6e6
"""Largest size (bytes) of all records in a page, before they are written as text."""

ORDERS = 8
"""Largest number of orders that can be switched off."""

LEAST_RANGE = 40.0
"""Range (dB) below the loudest order within which an order can be switched off."""

FAINT = 90.0
"""Range (dB) below the strongest line within which lines are played."""

TOGETHER = "All designs play together; the buttons choose which one is heard, at the same instant. "

EXPLANATION = (
    "One gain holds for everything that is played: full scale is {scale:.3g} Pa. The WAV files beside this page hold "
    "pascals."
)


def blocks(stored: Stored) -> list[Any]:
    """Return the player and the table of sound files."""
    scale = 1.05 * max([_peak(run) for run in stored.runs] + [0.0])
    background = _background(stored)
    if background is not None:
        scale += background.peak
    data: dict[str, Any] = {"scale": scale, "runs": _runs(stored, scale) if scale > 0 else []}
    if not data["runs"]:
        return []
    if background is not None:
        rate = audible_rate(10e3, 24000)
        data["background"] = _text(encoded_16_bit(background.resampled(rate), scale))
    words = kind_of_record(stored).lower() if "wav" in data["runs"][0] else "steady sound, a loop"
    caption = f"Player: {words}, at {stored.microphone or 'the first microphone'}."
    return [
        Text((TOGETHER if len(data["runs"]) > 1 else "") + EXPLANATION.format(scale=scale)),
        Figure(caption, data, height=90, kind="player"),
        *_files(stored),
    ]


def _peak(run: StoredRun) -> float:
    """Return the largest sound pressure (Pa) of a run; 0 without a sound."""
    if run.pressure_history is not None:
        return float(np.abs(run.pressure_history.pressure[:, 0]).max())
    loop = _loop(run)
    return 0.0 if loop is None else loop.sound.peak


def _loop(run: StoredRun) -> Loop | None:
    with suppress(InputError):
        if run.pressure is not None:
            heard = run.pressure.frequency[run.pressure.frequency > 0]
            return steady_loop(run.pressure, rate=audible_rate(float(heard.max(initial=0.0)), 16000))
    return None


def _runs(stored: Stored, scale: float) -> list[dict[str, Any]]:
    """Return the sound of every configuration for the player."""
    histories = {run.name: run.pressure_history for run in stored.runs if run.pressure_history is not None}
    orders = _orders(stored)
    rate = _embedded_rate(stored, list(histories.values()))
    found = []
    for number, run in enumerate(stored.runs):
        one: dict[str, Any] = {"name": run.name, "colour": colour(number)}
        if run.name in histories and rate:
            history = histories[run.name]
            heard = run_up_sound(history, rate=rate)
            one["wav"] = _text(encoded_16_bit(heard, scale))
            one |= _tracks(_sampled(history, heard), orders)
        elif run.pressure is not None and (loop := _loop(run)) is not None:
            one |= _lines(run, loop, orders)
        else:
            continue
        found.append(one)
    return found


def _lines(run: StoredRun, loop: Loop, orders: list[tuple[float, str]]) -> dict[str, Any]:
    """Return the lines of a loop, and the place of every order among them."""
    assert run.pressure is not None
    size = np.abs(loop.amplitude)
    kept = np.flatnonzero(size > size.max(initial=0.0) * 10 ** (-FAINT / 20))
    turns = run.pressure.input_speed / (2 * np.pi)
    axis = run.pressure.frequency[run.pressure.frequency > 0][kept] / (turns or 1.0)
    return {
        "count": loop.count,
        "rate": loop.rate,
        "line": packed(loop.line[kept], "i4"),
        "real": packed(loop.amplitude[kept].real),
        "imag": packed(loop.amplitude[kept].imag),
        "orders": [
            {"name": name, "lines": np.flatnonzero(np.abs(axis - order) < 1e-3 * max(1.0, order)).tolist()}
            for order, name in orders
        ],
    }


def _sampled(history: PressureHistory, sound: Sound) -> PressureHistory:
    """Return a run-up at the samples of its sound."""
    time = history.time[0] + np.arange(len(sound.pressure)) / sound.rate
    speed = np.interp(time, history.time, history.input_speed)
    return PressureHistory(time, history.points[:1], np.asarray(sound.pressure)[:, None], speed)


def _tracks(history: PressureHistory, orders: list[tuple[float, str]]) -> dict[str, Any]:
    """Return angle and speed of a run-up, and the envelope of every order."""
    tracks = [(name, order_track(history, order)) for order, name in orders]
    if not tracks:
        return {"orders": []}
    first = tracks[0][1]
    return {
        "step": float(first.time[1] - first.time[0]),
        "angle": packed(first.angle, "f8"),
        "speed": packed(first.input_speed),
        "orders": [
            {
                "name": name,
                "order": track.order,
                "real": packed(track.envelope.real),
                "imag": packed(track.envelope.imag),
            }
            for name, track in tracks
        ],
    }


def _orders(stored: Stored) -> list[tuple[float, str]]:
    """Return the orders, or frequencies without an input speed, that are loudest in dB(A), with their names.

    Records in which the input turns too few times resolve none.
    """
    histories = [run.pressure_history for run in stored.runs if run.pressure_history is not None]
    if any(np.trapezoid(history.input_speed, history.time) <= 2 * np.pi * LEAST_TURNS for history in histories):
        return []
    if histories:
        curves = next(iter(stored.curves.values()))
        return [(curve.order, curve.name) for curve in curves if curve.order is not None][:ORDERS]
    loudest: dict[float, float] = {}
    turning = False
    for run in stored.runs:
        if run.pressure is None:
            continue
        turns = run.pressure.input_speed / (2 * np.pi)
        turning = turning or turns > 0
        frequency, level = run.weighted_lines
        for line in np.argsort(-level)[:ORDERS]:
            order = round(float(frequency[line] / (turns or 1.0)), 6)
            loudest[order] = max(loudest.get(order, -np.inf), float(level[line]))
    least = max(loudest.values(), default=0.0) - LEAST_RANGE
    chosen = sorted(
        sorted((order for order in loudest if loudest[order] > least), key=lambda order: -loudest[order])[:ORDERS]
    )
    return [(order, _name(stored, order) if turning else f"{order:g} Hz") for order in chosen]


def _name(stored: Stored, order: float) -> str:
    origin = stored.origin(order)
    return f"order {order:.6g}" + (f" ({origin})" if origin else "")


def _embedded_rate(stored: Stored, histories: list[PressureHistory]) -> int:
    """Return the sampling rate (Hz) of the records in the page; 0 where none is small enough."""
    high = max((float(run.case.get("values", {}).get("band.high", 0.0)) for run in stored.runs), default=0.0)
    seconds = sum(float(history.time[-1] - history.time[0]) for history in histories)
    wanted = audible_rate(high or 20e3, RATES[0])
    return next((rate for rate in reversed(RATES) if rate <= wanted and 2 * rate * seconds <= EMBEDDED), 0)


def _background(stored: Stored) -> Sound | None:
    """Return the background in the folder."""
    path = stored.folder / BACKGROUND
    if not path.is_file():
        return None
    found = read_wav(path)
    return Sound(found.pressure, found.rate, True)


def _files(stored: Stored) -> list[Any]:
    """Return the table of sound files."""
    rows = [
        (
            name,
            entry["file"],
            f"{entry['rate_hz']}",
            f"{entry['seconds']:.4g}",
            f"{entry['rms_Pa']:.4g}",
            f"{entry['level_dB']:.1f}",
        )
        for name, entry in _entries(stored)
    ]
    head = ("sound", "file", "samples per second", "duration / s", "RMS / Pa", "level / dB")
    caption = "Files: 32-bit floating point, sample 1.0 = 1 Pa. Levels re 20 µPa, not weighted."
    return [Table(head, rows, caption, numbers=2)] if rows else []


def _entries(stored: Stored) -> list[tuple[str, Any]]:
    found = [(run.name, entry) for run in stored.runs if (entry := run.summary.get("sound"))]
    masks = [("background", entry["background"]) for _, entry in found if "background" in entry]
    return [*found, *masks[:1]]


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
