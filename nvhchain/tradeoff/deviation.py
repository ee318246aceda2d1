"""Deviation of a sound pressure from its yardstick: overall, per mesh order and at the worst line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from nvhchain import levels
from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray, PressureHistory

REACH = 40.0
"""Level range (dB) below the strongest line of a field point in which lines are compared."""

PARTS = 20
"""Number of equal parts of a run-up whose levels are compared."""

_SAME_LINE = 1e-6
"""Largest relative difference of frequencies that count as one line."""


@dataclass(frozen=True)
class Deviation:
    """Errors (dB) with their sign, at the field point where they are largest.

    overall: error of the level in dB(A).
    worst_line: error of the worst line within `REACH` of the strongest (dB).
    worst_frequency: frequency of this line (Hz).
    orders: error (dB) of every harmonic of a mesh order within `REACH`, by order of the input; empty without gears.

    Raises InputError if an error is not a finite number.
    """

    overall: float
    worst_line: float
    worst_frequency: float
    orders: dict[float, float]

    def __post_init__(self) -> None:
        for error in (self.overall, self.worst_line, *self.orders.values()):
            require(isfinite(error), f"an error of {error} dB is none: measure it again with `nvhchain tradeoff`")

    @property
    def worst_order(self) -> float:
        """Error of the worst mesh harmonic (dB); without gears that of the worst line."""
        return max(self.orders.values(), key=abs) if self.orders else self.worst_line


def deviation(
    pressure: FieldPressure, yardstick: FieldPressure, mesh_orders: Sequence[float] = (), *, reach: float = REACH
) -> Deviation:
    """Compute the errors of a line spectrum of pressure against its yardstick.

    mesh_orders: mesh orders per turn of the input shaft.
    reach: level range (dB) below the strongest line in which lines are compared.
    Returns errors with their sign.

    A line that one of the two lacks is silent there. A line of `pressure` alone counts where it lies within `reach` of
    the yardstick's strongest.
    """
    _check_points(pressure, yardstick)
    require(reach > 0, f"reach = {reach} dB must be positive: lines so far below the strongest are compared")
    for mesh in mesh_orders:
        require(0 < mesh < inf, f"mesh order {mesh} must be positive and finite: it is per turn of the input shaft")
    extra = pressure.frequency[_nearest(yardstick, pressure.frequency)[1]]
    lines = np.sort(np.concatenate([yardstick.frequency, extra]))
    own, right = _pressure_at_lines(pressure, lines), _pressure_at_lines(yardstick, lines)
    size, true = np.abs(own), np.abs(right)
    alone = _nearest(yardstick, lines)[1][:, None]
    loud = np.where(alone, size, true) >= 10 ** (-reach / 20) * true.max(axis=0)
    error = np.where(loud, levels.decibel(size) - levels.decibel(true), 0.0)
    line, point = np.unravel_index(int(np.abs(error).argmax()), error.shape)
    overall = levels.overall(lines, own) - levels.overall(lines, right)
    return Deviation(
        float(overall[np.abs(overall).argmax()]),
        float(error[line, point]),
        float(lines[line]),
        _orders(lines, yardstick.input_speed / (2 * np.pi), error, loud.any(axis=1), mesh_orders),
    )


def _nearest(pressure: FieldPressure, lines: FloatArray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices (n_line,) of the nearest lines of `pressure`, and True where they differ from `lines` (Hz)."""
    nearest = np.searchsorted(0.5 * (pressure.frequency[1:] + pressure.frequency[:-1]), lines)
    return nearest, np.abs(pressure.frequency[nearest] - lines) > _SAME_LINE * lines


def _pressure_at_lines(pressure: FieldPressure, lines: FloatArray) -> ComplexArray:
    """Return the pressure (n_line, n_point) at `lines` (Hz), zero where it has no such line."""
    nearest, missing = _nearest(pressure, lines)
    return np.where(missing[:, None], 0.0, pressure.pressure[nearest])


def _check_points(pressure: FieldPressure | PressureHistory, yardstick: FieldPressure | PressureHistory) -> None:
    """Refuse pressures at different points."""
    here, there = pressure.points, yardstick.points
    require(
        here.shape == there.shape and np.allclose(here, there, rtol=0, atol=1e-9),
        f"pressures at {here.tolist()} m and {there.tolist()} m: compare the same points",
    )


def _orders(
    lines: FloatArray, turns: float, error: FloatArray, loud: np.ndarray, mesh_orders: Sequence[float]
) -> dict[float, float]:
    """Return the error of every loud harmonic of the mesh orders, at its worst point.

    `turns` is the speed of the input shaft (1/s).
    """
    if not turns:
        return {}
    found: dict[float, float] = {}
    for line in np.flatnonzero(loud):
        order = lines[line] / turns
        for mesh in mesh_orders:
            harmonic = round(order / mesh)
            if harmonic >= 1 and abs(order - harmonic * mesh) <= _SAME_LINE * order:
                found[round(harmonic * mesh, 6)] = float(error[line, np.abs(error[line]).argmax()])
    return dict(sorted(found.items()))


def deviation_in_time(pressure: PressureHistory, yardstick: PressureHistory) -> Deviation:
    """Compute the errors of a run-up's pressure against its yardstick.

    Returns errors with their sign, without orders.

    The record is divided into `PARTS` equal parts, and those within `REACH` of the loudest are compared. The worst part
    takes the place of the worst line. The input's turns per second in its middle take the place of the frequency.
    """
    _check_points(pressure, yardstick)
    overall = _equivalent(pressure, 1)[0] - _equivalent(yardstick, 1)[0]
    true = _equivalent(yardstick, PARTS)
    error = np.where(true >= true.max(axis=0) - REACH, _equivalent(pressure, PARTS) - true, 0.0)
    part, point = np.unravel_index(int(np.abs(error).argmax()), error.shape)
    middle = yardstick.input_speed[int((part + 0.5) * len(yardstick.time) / PARTS)]
    return Deviation(
        float(overall[np.abs(overall).argmax()]), float(error[part, point]), float(middle / (2 * np.pi)), {}
    )


def _equivalent(history: PressureHistory, parts: int) -> FloatArray:
    """Return the equivalent level (parts, n_point) in dB(A) of equal parts of a record."""
    rate = (len(history.time) - 1) / float(history.time[-1] - history.time[0])
    return np.array([levels.equivalent(part, sample_rate=rate) for part in np.array_split(history.pressure, parts)])
