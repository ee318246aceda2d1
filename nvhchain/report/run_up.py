"""Run-ups: waterfalls, curves over speed, and orders that matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain import levels
from nvhchain.error_band import RunUpBand
from nvhchain.error_band.band import SILENT_LEVEL
from nvhchain.handoff import BearingForces, FloatArray, PressureHistory
from nvhchain.plots.marks import OrderMarks, order_name
from nvhchain.spectrum import Waterfall, order_cut, order_waterfall, waterfall

ORDER_RESOLUTION = 0.15
"""Orders of the input that figures and order cuts resolve: windows of ten turns."""

HARMONICS = 4
"""Least number of harmonics of the highest mesh order in maps of orders."""

MAIN_ORDERS = 8
"""Largest number of orders that are followed over speed."""

LEAST_RANGE = 20.0
"""Range (dB) below the strongest order within which an order is followed."""

SAME_SPEED = 0.02
"""Relative range of speeds that figures over speed need."""

WINDOW_BANDWIDTH = 1.5
"""Noise bandwidth of a Hann window in lines.

The summed energy of amplitude-corrected lines is too high by this factor.
"""


@dataclass(frozen=True, eq=False)
class Curve:
    """Level over speed.

    speed : (n,) input speed (rad/s).
    level : (n,) level.
    order : order of the input; None for the overall level.
    """

    name: str
    unit: str
    speed: FloatArray
    level: FloatArray
    order: float | None = None


def curve_title(curve: Curve) -> str:
    """Return name and unit of a curve."""
    return f"{curve.name}, {curve.unit}"


def loudest(cuts: Sequence[Curve]) -> tuple[float, float]:
    """Return the order of the cut that is loudest in dB(A), and its speed (rad/s) there."""
    found: list[tuple[float, float, float]] = []
    for cut in cuts:
        assert cut.order is not None
        weighted = cut.level + levels.a_weighting(np.maximum(cut.order * cut.speed / (2 * pi), 1e-3))
        peak = int(weighted.argmax())
        found.append((float(weighted[peak]), cut.order, float(cut.speed[peak])))
    return max(found)[1:]


def run_up_maps(
    histories: Mapping[str, PressureHistory], marks: OrderMarks, *, high: float
) -> dict[str, tuple[Waterfall, Waterfall]]:
    """Return the waterfalls of the first field point against frequency up to `high` (Hz), and against order.

    Orders reach to those that stay below `high` up to the mean speed, for half of a steady run-up. The maps against
    order have one axis, also those of different ramps: the coarsest resolution and the highest order of all.
    """
    signals = {
        name: (history.pressure[:, 0], sample_rate(history), history.input_speed) for name, history in histories.items()
    }
    highest = max((_highest_order(history, marks, high) for history in histories.values()), default=0.0)
    resolution = max((_order_resolution(*signal) for signal in signals.values()), default=0.0)
    return {
        name: (
            input_frequency_waterfall(*signal, high=high),
            input_order_waterfall(*signal, high=highest, resolution=resolution),
        )
        for name, signal in signals.items()
    }


def _highest_order(history: PressureHistory, marks: OrderMarks, high: float) -> float:
    """Return the highest order of the map of a run-up."""
    turns = float(history.input_speed.mean()) / (2 * pi)
    highest = max(HARMONICS * max(marks.mesh.values(), default=20.0), high / max(turns, 1e-9))
    return min(highest, high / max(float(history.input_speed.min()) / (2 * pi), 1e-9))


def curves_of(maps: Mapping[str, tuple[Waterfall, Waterfall]], marks: OrderMarks) -> dict[str, list[Curve]]:
    """Return the curves over speed from the maps against frequency and order."""
    order_maps = [order_map for _, order_map in maps.values()]
    orders = main_orders(order_maps, marks)
    return {
        name: [_overall(frequency_map), *_cuts(order_map, orders, marks)]
        for name, (frequency_map, order_map) in maps.items()
    }


def main_orders(maps: Sequence[Waterfall], marks: OrderMarks) -> list[float]:
    """Return the orders with most A-weighted energy over the run-up in any of the maps, in rising order.

    An order is a line of the maps that is stronger than its neighbours within the width of a window's main lobe. Mesh
    orders and their sidebands come first: peaks between them are mostly vibration at a natural frequency.
    """
    axis = maps[0].axis
    energy = np.zeros(len(axis))
    for order_map in maps:
        weight = 10 ** (levels.a_weighting(np.outer(order_map.input_speed / (2 * pi), axis)) / 10)
        energy = np.maximum(energy, (np.abs(order_map.amplitude) ** 2 * weight).mean(axis=0))
    energy[:3] = 0.0  # the mean and its leakage
    found: list[float] = []
    for line in np.argsort(-energy):
        if not energy[line] > 10 ** (-LEAST_RANGE / 10) * energy.max():
            break
        if energy[line] == energy[max(line - 2, 0) : line + 3].max():
            found += _snap_to_harmonics([float(axis[line])], axis, marks)
    named = [order for order in dict.fromkeys(found) if order_name(order, marks.mesh, marks.slots)]
    return sorted(list(dict.fromkeys([*named, *found]))[:MAIN_ORDERS])


def _snap_to_harmonics(orders: Sequence[float], axis: FloatArray, marks: OrderMarks) -> list[float]:
    """Return orders in which those within the resolution of a mesh harmonic are this harmonic, if it is a line."""
    found = set()
    for order in orders:
        harmonics = [max(round(order / mesh), 1) * mesh for mesh in marks.mesh.values()]
        nearest = min(harmonics, key=lambda harmonic: abs(harmonic - order), default=order)
        is_line = np.abs(axis - nearest).min() < 1e-6 * nearest
        found.add(nearest if is_line and abs(nearest - order) <= ORDER_RESOLUTION else order)
    return sorted(found)


def run_up_summary(history: PressureHistory, curves: Sequence[Curve]) -> dict[str, Any]:
    """Return speeds and duration, the equivalent level of the whole record and the highest level of every curve."""
    return {
        "duration_s": float(history.time[-1] - history.time[0]),
        "start_speed_rpm": 30 / pi * float(history.input_speed[0]),
        "end_speed_rpm": 30 / pi * float(history.input_speed[-1]),
        "overall_dBA": float(levels.equivalent(history.pressure[:, 0], sample_rate=sample_rate(history))),
        "highest": {
            curve_title(curve): {
                "level_db": float(curve.level.max()),
                "speed_rpm": 30 / pi * float(curve.speed[curve.level.argmax()]),
            }
            for curve in curves
        },
    }


def constant_speed(speed: ArrayLike) -> bool:
    """Return True if the means of tenths of a record differ by less than `SAME_SPEED`."""
    means = [part.mean() for part in np.array_split(np.asarray(speed, dtype=float), 10) if len(part)]
    return bool(means) and bool(np.ptp(means) < SAME_SPEED * np.mean(means))


def window_levels(
    history: PressureHistory, band: RunUpBand, *, high: float, place: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return input speed (n,) rad/s, level (n,) dB(A) and its limits (n, 2) dB(A) in the windows of a run-up.

    These are the levels of the curve over speed, up to `high` (Hz). A window is as far from its limits as the part of
    the band that it lies in. Records at constant speed have the levels of these parts.
    """
    parts, limits = band.speed_levels[:, place], band.limits[:, place]
    if constant_speed(history.input_speed):
        return band.input_speed, parts, limits
    windows = input_frequency_waterfall(
        history.pressure[:, place], sample_rate(history), history.input_speed, high=high
    )
    level = _overall(windows).level
    with np.errstate(invalid="ignore"):
        offsets = np.where(parts[:, None] > SILENT_LEVEL, limits - parts[:, None], [-np.inf, 0.0])
    part_index = (windows.time / float(history.time[-1] - history.time[0]) * len(parts)).astype(int)
    return windows.input_speed, level, level[:, None] + offsets[np.minimum(part_index, len(parts) - 1)]


