"""Confidence limits in a summary."""

from __future__ import annotations

from math import pi
from typing import Any

from nvhchain.chain.result import Result
from nvhchain.error_band import RunUpBand
from nvhchain.error_band.files import finite


def limits(result: Result) -> dict[str, Any]:
    """Return the confidence limits of a result in the form of summary.json.

    The overall level and every line or speed are those at the first field point, in dB(A) or dB. For each other
    quantity of the case the limits are those of the place with the highest level.
    """
    band = result.error_band
    found: dict[str, Any] = {"error_band_dBA": finite(band.overall[0])}
    if isinstance(band, RunUpBand):
        found["over_speed"] = [
            {"speed_rpm": 30 / pi * float(speed), "level_dBA": float(level[0]), "limits_dBA": finite(edges[0])}
            for speed, level, edges in zip(band.input_speed, band.speed_levels, band.limits, strict=True)
        ]
    else:
        found["lines"] = [
            {"frequency_hz": float(f), "limits_db": finite(edges)}
            for f, *edges in zip(band.frequency, band.lower[:, 0], band.upper[:, 0], strict=True)
        ]
        found["limit_parts"] = [
            {"source": source, "share": float(share[0]), "frequency_hz": float(frequency[0])}
            for source, share, frequency in band.parts
        ]
    others = {name: of for name, of in result.error_bands.items() if name != "pressure"}
    found["other_quantities"] = {
        name: {"level": float(of.level.max()), "limits": finite(of.overall[of.level.argmax()])}
        for name, of in others.items()
    }
    return found
