"""Craig–Bampton matrices of a housing for other codes: MATLAB, or Nastran bulk data with DMIG; both in SI units."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.io import savemat

from nvhchain.errors import require
from nvhchain.fem.modal_model import CraigBampton
from nvhchain.files.atomic_write import content_of, write_output
from nvhchain.handoff import FloatArray
from nvhchain.interop.solids.writers import real16

_SEAT_FREEDOMS = 6
_DOUBLE, _SYMMETRIC = 2, 6
"""Type and form of a DMIG matrix: real double precision, symmetric (one triangle is given)."""


def write_craig_bampton(model: CraigBampton, path: str | Path) -> Path:
    """Write the matrices in the format of the suffix.

    A .mat file is of level 5, with `stiffness`, `mass`, `interface_frequency`, `motion`, `names`, `positions` and
    `units`. A .bdf file holds DMIG `KHOUSE` and `MHOUSE`. Seats are GRID 1, 2, … in their order; SPOINTs of the modal
    coordinates follow. `K2GG = KHOUSE` and `M2GG = MHOUSE` select them.
    """
    path = Path(path)
    check_craig_bampton_path(path)
    if path.suffix == ".mat":
        content = _content(model)
        return write_output(path, content_of(lambda file: savemat(file, content, appendmat=False, oned_as="column")))
    return write_output(path, (f"{line}\n".encode() for line in _bulk_data(model)))


def check_craig_bampton_path(path: str | Path) -> None:
    """Refuse an unknown suffix before the matrices are computed."""
    require(Path(path).suffix in (".mat", ".bdf"), f"{path}: Craig–Bampton matrices are written as .mat or .bdf")


def _content(model: CraigBampton) -> dict[str, object]:
    return {
        "stiffness": model.stiffness,
        "mass": model.mass,
        "interface_frequency": model.interface_frequency,
        "motion": model.motion,
        "names": np.array(model.names, dtype=object),
        "positions": model.positions,
        "units": {"stiffness": "N/m, N, N m", "mass": "kg, kg m, kg m2", "interface_frequency": "Hz", "positions": "m"},
    }


def _bulk_data(model: CraigBampton) -> Iterator[str]:
    seats, modes = len(model.names), len(model.interface_frequency)
    yield "$ Craig-Bampton matrices of a housing, SI units; select with K2GG = KHOUSE, M2GG = MHOUSE"
    for number, (name, point) in enumerate(zip(model.names, model.positions, strict=True), start=1):
        x, y, z = (real16(value) for value in point)
        yield f"$ seat {name}"
        yield f"{'GRID*':8}{number:16d}{'':16}{x:>16}{y:>16}"
        yield f"{'*':8}{z:>16}"
    if modes:
        yield f"{'SPOINT':8}{seats + 1:8d}{'THRU':8}{seats + modes:8d}"
    points = [(1 + i // _SEAT_FREEDOMS, 1 + i % _SEAT_FREEDOMS) for i in range(_SEAT_FREEDOMS * seats)]
    points += [(seats + i, 0) for i in range(1, modes + 1)]
    yield from _dmig("KHOUSE", model.stiffness, points)
    yield from _dmig("MHOUSE", model.mass, points)


def _dmig(name: str, matrix: FloatArray, points: list[tuple[int, int]]) -> Iterator[str]:
    """Yield columns of the lower triangle without zeros."""
    yield f"{'DMIG':8}{name:8}{0:8d}{_SYMMETRIC:8d}{_DOUBLE:8d}{0:8d}"
    for column, (grid, component) in enumerate(points):
        rows = column + np.flatnonzero(matrix[column:, column])
        if len(rows):
            yield f"{'DMIG*':8}{name:16}{grid:16d}{component:16d}"
        for row in rows.tolist():
            value = f"{matrix[row, column]:.9E}".replace("E", "D")
            yield f"{'*':8}{points[row][0]:16d}{points[row][1]:16d}{value:>16}"
