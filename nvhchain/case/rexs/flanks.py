"""Flank modifications of imported gears as the chain draws them."""

from __future__ import annotations

from nvhchain.gear import GearGeometry
from nvhchain.gear.drawing.micro_geometry import Flank, MicroGeometry, Relief
from nvhchain.interop.rexs import FlankShape, GearUnit, ImportedGear, ImportedRelief


def micro_geometry(unit: GearUnit, gear: ImportedGear, drawn: GearGeometry) -> MicroGeometry:
    """Return the flanks of a gear; the left one drives where the file names none as loaded.

    An idler is driven on its drive flank and drives with the other.
    """
    left, right = gear.flanks
    driven = [gear.loaded_flanks[s.name] for s in unit.stages if s.wheel == gear.name and s.name in gear.loaded_flanks]
    drives = [gear.loaded_flanks[s.name] for s in unit.stages if s.pinion == gear.name and s.name in gear.loaded_flanks]
    loaded = (driven or drives or [""])[0]
    if not driven and loaded and any(stage.wheel == gear.name for stage in unit.stages):
        loaded = "left" if loaded == "right" else "right"
    if left != right and not loaded:
        unit.findings.add(
            "assumed", gear.name, "driving flank", "left", "both flanks differ; the file names none as loaded"
        )
    drive, coast = (right, left) if loaded == "right" else (left, right)
    return MicroGeometry(_flank(unit, gear, drive, drawn), _flank(unit, gear, coast, drawn))


def _flank(unit: GearUnit, gear: ImportedGear, shape: FlankShape, drawn: GearGeometry) -> Flank:
    return Flank(
        profile_crowning=shape.profile_crowning,
        lead_crowning=shape.lead_crowning,
        tip_relief=_relief(unit, gear, shape.tip_relief, drawn, tip=True),
        root_relief=_relief(unit, gear, shape.root_relief, drawn, tip=False),
    )


def _relief(
    unit: GearUnit, gear: ImportedGear, relief: ImportedRelief | None, drawn: GearGeometry, *, tip: bool
) -> Relief | None:
    """Return a relief by its rolled length; one that starts outside the flank ends with it."""
    if relief is None:
        return None
    low, high = drawn.usable_flank
    length = relief.length
    if length is None:
        start = drawn.base_radius * float(drawn.roll_angle_at(0.5 * (relief.diameter or 0.0)))
        length = high - start if tip else start - low
    name = "tip relief" if tip else "root relief"
    if not 0.0 < length <= high - low:
        text = f"{1e3 * length:.4g} mm of rolled length, flank {1e3 * (high - low):.4g} mm"
        unit.findings.add("excluded", gear.name, name, text, "starts outside the usable flank")
        return None
    if relief.shape not in ("linear", "parabolic"):
        unit.findings.add("assumed", gear.name, name, f"parabolic instead of {relief.shape}", "shapes of the chain")
    return Relief(relief.amount, length, "linear" if relief.shape == "linear" else "parabolic")
