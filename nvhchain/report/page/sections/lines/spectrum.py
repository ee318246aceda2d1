"""Spectra of sound pressure and sound power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.handoff import FloatArray, SoundPower
from nvhchain.report.marks import order_name
from nvhchain.report.page.blocks import DASHES, Figure, colour, label, rounded, symbol
from nvhchain.report.page.stored import Stored, StoredRun

TITLE = "Spectra"

RANGE = 80.0
"""Range (dB) of lines below the strongest one of all, plain or A-weighted."""


def blocks(stored: Stored) -> list[Any]:
    """Return the spectra of sound pressure at all field points, and of sound power."""
    found = []
    heard = [(number, run) for number, run in enumerate(stored.runs) if run.pressure is not None]
    if heard:
        first = heard[0][1]
        assert first.pressure is not None
        count = min(run.pressure.points.shape[0] for _, run in heard if run.pressure is not None)
        runs = [
            _run(stored, number, run, of.frequency, levels.decibel(of.pressure[:, :count]), of.input_speed)
            for number, run in heard
            if (of := run.pressure) is not None
        ]
        found.append(
            _figure(
                stored,
                runs,
                [first.point_name(point) for point in range(count)],
                "20 µPa",
                "Sound pressure level of every line. Bars at the heads: confidence limits of lines within 20 dB of the "
                "strongest, at the first microphone. Upright lines: mesh orders and their harmonics.",
            )
        )
    powers = [
        (number, run, power)
        for number, run in enumerate(stored.runs)
        if (power := run.hand_off("sound_power", SoundPower))
    ]
    if powers:
        runs = [
            _run(
                stored, number, run, of.frequency, levels.power_level(of.power)[:, None], of.input_speed, limited=False
            )
            for number, run, of in powers
        ]
        found.append(_figure(stored, runs, ["sound power"], "1 pW", "Sound power level of every line."))
    return found


def _figure(stored: Stored, runs: list[dict[str, Any]], points: Sequence[str], reference: str, caption: str) -> Figure:
    marks = [{"order": order, "dash": DASHES[index % 4]} for index, order in enumerate(stored.marks.mesh.values())]
    data = {"runs": runs, "points": list(points), "reference": reference, "weighted": True, "marks": marks}
    return Figure(caption, data, height=430, kind="spectrum")


def _run(
    stored: Stored,
    number: int,
    run: StoredRun,
    frequency: FloatArray,
    level: FloatArray,
    input_speed: float,
    *,
    limited: bool = True,
) -> dict[str, Any]:
    """Return the lines of one configuration: levels (n_f, n_point) dB."""
    weighted = level + levels.a_weighting(frequency)[:, None]
    seen = (frequency > 0) & ((level > level.max() - RANGE) | (weighted > weighted.max() - RANGE)).any(axis=1)
    turns = input_speed / (2 * np.pi)
    names = [order_name(f / turns, stored.marks.mesh, stored.marks.slots) if turns else "" for f in frequency[seen]]
    found: dict[str, Any] = {
        "name": label(run.name),
        "colour": colour(number),
        "symbol": symbol(number),
        "turns": turns,
        "frequency": rounded(frequency[seen], 4),
        "level": [rounded(of[seen]) for of in level.T],
        "origin": [label(name) for name in names],
    }
    limits = run.summary.get("lines", []) if limited else []
    if len(limits) == len(frequency):
        edges = np.array([line["limits_db"] for line in limits], dtype=float)[seen]
        found |= {"lower": rounded(edges[:, 0]), "upper": rounded(edges[:, 1])}
    return found
