"""Foreign records of bearing forces that several tests read and write."""

import numpy as np
import pytest

from nvhchain.interop import BearingChannels, ForceChannels

RATE = 25e3
POSITIONS = {"A": (0.0, 0.0, 0.01), "B": (0.05, -0.02, 0.13)}

SUFFIXES = pytest.mark.parametrize("suffix", [".csv", ".mat", ".h5", ".uff"])


def csv(path, time, columns, *, header="t,Ax,Ay,Az,Bx,By,Bz", units=None):
    rows = [header] + ([units] if units else [])
    rows += [",".join(repr(float(v)) for v in row) for row in np.column_stack([time, columns])]
    path.write_text("\n".join(rows))
    return path


def six_tones(time, frequency=300.0):
    return np.stack([np.sin(2 * np.pi * frequency * time + k) for k in range(6)], axis=1)


def one_bearing(*names, **more):
    """Declaration of a bearing at the origin; N on the housing at 1 kHz."""
    stated = {"force_unit": "N", "acts_on": "housing", "speed": 10.0, "sample_rate": 1e3} | more
    return ForceChannels((BearingChannels("A", *names, (0.0, 0.0, 0.0)),), **stated)
