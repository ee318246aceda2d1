"""Hearing: loudness, sharpness and roughness of a sound, steady or over time (extra `sound`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log2

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.runtime.extras import imported
from nvhchain.sound.signals import Sound

_STEP = 0.05
"""Spacing (s) of the curves over time; the loudness of an interval is its largest one."""

_LOUDEST = 1.0
"""Duration (s) of the loudest part of a run-up, whose loudness states the limits."""


@dataclass(frozen=True, eq=False)
class Hearing:
    """Quantities of hearing of a sound, the same at both ears, in a free field from the front.

    loudness: loudness (sone); of a changing sound N5, which it exceeds for 5 % of the time.
    sharpness: sharpness (acum); of a changing sound the mean.
    roughness: roughness (asper); of a changing sound the largest 5 %, as for the loudness.
    time (n,): times (s) of the curves; empty for a steady sound.
    loudness_in_time (n,): loudness (sone).
    sharpness_in_time (n,): sharpness (acum).
    roughness_in_time (n,): roughness (asper).
    """

    loudness: float
    sharpness: float
    roughness: float
    time: FloatArray
    loudness_in_time: FloatArray
    sharpness_in_time: FloatArray
    roughness_in_time: FloatArray


@checked
def hearing(sound: Sound) -> Hearing:
    """Compute loudness, sharpness and roughness.

    sound: sound in pascals: a steady loop, or a record.
    Returns numbers, and for a record the curves over time.

    Loudness: ISO 532-1:2017, the steady method for a loop and the time-varying one for a record. Sharpness: DIN
    45692:2009. Roughness: Daniel & Weber, Acustica 83 (1997) 113, in windows of 0.2 s.
    """
    engine = imported("nvhchain.sound._mosqito", "mosqito")
    signal = np.asarray(sound.resampled(engine.RATE).pressure)
    rough_time, rough = engine.roughness_in_time(signal)
    if sound.loops:
        loudness, sharpness = engine.steady_loudness(signal)
        none = np.zeros(0)
        return Hearing(loudness, sharpness, float(rough.mean()), none, none, none, none)
    time, loud, sharp = engine.loudness_in_time(signal)
    step = max(1, round(_STEP / float(time[1] - time[0])))
    starts = np.arange(0, len(time), step)
    return Hearing(
        float(np.percentile(loud, 95)),
        float(sharp[sharp > 0].mean()) if (sharp > 0).any() else 0.0,
        float(np.percentile(rough, 95)),
        time[starts],
        np.maximum.reduceat(loud, starts),
        np.add.reduceat(sharp, starts) / np.diff(np.append(starts, len(sharp))),
        np.interp(time[starts], rough_time, rough),
    )


@checked
def loudness_at(sound: Sound, gains: FloatArray) -> FloatArray:
    """Return the loudness of a sound made louder or quieter.

    gains (n,): changes of the level (dB).
    Returns (n,): loudness (sone); N5 of a record.
    """
    engine = imported("nvhchain.sound._mosqito", "mosqito")
    signal = np.asarray(sound.resampled(engine.RATE).pressure)
    found = []
    for gain in gains:
        louder = signal * 10 ** (gain / 20)
        if sound.loops:
            found.append(engine.steady_loudness(louder)[0])
        else:
            found.append(float(np.percentile(engine.loudness_in_time(louder)[1], 95)))
    return np.array(found)


def loudness_limits(sound: Sound, loudness: float, gains: Sequence[float | None]) -> list[float | None]:
    """Return the loudness of a sound with all lines louder or quieter by the limits of the overall level.

    loudness: its loudness (sone).
    gains: lower and upper limit of the level less the level (dB); None for a limit that does not exist.
    Returns lower and upper limit (sone); None for one that does not exist.

    The limits of a record have the ratios of those of its loudest second, by the method for steady sounds.
    """
    if not sound.loops:
        part = max(1, round(_LOUDEST * sound.rate))
        starts = range(0, max(1, len(sound.pressure) - part + 1), max(1, part // 2))
        loudest = max(starts, key=lambda start: float(np.square(sound.pressure[start : start + part]).sum()))
        sound = Sound(sound.pressure[loudest : loudest + part], sound.rate, True)
    middle, *ends = loudness_at(sound, np.array([0.0, *(gain or 0.0 for gain in gains)])).tolist()
    scale = loudness / middle if middle > 0 else 1.0
    return [None if gain is None else scale * end for gain, end in zip(gains, ends, strict=True)]


def loudness_ratios(sound: Sound, time: FloatArray, gains: FloatArray) -> FloatArray:
    """Return what the loudness of a record is multiplied by where its level is at its limits.

    time (n,): middles of the parts of the record (s) to which the gains belong.
    gains (n, 2): lower and upper limit of the level less the level (dB); −inf for no lower limit.
    Returns (n, 2): ratios of the loudness of a second about each time, by the method for steady sounds.
    """
    size, ratios = max(1, round(_LOUDEST * sound.rate)), np.ones((len(time), 2))
    for row, (instant, ends) in enumerate(zip(time.tolist(), gains, strict=True)):
        first = min(max(0, round(instant * sound.rate) - size // 2), max(0, len(sound.pressure) - size))
        part = Sound(sound.pressure[first : first + size], sound.rate, True)
        middle, *limits = loudness_at(part, np.array([0.0, *np.maximum(ends, -200.0)])).tolist()
        ratios[row] = np.array(limits) / middle if middle > 0 else 1.0
    return ratios


def loudness_level(loudness: float) -> float:
    """Return the loudness level of a loudness.

    Returns loudness level (phon), ISO 532-1:2017; at least 3 phon.
    """
    return 40.0 + 10.0 * log2(loudness) if loudness >= 1 else max(3.0, 40.0 * (loudness + 0.0005) ** 0.35)
