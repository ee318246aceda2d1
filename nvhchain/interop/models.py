"""Solid models by the ending of their file."""

from __future__ import annotations

from pathlib import Path

from nvhchain.errors import InputError
from nvhchain.fem.solid_model import SolidModel
from nvhchain.interop.abaqus import read_abaqus
from nvhchain.interop.nastran import read_nastran

NASTRAN, ABAQUS = (".bdf", ".dat", ".nas", ".blk", ".bulk"), (".inp",)


def read_solid_model(path: str | Path, *, units: str) -> SolidModel:
    """Nastran bulk data (.bdf, .dat, .nas) or Abaqus input (.inp).  units: of the file, a key of `UNIT_SYSTEMS`.

    Raises InputError for another ending, and what the readers raise.
    """
    ending = Path(path).suffix.lower()
    if ending in NASTRAN:
        return read_nastran(path, units=units)
    if ending in ABAQUS:
        return read_abaqus(path, units=units)
    raise InputError(f"{path}: {ending or 'no ending'} is not a solid model: {', '.join(NASTRAN + ABAQUS)} are read")
