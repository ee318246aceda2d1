"""DMIG matrices of Nastran bulk data: symmetric, square or rectangular, real or complex."""

from __future__ import annotations

import cmath
from math import radians
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError, require
from nvhchain.interop.matrices.labelled import LabelledMatrix, Unknown, check_size
from nvhchain.interop.notation._texts import damaged
from nvhchain.interop.solids.nastran_cards import cards, real, split_deck

_SQUARE, _SYMMETRIC, _NUMBERED_COLUMNS = (1, 2), 6, 9
"""Forms of a matrix; columns of the last are numbers."""

Entry = tuple[Unknown, Unknown, complex]


def read_dmig(path: Path) -> dict[str, LabelledMatrix]:
    """Return all DMIG of a file by name.

    Raises FileFormatError for a damaged file, InputError for a form that is not read.
    """
    heads: dict[str, tuple[int, bool, bool, int]] = {}
    entries: dict[str, list[Entry]] = {}
    with damaged(path, lambda error: f"damaged DMIG: {error}"):
        for card in cards(split_deck(path)[1]):
            if card[0] != "DMIG":
                continue
            field = [*card, *[""] * 9]
            name = field[1].upper()
            if field[2] == "0" and name not in heads:
                form, kind = int(field[3]), int(field[4])
                known = form in (*_SQUARE, _SYMMETRIC, _NUMBERED_COLUMNS)
                require(known, f"{path}: DMIG {name} has form {form}: 1, 6 and 9 are read")
                heads[name], entries[name] = (form, kind > 2, field[6] == "1", int(field[8] or 0)), []
                continue
            if name not in heads:
                raise FileFormatError(f"{path}: DMIG {name} has entries before its header")
            entries[name] += _column(card, *heads[name][:3])
    require(bool(heads), f"{path}: holds no DMIG")
    return {name: _matrix(path, name, heads[name], entries[name]) for name in heads}


def _column(card: list[str], form: int, is_complex: bool, polar: bool) -> list[Entry]:
    """Return the entries of one column: quadruples of node, component, A and B."""
    column = int(card[2]), 0 if form == _NUMBERED_COLUMNS else int(card[3] or 0)
    found: list[Entry] = []
    for place in range(5, len(card), 4):
        node, component, first, second = [*card[place : place + 4], "", "", ""][:4]
        if not node:
            continue
        value: complex = real(first)
        if is_complex:
            second_value = real(second) if second else 0.0
            value = cmath.rect(abs(value), radians(second_value)) if polar else complex(value.real, second_value)
        found.append(((int(node), int(component or 0)), column, value))
    return found


def _matrix(path: Path, name: str, head: tuple[int, bool, bool, int], entries: list[Entry]) -> LabelledMatrix:
    form, is_complex, _, count = head
    require(bool(entries), f"{path}: DMIG {name} has no entries")
    rows = tuple(sorted({row for row, _, _ in entries}))
    columns = tuple(sorted({column for _, column, _ in entries}))
    if form != _NUMBERED_COLUMNS:
        rows = columns = tuple(sorted({*rows, *columns}))
    else:
        check_size(str(path), name, max(count, columns[-1][0]))
        columns = tuple((number, 0) for number in range(1, max(count, columns[-1][0]) + 1))
    check_size(str(path), name, max(len(rows), len(columns)))
    row_index, column_index = ({unknown: i for i, unknown in enumerate(own)} for own in (rows, columns))
    values = np.zeros((len(rows), len(columns)), dtype=complex if is_complex else float)
    for row, column, value in entries:
        values[row_index[row], column_index[column]] = value if is_complex else value.real
        if form == _SYMMETRIC:
            values[column_index[column], row_index[row]] = values[row_index[row], column_index[column]]
    return LabelledMatrix(name, rows, None if form == _NUMBERED_COLUMNS else columns, values)
