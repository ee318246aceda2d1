"""Places and axes of components: support vectors along reference components."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.parts import BEARINGS, Parts

_PARALLEL = 1e-4
"""Largest sine of the angle between axes that count as parallel."""


@dataclass(frozen=True)
class Frame:
    """Place and axes of a component in the frame of the file.

    origin (3,): place (m).
    axes (3, 3): rows u, v, w.
    """

    origin: FloatArray
    axes: FloatArray


def frame_of(parts: Parts, component: Component, seen: tuple[int, ...] = ()) -> Frame | None:
    """Return place and axes of a component, or None where the file does not place it.

    Returns place; a circle of references is a mistake.
    """
    values = parts.values(component)
    support = values.vector("support_vector", "m")
    if support is None or len(support) != 3:
        return None
    if component.id in seen:
        members = seen[seen.index(component.id) :]
        least = members.index(min(members))
        members = (*members[least:], *members[:least], members[least])  # one line for a circle, wherever it begins
        circle = ", ".join(map(str, members))
        first = parts.document.components[members[0]].label
        parts.findings.refuse(
            f"{first}: reference_component_for_position runs in a circle ({circle}): refer to the gear unit"
        )
        return None
    u = np.array(values.vector("u_axis_vector", "m") or (1.0, 0.0, 0.0))
    w = np.array(values.vector("w_axis_vector", "m") or (0.0, 0.0, 1.0))
    axes = _axes(u, w)
    if axes is None:
        parts.findings.refuse(f"{component.label}: u_axis_vector and w_axis_vector span no frame: make them normal")
        return None
    origin = np.array(support)
    reference = values.number("reference_component_for_position")
    if reference is None or int(reference) == component.id:
        return Frame(origin, axes)
    base = parts.document.components.get(int(reference))
    if base is None:
        parts.findings.refuse(
            f"{component.label}: reference_component_for_position = {int(reference)} is not in the file: correct it"
        )
        return None
    reference_frame = frame_of(parts, base, (*seen, component.id))
    if reference_frame is None:
        return Frame(origin, axes) if "support_vector" not in parts.values(base) else None
    return Frame(reference_frame.origin + origin @ reference_frame.axes, axes @ reference_frame.axes)


def _axes(u: FloatArray, w: FloatArray) -> FloatArray | None:
    """Return rows u, v, w of length 1, w made normal to u; None where they are parallel or zero."""
    if u.shape != (3,) or w.shape != (3,) or not (np.linalg.norm(u) > 1e-12 and np.linalg.norm(w) > 1e-12):
        return None
    u = u / np.linalg.norm(u)
    w = w / np.linalg.norm(w)
    w = w - (w @ u) * u
    if np.linalg.norm(w) < 1e-6:
        return None
    w /= np.linalg.norm(w)
    return np.array([u, np.cross(w, u), w])


@dataclass(frozen=True)
class Line:
    """Axis of a shaft in the frame of the case.

    axis (2,): place x, y (m); None where it follows from the stages.
    start: z of the shaft's origin (m).
    direction: +1 where its u axis points along +z, else −1.
    placed: False where the line follows from a coupling or bearing.
    """

    axis: FloatArray | None
    start: float
    direction: int
    placed: bool = True


def base_frame(parts: Parts, lines: Mapping[int, Line]) -> Frame | None:
    """Return the frame of the first shaft that the file places, which is that of all lines."""
    placed = [shaft for shaft, line in lines.items() if line.placed]
    return frame_of(parts, parts.document.components[min(placed)]) if placed else None


def shaft_lines(parts: Parts) -> dict[int, Line]:
    """Return the lines of all shafts that the file places, and of those that couplings or bearings join with others."""
    lines = _placed_lines(parts)
    joints = [
        way
        for one, coordinate, other, its in _joints(parts)
        for way in ((one, coordinate, other, its), (other, its, one, coordinate))
    ]
    reached = list(lines)
    for first in (None, *sorted({joint[0] for joint in joints})):
        if first is not None and first not in lines:
            lines[first] = Line(None, 0.0, 1, placed=False)
            reached = [first]
        for known in reached:
            line = lines[known]
            for near, coordinate, far, its in joints:
                if near == known and far not in lines:
                    start = line.start + line.direction * (coordinate - its)
                    lines[far] = Line(line.axis, start, line.direction, placed=False)
                    reached.append(far)
    return lines


def _joints(parts: Parts) -> list[tuple[int, float, int, float]]:
    """Return couplings and bearings between two shafts: one shaft with its coordinate (m), the other with its own."""
    found = []
    for joint in parts.document.typed("coupling", "switchable_coupling", *BEARINGS):
        values, ends = parts.values(joint), {}
        for relation in parts.document.related("side", "assembly", joint.id):
            for side in ("inner", "outer"):
                end = relation.end(f"{side}_part")
                coordinate = values.number(f"u_coordinate_on_shaft_{side}_side", "m", low=-10.0, high=10.0)
                if end in parts.rotor and coordinate is not None:
                    ends[side] = end, coordinate
        if len(ends) == 2 and ends["inner"][0] != ends["outer"][0]:
            found.append((*ends["inner"], *ends["outer"]))
    return found


def _placed_lines(parts: Parts) -> dict[int, Line]:
    """Return the lines of all shafts that the file places; those that are not parallel are mistakes."""
    frames = {
        shaft: frame
        for shaft in parts.rotor
        if (frame := frame_of(parts, parts.document.components[shaft])) is not None
    }
    if not frames:
        return {}
    base = frames[min(frames)].axes
    lines = {}
    for shaft, frame in frames.items():
        place, direction = base @ frame.origin, base @ frame.axes[0]
        if np.hypot(direction[1], direction[2]) > _PARALLEL:
            parts.findings.refuse(
                f"{parts.document.components[shaft].label}: is not parallel to the first shaft: leave it out, "
                "shafts of the chain are parallel"
            )
            continue
        lines[shaft] = Line(place[1:], float(place[0]), 1 if direction[0] > 0 else -1)
    return lines
