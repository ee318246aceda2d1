"""Levels over steady speeds and torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.levels import number_text
from nvhchain.report.page.blocks import (
    LOUDER,
    QUIETER,
    Figure,
    Text,
    axes,
    colour_scale,
    curve,
    grid,
    heat_map,
    rounded,
    symbol,
    upright,
)
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
    found.append(_maps({name: (of, _levels(of)) for name, of in states.items()}, "dB(A)", "Overall level."))
    return found if len(states) == 1 else [*found, difference_maps(states)]


def stored_states(stored: Stored) -> dict[str, Any]:
    """Return configuration → its steady states in summary.json."""
    return {run.name: of for run in stored.runs if (of := run.summary.get("steady_states"))}


def over_steady_speeds(stored: Stored, *, height: int = 300) -> Figure:
    """Return the curves of all configurations at their first torque."""
    states = stored_states(stored)
    traces = [
        _curve(number, name, of["speed_rpm"], _levels(of)[0], "dB(A)")
        for number, (name, of) in enumerate(states.items())
    ]
    top = max(float(np.nanmax(_levels(of)[0])) for of in states.values())
    layout = axes("input speed / rpm", "level / dB(A)", yaxis={"range": [top - RANGE, top + 3.0]})
    speed = stored.runs[0].pressure.input_speed * 30 / np.pi if stored.runs[0].pressure is not None else 0.0
    if speed:
        layout["shapes"] = [upright(round(speed, 1), "dot", "#8a929b")]
    return Figure(
        "Overall level over steady input speeds. Dotted: the speed of the case.", traces, layout, height=height
    )


def _levels(of: Any) -> FloatArray:
    return np.array(of["level_dBA"], dtype=float)


def _curve(number: int, name: str, speed: list[float], level: FloatArray, unit: str) -> dict[str, Any]:
    style: dict[str, Any] = {"mode": "lines+markers", "marker": {"symbol": symbol(number), "size": 6}}
    return curve(number, name, rounded(speed, 1), rounded(level), "%{x:.0f} rpm: %{y:.1f} " + unit, **style)


def _differences(states: dict[str, Any]) -> dict[str, Any]:
    """Return "configuration − first" → its states and differences (dB) from the first."""
    (base, first), *others = states.items()
    return {f"{name} − {base}": (of, _levels(of) - _levels(first)) for name, of in others}


def _difference(states: dict[str, Any]) -> Figure:
    """Return every configuration minus the first over speed."""
    traces = [
        _curve(number, name, of["speed_rpm"], level[0], "dB")
        for number, (name, (of, level)) in enumerate(_differences(states).items(), start=1)
    ]
    for trace in traces:
        trace["showlegend"] = True
    layout = axes("input speed / rpm", "difference / dB", yaxis={"zerolinecolor": "#5b636b", "zerolinewidth": 2})
    return Figure(f"Difference from {next(iter(states))}; above 0 louder.", traces, layout, height=260)


def _maps(levels: dict[str, Any], unit: str, caption: str, *, height: int = 380) -> Figure:
    """Return maps over speed and torque, side by side with one scale of colours."""
    top = max(float(np.nanmax(level)) for _, level in levels.values())
    layout = grid(list(levels), min(len(levels), 2), "input speed / rpm", "input torque / N m")
    layout |= colour_scale(top, RANGE, unit)
    hover = "%{x:.0f} rpm, %{y:g} N m: %{z:.1f} " + unit
    traces = [
        heat_map(place, name, of["speed_rpm"], of["torque_Nm"], level, hover)
        for place, (name, (of, level)) in enumerate(levels.items())
    ]
    return Figure(f"{caption} Colours: {unit}.", traces, layout, height=height)


def difference_maps(states: dict[str, Any], *, height: int = 380) -> Figure:
    """Return maps of every configuration minus the first, with the differences as numbers."""
    levels = _differences(states)
    most = max(1.0, *(float(np.nanmax(np.abs(level))) for _, level in levels.values()))
    caption = f"Overall level minus that of {next(iter(states))}: orange louder, blue quieter."
    figure = _maps(levels, "dB", caption, height=height)
    colours = [[0.0, QUIETER], [0.5, "#f6f7f9"], [1.0, LOUDER]]
    scale = {"colorscale": colours, "cmin": round(-most, 1), "cmax": round(most, 1)}
    figure.layout["coloraxis"] |= scale
    for trace, (_, level) in zip(figure.data, levels.values(), strict=True):
        numbers = [[number_text(x, "+.1f") if np.isfinite(x) else "" for x in row] for row in level.tolist()]
        trace |= {
            "text": numbers,
            "texttemplate": "%{text}",
            "hovertemplate": trace["hovertemplate"].replace("%{z:.1f}", "%{text}"),
        }
    return figure
