"""Normal modes in a punch file of Nastran or OptiStruct: eigenvectors as text, on the nodes of their deck."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError, InputError, require, required
from nvhchain.fem.modal_model import ModalModel
from nvhchain.interop.modes.assembled import Mode, modal_model
from nvhchain.interop.modes.nastran_geometry import deck_geometry
from nvhchain.interop.notation._texts import damaged
from nvhchain.interop.notation.units import unit_system

_EIGENVALUE = re.compile(r"\$EIGENVALUE\s*=\s*(\S+)\s+MODE\s*=\s*(\d+)")
_WIDTH = 18
"""Characters of a number; node and type stand in the first 18, -CONT- too."""


def read_punch(path: str | Path, *, units: str, deck: str | Path | None, mass_normalized: bool = False) -> ModalModel:
    """Read normal modes of a punch file.

    Raises FileFormatError for a damaged file, InputError for a file without modes, for modes of several subcases,
    without a deck or the modal mass.
    """
    path, system = Path(path), unit_system(units)
    require(
        mass_normalized,
        f"{path}: a punch file states no modal mass: where EIGRL has NORM = MASS, its default, state "
        "mass_normalized = true",
    )
    missing = f"{path}: a punch file has no elements: state the deck of these modes by deck"
    place = required(None if deck is None else Path(deck), missing)
    try:
        with (
            path.open(encoding="utf-8", errors="replace") as file,
            damaged(path, lambda error: f"not a punch file of eigenvectors: {error}"),
        ):
            modes = list(_modes(file, path))
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    require(bool(modes), f"{path}: no $EIGENVECTOR: request VECTOR(PUNCH) = ALL of real modes")
    for number, mode in enumerate(modes, start=1):
        if len(mode.labels) != len(modes[0].labels):
            raise FileFormatError(
                f"{path}: mode {number} has {len(mode.labels)} nodes, the first {len(modes[0].labels)}: the file is "
                "cut off, write it again"
            )
    return modal_model(modes, deck_geometry(place), system, str(path), mass_normalized=True)


def _modes(lines: Iterable[str], path: Path) -> Iterator[Mode]:
    wanted, eigenvalue, subcases = False, 0.0, set[str]()
    labels: list[int] = []
    motion: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        if line.startswith("$"):
            if labels and line.startswith("$TITLE"):
                yield _mode(eigenvalue, labels, motion)
                labels, motion = [], []
            if line.startswith("$TITLE"):
                wanted = False
            elif line.startswith("$EIGENVECTOR"):
                wanted = True
            elif wanted and line.startswith(("$REAL-IMAGINARY", "$MAGNITUDE-PHASE")):
                raise InputError(f"{path}: line {number}: complex modes are not read: export real normal modes")
            elif wanted and line.startswith("$SUBCASE ID"):
                subcases.add(line.split("=")[1].split()[0])
                require(
                    len(subcases) == 1,
                    f"{path}: modes of subcases {', '.join(sorted(subcases))} are there: export one",
                )
            elif wanted and line.startswith("$EIGENVALUE"):
                if labels:
                    yield _mode(eigenvalue, labels, motion)
                    labels, motion = [], []
                found = _EIGENVALUE.match(line)
                if found is None:
                    raise FileFormatError(f"{path}: line {number}: {line.strip()[:60]!r} states no eigenvalue")
                eigenvalue = float(found[1])
        elif wanted and line[10:_WIDTH].strip() == "G":
            labels.append(int(line[:10]))
            motion.append([float(line[_WIDTH * k : _WIDTH * (k + 1)]) for k in (1, 2, 3)])
    if labels:
        yield _mode(eigenvalue, labels, motion)


def _mode(eigenvalue: float, labels: list[int], motion: list[list[float]]) -> Mode:
    frequency = float(np.sqrt(max(eigenvalue, 0.0)) / (2 * np.pi))
    return Mode(frequency, 1.0, 0.0, np.array(labels, dtype=np.int64), np.array(motion))
