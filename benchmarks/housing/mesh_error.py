"""Stated error of a casting's natural frequencies against finer meshes.

    python -m benchmarks mesh_error OUT

Writes docs/measured/housing/mesh_error.md. Modes are paired by the motion of the bearing seats; elements of no size (0
mm) are a straight line through all sizes. OUT keeps housings that have been reduced. Takes some minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.case import GearboxCase
from nvhchain.fidelity import HousingFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import FloatArray, IntArray, ReducedHousing
from nvhchain.housing import Casting, reduce_housing

CASES = Path(__file__).parents[2] / "cases"
STUDIES = {"small/single_stage": (13.0, 10.5, 9.0, 6.5), "gearbox/solid": (13.0, 10.5, 9.0)}
"""Case → sizes of elements, mm; all are held against the last, the first two against 9 mm, and all against the
limit of elements of no size."""
HIGHEST = 6000.0
"""Hz."""
ALIKE, NEAR = 0.8, 0.06
"""Of a pair: least square of the cosine between motions of the seats, largest relative distance of the frequencies."""


def reduced(name: str, size: float, out: Path) -> ReducedHousing:
    """The casting of a case with elements of so many mm."""
    file = out / f"{name.replace('/', '-')}-{size:g}.h5"
    if file.exists():
        return hdf5.load(file, ReducedHousing)
    case = nvh.load_case(CASES / f"{name}.toml")
    assert isinstance(case, GearboxCase)
    assert isinstance(case.housing, Casting)
    fidelity = HousingFidelity(element_size=1e-3 * size, mode_ratio=1.0, samples_per_face=1)
    made = reduce_housing(case.housing, f_max=HIGHEST, surface_size=0.025, fidelity=fidelity)
    hdf5.save(made, file)
    return made


def partners(coarse: ReducedHousing, fine: ReducedHousing) -> tuple[IntArray, NDArray[np.bool_]]:
    """(n,) mode of `fine` that is each mode of `coarse`, and whether there is one."""
    one, other = (h.seat_shapes.reshape(len(h.natural_frequency), -1) for h in (coarse, fine))
    cosine = (one @ other.T) ** 2 / np.outer((one**2).sum(axis=1), (other**2).sum(axis=1))
    apart = coarse.natural_frequency[:, None] / fine.natural_frequency - 1.0
    alike = np.where(np.abs(apart) < NEAR, cosine, 0.0)
    return alike.argmax(axis=1), alike.max(axis=1) > ALIKE


def extrapolated(housings: dict[float, ReducedHousing]) -> FloatArray:
    """(n,) Hz of the modes of the finest with elements of no size: a straight line through all sizes; NaN where a mesh
    lacks a mode."""
    finest = housings[min(housings)]
    found = np.full((len(housings), len(finest.natural_frequency)), np.nan)
    for row, housing in zip(found, housings.values(), strict=True):
        partner, paired = partners(housing, finest)
        row[partner[paired]] = housing.natural_frequency[paired]
    sizes = np.array(list(housings))
    line = np.linalg.pinv(np.column_stack([np.ones_like(sizes), sizes]))
    return np.asarray(line[0] @ found)


def rows(name: str, sizes: tuple[float, ...], out: Path) -> list[str]:
    """Lines of the table."""
    housings = {size: reduced(name, size, out) for size in sizes}
    limit = extrapolated(housings)
    found = []
    for fine in (*dict.fromkeys((9.0, sizes[-1])), 0.0):
        finer = housings[fine or sizes[-1]]
        truth = finer.natural_frequency if fine else limit
        for coarse in (size for size in sizes if size > fine):
            partner, paired = partners(housings[coarse], finer)
            paired &= ~np.isnan(truth[partner])
            true = (housings[coarse].natural_frequency / truth[partner] - 1.0)[paired]
            said = housings[coarse].accuracy.frequency_error[paired]
            found.append(
                f"| {name} | {coarse:g} | {fine:g} | {len(true)} | {100 * rms(true):.2f} | {100 * rms(said):.2f} | "
                f"{np.median(said / true):.1f} | {np.corrcoef(true, said)[0, 1]:.2f} |"
            )
    return found


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    """Reduce, compare, write."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    lines = [
        "| housing of | elements / mm | held against / mm | modes | true error, RMS / % | estimated / % | ratio "
        "(median) | correlation over the modes |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
        *(line for name, sizes in STUDIES.items() for line in rows(name, sizes, out)),
    ]
    publish("housing/mesh_error", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
