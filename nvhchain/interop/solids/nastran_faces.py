"""Faces in Nastran bulk data: shells without their properties."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.fem.mesh_files.contents import NODES, Damaged, MeshFile, Numbering, clip
from nvhchain.interop.solids.nastran_cards import cards, real, split_deck

NASTRAN_ENDINGS = (".bdf", ".nas", ".dat", ".fem")
"""Suffixes of bulk data."""

_FACES = {
    "CTRIA3": "triangle", "CTRIAR": "triangle", "CTRIA6": "triangle6", "CQUAD4": "quad", "CQUADR": "quad",
    "CQUAD8": "quad8",
}  # fmt: skip


def read_nastran_faces(path: Path) -> MeshFile:
    """Read grid points and shells; FileFormatError for a damaged file or points in local coordinate systems."""
    try:
        return _faces(path).checked()
    except (ValueError, IndexError, OverflowError) as error:
        why = str(error)
    raise FileFormatError(f"{path}: not bulk data of Nastran with shells ({why}): export it again") from None


def _faces(path: Path) -> MeshFile:
    labels: list[int] = []
    points: list[list[float]] = []
    found: dict[str, list[list[int]]] = {}
    for name, *fields in cards(split_deck(path)[1]):
        try:
            if name == "GRID":
                row = [*fields, "", "", "", "", ""]
                if row[1] not in ("", "0"):
                    raise Damaged(f"GRID {row[0]} lies in system {clip(row[1])}: write it in the basic one")
                labels.append(int(row[0]))
                points.append([real(field or "0") for field in row[2:5]])
            elif name in _FACES:
                found.setdefault(_FACES[name], []).append(
                    [int(field) for field in fields[2 : 2 + NODES[_FACES[name]]] if field]
                )
        except Damaged:
            raise
        except (ValueError, IndexError):
            raise Damaged(f"{name} {clip(' '.join(fields))} has fields that are no numbers, or too few") from None
    index = Numbering(np.array(labels, dtype=np.int64))
    cells = []
    for kind, rows in found.items():
        short_rows = [row for row in rows if len(row) != NODES[kind]]
        if short_rows:
            raise Damaged(f"a shell of kind {kind} has {len(short_rows[0])} of {NODES[kind]} grid points")
        cells.append((kind, index(rows, f"shells of kind {kind}")))
    return MeshFile(np.array(points, dtype=float).reshape(-1, 3), cells)
