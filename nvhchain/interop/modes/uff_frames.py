"""Coordinate systems of universal files, in which nodes move: datasets 18 and 2420."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from nvhchain.errors import InputError
from nvhchain.handoff import FloatArray

_ALIKE = 1e-6
"""Largest difference between entries of a matrix and its transpose that are equal."""


def frames_of(kind: int, rows: list[list[str]]) -> Iterator[tuple[int, FloatArray | None]]:
    """Yield number and axes (3, 3), as columns, of the systems of a dataset 18 or 2420; None for those not read.

    rows : words of the lines.

    Cylindrical and spherical systems are not read. Programs disagree whether rows or columns of the matrix in dataset
    2420 are the axes: a matrix is read where it equals its transpose.
    """
    if kind == 18:
        i = 0
        while i < len(rows):
            numbers, values = [int(word) for word in rows[i][:3]], list[float]()
            i += 2
            while len(values) < 9:
                values += [float(word.replace("D", "E")) for word in rows[i]]
                i += 1
            origin, axis, plane = np.array(values[:9]).reshape(3, 3)
            yield numbers[0], _axes(axis - origin, plane - origin) if numbers[1:] == [0, 0] else None
        return
    for i in range(2, len(rows) - 5, 6):
        number, system = int(rows[i][0]), int(rows[i][1])
        matrix = np.array([[float(word.replace("D", "E")) for word in row[:3]] for row in rows[i + 2 : i + 5]])
        alike = bool(np.abs(matrix - matrix.T).max() < _ALIKE)
        yield number, matrix if system == 0 and alike else None


def _axes(axis: FloatArray, plane: FloatArray) -> FloatArray:
    """Return axes as columns: x along the first vector, z in the plane of both."""
    x = axis / np.linalg.norm(axis)
    y = np.cross(plane, x)
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def axes_of(system: int, node: int, frames: Mapping[int, FloatArray | None], path: str) -> FloatArray:
    """Return the axes of a system; InputError if it is missing or not read."""
    axes = frames.get(system)
    if axes is None:
        why = "turned or curved in a way that is not read" if system in frames else "not defined"
        raise InputError(
            f"{path}: node {node} moves in its own system {system}, which is {why}: export displacements in the "
            "global one"
        )
    return axes
