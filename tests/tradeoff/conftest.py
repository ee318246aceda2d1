"""A small radiator and the pair of gears that the sweeps of these tests turn knobs on."""

import pytest

from nvhchain.case import FieldPoint, RadiatorCase, Sphere
from nvhchain.testing.coarse_runs import TINY, small_gearbox


@pytest.fixture(scope="session")
def sphere():
    """An oscillating sphere: more lines than are solved one by one, and a field point in a weak direction."""
    points = (FieldPoint("front", (0.0, 0.1, 0.9)), FieldPoint("side", (0.6, 0.0, 0.2)))
    lines = tuple(200.0 + 100.0 * n for n in range(18))
    return RadiatorCase("sphere", Sphere(0.1), lines, points, pulsation=0.3, velocity=(0.0, 0.0, 1.0))


@pytest.fixture(scope="session")
def gearbox():
    return small_gearbox()


@pytest.fixture(scope="session")
def tiny():
    return TINY
