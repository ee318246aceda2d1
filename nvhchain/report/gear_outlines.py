"""Outlines of the gears of a case for drawings on the page: transverse sections of teeth, bore and openings."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.case import Case, GearboxCase
from nvhchain.gear import GearBody
from nvhchain.handoff import FloatArray

FLANK, FILLET, SIDE = 9, 8, 7
"""Points along an involute, along a fillet, and along each of four sides of an opening."""


def gear_outlines(case: Case) -> dict[str, Any]:
    """Return the outlines of the gears and the places of the stages, for case.json; empty for a radiator.

    `gears`: name → teeth, tooth (radius in m and angle in rad from its centre line, one half from the root to the tip),
    bore (m), openings (radius, angle; count). `stages`: names of both gears and their places (m).
    """
    if not isinstance(case, GearboxCase):
        return {}
    axes = {shaft.name: list(shaft.axis) for shaft in case.shafts}
    places = {gear.name: axes[gear.shaft] for gear in case.gears}
    return {
        "gears": {gear.name: _outline(gear.body) for gear in case.gears},
        "stages": {
            stage.name: [{"gear": name, "place": places[name]} for name in (stage.pinion, stage.wheel)]
            for stage in case.stages
        },
    }


def _outline(body: GearBody) -> dict[str, Any]:
    of = body.geometry
    root, angle = of.fillet(np.linspace(1.0, 0.0, FILLET, endpoint=False))
    flank, half = of.outline(FLANK)
    tooth = np.column_stack([np.append(root, flank), np.append(angle, half)])
    found: dict[str, Any] = {"teeth": of.teeth, "tooth": _short(tooth), "bore": of.bore_radius}
    web, cut = body.blank.web, body.blank.cutouts
    if web is not None:
        found["web"] = [web.hub_radius, web.rim_radius]
    if cut is not None:
        sides = [np.column_stack(cut.outline(side, np.linspace(0.0, 1.0, SIDE, endpoint=False))) for side in range(4)]
        found["openings"] = {"count": cut.count, "phase": cut.phase, "outline": _short(np.concatenate(sides))}
    return found


def _short(points: FloatArray) -> list[list[float]]:
    return [[float(f"{r:.6g}"), float(f"{angle:.6g}")] for r, angle in points]
