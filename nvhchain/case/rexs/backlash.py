"""Backlash of imported gears: of the file, recommended, or none where a drawing is rounded."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import cos

import numpy as np
from scipy.optimize import nnls

from nvhchain.gear import GearGeometry, normal_backlash
from nvhchain.gear.drawing.backlash import working_angle
from nvhchain.gear.drawing.thickness import ROUNDING
from nvhchain.interop.rexs import GearUnit, ImportedStage

_EVEN = 1e-6
"""Weight of small allowances against the backlash; of all that give it, they choose those alike."""

_DISAGREE = 0.25
"""Relative difference of backlash and tooth thickness of a file that is named: both are middles of wide tolerances."""


def recommended_backlash(module: float, distance: float) -> float:
    """Return the minimum backlash (m) that ISO/TR 10064-2 recommends: 2/3 (0.06 + 0.0005 a + 0.03 m_n) mm.

    module : normal module (m).
    distance : centre distance (m).
    """
    return 2e-3 / 3 * (0.06 + 0.0005 * 1e3 * distance + 0.03 * 1e3 * module)


def set_backlashes(
    unit: GearUnit,
    stages: Sequence[ImportedStage],
    drawn: dict[str, GearGeometry],
    distances: Mapping[str, float],
    open_: Collection[str],
) -> None:
    """Give gears of unknown tooth thickness (`open_`) their allowances, and take a jam by rounding for none.

    distances : centre distance (m) of every stage.

    An allowance a of the normal tooth thickness makes j_bn larger by a cos α_n. The smallest allowances are taken that
    give every stage its backlash; those of a pair are alike.
    """
    names = [name for name in drawn if name in open_]
    wanted = {stage.name: _wanted(stage, drawn, distances[stage.name]) for stage in stages}

    def found(stage: ImportedStage) -> float:
        return normal_backlash(drawn[stage.pinion], drawn[stage.wheel], distances[stage.name])

    rows, missing, sources = [], [], dict.fromkeys(names, "")
    for stage in stages:
        backlash, source = wanted[stage.name]
        own = [name for name in (stage.pinion, stage.wheel) if name in open_]
        for name in own:
            sources[name] = sources[name] or source
        rows.append([float(name in own) for name in names])
        missing.append(max(backlash - found(stage), 0.0) / cos(drawn[stage.pinion].normal_pressure_angle))
    if names:
        matrix = np.vstack([rows, _EVEN * np.eye(len(names))])
        allowances, _ = nnls(matrix, np.append(missing, np.zeros(len(names))))
        for row, least in zip(np.array(rows), missing, strict=True):  # never less than a stage needs
            allowances += row * max(least - row @ allowances, 0.0) / max(row.sum(), 1.0)
        for name, allowance in zip(names, allowances.tolist(), strict=True):
            drawn[name] = replace(drawn[name], thickness_allowance=allowance)
            unit.findings.add("assumed", name, "thickness allowance", f"{1e6 * allowance:.4g} µm", sources[name])
    for stage in stages:
        backlash, source = wanted[stage.name]
        if source == _STATED and abs(found(stage) - backlash) > _DISAGREE * backlash:
            text = f"{1e6 * backlash:.4g} µm stated, {1e6 * found(stage):.4g} µm by the tooth thickness"
            shared = any(name in open_ for name in (stage.pinion, stage.wheel))
            why = "a gear meshes with others of known thickness" if shared else "the tooth thickness is taken"
            unit.findings.add("differs", stage.name, "backlash", text, why)
        _mend_jam(unit, stage, drawn, distances[stage.name])


_STATED = "backlash of the stage in the file"


def _wanted(stage: ImportedStage, drawn: Mapping[str, GearGeometry], distance: float) -> tuple[float, str]:
    """Return the normal backlash (m) of a stage and its source."""
    pinion = drawn[stage.pinion]
    if stage.backlash is not None:
        return stage.backlash, _STATED
    if stage.circumferential_backlash is not None:
        working = working_angle(pinion, drawn[stage.wheel], distance)
        return stage.circumferential_backlash * cos(working) * cos(pinion.base_helix_angle), _STATED
    smallest = "smallest backlash of ISO/TR 10064-2; no tooth thickness given"
    return recommended_backlash(pinion.normal_module, distance), smallest


def _mend_jam(unit: GearUnit, stage: ImportedStage, drawn: dict[str, GearGeometry], distance: float) -> None:
    """Take a jam of the flanks for none, by a thinner wheel."""
    pinion, wheel = drawn[stage.pinion], drawn[stage.wheel]
    found = normal_backlash(pinion, wheel, distance)
    if found < 0:
        kind, why = ("assumed", "rounding of a drawing") if found >= -ROUNDING else ("differs", "the flanks jam")
        text = f"0 instead of {1e6 * found:.4g} µm"
        unit.findings.add(kind, stage.name, "backlash", text, f"{why}; {stage.wheel} made thinner")  # type: ignore[arg-type]
        allowance = wheel.thickness_allowance - found / cos(pinion.normal_pressure_angle) + 1e-12
        drawn[stage.wheel] = replace(wheel, thickness_allowance=allowance, thickness=None)
