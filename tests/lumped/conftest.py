"""Pairs of table 3.2 and pairs of the harmonic study."""

import numpy as np
import pytest

from nvhchain.lumped import BASE_RADIUS, GearPair, pair_from_error, static_transmission_error

FORCE = 350.0 / BASE_RADIUS


@pytest.fixture(scope="session")
def study_pair():
    """Pair of the harmonic study, amplitudes in µm: N_t = 57, N_h = 8, 350 Nm, 6 % damping."""

    def make(
        average: float, mesh: float, blank: float = 0.0, *, order: int = 8, damping_ratio: float = 0.06
    ) -> GearPair:
        error, cycles = static_transmission_error(
            average=1e-6 * average, mesh=1e-6 * mesh, blank=1e-6 * blank, teeth=57, blank_order=order
        )
        return pair_from_error(
            error, force=FORCE, mass=0.65, mesh_cycles=cycles, damping_ratio=damping_ratio, half_backlash=50e-6
        )

    return make


@pytest.fixture(scope="session")
def mathieu():
    """ẍ + 2 ζ ω_n ẋ + ω_n² (1 + ε cos Ωt) x = 0 with ω_n = 1e4 rad/s."""

    def make(epsilon: float, zeta: float) -> GearPair:
        angle = 2 * np.pi * np.arange(64) / 64
        return GearPair(1.0, 0.0, 1e8 * (1 + epsilon * np.cos(angle)), 1, zeta)

    return make
