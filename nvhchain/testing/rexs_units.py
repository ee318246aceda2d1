"""Gear units in REXS for tests: trains of cylindrical stages as components and relations, written as XML or JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import cos, radians
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from nvhchain.case import GearboxCase, load_case
from nvhchain.case.rexs import import_rexs


@dataclass
class RexsUnit:
    """Components and relations that a test may change before they are written."""

    version: str = "1.4"
    components: dict[int, tuple[str, str, dict[str, tuple[Any, str]]]] = field(default_factory=dict)
    relations: list[tuple[str, list[tuple[str, int]]]] = field(default_factory=list)
    load_cases: list[dict[int, dict[str, tuple[Any, str]]]] = field(default_factory=list)

    def add(self, kind: str, name: str = "", **attributes: tuple[Any, str]) -> int:
        """Add a component."""
        number = len(self.components) + 1
        self.components[number] = (kind, name, dict(attributes))
        return number

    def relate(self, kind: str, **ends: int) -> None:
        """Add a relation."""
        self.relations.append((kind, list(ends.items())))

    def numbers(self, kind: str) -> list[int]:
        """Return the numbers of the components of a type."""
        return [number for number, (type_, *_) in self.components.items() if type_ == kind]

    def attributes(self, number: int) -> dict[str, tuple[Any, str]]:
        """Return the attributes of a component, to be changed."""
        return self.components[number][2]

    def xml(self) -> str:
        """Return the unit as XML."""
        relations = "".join(
            f'<relation id="{number}" type="{kind}">'
            + "".join(f'<ref role="{role}" id="{end}" hint="{self._hint(end)}"/>' for role, end in ends)
            + "</relation>"
            for number, (kind, ends) in enumerate(self.relations, start=1)
        )
        components = "".join(self._xml(number, attributes) for number, (*_, attributes) in self.components.items())
        cases = "".join(
            f'<load_case id="{number}">{"".join(self._xml(key, value) for key, value in case.items())}</load_case>'
            for number, case in enumerate(self.load_cases, start=1)
        )
        return (
            f'<?xml version="1.0" encoding="UTF-8"?>\n<model version="{self.version}" applicationId="test" '
            f'applicationVersion="1" date="2026-01-01T00:00:00+00:00"><relations>{relations}</relations>'
            f'<components>{components}</components><load_spectrum id="1">{cases}</load_spectrum></model>'
        )

    def json(self) -> str:
        """Return the unit as JSON."""
        model = {
            "version": self.version,
            "applicationId": "test",
            "applicationVersion": "1",
            "date": "2026-01-01T00:00:00+00:00",
            "relations": [
                {"id": n, "type": kind, "refs": [{"role": r, "id": e, "hint": self._hint(e)} for r, e in ends]}
                for n, (kind, ends) in enumerate(self.relations, start=1)
            ],
            "components": [self._json(number, attributes) for number, (*_, attributes) in self.components.items()],
            "load_spectrum": {
                "id": 1,
                "load_cases": [
                    {"id": n, "components": [self._json(key, value) for key, value in case.items()]}
                    for n, case in enumerate(self.load_cases, start=1)
                ],
            },
        }
        return json.dumps({"model": model})

    def save(self, path: Path) -> Path:
        """Write the unit as XML or JSON, by the ending of the path."""
        path.write_text(self.json() if path.suffix == ".rexsj" else self.xml(), encoding="utf-8")
        return path

    def _hint(self, number: int) -> str:
        return self.components[number][0] if number in self.components else ""

    def _xml(self, number: int, attributes: dict[str, tuple[Any, str]]) -> str:
        kind, name, _ = self.components[number]
        inside = ""
        for key, (value, unit) in attributes.items():
            text = f"<array>{''.join(f'<c>{x}</c>' for x in value)}</array>" if isinstance(value, list) else str(value)
            inside += f'<attribute id="{key}" unit={quoteattr(unit)}>{text}</attribute>'
        return f'<component id="{number}" type="{kind}" name={quoteattr(name)}>{inside}</component>'

    def _json(self, number: int, attributes: dict[str, tuple[Any, str]]) -> dict[str, Any]:
        kind, name, _ = self.components[number]
        entries = []
        for key, (value, unit) in attributes.items():
            type_name = {list: "floating_point_array", str: "enum", bool: "boolean", int: "integer"}.get(
                type(value), "floating_point"
            )
            entries.append({"id": key, "unit": unit, type_name: value})
        return {"id": number, "type": kind, "name": name, "attributes": entries}


def gear_train(
    *stages: tuple[int, int], module: float = 3.0, helix: float = 15.0, width: float = 24.0, version: str = "1.4"
) -> RexsUnit:
    """Return a unit of stages in a row, each shaft beside the last, two bearings on every shaft.

    module, width : normal module and face width (mm).
    """
    unit = RexsUnit(version)
    box = unit.add("gear_unit", "Train", **_place(0.0, 0.0, 1))
    casing = unit.add("gear_casing", "Casing")
    unit.relate("assembly", assembly=box, part=casing)
    length = 20.0 + len(stages) * (width + 20.0)
    y, shafts = 0.0, []
    for number in range(len(stages) + 1):
        if number:
            y += sum(stages[number - 1]) * module / 2 / cos(radians(helix))
        shaft = unit.add("shaft", f"S{number + 1}", **_place(-20.0, y, box))
        unit.relate("assembly", assembly=box, part=shaft)
        section = unit.add(
            "shaft_section",
            u_coordinate_on_shaft=(0.0, "mm"),
            length=(length + 40.0, "mm"),
            outer_diameter_begin=(28.0, "mm"),
            outer_diameter_end=(28.0, "mm"),
        )
        unit.relate("assembly", assembly=shaft, part=section)
        for place in (0.0, length):
            _bearing(unit, shaft, casing, place + 20.0)
        shafts.append(shaft)
    for number, teeth in enumerate(stages):
        _stage(
            unit,
            box,
            shafts[number : number + 2],
            teeth,
            20.0 + (number + 0.5) * (width + 20.0),
            (module, helix, width),
        )
    loads = [unit.add("external_load", transmits_torque=(True, "none")) for _ in range(2)]
    unit.relate("assembly", assembly=shafts[0], part=loads[0])
    unit.relate("assembly", assembly=shafts[-1], part=loads[1])
    unit.load_cases.append(
        {shafts[0]: {"rotational_speed": (1800.0, "1 / min")}, loads[0]: {"torque_around_u_axis": (60.0, "N m")}}
    )
    return unit


def coaxial_unit() -> RexsUnit:
    """Return two stages whose last shaft lies on the axis of the first, which ends in a bearing inside it."""
    unit = gear_train((20, 31), (18, 33))
    first, _, last = unit.numbers("shaft")
    unit.attributes(last)["support_vector"] = ([64.0 - 20.0, 0.0, 0.0], "mm")
    sections, bearings = unit.numbers("shaft_section"), unit.numbers("rolling_bearing_with_catalog_geometry")
    unit.attributes(sections[0])["length"] = (88.0, "mm")  # ends in the bore of the last shaft
    unit.attributes(sections[2]).update(length=(96.0, "mm"), inner_diameter_begin=(0.0, "mm"))
    hollow = unit.add(
        "shaft_section",
        u_coordinate_on_shaft=(0.0, "mm"),
        length=(24.0, "mm"),
        outer_diameter_begin=(46.0, "mm"),
        inner_diameter_begin=(34.0, "mm"),
    )
    unit.relate("assembly", assembly=last, part=hollow)
    unit.attributes(sections[2])["u_coordinate_on_shaft"] = (24.0, "mm")
    unit.attributes(sections[2])["length"] = (72.0, "mm")
    gears = unit.numbers("cylindrical_gear")
    unit.attributes(gears[2])["u_coordinate_on_shaft"] = (20.0 + 1.5 * 44.0 + 12.0, "mm")
    unit.attributes(gears[3])["u_coordinate_on_shaft"] = (20.0 + 1.5 * 44.0 + 12.0 - 64.0, "mm")
    # bearings: S1 front in the casing, S1 rear in the last shaft, S3 at its hollow end and at its rear
    inner = bearings[1]
    unit.relations = [(k, e) for k, e in unit.relations if ("assembly", inner) not in e]
    unit.attributes(inner)["u_coordinate_on_shaft_inner_side"] = (76.0, "mm")
    unit.attributes(inner).update(outer_diameter=(34.0, "mm"), axial_force_absorption=("no_direction", "none"))
    unit.relate("side", assembly=inner, inner_part=first, outer_part=last)
    unit.attributes(bearings[4]).update(
        u_coordinate_on_shaft_inner_side=(12.0, "mm"), inner_diameter=(46.0, "mm"), outer_diameter=(72.0, "mm")
    )
    unit.attributes(bearings[5])["u_coordinate_on_shaft_inner_side"] = (80.0, "mm")
    return unit


def idler_unit() -> RexsUnit:
    """Return spur gears in a row whose middle one turns on a needle bearing on a pin, which carries no gear."""
    unit = gear_train((20, 31), (31, 25), helix=0.0)
    _, second, third, fourth = unit.numbers("cylindrical_gear")
    unit.attributes(third)["u_coordinate_on_shaft"] = (42.0, "mm")  # a ring with one set of teeth
    unit.attributes(fourth)["u_coordinate_on_shaft"] = (42.0, "mm")
    swap = {("gear_1", third): ("gear_1", second)}
    unit.relations = [(kind, [swap.get(end, end) for end in ends]) for kind, ends in unit.relations]
    _, ring, _ = unit.numbers("shaft")
    unit.attributes(unit.numbers("shaft_section")[1]).update(
        u_coordinate_on_shaft=(30.0, "mm"),
        length=(24.0, "mm"),
        outer_diameter_begin=(60.0, "mm"),
        outer_diameter_end=(60.0, "mm"),
        inner_diameter_begin=(40.0, "mm"),
        inner_diameter_end=(40.0, "mm"),
    )
    pin = unit.add("shaft", "Pin", **unit.attributes(ring))
    section = unit.add(
        "shaft_section", length=(120.0, "mm"), outer_diameter_begin=(28.0, "mm"), outer_diameter_end=(28.0, "mm")
    )
    unit.relate("assembly", assembly=pin, part=section)
    unit.relations = [
        (kind, [(role, pin if role == "inner_part" and end == ring else end) for role, end in ends])
        for kind, ends in unit.relations
    ]
    needles = unit.add(
        "rolling_bearing_with_catalog_geometry",
        bearing_type=("radial_needle_roller_bearing", "none"),
        u_coordinate_on_shaft_inner_side=(42.0, "mm"),
        inner_diameter=(28.0, "mm"),
        outer_diameter=(40.0, "mm"),
        width=(22.0, "mm"),
        radial_dynamic_load_rating=(28.0, "kN"),
        radial_static_load_rating=(40.0, "kN"),
    )
    unit.relate("side", assembly=needles, inner_part=pin, outer_part=ring)
    return unit


def _place(u: float, v: float, reference: int) -> dict[str, tuple[Any, str]]:
    return {
        "support_vector": ([u, v, 0.0], "mm"),
        "u_axis_vector": ([1.0, 0.0, 0.0], "mm"),
        "w_axis_vector": ([0.0, 0.0, 1.0], "mm"),
        "reference_component_for_position": (reference, "none"),
    }


def _bearing(unit: RexsUnit, shaft: int, casing: int, u: float) -> None:
    bearing = unit.add(
        "rolling_bearing_with_catalog_geometry",
        catalogue_designation=("6206", "none"),
        bearing_type=("radial_grooved_ball_bearing", "none"),
        u_coordinate_on_shaft_inner_side=(u, "mm"),
        inner_diameter=(28.0, "mm"),
        outer_diameter=(52.0, "mm"),
        width=(15.0, "mm"),
        radial_dynamic_load_rating=(16.6, "kN"),
    )
    unit.relate("side", assembly=bearing, inner_part=shaft, outer_part=casing)


def _stage(
    unit: RexsUnit,
    box: int,
    shafts: Sequence[int],
    teeth: tuple[int, int],
    u: float,
    drawing: tuple[float, float, float],
) -> None:
    module, helix, width = drawing
    stage = unit.add("cylindrical_stage", center_distance=(sum(teeth) * module / 2 / cos(radians(helix)), "mm"))
    unit.relate("assembly", assembly=box, part=stage)
    gears = []
    for count, shaft, hand in zip(teeth, shafts, (1.0, -1.0), strict=True):
        gear = unit.add(
            "cylindrical_gear",
            f"z{count} on {shaft}",
            number_of_teeth=(count, "none"),
            normal_module=(module, "mm"),
            helix_angle_reference_diameter=(hand * helix, "deg"),
            face_width=(width, "mm"),
            u_coordinate_on_shaft=(u, "mm"),
        )
        unit.relate("assembly", assembly=shaft, part=gear)
        flanks = [
            unit.add(
                "cylindrical_gear_flank",
                normal_pressure_angle=(20.0, "deg"),
                addendum_modification_coefficient=(0.0, "none"),
            )
            for _ in range(2)
        ]
        unit.relate("flank", gear=gear, left=flanks[0], right=flanks[1])
        gears.append(gear)
    unit.relate("stage", stage=stage, gear_1=gears[0], gear_2=gears[1])


def imported(unit: RexsUnit, folder: Path, **options: Any) -> tuple[GearboxCase, str]:
    """Return the case and the page of a unit, written and imported in a folder."""
    folder.mkdir(exist_ok=True)
    made = import_rexs(unit.save(folder / "unit.rexs"), folder / "case", **options)
    case = load_case(made.case)
    assert isinstance(case, GearboxCase)
    return case, made.page.read_text(encoding="utf-8")
