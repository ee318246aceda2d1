"""Normal modes in the HDF5 results of MSC Nastran: eigenvectors, their summary, and the model where it is stored."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from nvhchain.errors import require, required
from nvhchain.fem.modal_model import ModalModel
from nvhchain.interop.modes.assembled import Geometry, Mode, modal_model
from nvhchain.interop.modes.nastran_geometry import card_geometry, deck_geometry
from nvhchain.interop.notation._apart import read_apart
from nvhchain.interop.notation._texts import damaged
from nvhchain.interop.notation.units import unit_system

_DOMAINS, _VECTORS = "NASTRAN/RESULT/DOMAINS", "NASTRAN/RESULT/NODAL/EIGENVECTOR"
_SUMMARY, _GRID = "NASTRAN/RESULT/SUMMARY/EIGENVALUE", "NASTRAN/INPUT/NODE/GRID"
_NORMAL_MODES = 2
"""Value of ANALYSIS."""

_ELEMENTS = ("CTETRA", "CPENTA", "CHEXA", "CQUAD4", "CQUADR", "CQUAD8", "CTRIA3", "CTRIAR", "CTRIA6")
_FRAMES = ("CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S")
_TABLES = (
    *(_DOMAINS, _VECTORS, _SUMMARY, _GRID),
    *(f"NASTRAN/INPUT/ELEMENT/{name}" for name in _ELEMENTS),
    *(f"NASTRAN/INPUT/COORDINATE_SYSTEM/{name}" for name in _FRAMES),
)


_READER = """
import io, sys
import h5py, numpy
path, *names = sys.stdin.buffer.read().decode().split("\\n")
with h5py.File(path, "r") as file:
    found = {name: numpy.asarray(file[name][()]) for name in names if name in file}
"""


def holds_nastran_results(path: Path) -> bool:
    """Return True for an HDF5 file of Nastran; False for others, and for files that cannot be opened."""
    try:
        with h5py.File(path, "r") as file:
            return "NASTRAN" in file
    except (OSError, RuntimeError):
        return False


def read_nastran_hdf5(
    path: str | Path, *, units: str, mass_normalized: bool = False, deck: str | Path | None = None
) -> ModalModel:
    """Read normal modes of an HDF5 file of MSC Nastran.

    deck : deck with nodes and elements; by default those in the file.

    Raises FileFormatError for a damaged file, InputError for a file without modes, with modes of several subcases,
    or without its model.
    """
    path, system = Path(path), unit_system(units)
    found = read_apart(_READER, path, *_TABLES, kind="HDF5")
    with damaged(path, lambda error: f"tables of another layout than Nastran's: {error}", TypeError, AttributeError):
        geometry = _geometry(found, path) if deck is None else deck_geometry(Path(deck))
        modes = list(_modes(found, path))
    return modal_model(modes, geometry, system, str(path), mass_normalized=mass_normalized)


def _modes(found: Mapping[str, Any], path: Path) -> Iterator[Mode]:
    missing = f"{path}: no {_VECTORS} with {_DOMAINS}: request VECTOR (or DISPLACEMENT) of real modes, HDF5"
    domains, vectors = required(found.get(_DOMAINS), missing), required(found.get(_VECTORS), missing)
    own = domains[(domains["ANALYSIS"] == _NORMAL_MODES) & np.isin(domains["ID"], np.unique(vectors["DOMAIN_ID"]))]
    require(len(own) > 0, f"{path}: its eigenvectors are no real normal modes: export SOL 103")
    names = [name for name in ("SUBCASE", "DESIGN_CYCLE", "SE") if name in own.dtype.names]
    for name in names:
        several = sorted(set(own[name].tolist()))
        require(len(several) == 1, f"{path}: modes of {name} {', '.join(map(str, several))} are there: export one")
    summary = found.get(_SUMMARY)
    mass = {} if summary is None else dict(zip(summary["MODE"].tolist(), summary["MASS"].tolist(), strict=True))
    points = None if found.get(_GRID) is None else found[_GRID]["ID"]
    order = np.argsort(vectors["DOMAIN_ID"], kind="stable")
    vectors = vectors[order]
    for domain in own:
        first, last = np.searchsorted(vectors["DOMAIN_ID"], [domain["ID"], domain["ID"] + 1])
        rows = vectors[first:last]
        rows = rows if points is None else rows[np.isin(rows["ID"], points)]  # others are scalar points
        yield Mode(
            float(np.sqrt(max(float(domain["TIME_FREQ_EIGR"]), 0.0)) / (2 * np.pi)),
            float(mass.get(int(domain["MODE"]), 0.0)),
            0.0,
            rows["ID"].astype(np.int64),
            np.column_stack([rows[axis] for axis in "XYZ"]).astype(float),
        )


def _geometry(found: Mapping[str, Any], path: Path) -> Geometry:
    """Return the stored model, as cards."""
    missing = f"{path}: no {_GRID}: state the deck of these modes by deck, or write the input with them"
    named = {
        "GRID": [
            ["GRID", str(row["ID"]), str(row["CP"]), *map(repr, row["X"].tolist()), str(row["CD"])]
            for row in required(found.get(_GRID), missing)
        ]
    }
    for name in _ELEMENTS:
        table = found.get(f"NASTRAN/INPUT/ELEMENT/{name}")
        if table is not None:
            named[name] = [
                [name, str(row["EID"]), str(row["PID"]), *(str(n) if n else "" for n in row["G"].tolist())]
                for row in table
            ]
    for name in _FRAMES:
        table = found.get(f"NASTRAN/INPUT/COORDINATE_SYSTEM/{name}")
        if table is not None:
            fields = [one for one in table.dtype.names if one != "DOMAIN_ID"]
            named[name] = [[name, *(_text(row[one]) for one in fields)] for row in table]
    return card_geometry(named, str(path))


def _text(value: Any) -> str:
    """Return a number as a field of a card."""
    return repr(float(value)) if isinstance(value, np.floating) else str(int(value))
