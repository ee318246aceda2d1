"""Door to MoSQITo (extra `sound`): loudness, sharpness and roughness of signals (n_t,) Pa at 48 kHz."""

from __future__ import annotations

import numpy as np
from mosqito import loudness_zwst, loudness_zwtv, roughness_dw, sharpness_din_from_loudness

from nvhchain.handoff import FloatArray

RATE = 48000
"""Sampling rate (Hz) of the filters of the standards."""

AUDIBLE = 0.1
"""Loudness (sone) below which a sound has no sharpness."""


def steady_loudness(signal: FloatArray) -> tuple[float, float]:
    """Return loudness (sone) by ISO 532-1, method for steady sounds, and sharpness (acum) by DIN 45692."""
    with np.errstate(all="ignore"):
        loudness, specific, _ = loudness_zwst(signal, RATE, field_type="free")
        sharpness = _sharpness(np.atleast_1d(np.asarray(loudness, dtype=float)), np.asarray(specific)[:, None])
    return float(loudness), float(sharpness[0])


def loudness_in_time(signal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times (s), loudness (sone) by ISO 532-1, method for time-varying sounds, and sharpness (acum)."""
    with np.errstate(all="ignore"):
        loudness, specific, _, time = loudness_zwtv(signal, RATE, field_type="free")
        sharpness = _sharpness(np.asarray(loudness, dtype=float), np.asarray(specific))
    return np.asarray(time, dtype=float), np.asarray(loudness, dtype=float), sharpness


def roughness_in_time(signal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times (s) and roughness (asper) of windows of 0.2 s, by Daniel and Weber (1997)."""
    with np.errstate(all="ignore"):
        roughness, _, _, time = roughness_dw(signal, RATE, overlap=0.5)
    return np.atleast_1d(np.asarray(time, dtype=float)), np.atleast_1d(np.nan_to_num(roughness))


def _sharpness(loudness: FloatArray, specific: FloatArray) -> FloatArray:
    """Return sharpness (n,) acum of loudness (n,) and specific loudness (240, n)."""
    heard = np.maximum(loudness, AUDIBLE)  # smaller values fail in MoSQITo 1.2.1
    found = np.asarray(sharpness_din_from_loudness(heard, specific, weighting="din"), dtype=float).ravel()
    return np.where(loudness < AUDIBLE, 0.0, np.nan_to_num(found))
