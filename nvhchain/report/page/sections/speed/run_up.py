"""Run-ups: levels over speed, order cuts and waterfalls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.handoff import FloatArray
from nvhchain.report.page.blocks import Figure, Text, axes, colour, dash, grid, label, packed, rounded, symbol
from nvhchain.report.page.stored import Stored, StoredRun
from nvhchain.report.run_up import Curve, curves_of
from nvhchain.spectrum import Waterfall

TITLE = "Run-up"

LINES, SPEEDS = 420, 200
"""Largest numbers of lines and speeds of a map; of more, the strongest of neighbours is drawn."""

RANGE = 60.0
"""Range (dB) of the colours and of order cuts."""


def blocks(stored: Stored) -> list[Any]:
    """Return levels over speed, order cuts, and waterfalls against frequency and order."""
    heard = [(number, run.name, of) for number, run in enumerate(stored.runs) if (of := run.pressure_history)]
    if not heard:
        return []
    maps = stored.run_up_maps
    curves = curves_of(maps, stored.marks)
    numbers = {name: number for number, name, _ in heard}
    found: list[Any] = [
        Text(
            f"Sound at {stored.runs[0].point_name(0)}. Orders count turns of the input; those with most A-weighted "
            "energy are followed. Windows last ten turns of the input."
        ),
        _overall(stored, numbers, curves),
    ]
    if len(next(iter(curves.values()))) > 1:
        found.append(_order_cuts(numbers, curves))
    found.append(_maps(stored, {name: of[0] for name, of in maps.items()}, "frequency / Hz", "frequency"))
    found.append(_maps(stored, {name: of[1] for name, of in maps.items()}, "order of the input", "order"))
    return found


def _overall(stored: Stored, numbers: dict[str, int], curves: dict[str, list[Curve]]) -> Figure:
    traces = [trace for trace in over_speed_traces(stored.runs) if trace.get("fill")]
    traces += [_curve(name, number, curves[name][0], "dB(A)") for name, number in numbers.items()]
    top = max(float(of[0].level.max()) for of in curves.values())
    span = [top - 45.0, max(top, speed_range(stored.runs)[1] - 3.0) + 3.0]
    layout = axes("input speed / rpm", "level / dB(A) re 20 µPa", yaxis={"range": span})
    return Figure(
        "Overall level over speed. Shaded: confidence limits of twenty parts of the run-up.", traces, layout, height=360
    )


def _order_cuts(numbers: dict[str, int], curves: dict[str, list[Curve]]) -> Figure:
    cuts = {name: of[1:] for name, of in curves.items()}
    titles = [of.name for of in next(iter(cuts.values()))]
    layout = grid(titles, 2, "input speed / rpm", "level / dB")
    traces = []
    top = max(float(of.level.max()) for of_run in cuts.values() for of in of_run)
    for place in range(len(titles)):
        end = "" if place == 0 else str(place + 1)
        layout[f"yaxis{end}"]["range"] = [top - RANGE, top + 3.0]
        for name, number in numbers.items():
            trace = _curve(name, number, cuts[name][place], "dB")
            traces.append(trace | {"xaxis": f"x{end}", "yaxis": f"y{end}", "showlegend": place == 0})
    layout["legend"] = {"orientation": "h", "x": 0, "y": 1.06, "yanchor": "bottom"}
    layout["margin"] = {"l": 60, "r": 16, "t": 60, "b": 46}
    caption = "Levels of single orders over speed, dB re 20 µPa."
    return Figure(caption, traces, layout, height=120 + 190 * -(-len(titles) // 2))


def _curve(name: str, number: int, curve: Curve, unit: str) -> dict[str, Any]:
    rising = np.argsort(curve.speed)
    level = np.where(curve.level > -100.0, curve.level, np.nan)
    return {
        "type": "scatter",
        "mode": "lines",
        "name": label(name),
        "legendgroup": label(name),
        "x": packed(curve.speed[rising] * 30 / np.pi),
        "y": packed(level[rising]),
        "line": {"color": colour(number), "dash": dash(number), "width": 2},
        "hovertemplate": "%{x:.0f} rpm: %{y:.1f} " + unit + "<extra>" + label(name) + "</extra>",
    }


def _maps(stored: Stored, maps: dict[str, Waterfall], title: str, word: str) -> Figure:
    """Return waterfalls side by side with one scale of colours."""
    shown = {name: _level(of) for name, of in maps.items()}
    top = max(float(level.max()) for _, _, level in shown.values())
    layout = grid(list(shown), len(shown), title, "input speed / rpm")
    layout["coloraxis"] = {
        "colorscale": "Cividis",
        "cmin": round(top - RANGE, 1),
        "cmax": round(top, 1),
        "colorbar": {"title": {"text": "dB re<br>20 µPa"}, "thickness": 12},
    }
    layout["margin"] = {"l": 60, "r": 16, "t": 34, "b": 46}
    traces: list[dict[str, Any]] = []
    for place, (name, (axis, speed, level)) in enumerate(shown.items()):
        end = "" if place == 0 else str(place + 1)
        where = {"xaxis": f"x{end}", "yaxis": f"y{end}"}
        traces.append(
            {
                "type": "heatmap",
                "x": packed(axis),
                "y": packed(speed),
                "z": packed(level),
                "coloraxis": "coloraxis",
                "name": label(name),
                "hovertemplate": f"{word} " + "%{x:.5g}, %{y:.0f} rpm: %{z:.1f} dB<extra></extra>",
                **where,
            }
        )
        for stage, order in stored.marks.mesh.items():
            ends = [order, order] if word == "order" else [order * speed[0] / 60, order * speed[-1] / 60]
            if max(ends) <= axis[-1]:
                traces.append(
                    {
                        "type": "scatter",
                        "mode": "lines",
                        "x": ends,
                        "y": [float(speed[0]), float(speed[-1])],
                        "line": {"color": "white", "width": 1, "dash": "dot"},
                        "hoverinfo": "skip",
                        "showlegend": False,
                        "name": label(stage),
                        **where,
                    }
                )
        layout[f"xaxis{end}"]["range"] = [0.0, float(axis[-1])]
        layout[f"yaxis{end}"]["range"] = [float(speed[0]), float(speed[-1])]  # matched maps have no range of their own
    caption = f"Sound pressure over speed and {word}, dB re 20 µPa. Dotted: mesh orders."
    return Figure(caption, traces, layout, height=420)


def _level(of: Waterfall) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return axis (n,), rising speed (m,) rpm and level (m, n) dB, with neighbours merged to their strongest."""
    size = np.abs(of.amplitude)[:, 1:]
    rising = np.argsort(of.input_speed)
    speed, size, axis = of.input_speed[rising] * 30 / np.pi, size[rising], of.axis[1:]
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


