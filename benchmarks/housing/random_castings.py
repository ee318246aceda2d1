"""Random castings within the limits of their fields: how many are meshed, refused before the work, or fail.

    python -m benchmarks random_castings COUNT [FIRST]

Lengths are round numbers, as in drawings: coincidences of faces are what solid modellers fail at. Prints every failure
with its seed, then the count. A casting takes some seconds.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import HousingFidelity
from nvhchain.housing import Bore, Casting, GearSpace
from nvhchain.housing.casting.mesh import mesh_casting, radiating_surface

COARSE = HousingFidelity(element_size=0.018, elements_per_turn=8.0)


@dataclass
class Counts:
    """Castings by their end."""

    meshed: int = 0
    refused: int = 0
    failed: int = 0


def random_casting(seed: int) -> Casting:
    """Return a casting with one to three shafts; InputError where its lengths do not fit each other."""
    random = np.random.default_rng(seed)

    def length(low: float, high: float, step: float) -> float:
        """Return a multiple of a step (mm) in m."""
        return float(round(random.integers(round(low / step), round(high / step) + 1) * step, 3)) / 1e3

    shafts = int(random.integers(1, 4))
    seats = [length(14, 30, 1) for _ in range(shafts)]
    spaces = [seat + length(12, 50, 1) for seat in seats]
    axes, angle = [(0.0, 0.0)], np.radians(15 * random.integers(-3, 4))
    for number in range(1, shafts):
        apart = seats[number - 1] + seats[number] + length(8, 60, 1)
        x, y = axes[-1]
        axes.append((round(x + apart * np.cos(angle), 6), round(y + apart * np.sin(angle), 6)))
        angle += np.radians(15 * random.integers(-3, 4))
    bell = length(20, 50, 5)
    depth = bell + length(60, 180, 10)
    end_wall, seat_length = length(4, 10, 1), length(14, 30, 2)
    bores = []
    for number, (axis, seat) in enumerate(zip(axes, seats, strict=True)):
        bores.append(Bore(f"E{number}", (*axis, bell + end_wall / 2), seat, seat_length))
        bores.append(Bore(f"R{number}", (*axis, depth - end_wall / 2), seat, seat_length))
    bolt = length(3, 6, 0.5)
    return Casting(
        bores=tuple(bores),
        gear_spaces=tuple(GearSpace(axis, space) for axis, space in zip(axes, spaces, strict=True)),
        wall=length(4, 9, 0.5),
        end_wall=end_wall,
        depth=depth,
        bell_depth=bell,
        draft=length(0, 12, 1),
        chamfer=length(0, 14, 2),
        boss_thickness=length(5, 12, 1),
        cover_thickness=length(4, 10, 1),
        flange_width=length(8, 18, 1),
        flange_thickness=length(8, 18, 1),
        bolts=int(random.choice([0, 4, 6, 8, 10, 12, 16])),
        bolt_radius=bolt,
        lug_radius=bolt + length(4, 10, 1),
        rib_height=length(0, 16, 2),
        rib_thickness=length(4, 8, 1),
        spokes=int(random.integers(0, 9)),
        side_ribs=int(random.choice([0, 4, 8, 12, 16])),
    )


def main() -> None:
    """Mesh COUNT castings."""
    count, first = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    counts = Counts()
    for seed in range(first, first + count):
        try:
            casting = random_casting(seed)
        except InputError:
            counts.refused += 1
            continue
        try:
            mesh_casting(casting, COARSE)
            radiating_surface(casting, 0.04)
            counts.meshed += 1
            if counts.meshed % 25 == 0:
                print(f"{seed + 1 - first} castings: {counts}", flush=True)
        except (SolverError, InputError) as error:
            counts.failed += 1
            print(f"{seed}: {error}", flush=True)
    print(f"{count} castings from seed {first}: {counts}", flush=True)


if __name__ == "__main__":
    main()
