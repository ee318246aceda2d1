"""Values that a case file must give, each with a proposal from the rest of it, and stiffness that it may leave out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from math import ceil
from typing import Any

from nvhchain.case.gears import Gear
from nvhchain.case.toml.table import build
from nvhchain.dimensions import strip_unit
from nvhchain.dynamics import Bearing, Shaft
from nvhchain.errors import InputError
from nvhchain.housing import Casting

REQUIRED = tuple(field.name for field in fields(Casting) if field.default is MISSING)
"""Fields of a casting without a default."""

_CLEARANCE = 0.003
"""Room (m) between a gear and the wall in a proposal."""


def missing_values(table: Mapping[str, Any]) -> Iterator[str]:
    """Yield a message for every length of a casting that a gearbox's table lacks."""
    housing = table.get("housing")
    if not isinstance(housing, Mapping) or housing.get("type", "casting") != "casting":
        return
    missing = [name for name in REQUIRED if not _given(housing, name)]
    proposals = _proposals(table) if missing else {}
    for name in missing:
        yield f"housing: {name} {'are' if name.endswith('s') else 'is'} missing: give {proposals[name]}"


def assumed_stiffness(table: Mapping[str, Any]) -> Iterator[str]:
    """Yield the sentence about bearings without stiffness in a gearbox's table, if there are any."""
    names = [
        str(part.get("name"))
        for kind in ("bearings", "shaft_bearings")
        for part in _tables(table.get(kind))
        if "model" not in part and not (_given(part, "radial_stiffness") and _given(part, "axial_stiffness"))
    ]
    if names:
        yield (
            f"bearing(s) {', '.join(names)} take an assumed stiffness, {Bearing.radial_stiffness:g} N/m radially and "
            f"{Bearing.axial_stiffness:g} N/m axially, as tapered roller bearings of a car: give radial_stiffness and "
            "axial_stiffness, or a model of the catalogue"
        )


def _proposals(table: Mapping[str, Any]) -> dict[str, str]:
    """Return a casting's required field → words for its value, with numbers of the case where they are readable."""
    shafts, bearings = _built(Shaft, table.get("shafts")), _built(Bearing, table.get("bearings"))
    gears = _built(Gear, table.get("gears"))
    axes = {shaft.name: f"[{1e3 * shaft.axis[0]:.7g}, {1e3 * shaft.axis[1]:.7g}]" for shaft in shafts}
    tips = {
        name: max((gear.geometry.tip_circle_radius for gear in gears if gear.shaft == name), default=0.0)
        for name in axes
    }
    spaces = [
        f"{{ centre_mm = {axes[name]}, radius_mm = {ceil(1e3 * (tip + _CLEARANCE))} }}"
        for name, tip in tips.items()
        if tip > 0.0
    ]
    bores = [
        f'{{ name = "{each.name}", centre_mm = {axes[each.shaft][:-1]}, {1e3 * each.z:.7g}], radius_mm = … }}'
        for each in bearings
        if each.shaft in axes
    ]
    planes = [(each.z, each.name) for each in bearings]
    first, last = (
        (f"; bearing {name} is at z = {1e3 * z:.7g} mm" for z, name in (min(planes), max(planes)))
        if planes
        else ("", "")
    )
    return {
        "bores": f"one for every bearing with its outer radius: {_listed(bores)}",
        "gear_spaces": f"one for every shaft, the tip radius of its largest gear and clearance: {_listed(spaces)}",
        "wall": "the thickness of the side wall as wall_mm",
        "end_wall": "the thickness of the end walls as end_wall_mm",
        "depth": f"the outside of the rear wall as depth_mm{last}",
        "bell_depth": f"the outside of the wall on the mounting side as bell_depth_mm{first}",
    }


def _listed(entries: Sequence[str]) -> str:
    return f"[{', '.join(entries)}]" if entries else "a list of tables with centre_mm and radius_mm"


def _built(cls: type, parts: Any) -> list[Any]:
    """Return those parts of a list of tables that are right."""
    found = list[Any]()
    for part in _tables(parts):
        try:
            found.append(build(cls, part, ""))
        except InputError:
            continue
    return found


def _tables(parts: Any) -> list[Mapping[str, Any]]:
    return [part for part in parts if isinstance(part, Mapping)] if isinstance(parts, list) else []


def _given(table: Mapping[str, Any], name: str) -> bool:
    return name in map(strip_unit, table)
