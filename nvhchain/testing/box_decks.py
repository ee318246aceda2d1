"""Closed box around the bearings of the small gearbox as Nastran decks, of solids and of shells."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from nvhchain.handoff import FloatArray

LOW, HIGH = np.array([-0.07, -0.07, 0.033]), np.array([0.14, 0.07, 0.127])
"""Corners of the middle surface (m); both end walls carry bearings."""

WALL = 0.005
SEATS = {"A1": (0.0, 0.0), "A2": (0.0, 0.0), "B1": (0.06854129, 0.0), "B2": (0.06854129, 0.0)}
"""Axes of the bearings (m): first ones in the lower wall, second ones in the upper."""

_REACH = 0.022
"""Radius of the seats (m)."""

_FOOT = 0.02
"""Edge of the held corners of the side wall at y = `LOW[1]` (m)."""

_AROUND = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


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
        nodes = [label[tuple(i + j for i, j in zip(cell, at, strict=True))] for at in _AROUND]
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
                        at = [0, 0, 0]
                        at[normal], at[u], at[v] = level, i + a, j + b
                        nodes.append(label[tuple(at)])
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

    def __getitem__(self, at: tuple[int, ...]) -> int:
        return self._known.setdefault(at, len(self._known) + 1)

    def places(self) -> FloatArray:
        """Return the places (n, 3) m, by label from 1."""
        return np.array([[axis[i] for axis, i in zip(self._axes, at, strict=True)] for at in self._known])

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
