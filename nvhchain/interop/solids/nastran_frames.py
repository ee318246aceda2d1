"""Coordinate systems of Nastran bulk data (CORD1R/C/S by grid points, CORD2R/C/S by coordinates), and cards in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import FileFormatError, InputError, require
from nvhchain.handoff import FloatArray
from nvhchain.interop.notation.units import UnitSystem
from nvhchain.interop.solids._model_parts import Parts
from nvhchain.interop.solids.nastran_cards import real

Cards = Mapping[str, list[list[str]]]

Place = tuple[float, ...]

_AXIS = 1e-6
"""Largest component across for axes that lie along those of the basic system."""


@dataclass(frozen=True, eq=False)
class Frame:
    """Coordinate system: `R`, `C` or `S`, its origin, and its axes as columns; angles are in degrees."""

    kind: str = "R"
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))
    axes: FloatArray = field(default_factory=lambda: np.eye(3))

    def place(self, point: FloatArray) -> FloatArray:
        """Return the coordinates of a point in the basic system."""
        if self.kind == "C":  # r, θ, z
            r, angle, z = point[0], np.radians(point[1]), point[2]
            point = np.array([r * np.cos(angle), r * np.sin(angle), z])
        elif self.kind == "S":  # r, θ from z, φ about z
            r, polar, angle = point[0], np.radians(point[1]), np.radians(point[2])
            point = r * np.array([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)])
        return np.asarray(self.origin + self.axes @ point)

    def axes_at(self, point: FloatArray) -> FloatArray:
        """Return the axes (3, 3) as columns, at a point of the basic system."""
        if self.kind == "R":
            return self.axes
        x, y, z = self.axes.T @ (point - self.origin)
        radius = np.hypot(x, y)
        radial = np.array([x, y, 0.0]) / radius if radius > 0 else np.array([1.0, 0.0, 0.0])
        tangential = np.array([-radial[1], radial[0], 0.0])
        if self.kind == "C":
            local = np.column_stack([radial, tangential, [0.0, 0.0, 1.0]])
        else:
            reach = np.hypot(radius, z)
            out = (radius * radial + [0.0, 0.0, z]) / reach if reach > 0 else np.array([0.0, 0.0, 1.0])
            local = np.column_stack([out, np.cross(tangential, out), tangential])
        return np.asarray(self.axes @ local)


BASIC = Frame()


def basic_component(component: int, axes: FloatArray) -> tuple[int, float] | None:
    """Return the motion 0 … 5 of the basic system, and its sign, that is `component` 0 … 5 of `axes`; None if mixed."""
    column = axes[:, component % 3]
    axis = int(np.abs(column).argmax())
    if np.abs(np.delete(column, axis)).max() > _AXIS:
        return None
    return axis + 3 * (component // 3), float(np.sign(column[axis]))


def basic_components(components: Iterable[str], axes: FloatArray) -> set[str] | None:
    """Return the components `1` … `6` of the basic system that make the same space; None if there are none such."""
    held = set()
    for first in (1, 4):
        own = [int(c) - first for c in components if c in "123456" and first <= int(c) < first + 3]
        share = (axes[:, own] ** 2).sum(axis=1)  # of each basic axis within the space
        if (np.minimum(share, 1.0 - share) > 4 * _AXIS**2).any():
            return None
        held |= {str(first + axis) for axis in np.flatnonzero(share > 0.5)}
    return held


def frames_and_grids(named_cards: Cards, source: str) -> tuple[dict[int, Frame], dict[int, Place]]:
    """Return coordinate systems by number, and grid points by label in the basic system.

    Raises InputError for systems that rest on missing ones, FileFormatError for a point that is there twice.
    """
    frames: dict[int, Frame] = {0: BASIC}
    grids: dict[int, Place] = {}
    default = _padded(named_cards.get("GRDSET", [[]])[0])[2]
    points = [_padded(card) for card in named_cards.get("GRID", [])]
    systems: list[tuple[str, list[str]]] = []
    for name, cards in named_cards.items():
        if name[:5] == "CORD2":
            systems += [(name, card) for card in cards]
        elif name[:5] == "CORD1":  # one card may hold two
            systems += [(name, [name, *card[i : i + 4]]) for card in cards for i in (1, 5) if "".join(card[i : i + 4])]
    while points or systems:
        waiting, late = [], []
        for card in points:
            system = int(card[2] or default or 0)
            if system not in frames:
                waiting.append(card)
                continue
            label = int(card[1])
            if label in grids:
                raise FileFormatError(f"{source}: GRID {label} is defined twice")
            x, y, z = (real(x) if x else 0.0 for x in card[3:6])
            grids[label] = (x, y, z) if system == 0 else tuple(frames[system].place(np.array([x, y, z])))
        for name, card in systems:
            frame = _frame(name, card, frames, grids)
            if frame is None:
                late.append((name, card))
            else:
                frames[int(card[1])] = frame
        if len(waiting) == len(points) and len(late) == len(systems):
            if systems:
                name, card = systems[0]
                rest = f"system {card[2]}" if name[:5] == "CORD2" else f"grid points {', '.join(card[2:5])}"
                raise InputError(f"{source}: coordinate system {card[1]} rests on {rest}, which is not defined")
            card = points[0]
            raise InputError(
                f"{source}: GRID {card[1]} is in coordinate system {card[2] or default}, which is not defined"
            )
        points, systems = waiting, late
    return frames, grids


def _padded(card: list[str]) -> list[str]:
    return [*card, *[""] * 9][: max(9, len(card))]


def _frame(name: str, card: list[str], frames: Mapping[int, Frame], grids: Mapping[int, Place]) -> Frame | None:
    """Return the system of a card, or None while what it rests on is not known."""
    if name[:5] == "CORD1":
        if any(int(label) not in grids for label in card[2:5]):
            return None
        a, b, c = (np.array(grids[int(label)]) for label in card[2:5])
    else:
        base = int(card[2] or 0)
        if base not in frames:
            return None
        coordinates = [real(x) if x else 0.0 for x in [*card[3:], *[""] * 9][:9]]  # blank is zero
        a, b, c = (frames[base].place(np.array(coordinates[i : i + 3])) for i in (0, 3, 6))
    axis, plane = b - a, c - a
    z = axis / max(float(np.linalg.norm(axis)), np.finfo(float).tiny)
    x = plane - z * (z @ plane)
    size = float(np.linalg.norm(x))
    if size <= _AXIS * float(np.linalg.norm(plane)) or not np.linalg.norm(axis) > 0:
        raise InputError(f"coordinate system {card[1]}: its three points lie on a line")
    x /= size
    return Frame(name[5], a, np.column_stack([x, np.cross(z, x), z]))


@dataclass(frozen=True, eq=False)
class Deck:
    """Cards of a deck with what they rest on.

    cards: name → cards.
    parts: contents as read so far.
    system: units of the file.
    frames: coordinate systems.
    materials: function that returns MAT1 by number, for a section named in its messages.
    mass: PARAM WTMASS, mass in kg per unit of the file's masses and densities over `system.mass`.
    """

    cards: Cards
    parts: Parts
    system: UnitSystem
    frames: Mapping[int, Frame]
    materials: Callable[[str, str], Material]
    mass: float

    def fields(self, *names: str) -> Iterator[tuple[str, list[str]]]:
        """Yield names and cards, padded to 50 fields."""
        for name in names:
            for card in self.cards.get(name, []):
                yield f"{self.parts.source}: {name} {card[1]}", [*card, *[""] * (50 - len(card))]

    def axes(self, node: int) -> FloatArray:
        """Return the axes (3, 3), as columns, in which the motions of a node are written."""
        frame = self.frames.get(self.parts.rotated.get(node, 0), BASIC)
        return frame.axes_at(np.array(self.parts.nodes[node]))

    def place(self, node: int) -> FloatArray:
        """Return the place (3,) m of a node."""
        require(node in self.parts.nodes, f"{self.parts.source}: node {node} is not defined")
        return self.system.length * np.array(self.parts.nodes[node])

    def motion(self, node: int, component: int) -> FloatArray:
        """Return the row (6,) by which motions of the basic system give a component 1 … 6 of a node's own axes."""
        require(1 <= component <= 6, f"{self.parts.source}: node {node} has no component {component}: give 1 to 6")
        row = np.zeros((2, 3))
        row[(component - 1) // 3] = self.axes(node)[:, (component - 1) % 3]
        return row.ravel()

    def component(self, node: int, component: int, where: str) -> tuple[int, float]:
        """Return the motion 0 … 5 of the basic system, and its sign, behind a component 1 … 6 of a node."""
        found = basic_component(component - 1, self.axes(node))
        if found is None:
            raise InputError(
                f"{where}: component {component} of node {node} is in coordinate system {self.parts.rotated[node]}, "
                "which is turned: write it in the basic system"
            )
        return found