def input_frequency_waterfall(signal: FloatArray, rate: float, input_speed: FloatArray, *, high: float) -> Waterfall:
    """Return the waterfall of `signal` (n_t, …), sampled at `rate` (Hz), up to `high` (Hz).

    The input turns ten times in a window at the mean of `input_speed` (n_t,) rad/s.  A window covers at most half the
    record.
    """
    turns = float(input_speed.mean()) / (2 * pi)
    resolution = max(ORDER_RESOLUTION * turns, 3.0 * rate / len(signal))
    return waterfall(signal, sample_rate=rate, input_speed=input_speed, resolution=resolution, high=high)


def input_order_waterfall(
    signal: FloatArray, rate: float, input_speed: FloatArray, *, high: float, resolution: float | None = None
) -> Waterfall:
    """Return the waterfall of `signal` (n_t, …) against order of the input, up to order `high`.

    The input turns ten times in every window.  A window covers at most half the record.

    resolution : coarser resolution (orders), with fewer turns in a window.
    """
    resolution = resolution or _order_resolution(signal, rate, input_speed)
    return order_waterfall(signal, sample_rate=rate, input_speed=input_speed, resolution=resolution, high=high)


def _order_resolution(signal: FloatArray, rate: float, input_speed: FloatArray) -> float:
    """Return the orders that the windows of a record resolve."""
    turned = float(input_speed.mean()) / (2 * pi) * (len(signal) - 1) / rate
    return max(ORDER_RESOLUTION, 3.0 / turned)


def sample_rate(record: PressureHistory | BearingForces) -> float:
    """Return the sample rate (Hz) of a record."""
    return (len(record.time) - 1) / float(record.time[-1] - record.time[0])


def _overall(frequency_map: Waterfall) -> Curve:
    """Return the A-weighted level of all lines."""
    lines = frequency_map.amplitude[:, 1:].T / np.sqrt(WINDOW_BANDWIDTH)
    return Curve("overall", "dB(A)", frequency_map.input_speed, levels.overall(frequency_map.axis[1:], lines))


def _cuts(order_map: Waterfall, orders: Sequence[float], marks: OrderMarks) -> list[Curve]:
    if not orders:
        return []
    cuts = levels.decibel(order_cut(order_map, orders))
    found = []
    for order, cut in zip(orders, cuts.T, strict=True):
        origin = order_name(order, marks.mesh, marks.slots)
        name = f"order {order:.4g}" + (f" ({origin})" if origin else "")
        found.append(Curve(name, "dB", order_map.input_speed, cut, order))
    return found
