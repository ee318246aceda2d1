"""Decks in the language of Abaqus and CalculiX (N, mm, t) for tests and benchmarks: folded shells, and boxes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from nvhchain.handoff import FloatArray

_CORNERS = {"S4": ((0, 0), (1, 0), (1, 1), (0, 1))}
_SECOND = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))


def folded_shells(
    profile: Sequence[tuple[float, float]],
    length: float,
    counts: tuple[int, int],
    *,
    kind: str = "S4",
    thickness: float,
    offset: str = "",
    more: str = "",
) -> str:
    """Return a deck of steel shells, clamped at one end.

    profile : corners of the profile in y and z (mm).
    length : length along x (mm).
    thickness : thickness (mm).
    """
    step = 2 if kind == "S8R" else 1
    ends = np.array(profile, dtype=float)
    parts = np.linspace(0.0, 1.0, counts[1] * step, endpoint=False)[:, None]
    sides = [a + (b - a) * parts for a, b in pairwise(ends)]
    line = np.vstack([*sides, ends[-1:]])
    labels: dict[tuple[int, int], int] = {}
    corners = _SECOND if step == 2 else _CORNERS["S4"]
    cells = [
        [labels.setdefault((i + a, j + b), len(labels) + 1) for a, b in corners]
        for i in range(0, counts[0] * step, step)
        for j in range(0, len(line) - 1, step)
    ]
    lines = ["*NODE, NSET=ALL"]
    for (i, j), label in labels.items():
        y, z = line[j]
        lines.append(f"{label}, {length * i / (counts[0] * step):.9g}, {y:.9g}, {z:.9g}")
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=SHELLS")
    lines += [", ".join(map(str, [number, *cell])) for number, cell in enumerate(cells, start=1)]
    lines += ["*NSET, NSET=CLAMPED", *(f"{label}," for (i, _), label in labels.items() if i == 0)]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*DENSITY", "7.85e-9"]
    lines += [f"*SHELL SECTION, ELSET=SHELLS, MATERIAL=STEEL{f', OFFSET={offset}' if offset else ''}", f"{thickness}"]
    lines += more.format(free=labels[counts[0] * step, 0]).splitlines()
    return "\n".join([*lines, "*BOUNDARY", "CLAMPED, 1, 6", ""])


PLATE = [(0.0, 0.0), (100.0, 0.0)]
CHANNEL = [(0.0, 40.0), (0.0, 0.0), (100.0, 0.0), (100.0, 40.0)]
MASS_AND_SPRING = """*ELEMENT, TYPE=MASS, ELSET=LUMP
9001, {free}
*MASS, ELSET=LUMP
1.e-4
*ELEMENT, TYPE=SPRING1, ELSET=LEG
9002, {free}
*SPRING, ELSET=LEG
3
50."""

FOLDED = {
    "plate S4": folded_shells(PLATE, 200.0, (40, 20), thickness=2.0),
    "plate S8R": folded_shells(PLATE, 200.0, (20, 10), kind="S8R", thickness=2.0),
    "plate S8R, offset": folded_shells(PLATE, 200.0, (16, 8), kind="S8R", thickness=5.0, offset="0.5"),
    "channel S8R": folded_shells(CHANNEL, 200.0, (16, 6), kind="S8R", thickness=3.0),
    "channel S8R, mass and spring": folded_shells(
        CHANNEL, 200.0, (16, 6), kind="S8R", thickness=3.0, more=MASS_AND_SPRING
    ),
}
"""Decks that are compared with CalculiX."""


LOW, HIGH = np.array([-0.07, -0.07, 0.033]), np.array([0.14, 0.07, 0.127])
"""Corners of the middle surface (m); both end walls carry bearings."""

WALL = 0.005
SEATS = {"A1": (0.0, 0.0), "A2": (0.0, 0.0), "B1": (0.06854129, 0.0), "B2": (0.06854129, 0.0)}
"""Axes of the bearings (m): first ones in the lower wall, second ones in the upper."""

_REACH = 0.022
"""Radius of the seats (m)."""

_FOOT = 0.02
"""Edge of the held corners of the side wall at y = `LOW[1]` (m)."""

_BRICK_CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def box_of_solids(size: float) -> list[str]:
    """Return cards of bricks with one through the wall; `size` is their edge along it (m)."""
    axes = [
        np.concatenate([[a - WALL / 2], _steps(a + WALL / 2, b - WALL / 2, size), [b + WALL / 2]])
        for a, b in zip(LOW, HIGH, strict=True)
    ]
    last = [len(axis) - 2 for axis in axes]
    cells = [c for c in np.ndindex(*(n + 1 for n in last)) if any(i in (0, n) for i, n in zip(c, last, strict=True))]
    label = _Labels(axes)
    cards = []
    for number, cell in enumerate(cells, start=1):
        nodes = [label[tuple(i + j for i, j in zip(cell, corner, strict=True))] for corner in _BRICK_CORNERS]
        cards += [f"CHEXA,{number},1,{','.join(map(str, nodes[:6]))}", f"+,{','.join(map(str, nodes[6:]))}"]
    return [*cards, "PSOLID,1,1", *label.cards(), *_supports(label.places())]


def box_of_shells(size: float) -> list[str]:
    """Return cards of CQUAD4 with an edge of about `size` (m), on the middle surface of the walls."""
    axes = [_steps(a, b, size) for a, b in zip(LOW, HIGH, strict=True)]
    label, cards, number = _Labels(axes), [], 0
    for normal in range(3):
        u, v = (normal + 1) % 3, (normal + 2) % 3
        for level in (0, len(axes[normal]) - 1):
            for i in range(len(axes[u]) - 1):
                for j in range(len(axes[v]) - 1):
                    nodes = []
                    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        point = [0, 0, 0]
                        point[normal], point[u], point[v] = level, i + a, j + b
                        nodes.append(label[tuple(point)])
                    number += 1
                    cards.append(f"CQUAD4,{number},1,{','.join(map(str, nodes))}")
    return [*cards, f"PSHELL,1,1,{1e3 * WALL},1,,1", *label.cards(), *_supports(label.places())]


def deck(cards: Iterable[str]) -> str:
    """Return a deck of aluminium in N, mm, t."""
    return "\n".join(["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,70000.,,0.33,2.7-9", *cards, "ENDDATA", ""])


def _steps(low: float, high: float, size: float) -> FloatArray:
    return np.linspace(low, high, 1 + round((high - low) / size))


class _Labels:
    """Labels of the points of a lattice, given as they are asked for."""

    def __init__(self, axes: list[FloatArray]) -> None:
        self._axes = axes
        self._known: dict[tuple[int, ...], int] = {}

    def __getitem__(self, point: tuple[int, ...]) -> int:
        return self._known.setdefault(point, len(self._known) + 1)

    def places(self) -> FloatArray:
        """Return the places (n, 3) m, by label from 1."""
        return np.array([[axis[i] for axis, i in zip(self._axes, point, strict=True)] for point in self._known])

    def cards(self) -> list[str]:
        return [f"GRID,{n},,{','.join(f'{1e3 * x:.6f}' for x in place)}" for n, place in enumerate(self.places(), 1)]


def _supports(places: FloatArray) -> list[str]:
    """Return rigid seats in the end walls, and what holds the feet."""
    cards, labels = [], np.arange(1, len(places) + 1)
    for number, (name, (x, y)) in enumerate(SEATS.items()):
        level = HIGH[2] if name.endswith("2") else LOW[2]
        near = (np.hypot(places[:, 0] - x, places[:, 1] - y) < _REACH) & (np.abs(places[:, 2] - level) < 0.6 * WALL)
        point = 900001 + number
        cards.append(f"GRID,{point},,{1e3 * x:.6f},{1e3 * y:.6f},{1e3 * level:.6f}")
        members = [*map(str, labels[near])]
        cards.append(f"RBE2,{point},{point},123456,{','.join(members[:5])}")
        cards += [f"+,{','.join(members[i : i + 8])}" for i in range(5, len(members), 8)]
    ends = ((places[:, [0, 2]] < LOW[[0, 2]] + _FOOT) | (places[:, [0, 2]] > HIGH[[0, 2]] - _FOOT)).all(axis=1)
    foot = ends & (places[:, 1] < LOW[1] + 0.6 * WALL)
    return [*cards, *(f"SPC1,1,123456,{n}" for n in labels[foot])]
