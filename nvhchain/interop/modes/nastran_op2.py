"""Normal modes in an OP2 file of Nastran or OptiStruct, on the nodes of their deck; pyYeti reads the records."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.errors import FileFormatError, InputError, require, required
from nvhchain.fem.modal_model import ModalModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.interop.modes.assembled import Mode, modal_model
from nvhchain.interop.modes.nastran_geometry import deck_geometry
from nvhchain.interop.notation.units import unit_system
from nvhchain.runtime.extras import check_installed

_VECTORS = ("OUGV1", "BOUGV1", "OUG1", "BOPHIG", "OPHIG", "OUGV1PAT")
_EIGENVALUES = ("LAMA", "BLAMA", "LAMAS")
_NORMAL_MODES, _REAL_SORTED = 2, (1, 7)
"""Approach of real eigenvalues, and tables of displacements and eigenvectors by node."""

_MODE_WORDS = 7
"""Words of a mode in LAMA: its number, order, eigenvalue, radians, cycles, modal mass and stiffness."""

_NODE_WORDS = 8
"""Words of a node: ten times its number and a code, its type, three shifts, three turns."""


def read_op2(path: str | Path, *, units: str, deck: str | Path | None, mass_normalized: bool = False) -> ModalModel:
    """Read normal modes of an OP2 file.

    Raises FileFormatError for a damaged file, InputError for a file without real normal modes, or without a deck;
    without the extra `nastran`.
    """
    path, system = Path(path), unit_system(units)
    missing = f"{path}: the elements of an OP2 file are not read: state the deck of these modes by deck"
    geometry = deck_geometry(required(None if deck is None else Path(deck), missing))
    check_installed("pyyeti")
    from pyyeti.nastran.op2 import OP2

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            modes = list(_modes(OP2(str(path)), path))
    except InputError:
        raise
    except Exception as error:  # the reader raises what it meets in a damaged file
        raise FileFormatError(f"{path}: damaged or truncated OP2: {type(error).__name__} {error}") from None
    return modal_model(modes, geometry, system, str(path), mass_normalized=mass_normalized)


def _records(file: Any, name: str) -> Iterator[IntArray]:
    """Yield the records of a table after its header, as whole numbers of the width of the file's words."""
    file.set_position(name)
    file.rdop2nt()
    while (record := file.rdop2record("int")) is not None:
        yield record


def _reals(words: IntArray) -> FloatArray:
    """Return words read as real numbers."""
    kind = np.dtype(f"f{words.dtype.itemsize}").newbyteorder(words.dtype.byteorder)
    return np.ascontiguousarray(words).view(kind).astype(float)


def _modes(file: Any, path: Path) -> Iterator[Mode]:
    known = list(file.dbdct)
    missing = f"{path}: holds no eigenvectors (OUGV1), only {', '.join(known[:12]) or 'nothing'}: request VECTOR = ALL"
    name = required(next((one for one in _VECTORS if one in known), None), missing)
    masses: dict[int, float] = {}
    for table in (one for one in _EIGENVALUES if one in known):
        for record in list(_records(file, table))[1:2]:
            rows = record[: len(record) // _MODE_WORDS * _MODE_WORDS].reshape(-1, _MODE_WORDS)
            masses |= dict(zip(rows[:, 0].tolist(), _reals(rows)[:, 5].tolist(), strict=True))
    subcases = set()
    records = _records(file, name)
    for head in records:
        kind, code, subcase, number = int(head[0]) // 10, int(head[1]), int(head[3]), int(head[4])
        require(
            kind == _NORMAL_MODES and code in _REAL_SORTED and int(head[8]) in (0, 1),
            f"{path}: {name} holds other results than real normal modes: export SOL 103, SORT1",
        )
        subcases.add(subcase)
        require(len(subcases) == 1, f"{path}: modes of subcases {', '.join(map(str, sorted(subcases)))}: export one")
        rows = next(records).reshape(-1, _NODE_WORDS)
        grids = rows[rows[:, 1] == 1]
        frequency = float(np.sqrt(max(_reals(head)[5], 0.0)) / (2 * np.pi))
        yield Mode(frequency, masses.get(number, 0.0), 0.0, grids[:, 0].astype(np.int64) // 10, _reals(grids[:, 2:5]))
