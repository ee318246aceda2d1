"""The spur gears of S. Shweiki's thesis, ch. 3 and 4, and blanks fitted to the masses it gives.

57 teeth each, module 2.6 mm, 23 mm wide, centres 150 mm apart, with the tip and root diameters that give its contact
ratio of 1.4557. The blanks' dimensions are not given there: hub and rim are chosen here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from nvhchain.gear import Blank, Flank, GearBody, GearGeometry, MicroGeometry, Slots, ThinRim, mass_properties

MODULE, SHIFT = 2.6e-3, 0.3614
SPUR = GearGeometry(
    teeth=57,
    normal_module=MODULE,
    normal_pressure_angle=np.radians(20.0),
    helix_angle=0.0,
    face_width=23e-3,
    bore_radius=20e-3,
    profile_shift=SHIFT,
    dedendum=(148.2e-3 - 141.7e-3) / 2 / MODULE + SHIFT,
    tip_radius=154.5e-3 / 2,
    thickness_allowance=50e-6,
)
CROWNED = replace(SPUR, micro=MicroGeometry(drive=Flank(profile_crowning=10e-6)))
"""Of ch. 4."""
CENTRE_DISTANCE = 150e-3
HUB, RIM = 30e-3, 63e-3
TORQUES = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
FRICTION = 0.3


def of_mass(mass: float, blank: Callable[[float], Blank], low: float, high: float) -> Blank:
    """`blank(x)` that makes the gear weigh `mass`, kg, with low < x < high."""
    return blank(brentq(lambda x: mass_properties(GearBody(SPUR, blank(x))).mass - mass, low, high))


def blanks_of_chapter_4() -> dict[str, Blank]:
    """A: a thin web of 1.72 kg.  B: three slots in a thicker web, 1.68 kg."""
    return {
        "A, thin rim": of_mass(1.72, lambda web: ThinRim(web, HUB, RIM), 2e-3, 20e-3),
        "B, three slots": of_mass(
            1.68,
            lambda width: Slots(3, 34e-3, 60e-3, width, 4e-3, web_thickness=12e-3, hub_radius=HUB, rim_radius=RIM),
            np.radians(20.0),
            np.radians(110.0),
        ),
    }
