"""Decks of shells folded along lines, in the language of Abaqus and CalculiX (N, mm, t), for tests and benchmarks."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

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

    Parameters
    ----------
    profile : sequence of (float, float)
        Corners of the profile in y and z (mm).
    length : float
        Length along x (mm).
    counts : tuple of int
        Elements along x and along each side of the profile.
    kind : {"S4", "S8R"}
        Type of the shells.
    thickness : float
        Thickness (mm).
    offset : str
        Value of OFFSET; empty for none.
    more : str
        Lines of the model; `{free}` stands for the node at the free end and the first corner.

    Returns
    -------
    str
        Deck without a step.
    """
    step = 2 if kind == "S8R" else 1
    ends = np.array(profile, dtype=float)
    parts = np.linspace(0.0, 1.0, counts[1] * step, endpoint=False)[:, None]
    sides = [a + (b - a) * parts for a, b in pairwise(ends)]
    line = np.vstack([*sides, ends[-1:]])
    labels: dict[tuple[int, int], int] = {}
    around = _SECOND if step == 2 else _CORNERS["S4"]
    cells = [
        [labels.setdefault((i + a, j + b), len(labels) + 1) for a, b in around]
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
