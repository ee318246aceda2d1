"""Parts of the difference of two designs: decibels by line, and by mode and path of the loudest lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.chain.result import Result
from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray
from nvhchain.plots.marks import OrderMarks, order_name
from nvhchain.report.causes.mode_pairs import joint_names, renamed
from nvhchain.report.causes.paths import line_parts
from nvhchain.report.run_up import WINDOW_BANDWIDTH, Curve
from nvhchain.spectrum import Waterfall

LINES = 8
"""Largest number of lines that are split into modes and paths."""

PARTS = 11
"""Largest number of modes or paths of a line; the others are one more part."""

NARROW = 0.1
"""Share of the windows of a run-up, at least those of one event, in which sound is named by its speed."""

LEAST_PART = 0.05
"""Least part (dB) that is looked for at one speed."""

EVENT = 4
"""Windows of a run-up that hold one event: they overlap by three quarters."""

SAME_SPEED = 0.01
"""Largest relative difference of speeds of windows that are compared."""

OTHERS = "all others"
"""Name of the part that holds what is not listed."""


@dataclass(frozen=True, eq=False)
class LineDifference:
    """Lines of two designs side by side at one field point.

    order : (n,) order of the input, or frequency (Hz) of a source that does not turn.
    frequency : (n, 2) frequency of the line in both designs (Hz); NaN where a design has no such line.
    pressure : (n, 2) A-weighted pressure in both designs (Pa, peak).
    part : (n,) part of each line in the difference of the overall levels (dB).
    """

    order: FloatArray
    frequency: FloatArray
    pressure: ComplexArray
    part: FloatArray


def line_differences(first: FieldPressure, second: FieldPressure) -> LineDifference:
    """Return the part of every line in the difference of two overall A-weighted levels.

    With the energies E₁ = Σ e₁ and E₂ = Σ e₂, the part of a line is (e₂ − e₁)/M. M = (E₂ − E₁)/(L₂ − L₁) is the
    logarithmic mean times ln 10/10. The parts add up to L₂ − L₁, also where single lines oppose it.
    """
    found: dict[float, list[tuple[float, complex]]] = {}
    turning = min(first.input_speed, second.input_speed) > 0
    for place, field in enumerate((first, second)):
        gain = 10 ** (levels.a_weighting(np.maximum(field.frequency, 1e-3)) / 20)
        key = field.frequency / (field.input_speed / (2 * np.pi)) if turning else field.frequency
        for line, f, p in zip(
            key.tolist(), field.frequency.tolist(), (gain * field.pressure[:, 0]).tolist(), strict=True
        ):
            found.setdefault(round(line, 6), [(np.nan, 0j), (np.nan, 0j)])[place] = (f, p)
    order = np.array(sorted(found))
    frequency = np.array([[f for f, _ in found[line]] for line in order.tolist()])
    pressure = np.array([[p for _, p in found[line]] for line in order.tolist()])
    energy = np.abs(pressure) ** 2
    return LineDifference(order, frequency, pressure, (energy[:, 1] - energy[:, 0]) / _mean(energy.sum(axis=0)))


def _mean(energy: FloatArray) -> float:
    """Return energy per decibel between two energies: their logarithmic mean times ln 10/10."""
    before, after = energy.tolist()
    if min(before, after) <= 0:
        return float("inf")
    if abs(after - before) <= 1e-9 * before:
        return float(before * np.log(10) / 10)
    return float((after - before) / (10 * np.log10(after / before)))


def causes(first: Result, second: Result) -> list[dict[str, Any]]:
    """Return the lines that make most of the difference of two designs, each by modes and paths, for summary.json.

    Empty for run-ups and silent designs. `part_db` of all lines and of `all others` adds up to the difference; so does
    that of the modes, and of the paths, to their line.
    """
    if first.pressure is None or second.pressure is None:
        return []
    found = line_differences(first.pressure, second.pressure)
    if not np.abs(found.part).max(initial=0.0):
        return []
    strongest = np.argsort(-np.abs(found.part), kind="stable")[:LINES]
    names = joint_names(first, second)
    split = [
        _split(run, found.frequency[strongest, place], None if names is None else names[place])
        for place, run in enumerate((first, second))
    ]
    lines: list[dict[str, Any]] = []
    for line in strongest.tolist():
        both = [run_parts.get(float(f), ({}, {})) for run_parts, f in zip(split, found.frequency[line], strict=True)]
        gain = [_gain(f) for f in found.frequency[line]]
        energy = np.abs(found.pressure[line]) ** 2
        scale = found.part[line] / (energy[1] - energy[0]) if energy[1] != energy[0] else 0.0
        kinds = {
            kind: split_difference(
                found.pressure[line],
                [{name: g * p for name, p in each[number].items()} for g, each in zip(gain, both, strict=True)],
                scale,
            )
            for number, kind in enumerate(("paths", "modes"))
        }
        lines.append(
            {
                "order": float(found.order[line]),
                "frequency_hz": _one_frequency(found.frequency[line]),
                "levels_dBA": [float(levels.decibel(p)) if p else None for p in found.pressure[line].tolist()],
                "part_db": float(found.part[line]),
                **kinds,
            }
        )
    rest = float(found.part.sum() - sum(cause["part_db"] for cause in lines))
    return [*lines, {"order": None, "part_db": rest, "lines": len(found.order) - len(lines)}]


def run_up_causes(
    levels_dBA: tuple[float, float], maps: tuple[Waterfall, Waterfall], orders: Sequence[float]
) -> list[dict[str, Any]]:
    """Return the orders that make most of the difference of two run-ups.

    The energy of an order is its A-weighted mean over time; each window lasts ten turns. Where most of the rest lies
    about one speed, such as vibration that a resonance leaves, it is one more part, with `speeds_rpm`.

    levels_dBA : (float, float) equivalent levels of the whole records.
    maps : (Waterfall, Waterfall) waterfalls against order.
    """
    total = REFERENCE_PRESSURE**2 * 10 ** (np.array(levels_dBA) / 10)
    energy = np.array([_order_energies(waterfall, orders).sum(axis=0) for waterfall in maps])
    part = (energy[1] - energy[0]) / _mean(total)
    shown = np.argsort(-np.abs(part), kind="stable")[:LINES]
    found: list[dict[str, Any]] = [
        {
            "order": float(orders[i]),
            "frequency_hz": None,
            "levels_dBA": [float(10 * np.log10(e / REFERENCE_PRESSURE**2)) if e > 0 else None for e in energy[:, i]],
            "part_db": float(part[i]),
        }
        for i in shown.tolist()
    ]
    rest = levels_dBA[1] - levels_dBA[0] - sum(cause["part_db"] for cause in found)
    near = _speed_part(maps, [cause["order"] for cause in found], rest, _mean(total))
    left = {"order": None, "part_db": float(rest - sum(cause["part_db"] for cause in near)), "lines": None}
    return [*sorted([*found, *near], key=lambda cause: -abs(cause["part_db"])), left]


def _speed_part(
    maps: tuple[Waterfall, Waterfall], orders: Sequence[float], rest: float, energy_per_decibel: float
) -> list[dict[str, Any]]:
    """Return the part (dB) of sound outside the orders about one speed; empty where it is less than half of the rest.

    It is at most the rest, as windows do not reach the ends of a record, whose sound then counts too little. Empty for
    different ramps, too.

    energy_per_decibel : energy per decibel of the overall levels (`_mean`).
    """
    if abs(rest) < LEAST_PART or not _same_speeds(*(waterfall.input_speed for waterfall in maps)):
        return []
    before, after = (
        _energies(waterfall).sum(axis=1) / WINDOW_BANDWIDTH - _order_energies(waterfall, orders).sum(1)
        for waterfall in maps
    )
    part = (after - before) / energy_per_decibel
    first, last = _narrowest(np.sign(rest) * part)
    if not 0.5 * abs(rest) <= np.sign(rest) * part[first:last].sum():
        return []
    speeds = sorted(30 / np.pi * maps[1].input_speed[[first, last - 1]])
    where = {"order": None, "speeds_rpm": [float(speed) for speed in speeds], "lines": None}
    return [where | {"part_db": float(np.sign(rest) * min(abs(rest), abs(part[first:last].sum())))}]


def _same_speeds(first: FloatArray, second: FloatArray) -> bool:
    """Return True if the windows of two run-ups have the same speeds."""
    return first.shape == second.shape and bool(np.allclose(first, second, rtol=SAME_SPEED))


def _narrowest(energy: FloatArray) -> tuple[int, int]:
    """Return the first window and the one after the last of the narrow range that holds most of an energy (n,)."""
    count = min(len(energy), max(EVENT, round(NARROW * len(energy))))
    inside = np.convolve(energy, np.ones(count), "valid")
    first = int(inside.argmax())
    large = first + np.flatnonzero(energy[first : first + count] >= NARROW * inside.max())
    return (int(large[0]), int(large[-1]) + 1) if len(large) else (first, first + count)


def named_or_lasting(curves: Sequence[Curve], maps: Sequence[Waterfall], marks: OrderMarks) -> list[float]:
    """Return the orders of curves that gears make or that last: vibration near one speed is none, unless no gear is."""
    orders = [curve.order for curve in curves if curve.order is not None]
    return [
        order
        for order in orders
        if not marks.mesh or order_name(order, marks.mesh, marks.slots) or _lasting(maps, order)
    ]


def _lasting(maps: Sequence[Waterfall], order: float) -> bool:
    """Return False for an order with most of its energy about one speed in all maps."""
    for waterfall in maps:
        energy = _order_energies(waterfall, [order])[:, 0]
        first, last = _narrowest(energy)
        if energy[first:last].sum() < 0.5 * energy.sum():
            return True
    return False


def _order_energies(waterfall: Waterfall, orders: Sequence[float]) -> FloatArray:
    """Return what every window adds to the A-weighted mean square of orders (n_window, n)."""
    return _energies(waterfall, np.array([np.abs(waterfall.axis - order).argmin() for order in orders], dtype=int))


def _energies(waterfall: Waterfall, lines: Any = slice(None)) -> FloatArray:
    """Return what every window adds to the A-weighted mean square (n_window, n) of lines over the time of a run-up."""
    turns = waterfall.input_speed / (2 * np.pi)
    gain = 10 ** (levels.a_weighting(np.maximum(np.outer(turns, waterfall.axis[lines]), 1e-3)) / 10)
    seconds = 1.0 / np.maximum(turns, 1e-9)
    return np.asarray(seconds[:, None] / seconds.sum() * 0.5 * np.abs(waterfall.amplitude[:, lines]) ** 2 * gain)


def split_difference(
    pressure: ComplexArray, parts: Sequence[Mapping[str, complex | ComplexArray]], scale: float
) -> list[dict[str, Any]]:
    """Return the parts of a line's difference: modes or paths, and what they leave.

    |p₂|² − |p₁|² = Σ Re((p₂ᵢ − p₁ᵢ)(p₂ + p₁)*), for any phases; an order of a run-up sums this over its speeds.

    pressure : (2,) or (2, n_speed) pressure of the line in both designs.
    """
    names = list(dict.fromkeys([*parts[0], *parts[1]]))
    if not names:
        return []
    pressure = pressure.reshape(2, -1)
    none = np.zeros(pressure.shape[1], complex)
    both = np.array([[np.atleast_1d(design.get(name, none)) for design in parts] for name in names])
    part = scale * ((both[:, 1] - both[:, 0]) * np.conj(pressure.sum(axis=0))).real.sum(axis=1)
    chosen = np.argsort(-np.abs(part), kind="stable")[:PARTS]
    total = scale * float((np.abs(pressure[1]) ** 2 - np.abs(pressure[0]) ** 2).sum())
    size = np.sqrt((np.abs(both) ** 2).mean(axis=2))
    listed = [{"name": names[i], "part_db": float(part[i]), "pressure_Pa": size[i].tolist()} for i in chosen]
    return [*listed, {"name": OTHERS, "part_db": total - float(part[chosen].sum())}]


def _split(
    run: Result, frequency: FloatArray, names: Mapping[str, str] | None
) -> dict[float, tuple[dict[str, complex], dict[str, complex]]]:
    """Return frequency (Hz) → paths and modes with their pressure at the first field point; empty without operators.

    names : names of modes → names in the comparison; None to leave out the modes.
    """
    lines = np.unique(frequency[np.isfinite(frequency) & (frequency > 0)])
    pressure, forces, housing, vectors = run.pressure, run.force_spectrum, run.housing, run.transfer_vectors
    if pressure is None or forces is None or housing is None or vectors is None or not len(lines):
        return {}
    parts = line_parts(pressure, forces, housing, vectors, lines, fidelity=run.fidelity.acoustics)
    if parts is None:
        return {}
    parts = parts[0], renamed(parts[1], names or {})
    paths, modes = (
        [dict(zip(contributions.names, line.tolist(), strict=True)) for line in contributions.pressure[:, 0]]
        for contributions in parts
    )
    return {float(f): (paths[i], {} if names is None else modes[i]) for i, f in enumerate(lines)}


def _one_frequency(frequency: FloatArray) -> float | None:
    """Return the frequency (Hz) of a line; None where designs of different speeds have it at two frequencies."""
    known = frequency[np.isfinite(frequency)]
    return float(known.max()) if np.ptp(known) <= 1e-6 * known.max() else None


def _gain(frequency: float) -> float:
    """Return the A-weighting as a factor; 0 for no line."""
    return float(10 ** (levels.a_weighting(frequency) / 20)) if frequency > 0 else 0.0
