"""How far a sound pressure is from its yardstick: overall, per mesh order and at the worst line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain import levels
from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray, PressureHistory

REACH = 40.0
"""dB below the strongest line of a field point down to which lines are compared."""

PARTS = 20
"""Equal parts of a run-up whose levels are compared."""

_SAME_LINE = 1e-6
"""Relative difference of frequencies that are one line."""


@dataclass(frozen=True)
class Deviation:
    """Errors in dB, with their sign, at the field point where they are largest.

    overall: of the level in dB(A).  worst_line: of the worst line within `REACH` of the strongest, at worst_frequency
    (Hz).  orders: harmonic of a mesh order → error, where it is within `REACH`; empty without gears.
    """

    overall: float
    worst_line: float
    worst_frequency: float
    orders: dict[float, float]

    @property
    def worst_order(self) -> float:
        """Error of the worst mesh harmonic, dB; that of the worst line where there are no gears."""
        return max(self.orders.values(), key=abs) if self.orders else self.worst_line


def deviation(
    pressure: FieldPressure, yardstick: FieldPressure, mesh_orders: Sequence[float] = (), *, reach: float = REACH
) -> Deviation:
    """Errors of `pressure` against `yardstick` at the same points.

    mesh_orders: per turn of the input shaft.  Lines of the yardstick that `pressure` lacks count as silent there.
    Raises InputError for other points.
    """
    require(
        np.allclose(pressure.points, yardstick.points, rtol=0, atol=1e-9),
        f"pressures at {pressure.points.tolist()} m and {yardstick.points.tolist()} m: compare the same points",
    )
    values = at_lines(pressure, yardstick.frequency)
    size, true = np.abs(values), np.abs(yardstick.pressure)
    loud = true >= 10 ** (-reach / 20) * true.max(axis=0)
    error = np.where(loud, levels.decibel(size) - levels.decibel(true), 0.0)
    line, point = np.unravel_index(int(np.abs(error).argmax()), error.shape)
    overall = levels.overall(yardstick.frequency, values) - levels.overall(yardstick.frequency, yardstick.pressure)
    return Deviation(
        float(overall[np.abs(overall).argmax()]),
        float(error[line, point]),
        float(yardstick.frequency[line]),
        _orders(yardstick, error, loud.any(axis=1), mesh_orders),
    )


def at_lines(pressure: FieldPressure, lines: FloatArray) -> ComplexArray:
    """Pressure (n_line, n_point) at `lines` (Hz), zero where it has no such line."""
    nearest = np.searchsorted(0.5 * (pressure.frequency[1:] + pressure.frequency[:-1]), lines)
    there = np.abs(pressure.frequency[nearest] - lines) <= _SAME_LINE * lines
    return np.where(there[:, None], pressure.pressure[nearest], 0.0)


def _orders(
    yardstick: FieldPressure, error: FloatArray, loud: np.ndarray, mesh_orders: Sequence[float]
) -> dict[float, float]:
    """Error of every loud harmonic of the mesh orders, at its worst point."""
    turns = yardstick.input_speed / (2 * np.pi)
    if not turns:
        return {}
    found: dict[float, float] = {}
    for line in np.flatnonzero(loud):
        order = yardstick.frequency[line] / turns
        for mesh in mesh_orders:
            harmonic = round(order / mesh)
            if harmonic >= 1 and abs(order - harmonic * mesh) <= _SAME_LINE * order:
                found[round(harmonic * mesh, 6)] = float(error[line, np.abs(error[line]).argmax()])
    return dict(sorted(found.items()))


def deviation_in_time(pressure: PressureHistory, yardstick: PressureHistory) -> Deviation:
    """As `deviation`, of a run-up.

    The worst of `PARTS` equal parts of the record within `REACH` of the loudest takes the place of the worst line, and
    the input's turns per second in its middle that of the frequency.  Raises InputError for other points.
    """
    require(
        np.allclose(pressure.points, yardstick.points, rtol=0, atol=1e-9),
        f"pressures at {pressure.points.tolist()} m and {yardstick.points.tolist()} m: compare the same points",
    )
    overall = _equivalent(pressure, 1)[0] - _equivalent(yardstick, 1)[0]
    true = _equivalent(yardstick, PARTS)
    error = np.where(true >= true.max(axis=0) - REACH, _equivalent(pressure, PARTS) - true, 0.0)
    part, point = np.unravel_index(int(np.abs(error).argmax()), error.shape)
    middle = yardstick.input_speed[int((part + 0.5) * len(yardstick.time) / PARTS)]
    return Deviation(
        float(overall[np.abs(overall).argmax()]), float(error[part, point]), float(middle / (2 * np.pi)), {}
    )


def _equivalent(history: PressureHistory, parts: int) -> FloatArray:
    """Equivalent level (parts, n_point) in dB(A) of equal parts of a record."""
    rate = (len(history.time) - 1) / float(history.time[-1] - history.time[0])
    return np.array([levels.equivalent(part, sample_rate=rate) for part in np.array_split(history.pressure, parts)])
