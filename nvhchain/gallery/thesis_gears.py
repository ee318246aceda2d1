"""The spur gears of S. Shweiki's thesis, chapters 3 and 4.

57 teeth each, module 2.6 mm, 23 mm wide, centres 150 mm apart.  The stated root diameter of 141.7 mm is that of no
profile shift; tip diameter and contact ratio (1.4557) fit it.  Masses are stated, the dimensions of the blanks are not.
Those below are one set that meets masses and, within 7 %, the mesh stiffness of table 3.2 (docs/measured/gear/
pairs_of_chapter_3.md).  Chapter 4 takes the same gears: pair A the thin web, pair B the three slots.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nvhchain.gear import Blank, Flank, GearGeometry, Holes, MicroGeometry, Slots, ThinRim

SPUR = GearGeometry(
    teeth=57,
    normal_module=2.6e-3,
    normal_pressure_angle=np.radians(20.0),
    helix_angle=0.0,
    face_width=23e-3,
    bore_radius=30e-3,
    dedendum=1.25,
    tip_radius=154.5e-3 / 2,
)
CROWNED = replace(SPUR, micro=MicroGeometry(drive=Flank(profile_crowning=10e-6)))
"""Gear 1 of chapter 4 (table 4.1 crowns this one alone)."""

CENTRE_DISTANCE = 150e-3
BLANKS: dict[str, Blank] = {
    "a": ThinRim(8.740e-3, hub_radius=45e-3, rim_radius=67.3e-3),
    "b": Holes(8, pitch_radius=51.6e-3, hole_radius=13.93e-3),
    "c": ThinRim(5.847e-3, hub_radius=48.5e-3, rim_radius=67.3e-3),
    "d": Slots(3, inner_radius=45.4e-3, outer_radius=63.2e-3, angular_width=np.radians(101.6), fillet=4e-3),
}
"""Wheels of chapter 3; openings of b and d go through the full width."""

PAIRS_OF_CHAPTER_4 = {"A, thin web": BLANKS["a"], "B, three slots": BLANKS["d"]}
TORQUES = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
FRICTION = 0.3
