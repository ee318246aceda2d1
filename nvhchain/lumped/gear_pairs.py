"""Four gear pairs of the thesis's table 3.2: a solid gear against four lightweight ones."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians

import numpy as np

from nvhchain.errors import require
from nvhchain.kinds import checked
from nvhchain.lumped.pair import GearPair, pair_from_error, static_transmission_error

TEETH = 57
BASE_RADIUS = 0.5 * TEETH * 2.6e-3 * cos(radians(20.0))
"""Base radius of both gears (m): z = 57, m = 2.6 mm, α = 20°."""

HALF_BACKLASH = 50e-6
"""Half the backlash along the line of action (m) of the lumped model.

No backlash of the thesis is on record. Its gears, without profile shift at its centre distance, have a normal backlash
of 1.29 mm, half of which is 643 µm. Both give the same motion, as contact loss never reaches the back flank. A backlash
of 0.1 mm is common at this module.
"""

DAMPING_RATIO = 0.06
"""Fraction of critical damping."""


@dataclass(frozen=True)
class PairData:
    """One row of table 3.2.

    blank: name of the lightweight blank.
    average_stiffness: average mesh stiffness (N/m).
    mesh_amplitude: amplitude of the STE at mesh order (m).
    blank_amplitude: amplitude of the STE at `blank_order` (m).
    blank_order: order of the blank, per turn.
    mass: equivalent mass (kg), implied by the printed natural frequencies.

    The ratios of the printed natural frequencies follow √k.  The stated inertias do not give these frequencies.
    """

    blank: str
    average_stiffness: float
    mesh_amplitude: float
    blank_amplitude: float
    blank_order: int
    mass: float


THESIS_PAIRS = {
    "a": PairData("thin web", 2.72e8, 3.78e-6, 0.0, 1, 0.649),
    "b": PairData("8 holes, mass of a", 2.18e8, 3.66e-6, 1.79e-6, 8, 0.629),
    "c": PairData("thinner web", 2.42e8, 3.92e-6, 0.0, 1, 0.668),
    "d": PairData("3 slots, mass of c", 1.35e8, 3.89e-6, 9.58e-6, 3, 0.622),
}
"""Table 3.2 at 350 Nm. Its amplitudes are taken as those of a cosine."""


@checked
def thesis_pair(name: str, *, torque: float = 350.0) -> GearPair:
    """Return pair `a`, `b`, `c` or `d` of table 3.2 over one turn.

    name: row of table 3.2.
    torque: torque (Nm).
    Returns pair with STE_av = F/k_av and only the tabulated harmonics.

    The mean of k = F/STE exceeds the tabulated average by 1.6 … 4.2 % with these curves.  The error curve is the one at
    350 Nm scaled with the load.  A constant stiffness curve scales in the same way.
    """
    require(name in THESIS_PAIRS, f"pair {name!r} is not in table 3.2: choose from {', '.join(THESIS_PAIRS)}")
    data, force = THESIS_PAIRS[name], torque / BASE_RADIUS
    error, cycles = static_transmission_error(
        average=350.0 / BASE_RADIUS / data.average_stiffness,
        mesh=data.mesh_amplitude,
        blank=data.blank_amplitude,
        teeth=TEETH,
        blank_order=data.blank_order,
    )
    # all pairs cover one turn, so that they are integrated side by side
    error = np.tile(error, TEETH // cycles) * (torque / 350.0)
    return pair_from_error(
        error, force=force, mass=data.mass, mesh_cycles=TEETH, damping_ratio=DAMPING_RATIO, half_backlash=HALF_BACKLASH
    )
