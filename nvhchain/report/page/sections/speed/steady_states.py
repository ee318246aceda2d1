"""Levels over steady speeds and torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.report.page.blocks import Figure, Text, axes, colour, dash, grid, label, packed, rounded, symbol
from nvhchain.report.page.stored import Stored

TITLE = "Steady speeds"

RANGE = 45.0
"""Range (dB) of levels."""


def blocks(stored: Stored) -> list[Any]:
    """Return curves over speed, or maps over speed and torque, and differences from the first configuration."""
    states = stored_states(stored)
    if not states:
        return []
    note = (
        f"Overall level at {stored.microphone}, in steady states with the operators of the run. Single states have "
        "no confidence limits."
    )
    failed = [f"{name}, {reason}" for name, of in states.items() for reason in of.get("failed", [])]
    remarks = [f"{name}: {remark}" for name, of in states.items() for remark in of.get("remarks", [])]
    found: list[Any] = [Text(note), *(Text(f"Not computed: {text}") for text in failed[:3]), *map(Text, remarks)]
    if all(len(of["torque_Nm"]) == 1 for of in states.values()):
        curve = over_steady_speeds(stored)
        return [*found, curve] if len(states) == 1 else [*found, curve, _difference(states)]
    return [*found, _maps({name: (of, _levels(of)) for name, of in states.items()}, "dB(A)", "Overall level.")]


def stored_states(stored: Stored) -> dict[str, Any]:
    """Return configuration → its steady states in summary.json."""
    return {run.name: of for run in stored.runs if (of := run.summary.get("steady_states"))}


def over_steady_speeds(stored: Stored) -> Figure:
    """Return the curves of all configurations at their first torque."""
    states = stored_states(stored)
    traces = []
    for number, (name, of) in enumerate(states.items()):
        traces.append(_curve(number, name, of["speed_rpm"], _levels(of)[0], "dB(A)"))
    top = max(float(np.nanmax(_levels(of)[0])) for of in states.values())
    layout = axes("input speed / rpm", "level / dB(A)", yaxis={"range": [top - RANGE, top + 3.0]})
    speed = stored.runs[0].pressure.input_speed * 30 / np.pi if stored.runs[0].pressure is not None else 0.0
    if speed:
        layout["shapes"] = [
            {
                "type": "line",
                "x0": round(speed, 1),
                "x1": round(speed, 1),
                "yref": "paper",
                "y0": 0,
                "y1": 1,
                "line": {"color": "#8a929b", "width": 1, "dash": "dot"},
            }
        ]
    return Figure("Overall level over steady input speeds. Dotted: the speed of the case.", traces, layout, height=300)


def _levels(of: Any) -> FloatArray:
    return np.array(of["level_dBA"], dtype=float)


def _curve(number: int, name: str, speed: list[float], level: FloatArray, unit: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": label(name),
        "x": rounded(speed, 1),
        "y": rounded(level),
        "line": {"color": colour(number), "dash": dash(number), "width": 2},
        "marker": {"symbol": symbol(number), "size": 6},
        "hovertemplate": "%{x:.0f} rpm: %{y:.1f} " + unit + "<extra>" + label(name) + "</extra>",
    }


def _difference(states: dict[str, Any]) -> Figure:
    """Return every configuration minus the first over speed."""
    (base, first), *others = states.items()
    traces = [
        _curve(number, f"{name} − {base}", of["speed_rpm"], _levels(of)[0] - _levels(first)[0], "dB")
        for number, (name, of) in enumerate(others, start=1)
    ]
    for trace in traces:
        trace["showlegend"] = True
    layout = axes("input speed / rpm", "difference / dB", yaxis={"zerolinecolor": "#5b636b", "zerolinewidth": 2})
    return Figure(f"Difference from {base}; above 0 louder.", traces, layout, height=260)


def _maps(levels: dict[str, Any], unit: str, caption: str) -> Figure:
    """Return maps over speed and torque, side by side with one scale of colours."""
    top = max(float(np.nanmax(level)) for _, level in levels.values())
    layout = grid(list(levels), min(len(levels), 2), "input speed / rpm", "input torque / N m")
    bar = {"title": {"text": unit}, "thickness": 12}
    layout["coloraxis"] = {
        "colorscale": "Cividis",
        "cmin": round(top - RANGE, 1),
        "cmax": round(top, 1),
        "colorbar": bar,
    }
    layout["margin"] = {"l": 60, "r": 16, "t": 34, "b": 46}
    traces = []
    for place, (name, (of, level)) in enumerate(levels.items()):
        end = "" if place == 0 else str(place + 1)
        traces.append(
            {
                "type": "heatmap",
                "x": packed(of["speed_rpm"]),
                "y": packed(of["torque_Nm"]),
                "z": packed(level),
                "coloraxis": "coloraxis",
                "name": label(name),
                "hovertemplate": "%{x:.0f} rpm, %{y:g} N m: %{z:.1f} " + unit + "<extra></extra>",
                "xaxis": f"x{end}",
                "yaxis": f"y{end}",
            }
        )
    return Figure(f"{caption} Colours: {unit}.", traces, layout, height=380)
