"""The spur gears of S. Shweiki's thesis, chapters 3 and 4, and their contact at the gallery's fidelity.

57 teeth each, module 2.6 mm, 23 mm wide, centres 150 mm apart.  The stated root diameter of 141.7 mm is that of no
profile shift; tip diameter and contact ratio (1.4557) fit it.  Masses are stated, the dimensions of the blanks are not.
Those below are one set that meets masses and, within 4 %, the mesh stiffness of table 3.2.  The slots of d are fitted
to its blank order, too: over 101.6° from 45.4 mm, at the same mass, it is 5 % large and the stiffness 7 % small.
Chapter 4 takes the same gears: pair A the thin web, pair B the three slots.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from nvhchain.fidelity import GearFidelity
from nvhchain.gear import (
    Blank,
    Engagement,
    Flank,
    FlankCompliance,
    GearBody,
    GearGeometry,
    GearPair,
    Holes,
    LoadedMesh,
    MicroGeometry,
    Slots,
    ThinRim,
    close_edges,
    engaged_reach,
    flank_compliance,
    gear_field,
    loaded_mesh,
)
from nvhchain.handoff import FloatArray, GearField
from nvhchain.lumped import order_lines

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
    "d": Slots(3, inner_radius=45.15e-3, outer_radius=63.2e-3, angular_width=np.radians(100.4), fillet=4e-3),
}
"""Wheels of chapter 3; openings of b and d go through the full width."""

FRICTION = 0.3


def gear_fidelity(fidelity: GearFidelity, angles_per_mesh: int) -> GearFidelity:
    """Return the fidelity of spur gears 23 mm wide: 6 layers and 8 slices suffice (docs/measured/gear/gear.md)."""
    return replace(fidelity.even_layers(6), slices=8, angles_per_mesh=angles_per_mesh)


def engagement(
    driving: GearGeometry, driven: GearGeometry, blank: Blank, fidelity: GearFidelity, *, friction: bool = False
) -> Engagement:
    """Return the engagement of a solid gear with a lightweight one.

    friction: True for friction that bends the teeth.
    """
    pair = GearPair(GearBody(driving), GearBody(driven, blank), CENTRE_DISTANCE)
    # edges come into contact in some of the uses: the same reach serves all
    reach = engaged_reach(pair, max(fidelity.corner_gap, 1e-5))
    pinion, wheel = (_compliance(body, fidelity, reach, friction) for body in (pair.pinion, pair.wheel))
    return Engagement(pair, (pinion, wheel), fidelity)


@cache
def _compliance(body: GearBody, fidelity: GearFidelity, reach: int, friction: bool) -> FlankCompliance:
    """Return the compliance of a gear; that of the driving gear serves several pairs."""
    return flank_compliance(body, replace(fidelity, angles_per_mesh=16), reach=reach, friction=friction)


def orders(error: FloatArray, pair: GearPair) -> dict[int, float]:
    """Return the amplitude (m) of every whole order of a transmission error over the body period."""
    order, lines = order_lines(error, pair.meshes_per_body_period, pair.wheel.geometry.teeth)
    return {round(float(o)): float(a) for o, a in zip(order, lines, strict=True) if abs(o - round(o)) < 1e-6}


def loaded_gear(touching: Engagement, gear: int, torque: float, angle: float) -> tuple[GearField, LoadedMesh]:
    """Return displacement and stress of a gear at a wheel angle (rad), and its loaded mesh."""
    force = touching.pair.normal_force(torque)
    loaded = loaded_mesh(touching, angle, force, guess=1e-9 * force)
    closing = close_edges(touching, loaded.deflection)
    if closing is not touching:
        loaded = loaded_mesh(closing, angle, force, guess=loaded.deflection)
    return gear_field(touching.pair, gear, loaded, touching.fidelity), loaded


def field_numbers(field: GearField) -> dict[str, float]:
    """Return the largest displacement, and the largest stress more than one module away from the contact."""
    return {
        "largest displacement / µm": 1e6 * float(np.linalg.norm(field.displacement, axis=1).max()),
        "largest von Mises stress / MPa": 1e-6 * float(field.stress_away_from_contact().max()),
    }
