"""Error bands in JSON files, with null for no limit."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isfinite, pi
from pathlib import Path
from typing import Any

from nvhchain.error_band.band import SILENT_LEVEL, ErrorBand
from nvhchain.error_band.run_up import RunUpBand
from nvhchain.files.hdf5 import write_text
from nvhchain.handoff import FloatArray
from nvhchain.levels import decibel


def save_error_bands(bands: Mapping[str, ErrorBand | RunUpBand], out: str | Path) -> None:
    """Write `error_bands.json`: every band (`band_record`) by the name of its quantity.

    out: folder of the file; created if needed.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / "error_bands.json", json.dumps({name: band_record(band) for name, band in bands.items()}) + "\n")


def band_record(band: ErrorBand | RunUpBand) -> dict[str, Any]:
    """Return levels and limits of every place, overall and line by line or speed by speed.

    Levels of lines are in dB re `reference` (RMS). Overall levels and levels of speeds are in dB(A) if `weighted`.
    """
    line_band = band.bands[0] if isinstance(band, RunUpBand) else band
    found: dict[str, Any] = {
        "reference": line_band.reference,
        "weighted": line_band.weighted,
        "overall_level": band.level.tolist(),
        "overall_limits": [finite(edges) for edges in band.overall],
    }
    if isinstance(band, RunUpBand):
        found["over_speed"] = [
            {
                "speed_rpm": 30 / pi * float(speed),
                "level": level.tolist(),
                "limits": [finite(limits) for limits in edges],
            }
            for speed, level, edges in zip(band.input_speed, band.speed_levels, band.limits, strict=True)
        ]
        return found
    level = decibel(band.amplitude, band.reference)
    found["lines"] = [
        {
            "frequency_hz": float(f),
            "level": here.tolist(),
            "limits": [finite(limits) for limits in zip(low, high, strict=True)],
        }
        for f, here, low, high in zip(band.frequency, level, band.lower, band.upper, strict=True)
    ]
    return found


def finite(edges: FloatArray | Sequence[float]) -> list[float | None]:
    """Return limits for JSON, None in place of no limit."""
    return [float(edge) if isfinite(edge) and edge > SILENT_LEVEL else None for edge in edges]
