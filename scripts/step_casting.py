"""Draw the STEP casting of cases/small/cad.toml: `python scripts/step_casting.py cases/small/gear_case.step`.

The casting fits the gears of cases/small/single_stage.toml: walls of 5 mm, bosses around four seats, ribs, a flange
with six bolt holes, rounded edges and small fillets. Lengths are in millimetres. Tests draw it, too.
"""

from __future__ import annotations

import argparse
import re
from itertools import product
from pathlib import Path
from typing import Any

import gmsh

AXES = {"A": (0.0, 22.0), "B": (68.54129, 24.0)}
"""Shaft → x of its axis and radius of its seats."""

WALL, REAR, BELL = 5.0, 130.0, 30.0
SEATS = (22.0, 44.0), (116.0, 138.0)
LEFT, RIGHT, SIDE = -45.0, 127.5, 59.0
"""Outside of the side walls: x, x, y."""

ROUND, FILLET = 15.0, 1.0
FLANGE, FLANGE_WIDTH, BOLT = 14.0, 14.0, 5.0


def box(occ: Any, inset: float, low: float, high: float) -> tuple[int, int]:
    """Return a block between two heights, smaller than the outside by `inset`, with its upright edges rounded."""
    width, height = RIGHT - LEFT - 2 * inset, 2 * (SIDE - inset)
    face = occ.addRectangle(LEFT + inset, inset - SIDE, low, width, height, roundedRadius=max(ROUND - inset, 3.0))
    return next(part for part in occ.extrude([(2, face)], 0, 0, high - low) if part[0] == 3)


def tube(occ: Any, x: float, y: float, low: float, high: float, radius: float) -> tuple[int, int]:
    """Return a cylinder along z."""
    return (3, occ.addCylinder(x, y, low, 0, 0, high - low, radius))


def rib(occ: Any, x: float, y: float, low: float, size: tuple[float, float, float]) -> tuple[int, int]:
    """Return a block with its middle at (x, y)."""
    return (3, occ.addBox(x - size[0] / 2, y - size[1] / 2, low, *size))


def bolts() -> list[tuple[float, float]]:
    """Return the places of the bolts on the flange."""
    long_sides = list(product((LEFT + 25, RIGHT - 25), (-SIDE - 7.0, SIDE + 7.0)))
    return [*long_sides, (LEFT - 7.0, 0.0), (RIGHT + 7.0, 0.0)]


def casting(occ: Any) -> tuple[int, int]:
    """Return the casting."""
    outside = [box(occ, 0.0, 0.0, REAR), box(occ, -FLANGE_WIDTH, 0.0, FLANGE)]
    outside += [tube(occ, x, 0.0, REAR - WALL, SEATS[1][1] + 6.0, r + 9.0) for x, r in AXES.values()]
    outside += [rib(occ, x, 0.0, REAR - 2.0, (6.0, 2 * SIDE - 20.0, 9.0)) for x, _ in AXES.values()]
    outside += [rib(occ, x, y, 8.0, (6.0, 10.0, 100.0)) for x in (34.0,) for y in (-SIDE - 3.0, SIDE + 3.0)]
    body, _ = occ.fuse(outside[:1], outside[1:])
    body, _ = occ.cut(body, [box(occ, WALL, BELL + 6.0, REAR - WALL), box(occ, WALL, -1.0, BELL)])
    inside = [tube(occ, x, 0.0, *SEATS[0], r + 9.0) for x, r in AXES.values()]
    inside += [tube(occ, x, 0.0, SEATS[1][0], REAR - 1.0, r + 9.0) for x, r in AXES.values()]
    body, _ = occ.fuse(body, inside)
    holes = [tube(occ, x, 0.0, *seat, r) for (x, r), seat in product(AXES.values(), SEATS)]
    holes += [tube(occ, x, y, -1.0, FLANGE + 1.0, BOLT) for x, y in bolts()]
    body, _ = occ.cut(body, holes)
    return next(part for part in body if part[0] == 3)


def rounded(occ: Any, body: tuple[int, int]) -> tuple[int, int]:
    """Return the casting with small fillets on the rims of the rear bosses."""
    occ.synchronize()
    rims = []
    for dim, tag in gmsh.model.getEntities(1):
        low, high = gmsh.model.getBoundingBox(dim, tag)[2::3]
        if abs(low - SEATS[1][1] - 6.0) < 1e-3 and abs(high - low) < 1e-3 and gmsh.model.getType(dim, tag) == "Circle":
            rims.append(tag)
    made = occ.fillet([body[1]], rims, [FILLET])
    return next(part for part in made if part[0] == 3)


def _short(value: float) -> str:
    """Return a number with the digits that a millimetre needs, in the form of STEP."""
    text = f"{value:.9g}" if abs(value) > 1e-9 else "0."
    return text if "." in text else f"{text.replace('e', '.E')}" if "e" in text else f"{text}."


def draw(path: Path) -> None:
    """Write the STEP file."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    occ = gmsh.model.occ
    rounded(occ, casting(occ))
    occ.synchronize()
    gmsh.write(str(path))
    gmsh.finalize()
    text = re.sub(r"\n +", "", path.read_text(encoding="ascii"))  # lines are wrapped with blanks
    text = re.sub(r"-?\d+\.\d{9,}(?:E[-+]\d+)?", lambda number: _short(float(number[0])), text)
    path.write_text(re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "'2026-11-26T00:00:00'", text), encoding="ascii", newline="\n")


if __name__ == "__main__":
    command = argparse.ArgumentParser(description=__doc__)
    command.add_argument("file", help="STEP file to write")
    draw(Path(command.parse_args().file))
