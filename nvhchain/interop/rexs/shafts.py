"""Shafts of a document: sections, those of coupled shafts joined, and places of what stands on them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.gears import material_of
from nvhchain.interop.rexs.parts import Parts
from nvhchain.interop.rexs.places import Line, frame_of
from nvhchain.interop.rexs.unit import ImportedShaft, Section

_SHORTEST = 1e-5
"""Shortest section (m) that counts; programs write ones of length 0 for steps."""


def place_on_shaft(
    parts: Parts, component: Component, shaft: int, lines: Mapping[int, Line], name: str = "u_coordinate_on_shaft"
) -> float | None:
    """Return z (m) of a component by its coordinate on a shaft, or by its own support vector.

    Returns place (m); None where the file has none.
    """
    along = parts.values(component).number(name, "m", low=-10.0, high=10.0)
    line = lines.get(shaft)
    if along is not None:
        return along if line is None else line.start + line.direction * along
    frame, base = frame_of(parts, component), frame_of(parts, parts.document.components[min(lines)]) if lines else None
    if frame is None or base is None:
        return None
    return float(base.axes[0] @ frame.origin)


def read_shafts(parts: Parts, lines: Mapping[int, Line]) -> list[ImportedShaft]:
    """Return all shafts, those that are coupled as one."""
    found = []
    for shaft in parts.shafts():
        members = [other for other, of in sorted(parts.rotor.items()) if of == shaft]
        line = next((lines[member] for member in members if member in lines), None)
        for member in members:
            if line is not None and member in lines and np.hypot(*(lines[member].axis - line.axis)) > 1e-5:
                parts.findings.refuse(
                    f"{parts.document.components[member].label}: is coupled to a shaft that is not coaxial: correct "
                    "its support_vector"
                )
        pieces = [piece for member in members for piece in _sections(parts, member, lines.get(member))]
        axis = None if line is None else (float(line.axis[0]), float(line.axis[1]))
        found.append(ImportedShaft(parts.names[shaft], axis, tuple(sorted(pieces, key=lambda piece: piece.start))))
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
        if any(hole >= around for hole, around in zip(inner, outer, strict=True)):
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
    begin, end = (values.number(f"{name}_{at}", "m", low=0.0, high=10.0) for at in ("begin", "end"))
    begin = end if begin is None else begin
    end = begin if end is None else end
    return None if begin is None or end is None else (begin, end)
