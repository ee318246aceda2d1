"""Gears of the thesis in contact: engagements at the gallery's fidelity, their transmission errors, displaced gears."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from nvhchain.fidelity import GearFidelity
from nvhchain.gallery.thesis_gears import CENTRE_DISTANCE
from nvhchain.gear import (
    Blank,
    Engagement,
    FlankCompliance,
    GearBody,
    GearGeometry,
    GearPair,
    LoadedMesh,
    close_edges,
    engaged_reach,
    flank_compliance,
    gear_field,
    loaded_mesh,
)
from nvhchain.handoff import FloatArray, GearField
from nvhchain.lumped import order_lines


def gear_fidelity(fidelity: GearFidelity, angles_per_mesh: int) -> GearFidelity:
    """Return the fidelity of spur gears 23 mm wide: 6 layers and 8 slices suffice (docs/measured/gear/gear.md)."""
    return replace(fidelity, width_layers=6, slices=8, angles_per_mesh=angles_per_mesh)


def engagement(
    driving: GearGeometry, driven: GearGeometry, blank: Blank, fidelity: GearFidelity, *, friction: bool = False
) -> Engagement:
    """Return the engagement of a solid gear with a lightweight one.

    Parameters
    ----------
    driving, driven : GearGeometry
        Teeth of both gears.
    blank : Blank
        Blank of the driven gear.
    fidelity : GearFidelity
        Finite elements and slices.
    friction : bool
        True for compliances to the friction forces as well.
    """
    pair = GearPair(GearBody(driving), GearBody(driven, blank), CENTRE_DISTANCE)
    # edges come into contact in some of the uses: the same reach serves all
    reach = engaged_reach(pair, max(fidelity.corner_gap, 1e-5))
    bodies = (pair.pinion, pair.wheel)
    both = (_compliance(bodies[0], fidelity, reach, friction), _compliance(bodies[1], fidelity, reach, friction))
    return Engagement(pair, both, fidelity)


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
