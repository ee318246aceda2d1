"""Backlash of imported gears: of the file, recommended, or none where a drawing is rounded."""

from __future__ import annotations

from dataclasses import replace
from math import cos

from nvhchain.gear import GearGeometry, normal_backlash
from nvhchain.gear.drawing.backlash import working_angle
from nvhchain.gear.drawing.thickness import ROUNDING
from nvhchain.interop.rexs import GearUnit, ImportedGear, ImportedStage


def recommended_backlash(module: float, distance: float) -> float:
    """Return the minimum backlash (m) that ISO/TR 10064-2 recommends: 2/3 (0.06 + 0.0005 a + 0.03 m_n) mm.

    module : normal module (m).
    distance : centre distance (m).
    """
    return 2e-3 / 3 * (0.06 + 0.0005 * 1e3 * distance + 0.03 * 1e3 * module)


def set_backlash(
    unit: GearUnit,
    stage: ImportedStage,
    gears: dict[str, ImportedGear],
    drawn: dict[str, GearGeometry],
    distance: float,
) -> None:
    """Give gears of unknown tooth thickness their allowances, and take a jam by rounding for none."""
    pair = [stage.pinion, stage.wheel]
    found = normal_backlash(drawn[pair[0]], drawn[pair[1]], distance)
    cosine = cos(drawn[pair[0]].normal_pressure_angle)
    open_ = [n for n in pair if gears[n].thickness is None and gears[n].allowance is None and not drawn[n].thickness]
    wanted, source = stage.backlash, "backlash of the stage in the file"
    if wanted is None and stage.circumferential_backlash is not None:
        working = working_angle(drawn[pair[0]], drawn[pair[1]], distance)
        wanted = stage.circumferential_backlash * cos(working) * cos(drawn[pair[0]].base_helix_angle)
    if wanted is None:
        wanted = recommended_backlash(drawn[pair[0]].normal_module, distance)
        source = "smallest backlash of ISO/TR 10064-2; no tooth thickness given"
    if open_:
        each = max(wanted - found, 0.0) / cosine / len(open_)
        for name in open_:
            already = drawn[name].thickness_allowance
            drawn[name] = replace(drawn[name], thickness_allowance=max(already, each))
            text = f"{1e6 * max(already, each):.4g} µm"
            unit.findings.add("assumed", name, "thickness allowance", text, source)
    found = normal_backlash(drawn[pair[0]], drawn[pair[1]], distance)
    if found < 0:
        kind, why = ("assumed", "rounding of a drawing") if found >= -ROUNDING else ("differs", "the flanks jam")
        text = f"0 instead of {1e6 * found:.4g} µm"
        unit.findings.add(kind, stage.name, "backlash", text, f"{why}; {pair[1]} made thinner")  # type: ignore[arg-type]
        wheel = drawn[pair[1]]
        allowance = wheel.thickness_allowance - found / cosine + 1e-12
        drawn[pair[1]] = replace(wheel, thickness_allowance=allowance, thickness=None)