def over_speed_traces(runs: tuple[StoredRun, ...]) -> list[dict[str, Any]]:
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
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": rounded([*speed, *reversed(speed)], 1),
                "y": rounded([*high, *reversed(low)]),
                "fill": "toself",
                "fillcolor": colour(number),
                "opacity": 0.15,
                "line": {"width": 0},
                "hoverinfo": "skip",
                "showlegend": False,
                "legendgroup": label(run.name),
            }
        )
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": label(run.name),
                "legendgroup": label(run.name),
                "x": rounded(speed, 1),
                "y": rounded(row["level_dBA"] for row in rows),
                "line": {"color": colour(number), "dash": dash(number), "width": 2},
                "marker": {"symbol": symbol(number), "size": 6},
                "hovertemplate": "%{x:.0f} rpm: %{y:.1f} dB(A)<extra>" + label(run.name) + "</extra>",
            }
        )
    return traces


def speed_range(runs: tuple[StoredRun, ...]) -> list[float]:
    """Return the range of levels (dB) of figures over speed: 45 dB below the highest level, up to the highest limit."""
    rows: list[Mapping[str, Any]] = [row for run in runs for row in run.summary.get("over_speed", [])]
    if not rows:
        return [0.0, 1.0]
    top = max(float(row["level_dBA"]) for row in rows)
    limit = max([top, *(row["limits_dBA"][1] or top for row in rows)])
    return [top - 45.0, min(limit, top + 25.0) + 3.0]
