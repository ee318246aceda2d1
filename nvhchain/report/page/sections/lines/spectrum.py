"""Spectra of sound pressure and sound power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.handoff import FieldPressure, FloatArray, SoundPower
from nvhchain.report.page.blocks import DASHES, Figure, colour, label, symbol
from nvhchain.report.stored import Stored, StoredRun, rounded

TITLE = "Spectra"

RANGE = 80.0
"""Range (dB) of lines below the strongest one of all, plain or A-weighted."""


def blocks(stored: Stored) -> list[Any]:
    """Return the spectra of sound pressure at all field points, and of sound power."""
    found = []
    heard = stored.having(lambda run: run.pressure)
    if heard:
        count = min(len(sound.points) for *_, sound in heard)
        runs = [
            _run(stored, number, run, levels.decibel(sound.pressure[:, :count]), sound) for number, run, sound in heard
        ]
        points = [heard[0][1].point_name(point) for point in range(count)]
        caption = (
            "Sound pressure level of every line. Bars at the heads: confidence limits of lines within 20 dB of the "
            "strongest, at the first microphone. Upright lines: mesh orders and their harmonics."
        )
        found.append(_figure(stored, runs, points, "20 µPa", caption))
    powers = stored.having(lambda run: run.hand_off("sound_power", SoundPower))
    if powers:
        runs = [
            _run(stored, number, run, levels.power_level(sound.power)[:, None], sound) for number, run, sound in powers
        ]
        found.append(_figure(stored, runs, ["sound power"], "1 pW", "Sound power level of every line."))
    return found


def _figure(stored: Stored, runs: list[dict[str, Any]], points: Sequence[str], reference: str, caption: str) -> Figure:
    marks = [{"order": order, "dash": DASHES[index % 4]} for index, order in enumerate(stored.marks.mesh.values())]
    data = {"runs": runs, "points": list(points), "reference": reference, "weighted": True, "marks": marks}
    return Figure(caption, data, height=430, kind="spectrum")


def _run(
    stored: Stored, number: int, run: StoredRun, level: FloatArray, sound: FieldPressure | SoundPower
) -> dict[str, Any]:
    """Return the lines of one configuration: levels (n_f, n_point) dB."""
    frequency = sound.frequency
    weighted = level + levels.a_weighting(frequency)[:, None]
    seen = (frequency > 0) & ((level > level.max() - RANGE) | (weighted > weighted.max() - RANGE)).any(axis=1)
    turns = sound.input_speed / (2 * np.pi)
    names = [stored.origin(f / turns) if turns else "" for f in frequency[seen]]
    found: dict[str, Any] = {
        "name": label(run.name),
        "colour": colour(number),
        "symbol": symbol(number),
        "turns": turns,
        "frequency": rounded(frequency[seen], 4),
        "level": [rounded(point_level[seen]) for point_level in level.T],
        "origin": [label(name) for name in names],
    }
    limits = run.summary.get("lines", []) if isinstance(sound, FieldPressure) else []
    if len(limits) == len(frequency):
        edges = np.array([line["limits_db"] for line in limits], dtype=float)[seen]
        found |= {"lower": rounded(edges[:, 0]), "upper": rounded(edges[:, 1])}
    return found
