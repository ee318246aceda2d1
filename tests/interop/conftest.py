"""Bearing forces of two bearings, and what the channels of a record of theirs mean."""

import numpy as np
import pytest

from nvhchain.handoff import BearingForces
from nvhchain.interop import BearingChannels, ForceChannels
from nvhchain.testing.hand_offs import POSITIONS, RATE


@pytest.fixture
def forces():
    rng = np.random.default_rng(5)
    time = np.arange(500) / RATE
    return BearingForces(
        time=time,
        force=1e3 * rng.standard_normal((500, 2, 3)),
        names=("A", "B"),
        positions=np.array(list(POSITIONS.values())),
        input_speed=260.0 + time,
        periodic=True,
    )


@pytest.fixture
def declared():
    return ForceChannels(
        (BearingChannels("A", "Ax", "Ay", "Az"), BearingChannels("B", "Bx", "By", "Bz")),
        force_unit="N", acts_on="housing", speed=260.0, time_channel="t",
    )  # fmt: skip
