"""Matrix whose rows and columns are motions of nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.errors import InputError

Unknown = tuple[int, int]
"""Node and component 1 … 6; component 0 for a modal coordinate."""

MOST_UNKNOWNS = 20_000
"""Largest number of rows and columns: 3.2 GB of a full matrix."""


@dataclass(frozen=True, eq=False)
class LabelledMatrix:
    """Matrix of a file.

    rows, columns : motions; None where the file does not name them.
    values : (n, m) entries, real or complex.
    """

    name: str
    rows: tuple[Unknown, ...] | None
    columns: tuple[Unknown, ...] | None
    values: np.ndarray

    def arranged(self, rows: Sequence[Unknown], columns: Sequence[Unknown]) -> np.ndarray:
        """Return the entries for these unknowns, zero for those that the matrix does not have."""
        values = self.values
        for axis, (own, wanted) in enumerate(((self.rows, rows), (self.columns, columns))):
            if own is None:
                continue
            place = {unknown: i for i, unknown in enumerate(own)}
            found = np.array([place.get(unknown, -1) for unknown in wanted])
            values = np.where(
                np.expand_dims(found >= 0, 1 - axis), np.take(values, np.maximum(found, 0), axis=axis), 0.0
            )
        return values


def check_size(source: str, name: str, count: int) -> None:
    """Raise InputError for a matrix that is too large to be a reduced one."""
    if count > MOST_UNKNOWNS:
        raise InputError(
            f"{source}: matrix {name} has {count} unknowns, {MOST_UNKNOWNS} are admitted: reduce it to its seats and "
            "modes first"
        )
