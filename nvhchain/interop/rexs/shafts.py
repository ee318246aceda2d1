"""Shafts of a document: sections, those of coupled shafts joined, and places of what stands on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.contents.findings import Findings
from nvhchain.interop.rexs.gears import material_of
from nvhchain.interop.rexs.parts import Parts
from nvhchain.interop.rexs.places import Line, base_frame, frame_of
from nvhchain.interop.rexs.unit import ImportedMass, ImportedShaft, Section

_SAME_PLACE = 1e-5
"""Largest distance (m) of two statements of one place that counts as rounding."""

_SHORTEST = 1e-5
"""Shortest section (m) that counts; programs write ones of length 0 for steps."""


def place_on_shaft(
    parts: Parts, component: Component, shaft: int, lines: Mapping[int, Line], name: str = "u_coordinate_on_shaft"
) -> float | None:
    """Return z (m) of a component by its coordinate on a shaft, or by its own support vector.

    Returns place (m); None where the file has none.
    """
    coordinate = parts.values(component).number(name, "m", low=-10.0, high=10.0)
    line = lines.get(shaft)
    # mistakes of a frame that is not needed do not count
    heard = parts if coordinate is None else replace(parts, findings=Findings())
    frame, base = frame_of(heard, component), base_frame(heard, lines)
    own = None if frame is None or base is None else float(base.axes[0] @ frame.origin)
    if coordinate is None:
        return own
    place = coordinate if line is None else line.start + line.direction * coordinate
    if own is not None and line is not None and abs(own - place) > _SAME_PLACE:
        text = f"{name} {1e3 * coordinate:.6g} mm, support_vector {1e3 * line.direction * (own - line.start):.6g} mm"
        parts.findings.add("differs", component.label, "place on the shaft", text, "the first one taken")
    return place


def read_shafts(parts: Parts, lines: Mapping[int, Line]) -> list[ImportedShaft]:
    """Return all shafts, those that are coupled as one."""
    found = []
    for shaft in parts.shafts():
        members = [other for other, main in sorted(parts.rotor.items()) if main == shaft]
        line = next((lines[member] for member in members if member in lines), None)
        for member in members:
            own = lines[member].axis if member in lines else None
            if line is not None and line.axis is not None and own is not None and np.hypot(*(own - line.axis)) > 1e-5:
                parts.findings.refuse(
                    f"{parts.document.components[member].label}: is coupled to a shaft that is not coaxial: correct "
                    "its support_vector"
                )
        pieces = [piece for member in members for piece in _sections(parts, member, lines.get(member))]
        masses = [mass for member in members for mass in _masses(parts, member, lines)]
        axis = None if line is None or line.axis is None else (float(line.axis[0]), float(line.axis[1]))
        found.append(
            ImportedShaft(parts.names[shaft], axis, tuple(sorted(pieces, key=lambda piece: piece.start)), tuple(masses))
        )
    for mass in parts.document.typed("additional_mass"):
        if parts.document.owner(mass.id, "shaft") is None:
            parts.findings.add("excluded", mass.label, "additional mass", "on no shaft", "stands on another component")
    return found


def _masses(parts: Parts, shaft: int, lines: Mapping[int, Line]) -> list[ImportedMass]:
    """Return the additional masses on a shaft; an inertia that is missing is that of a thin disc."""
    found = []
    for part in parts.document.parts(shaft, "additional_mass"):
        values = parts.values(part)
        mass = values.number("mass_of_component", "kg", low=0.0, high=1e4)
        polar, *stated_transverse = (
            values.number(f"moment_of_inertia_{axis}_axis", "kg m²", low=0.0, high=1e4) for axis in "uvw"
        )
        given = [value for value in stated_transverse if value]
        z = place_on_shaft(parts, part, shaft, lines)
        if not mass and not polar:
            parts.findings.add("excluded", part.label, "additional mass", "0 kg", "neither mass nor inertia")
            continue
        if z is None:
            parts.findings.refuse(f"{part.label}: its place is missing: add u_coordinate_on_shaft")
            continue
        transverse = max(sum(given) / len(given) if given else 0.0, 0.5 * (polar or 0.0))
        found.append(ImportedMass(z, mass or 0.0, polar or 0.0, transverse))
        text = f"{mass or 0.0:.5g} kg, {polar or 0.0:.4g} kg m²"
        parts.findings.add("taken", part.label, "additional mass", text, f"on {parts.names[parts.rotor[shaft]]}")
        eccentric = values.vector("eccentricity_vector", "m")
        if eccentric and any(eccentric):
            parts.findings.add("excluded", part.label, "eccentricity", "not used", "masses of the case lie on the axis")
    return found


def _sections(parts: Parts, shaft: int, line: Line | None) -> list[Section]:
    component = parts.document.components[shaft]
    material = material_of(parts, component)
    origin, direction = (line.start, line.direction) if line else (0.0, 1)
    reached, found = 0.0, []
    for part in parts.document.parts(shaft, "shaft_section"):
        values = parts.values(part)
        start = values.number("u_coordinate_on_shaft", "m", low=-10.0, high=10.0)
        length = values.number("length", "m", low=0.0, high=10.0)
        outer = _ends(parts, part, "outer_diameter")
        inner = _ends(parts, part, "inner_diameter") or (0.0, 0.0)
        start = reached if start is None else start
        if length is None or outer is None:
            if "length" not in values or not any(f"outer_diameter_{end}" in values for end in ("begin", "end")):
                parts.findings.refuse(f"{part.label}: length or outer_diameter_begin is missing: add it")
            continue
        reached = start + length
        if length < _SHORTEST:
            continue
        if any(hole >= diameter for hole, diameter in zip(inner, outer, strict=True)):
            parts.findings.refuse(
                f"{part.label}: inner diameter {1e3 * max(inner):g} mm is not below the outer one, "
                f"{1e3 * min(outer):g} mm: correct one of them"
            )
            continue
        low, high = sorted((origin + direction * start, origin + direction * (start + length)))
        if direction < 0:
            outer, inner = outer[::-1], inner[::-1]
        found.append(Section(low, high, outer, inner, **material))
    return found


def _ends(parts: Parts, part: Component, name: str) -> tuple[float, float] | None:
    """Return the diameters (m) at begin and end; one stands for both."""
    values = parts.values(part)
    begin, end = (values.number(f"{name}_{side}", "m", low=0.0, high=10.0) for side in ("begin", "end"))
    begin = end if begin is None else begin
    end = begin if end is None else end
    return None if begin is None or end is None else (begin, end)
