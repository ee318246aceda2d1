"""Text matrices of Abaqus and CalculiX (.mtx): linear user elements, or lines of row, column and value."""

from __future__ import annotations

from math import isqrt
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError, require
from nvhchain.interop.matrices.labelled import LabelledMatrix, Unknown, check_size
from nvhchain.interop.notation._texts import damaged, text_lines
from nvhchain.interop.solids.abaqus_keywords import real


def read_abaqus_matrices(path: Path) -> dict[str, LabelledMatrix]:
    """Return the matrices of a file: `STIFFNESS`, `MASS`, … of a user element, or one by the name of the file.

    Raises FileFormatError for a damaged file.
    """
    lines = text_lines(path)
    element = any(line.lstrip().upper().startswith("*USER ELEMENT") for line in lines)
    with damaged(path, lambda error: f"not a text matrix of Abaqus: {error}"):
        found = (_user_element if element else _coordinates)(path, lines)
    return found


def _cells(line: str) -> list[str]:
    return [cell for cell in line.replace(",", " ").split() if cell]


def _user_element(path: Path, lines: list[str]) -> dict[str, LabelledMatrix]:
    nodes: list[int] = []
    freedoms: list[tuple[int, list[int]]] = []
    numbers: dict[str, list[float]] = {}
    place = ""
    for line in lines:
        upper = line.strip().upper()
        if upper.startswith("**"):
            if "ELEMENT NODES" in upper:
                place = "nodes"
            elif place == "nodes" and (cells := _cells(upper.lstrip("*"))) and cells[0].lstrip("-").isdigit():
                nodes += [int(cell) for cell in cells]
        elif upper.startswith("*USER ELEMENT"):
            place = "freedoms"
        elif upper.startswith("*MATRIX"):
            kind = upper.partition("TYPE=")[2].split(",")[0].strip()
            require(bool(kind), f"{path}: *MATRIX without TYPE")
            place = kind
            numbers[kind] = []
        elif upper.startswith("*"):
            place = ""
        elif place in ("freedoms", "nodes") and upper:
            stated = [int(cell) for cell in _cells(upper)]
            freedoms.append((1, stated) if not freedoms else (stated[0], stated[1:]))
        elif place in numbers:
            numbers[place] += [real(cell) for cell in _cells(upper)]
    require(bool(nodes), f"{path}: states no nodes (** ELEMENT NODES)")
    require(bool(freedoms) and bool(numbers), f"{path}: a user element without degrees of freedom or *MATRIX")
    unknowns: list[Unknown] = []
    starts = dict(freedoms)
    current: list[int] = []
    for position, node in enumerate(nodes, start=1):
        current = starts.get(position, current)
        # internal nodes of retained modes have numbers below 1
        unknowns += [(node, component if node > 0 else 0) for component in current]
    if len(set(unknowns)) < len(unknowns):
        raise FileFormatError(f"{path}: a node has the same degree of freedom twice")
    check_size(str(path), "STIFFNESS", len(unknowns))
    return {kind: _matrix(path, kind, tuple(unknowns), np.array(values)) for kind, values in numbers.items()}


def _matrix(path: Path, kind: str, unknowns: tuple[Unknown, ...], values: np.ndarray) -> LabelledMatrix:
    """Return a matrix given by columns, of which a symmetric one has the upper triangle."""
    n = len(unknowns)
    if len(values) == n * n and n > 1:
        full = values.reshape(n, n).T
    else:
        size = isqrt(2 * len(values))
        require(
            len(values) == n * (n + 1) // 2,
            f"{path}: *MATRIX, TYPE={kind} has {len(values)} numbers, those of {size} unknowns; {n} are stated",
        )
        full = np.zeros((n, n))
        rows, columns = np.tril_indices(n)
        full[columns, rows] = full[rows, columns] = values
    return LabelledMatrix(kind, unknowns, unknowns, full)


def _coordinates(path: Path, lines: list[str]) -> dict[str, LabelledMatrix]:
    """Return the matrix of lines `node, component, node, component, value`, of which one triangle may be given."""
    rows = [_cells(line) for line in lines if line.strip() and not line.lstrip().startswith("*")]
    require(bool(rows), f"{path}: holds no matrix")
    wrong = next((row for row in rows if len(row) != 5), None)
    if wrong is not None:
        raise FileFormatError(
            f"{path}: {' '.join(wrong)[:60]!r} is not node, component, node, component, value: use FORMAT=MATRIX "
            "INPUT or LABELS"
        )
    entries = [((int(a), int(b)), (int(c), int(d)), real(value)) for a, b, c, d, value in rows]
    unknowns = tuple(dict.fromkeys(row for row, _, _ in entries))
    check_size(str(path), path.stem, len(unknowns))
    index = {unknown: i for i, unknown in enumerate(unknowns)}
    require(
        all(column in index for _, column, _ in entries),
        f"{path}: a column has no row: write one triangle with its diagonal, or all",
    )
    full, given = np.zeros((len(unknowns),) * 2), np.zeros((len(unknowns),) * 2, dtype=bool)
    for row, column, value in entries:
        full[index[row], index[column]], given[index[row], index[column]] = value, True
    full = np.where(given, full, full.T)
    labels = tuple((node, component if node > 0 else 0) for node, component in unknowns)
    return {path.stem.upper(): LabelledMatrix(path.stem.upper(), labels, labels, full)}
