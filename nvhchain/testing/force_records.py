"""Records of bearing forces as other programs write them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.interop import BearingChannels, ForceChannels

RATE = 25e3
"""Hz."""

POSITIONS = {"A": (0.0, 0.0, 0.01), "B": (0.05, -0.02, 0.13)}
"""m, of two bearings."""

SUFFIXES = (".csv", ".mat", ".h5", ".uff")
"""File formats of records."""


def csv(
    path: Path,
    time: FloatArray,
    columns: FloatArray,
    *,
    header: str = "t,Ax,Ay,Az,Bx,By,Bz",
    units: str | None = None,
) -> Path:
    """Write a table of time (n,) and channels (n, m), with a line of units below the header where given."""
    rows = [header] + ([units] if units else [])
    rows += [",".join(repr(float(v)) for v in row) for row in np.column_stack([time, columns])]
    path.write_text("\n".join(rows))
    return path


def six_tones(time: FloatArray, frequency: float = 300.0) -> FloatArray:
    """Compute six channels (n, 6) of one tone, 1 rad apart."""
    return np.stack([np.sin(2 * np.pi * frequency * time + k) for k in range(6)], axis=1)


def one_bearing(x: str, y: str, z: str, **more: Any) -> ForceChannels:
    """Declare the channels of a bearing at the origin: N on the housing, sampled at 1 kHz."""
    stated: dict[str, Any] = {"force_unit": "N", "acts_on": "housing", "speed": 10.0, "sample_rate": 1e3} | more
    return ForceChannels((BearingChannels("A", x, y, z, (0.0, 0.0, 0.0)),), **stated)
