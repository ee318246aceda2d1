"""Run-ups: levels over speed, order cuts and waterfalls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.handoff import BearingForces, FloatArray
from nvhchain.handoff.accuracy import CONTACT_LOSS
from nvhchain.report.page.blocks import (
    Figure,
    Text,
    axes,
    colour_scale,
    curve,
    grid,
    heat_map,
    label,
    packed,
    panel,
    rounded,
    shade,
    symbol,
)  # fmt: skip
from nvhchain.report.page.sections.lines.octaves import octave_figure
from nvhchain.report.run_up import Curve, constant_speed
from nvhchain.report.stored import Stored, StoredRun
from nvhchain.spectrum import Waterfall

TITLE = "Run-up"

LINES, SPEEDS = 420, 200
"""Largest numbers of lines and speeds of a map; of more, the strongest of neighbours is drawn."""

MARKED = 30
"""Largest number of points of a curve that are marked."""

RANGE = 60.0
"""Range (dB) of the colours and of order cuts."""


def blocks(stored: Stored) -> list[Any]:
    """Return levels over speed, order cuts, and waterfalls against frequency and order."""
    heard = stored.having(lambda run: run.pressure_history)
    if not heard:
        return []
    maps = stored.run_up_maps
    curves = stored.curves
    numbers = {run.name: number for number, run, _ in heard}
    note = (
        f"Sound at {stored.runs[0].point_name(0)}. Orders count turns of the input; those with most A-weighted "
        "energy are followed. Windows last ten turns of the input."
    )
    remarks = [Text(text) for _, run, _ in heard for text in _contact_loss(run)]
    if all(constant_speed(history.input_speed) for _, _, history in heard):
        return [Text(f"{note} The mean speed is constant."), *remarks, _mean_levels(numbers, maps)]
    found: list[Any] = [Text(note), *remarks, _overall(stored, numbers, curves), octave_figure(stored)]
    if len(next(iter(curves.values()))) > 1:
        found.append(_order_cuts(stored, numbers, curves))
    for number, (title, word) in enumerate((("frequency / Hz", "frequency"), ("order of the input", "order"))):
        found.append(_maps(stored, {name: waterfalls[number] for name, waterfalls in maps.items()}, title, word))
    return found


def _contact_loss(run: StoredRun) -> list[str]:
    """Return remarks on the meshes of a run whose flanks part, and on the errors that this leaves."""
    forces = run.hand_off("bearing_forces", BearingForces)
    if forces is None:
        return []
    stated = forces.accuracy
    told = [doubt.text for doubt in stated.doubts() if doubt.kind == CONTACT_LOSS]
    found = []
    for number, (mesh, seconds, lowest, highest) in enumerate(stated.contact_losses()):
        text = told[number] if told else f"mesh {mesh}: its flanks part for {seconds:.3g} s of the record"
        rpm = (
            ""
            if np.isinf(highest)
            else f" They part between {30 / np.pi * lowest:.0f} and {30 / np.pi * highest:.0f} rpm."
        )
        found.append(f"{run.name}: {text}.{rpm}")
    return found


def title(stored: Stored) -> str:
    """Return the headline of the section."""
    return kind_of_record(stored)


def kind_of_record(stored: Stored) -> str:
    """Return what the records are, as a headline."""
    speeds = [history.input_speed for _, _, history in stored.having(lambda run: run.pressure_history)]
    if speeds and all(map(constant_speed, speeds)):
        return "Record at constant speed"
    return "Run-down" if speeds and all(speed[-1] < speed[0] for speed in speeds) else TITLE


def _mean_levels(numbers: dict[str, int], maps: dict[str, tuple[Waterfall, Waterfall]]) -> Figure:
    """Return the mean level of all windows against frequency."""
    traces, tops = [], []
    for name, number in numbers.items():
        waterfall = maps[name][0]
        level = levels.decibel(np.sqrt((np.abs(waterfall.amplitude[:, 1:]) ** 2).mean(axis=0)))
        tops.append(float(level.max()))
        hover = "%{x:.0f} Hz: %{y:.1f} dB"
        traces.append(curve(number, name, packed(waterfall.axis[1:]), packed(level), hover, width=1.3))
    span = {"range": [max(tops) - RANGE, max(tops) + 3.0]}
    layout = axes("frequency / Hz", "level / dB re 20 µPa", yaxis=span)
    return Figure("Sound pressure level of lines, mean of all windows.", traces, layout, height=360)


def _overall(stored: Stored, numbers: dict[str, int], curves: dict[str, list[Curve]]) -> Figure:
    traces = [trace for trace in speed_traces(stored.runs) if trace.get("fill")]
    traces += [_curve(name, number, curves[name][0], "dB(A)") for name, number in numbers.items()]
    top = max(float(run_curves[0].level.max()) for run_curves in curves.values())
    span = [top - 45.0, max(top, speed_range(stored.runs)[1] - 3.0) + 3.0]
    layout = axes("input speed / rpm", "level / dB(A) re 20 µPa", yaxis={"range": span})
    caption = "Overall level over speed. Shaded: confidence limits, with the distances of twenty parts of the run-up."
    return Figure(caption, traces, layout, height=360)


def _order_cuts(stored: Stored, numbers: dict[str, int], curves: dict[str, list[Curve]]) -> Figure:
    cuts = {name: run_curves[1:] for name, run_curves in curves.items()}
    titles = [cut.name for cut in next(iter(cuts.values()))]
    layout = grid(titles, 2, "input speed / rpm", "level / dB", legend=1.06)
    traces = []
    top = max(float(cut.level.max()) for run_cuts in cuts.values() for cut in run_cuts)
    for place in range(len(titles)):
        layout[f"yaxis{place + 1 if place else ''}"]["range"] = [top - RANGE, top + 3.0]
        for name, number in numbers.items():
            traces += _limits(stored.runs[number], number, cuts[name][place], place, top - 2 * RANGE)
        traces += [_curve(name, number, cuts[name][place], "dB", place) for name, number in numbers.items()]
    caption = "Levels of single orders over speed, dB re 20 µPa. Shaded: confidence limits of parts of the run-up."
    return Figure(caption, traces, layout, height=120 + 190 * -(-len(titles) // 2))


def _limits(run: StoredRun, number: int, cut: Curve, place: int, floor: float) -> list[dict[str, Any]]:
    """Return the shaded limits of an order; none where the summary has none."""
    known = [
        order_limits
        for order_limits in run.summary.get("order_limits", [])
        if abs(order_limits["order"] - (cut.order or 0.0)) < 1e-6
    ]
    slow, fast = cut.speed.min() * 30 / np.pi, cut.speed.max() * 30 / np.pi
    inside = [part for order_limits in known for part in order_limits["parts"] if slow <= part["speed_rpm"] <= fast]
    parts = sorted(inside, key=lambda part: float(part["speed_rpm"]))
    if len(parts) < 2:
        return []
    rising, speed = np.argsort(cut.speed), np.array([part["speed_rpm"] for part in parts])
    level = np.interp(speed, cut.speed[rising] * 30 / np.pi, cut.level[rising])
    ends = [
        [np.inf * sign if end is None else end for sign, end in zip((-1, 1), part["offsets_db"], strict=True)]
        for part in parts
    ]
    low, high = np.clip(level[:, None] + np.array(ends), floor, floor + 3 * RANGE).T
    limits = shade(number, run.name, [*speed, *speed[::-1]], [*high, *low[::-1]])
    return [limits | panel(place)]


def _curve(name: str, number: int, level_curve: Curve, unit: str, place: int | None = None) -> dict[str, Any]:
    rising = np.argsort(level_curve.speed)
    x, y = (
        packed(level_curve.speed[rising] * 30 / np.pi),
        packed(np.where(level_curve.level > -100.0, level_curve.level, np.nan)[rising]),
    )
    return curve(number, name, x, y, "%{x:.0f} rpm: %{y:.1f} " + unit, place=place, legendgroup=label(name))


def _maps(stored: Stored, maps: dict[str, Waterfall], title: str, word: str) -> Figure:
    """Return waterfalls side by side with one scale of colours."""
    shown = {name: _level(waterfall) for name, waterfall in maps.items()}
    top = max(float(level.max()) for _, _, level in shown.values())
    layout = grid(list(shown), len(shown), title, "input speed / rpm")
    layout |= colour_scale(top, RANGE, "dB re<br>20 µPa")
    traces: list[dict[str, Any]] = []
    speeds = np.concatenate([speed for _, speed, _ in shown.values()])
    ends_of_all = [float(speeds.min()), float(speeds.max())]
    for place, (name, (axis, speed, level)) in enumerate(shown.items()):
        end = str(place + 1) if place else ""
        traces.append(heat_map(place, name, axis, speed, level, f"{word} %{{x:.5g}}, %{{y:.0f}} rpm: %{{z:.1f}} dB"))
        for stage, order in stored.marks.mesh.items():
            ends = [order, order] if word == "order" else [order * speed[0] / 60, order * speed[-1] / 60]
            if max(ends) <= axis[-1]:
                traces.append(
                    {
                        "type": "scatter", "mode": "lines", "x": ends, "y": [float(speed[0]), float(speed[-1])],
                        "line": {"color": "white", "width": 1, "dash": "dot"}, "hoverinfo": "skip",
                        "showlegend": False, "name": label(stage), **panel(place),
                    }
                )  # fmt: skip
        layout[f"xaxis{end}"]["range"] = [0.0, float(axis[-1])]
        layout[f"yaxis{end}"]["range"] = ends_of_all  # matched maps have no range of their own
    caption = f"Sound pressure over speed and {word}, dB re 20 µPa. Dotted: mesh orders."
    return Figure(caption, traces, layout, height=420)


def _level(waterfall: Waterfall) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return axis (n,), rising speed (m,) rpm and level (m, n) dB, with neighbours merged to their strongest."""
    size = np.abs(waterfall.amplitude)[:, 1:]
    rising = np.argsort(waterfall.input_speed)
    speed, size, axis = waterfall.input_speed[rising] * 30 / np.pi, size[rising], waterfall.axis[1:]
    for dimension, most in ((0, SPEEDS), (1, LINES)):
        count = size.shape[dimension]
        first = np.arange(0, count, -(-count // most))
        size = np.maximum.reduceat(size, first, axis=dimension)
        means = np.diff(np.append(first, count))
        if dimension == 0:
            speed = np.add.reduceat(speed, first) / means
        else:
            axis = np.add.reduceat(axis, first) / means
    level = levels.decibel(size)
    return axis, speed, np.maximum(level, level.max() - 2 * RANGE)


def speed_traces(runs: tuple[StoredRun, ...]) -> list[dict[str, Any]]:
    """Return the curves of the overall level over speed, with limits."""
    traces: list[dict[str, Any]] = []
    floor = speed_range(runs)[0] - 40.0
    for number, run in enumerate(runs):
        rows = sorted(run.summary.get("over_speed", []), key=lambda row: float(row["speed_rpm"]))
        if not rows:
            continue
        speed = [row["speed_rpm"] for row in rows]
        low = [floor if row["limits_dBA"][0] is None else row["limits_dBA"][0] for row in rows]
        high = [row["level_dBA"] if row["limits_dBA"][1] is None else row["limits_dBA"][1] for row in rows]
        traces.append(shade(number, run.name, [*speed, *reversed(speed)], [*high, *reversed(low)]))
        dots = {"mode": "lines+markers", "marker": {"symbol": symbol(number), "size": 6}}
        style: dict[str, Any] = dots if len(rows) <= MARKED else {}
        level = rounded(row["level_dBA"] for row in rows)
        style["legendgroup"] = label(run.name)
        traces.append(curve(number, run.name, rounded(speed, 1), level, "%{x:.0f} rpm: %{y:.1f} dB(A)", **style))
    return traces


def speed_range(runs: tuple[StoredRun, ...]) -> list[float]:
    """Return the range of levels (dB) of figures over speed: 45 dB below the highest level, up to the highest limit."""
    rows: list[Mapping[str, Any]] = [row for run in runs for row in run.summary.get("over_speed", [])]
    if not rows:
        return [0.0, 1.0]
    top = max(float(row["level_dBA"]) for row in rows)
    limit = max([top, *(row["limits_dBA"][1] or top for row in rows)])
    return [top - 45.0, min(limit, top + 25.0) + 3.0]
