"""Reader of a parallel-shaft gear unit from REXS."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import pi
from pathlib import Path

from nvhchain.errors import Mistakes
from nvhchain.interop.rexs.bearings import read_bearings
from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.contents.files import read_document
from nvhchain.interop.rexs.contents.findings import Findings
from nvhchain.interop.rexs.gears import read_gear
from nvhchain.interop.rexs.loads import read_power, read_side_loads
from nvhchain.interop.rexs.parts import Parts, find_parts
from nvhchain.interop.rexs.places import Line, shaft_lines
from nvhchain.interop.rexs.shafts import place_on_shaft, read_shafts
from nvhchain.interop.rexs.unit import GearUnit, ImportedStage

_RESULTS = {
    "radial_contact_ratio": ("contact_ratio", ""),
    "overlap_contact_ratio": ("overlap_ratio", ""),
    "total_contact_ratio": ("total_contact_ratio", ""),
    "common_face_width": ("common_face_width", "m"),
}


def read_rexs(path: str | Path, *, load_case: str | None = None) -> GearUnit:
    """Read a parallel-shaft gear unit from a REXS file.

    Parameters
    ----------
    path : str or Path
        XML (.rexs), JSON (.rexsj) or ZIP (.rexsz) of versions 1.0 to 2.0.
    load_case : str, optional
        Load case, by its number; the first by default.

    Returns
    -------
    GearUnit
        Shafts, gears, stages, bearings and loads, with the record of what was taken and assumed.

    Raises
    ------
    InputError
        If the file cannot be read, or holds what the chain does not model; all mistakes at once.
    """
    document, findings = read_document(path), Findings()
    parts = find_parts(document, findings)
    if findings.mistakes:
        raise Mistakes([f"{path}: {text}" for text in findings.mistakes])
    pairs = _pairs(parts)
    lines = shaft_lines(parts)
    turns = _turns(parts, pairs)
    power = read_power(parts, turns, lines, load_case, _passed(parts, pairs))
    side_loads = read_side_loads(parts, lines, power.loads[0].name)
    for lubricant in document.typed("lubricant"):
        findings.add("excluded", lubricant.label, "lubricant", "not used", "friction and damping do not follow from it")
    mates = _mates(pairs)
    gears = {
        component.id: read_gear(
            parts,
            component,
            mates[component.id][0],
            _gear_place(parts, component, lines),
            opposite=mates[component.id][1],
        )
        for component in document.typed("cylindrical_gear")
        if component.id in mates
    }
    for component in document.typed("cylindrical_gear"):
        if component.id not in mates:
            findings.add("excluded", component.label, "gear", "meshes with none", "no stage names it")
    shafts, bearings = read_shafts(parts, lines), read_bearings(parts, lines)
    stages = [_stage(parts, *pair, turns, power.input_shaft) for pair in pairs]
    known = {gear.shaft for gear in gears.values() if gear}
    for _ in shafts:  # what carries a shaft of the train, or is carried by one, belongs to it
        links = [{b.shaft, b.outer_shaft} for b in bearings if b.outer_shaft]
        known = known.union(*(link for link in links if link & known))
    idle = [shaft.name for shaft in shafts if shaft.name not in known]
    for name in idle:
        findings.add("excluded", name, "shaft", "carries no gear in mesh", "with its bearings")
    if findings.mistakes:
        raise Mistakes([f"{path}: {text}" for text in findings.mistakes])
    units = document.typed("gear_unit")
    label = units[0].name if units and units[0].name else Path(path).stem
    return GearUnit(
        label,
        document.version,
        document.application,
        tuple(shaft for shaft in shafts if shaft.name not in idle),
        tuple(gear for gear in gears.values() if gear is not None),
        tuple(stages),
        tuple(b for b in bearings if b.shaft not in idle and b.outer_shaft not in idle),
        parts.names[power.input_shaft],
        parts.names[power.output_shaft],
        power.rotation,
        power.loads,
        _casing_material(parts),
        findings,
        tuple(load for load in side_loads if load.shaft not in idle),
    )


def _pairs(parts: Parts) -> list[tuple[Component, Component, Component]]:
    """Return every stage with its two gears; stages without two gears are mistakes."""
    found = []
    for stage in parts.document.typed("cylindrical_stage"):
        relations = parts.document.related("stage", "stage", stage.id)
        ends = [end for relation in relations for role, end in relation.refs if role in ("gear_1", "gear_2")]
        gears = [parts.document.components[end] for end in dict.fromkeys(ends)]
        gears = [gear for gear in gears if gear.type == "cylindrical_gear"]
        if len(gears) != 2:
            parts.findings.refuse(
                f"{stage.label}: joins {len(gears)} cylindrical gears: give the relation `stage` a gear_1 and a gear_2"
            )
            continue
        if {gear.id for gear in gears} & parts.idle:
            parts.findings.add(
                "excluded", parts.names[stage.id], "stage", "idle", "a gear is not engaged with its shaft"
            )
            continue
        found.append((stage, gears[0], gears[1]))
    return found


def _mates(pairs: list[tuple[Component, Component, Component]]) -> dict[int, tuple[Component, bool]]:
    """Return a mate of every gear in mesh, and True for gears of the other hand than the first of their train."""
    mates: dict[int, list[Component]] = {}
    for _, one, other in pairs:
        mates.setdefault(one.id, []).append(other)
        mates.setdefault(other.id, []).append(one)
    found: dict[int, tuple[Component, bool]] = {}
    for first in sorted(mates):
        reached = [first] if first not in found else []
        for gear in reached:
            found.setdefault(gear, (mates[gear][0], False))
            for mate in mates[gear]:
                if mate.id not in found:
                    own = next(one for one in mates[mate.id] if one.id == gear)
                    found[mate.id] = own, not found[gear][1]
                    reached.append(mate.id)
    return found


def _turns(parts: Parts, pairs: list[tuple[Component, Component, Component]]) -> dict[int, Fraction]:
    """Return turns about +z of every shaft in mesh for one turn of the first; loops of power are mistakes."""
    links = []
    for stage, one, other in pairs:
        shafts = [parts.shaft_of(gear) for gear in (one, other)]
        teeth = [parts.values(gear).number("number_of_teeth") for gear in (one, other)]
        if all(shaft is not None for shaft in shafts) and all(count and count >= 1 for count in teeth):
            first, second = (parts.rotor[shaft] for shaft in shafts if shaft is not None)
            links.append((stage, first, second, Fraction(round(teeth[0] or 1), round(teeth[1] or 1))))
    turns: dict[int, Fraction] = {}
    if links:
        turns[links[0][1]] = Fraction(1)
    used = set()
    for _ in links:
        for stage, first, second, ratio in links:
            if stage.id in used:
                continue
            if first == second:
                used.add(stage.id)
                parts.findings.refuse(f"{stage.label}: both gears stand on one shaft: correct the relation `assembly`")
            elif first in turns and second in turns:
                used.add(stage.id)
                parts.findings.refuse(
                    f"{stage.label}: closes a loop of shafts; power-split trains are not modelled: leave a stage out"
                )
            elif first in turns:
                used.add(stage.id)
                turns[second] = -turns[first] * ratio
            elif second in turns:
                used.add(stage.id)
                turns[first] = -turns[second] / ratio
    for stage, first, _, _ in links:
        if first not in turns:
            parts.findings.refuse(f"{stage.label}: is not driven by the other stages: leave it out")
    return turns


def _passed(parts: Parts, pairs: list[tuple[Component, Component, Component]]) -> set[int]:
    """Return the shafts of several stages, which pass power on."""
    shafts = [parts.shaft_of(gear) for _, one, other in pairs for gear in (one, other)]
    counts = Counter(parts.rotor[shaft] for shaft in shafts if shaft is not None)
    return {shaft for shaft, count in counts.items() if count > 1}


def _gear_place(parts: Parts, component: Component, lines: Mapping[int, Line]) -> float | None:
    owner = parts.document.owner(component.id, "shaft")
    return None if owner is None else place_on_shaft(parts, component, owner.id, lines)


def _stage(
    parts: Parts, stage: Component, one: Component, other: Component, turns: Mapping[int, Fraction], source: int
) -> ImportedStage:
    """Return a stage whose pinion is nearer to the input; its data stand with gear 1 and gear 2 of the file."""
    values = parts.values(stage)
    distance = values.number("center_distance", "m", low=1e-3, high=5.0)
    angle = values.number("rotating_angle_around_neg_u_axis", "rad")
    least, most = (values.number(f"{end}imum_normal_backlash", "m") for end in ("min", "max"))
    given = [value for value in (least, most) if value is not None]
    transverse = [
        v for end in ("min", "max") if (v := values.number(f"{end}imum_transverse_backlash", "m")) is not None
    ]
    stated = {name: value for key, (name, unit) in _RESULTS.items() if (value := values.number(key, unit))}
    for relation in parts.document.related("stage_gear_data", "stage", stage.id):
        end = relation.end("stage_gear_data")
        data = parts.values(parts.document.components[end]) if end is not None else values
        working = data.number("operating_pressure_angle_in_the_transverse_section", "rad")
        if working:
            stated["working_pressure_angle"] = working
    made = ImportedStage(
        parts.names[stage.id],
        parts.names[one.id],
        parts.names[other.id],
        distance,
        angle,
        sum(given) / len(given) if given else None,
        sum(transverse) / len(transverse) if transverse else None,
        values.number("sum_of_addendum_modification_coefficients"),
        stated,
    )
    return (
        made
        if _nearer(parts, one, other, source)
        else replace(made, pinion=made.wheel, wheel=made.pinion, angle=None if angle is None else angle + pi)
    )


def _nearer(parts: Parts, one: Component, other: Component, source: int) -> bool:
    """Return True if gear `one` is nearer to the input shaft than gear `other`, counted in stages."""
    links: dict[int, set[int]] = {}
    for _, first, second in _pairs(parts):
        ends = [parts.shaft_of(gear) for gear in (first, second)]
        if None not in ends:
            a, b = (parts.rotor[end] for end in ends if end is not None)
            links.setdefault(a, set()).add(b)
            links.setdefault(b, set()).add(a)
    steps, reached = {source: 0}, [source]
    for shaft in reached:
        for neighbour in sorted(links.get(shaft, ())):
            if neighbour not in steps:
                steps[neighbour] = steps[shaft] + 1
                reached.append(neighbour)
    ends = [parts.shaft_of(gear) for gear in (one, other)]
    far = len(steps) + 1
    return steps.get(parts.rotor.get(ends[0] or -1, -1), far) <= steps.get(parts.rotor.get(ends[1] or -1, -1), far)


def _casing_material(parts: Parts) -> tuple[float, float, float] | None:
    for casing in parts.document.typed("gear_casing"):
        for material in parts.document.parts(casing.id, "material"):
            values = parts.values(material)
            young, density = values.number("elastic_modulus", "Pa"), values.number("density", "kg/m³")
            poisson = values.number("poisson_ratio")
            if young and density and 1e9 <= young <= 1e12 and 100.0 <= density <= 2e4:
                return young, poisson if poisson is not None and 0.0 <= poisson < 0.499 else 0.3, density
            parts.findings.add(
                "excluded", material.label, "material of the casing", "rigid or without density", "not used"
            )
    return None
