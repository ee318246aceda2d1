"""Levels over steady speeds and torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.error_band import format_limits
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
    label,
    shade,
    symbol,
    upright,
)
from nvhchain.report.sentences import DIFFERENCE, decided_states
from nvhchain.report.stored import Stored, rounded

TITLE = "Steady speeds"

RANGE = 45.0
"""Range (dB) of levels."""

LEVEL = "limits_dBA"
"""Key of steady states in summary.json: limits of the levels."""


def blocks(stored: Stored) -> list[Any]:
    """Return curves over speed, or maps over speed and torque, and differences from the first configuration."""
    states = stored_states(stored)
    if not states:
        return []
    note = f"Overall level at {stored.microphone}, in steady states with the operators of the run."
    failed = [f"{name}, {reason}" for name, steady in states.items() for reason in steady.get("failed", [])]
    remarks = [f"{name}: {remark}" for name, steady in states.items() for remark in steady.get("remarks", [])]
    found: list[Any] = [Text(note), *(Text(f"Not computed: {text}") for text in failed[:3]), *map(Text, remarks)]
    if all(len(steady["torque_Nm"]) == 1 for steady in states.values()):
        curve = steady_speed_curves(stored)
        return [*found, curve] if len(states) == 1 else [*found, curve, _difference(states)]
    found.append(_maps({name: (steady, _levels(steady)) for name, steady in states.items()}, "dB(A)", "Overall level."))
    return found if len(states) == 1 else [*found, difference_maps(states)]


def stored_states(stored: Stored) -> dict[str, Any]:
    """Return configuration → its steady states in summary.json."""
    return {run.name: steady for run in stored.runs if (steady := run.summary.get("steady_states"))}


def steady_speed_curves(stored: Stored, *, height: int = 300) -> Figure:
    """Return the curves of all configurations at their first torque."""
    states = stored_states(stored)
    curves = [
        _curve(number, name, steady["speed_rpm"], _levels(steady)[0], "dB(A)")
        for number, (name, steady) in enumerate(states.items())
    ]
    levels = [level for steady in states.values() for level in (_levels(steady)[0], *_ends(steady, LEVEL)[0].T)]
    top = max(float(np.nanmax(level, initial=-1e3)) for level in levels)
    bottom = max(float(np.nanmax(_levels(steady)[0])) for steady in states.values()) - RANGE
    traces = _limits(states, LEVEL, bottom, top) + curves
    layout = axes("input speed / rpm", "level / dB(A)", yaxis={"range": [bottom, top + 3.0]})
    speed = stored.runs[0].pressure.input_speed * 30 / np.pi if stored.runs[0].pressure is not None else 0.0
    if speed:
        layout["shapes"] = [upright(round(speed, 1), "dot", "#8a929b")]
    return Figure(
        f"Overall level over steady input speeds{_limit_words(states, LEVEL)}. Dotted: the speed of the case.",
        traces,
        layout,
        height=height,
    )


def _levels(steady: Any) -> FloatArray:
    return np.array(steady["level_dBA"], dtype=float)


def _ends(steady: Any, key: str) -> FloatArray:
    """Return limits (n_torque, n_speed, 2); nan where a state has none, and at an open end."""
    missing = [[(None, None)] * len(steady["speed_rpm"])] * len(steady["torque_Nm"])
    return np.array(steady.get(key, missing), dtype=float)


def _limit_words(states: dict[str, Any], key: str) -> str:
    """Return the words for limits, where a configuration has any."""
    return ", with 95 % limits" if any(np.isfinite(_ends(steady, key)).any() for steady in states.values()) else ""


def _limits(states: dict[str, Any], key: str, bottom: float, top: float) -> list[dict[str, Any]]:
    """Return the shaded limits of unbroken runs of states; open ends are at the edges `bottom` and `top` (dB)."""
    found = []
    for number, (name, steady) in enumerate(states.items()):
        ends = _ends(steady, key)[0]
        known = np.flatnonzero(np.isfinite(ends).any(axis=1))
        for run in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
            speed = np.array(steady["speed_rpm"])[run].tolist()
            low, high = (
                np.nan_to_num(each, nan=edge).tolist() for each, edge in zip(ends[run].T, (bottom, top), strict=True)
            )
            if speed:
                found.append(shade(number, name, [*speed, *speed[::-1]], [*high, *low[::-1]]))
    return found


def _ranges(steady: Any, key: str) -> list[list[str]]:
    """Return the limits of a map as texts; empty ones where there are none."""

    def text(low: float, high: float) -> str:
        if np.isnan(high):
            return "" if np.isnan(low) else f" (at least {number_text(low)})"
        return f" ({format_limits((None if np.isnan(low) else low, high))})"

    return [[text(*ends) for ends in row] for row in _ends(steady, key).tolist()]


def _curve(number: int, name: str, speed: list[float], level: FloatArray, unit: str) -> dict[str, Any]:
    style: dict[str, Any] = {"mode": "lines+markers", "marker": {"symbol": symbol(number), "size": 6}}
    hover = "%{x:.0f} rpm: %{y:.1f} " + unit
    return curve(number, name, rounded(speed, 1), rounded(level), hover, legendgroup=label(name), **style)


def _differences(states: dict[str, Any]) -> dict[str, Any]:
    """Return "configuration − first" → its states and differences (dB) from the first."""
    (base, first), *others = states.items()
    return {f"{name} − {base}": (steady, _levels(steady) - _levels(first)) for name, steady in others}


def _difference(states: dict[str, Any]) -> Figure:
    """Return every configuration minus the first over speed."""
    differences = _differences(states)
    curves = [
        _curve(number, name, steady["speed_rpm"], level[0], "dB")
        for number, (name, (steady, level)) in enumerate(differences.items(), start=1)
    ]
    shown = [
        np.abs(values)
        for steady, level in differences.values()
        for values in (level[0], *_ends(steady, DIFFERENCE)[0].T)
    ]
    edge = max(1.0, *(float(np.nanmax(values, initial=0.0)) for values in shown)) + 1.0
    named = dict(zip(["", *differences], states.values(), strict=True))
    traces = _limits(named, DIFFERENCE, -edge, edge) + curves
    for trace in traces:
        trace["showlegend"] = trace["mode"] != "lines"
    layout = axes(
        "input speed / rpm",
        "difference / dB",
        yaxis={"zerolinecolor": "#5b636b", "zerolinewidth": 2, "range": [-edge, edge]},
    )
    caption = f"Difference from {next(iter(states))}{_limit_words(states, DIFFERENCE)}; above 0 louder."
    return Figure(caption, traces, layout, height=260)


def _maps(levels: dict[str, Any], unit: str, caption: str, *, limits: str = LEVEL, height: int = 380) -> Figure:
    """Return maps over speed and torque, side by side with one scale of colours."""
    top = max(float(np.nanmax(level)) for _, level in levels.values())
    layout = grid(list(levels), min(len(levels), 2), "input speed / rpm", "input torque / N m")
    layout |= colour_scale(top, RANGE, unit)
    hover = "%{x:.0f} rpm, %{y:g} N m: %{z:.1f} " + unit + "%{customdata}"
    traces = [
        heat_map(place, name, steady["speed_rpm"], steady["torque_Nm"], level, hover)
        | {"customdata": _ranges(steady, limits)}
        for place, (name, (steady, level)) in enumerate(levels.items())
    ]
    return Figure(f"{caption} Colours: {unit}.", traces, layout, height=height)


def difference_maps(states: dict[str, Any], *, height: int = 380) -> Figure:
    """Return maps of every configuration minus the first, with the differences as numbers."""
    levels = _differences(states)
    most = max(1.0, *(float(np.nanmax(np.abs(level))) for _, level in levels.values()))
    brackets = "; in brackets where the 95 % limits hold 0" if _limit_words(states, DIFFERENCE) else ""
    caption = f"Overall level minus that of {next(iter(states))}: orange louder, blue quieter{brackets}."
    figure = _maps(levels, "dB", caption, limits=DIFFERENCE, height=height)
    colours = [[0.0, QUIETER], [0.5, "#f6f7f9"], [1.0, LOUDER]]
    scale = {"colorscale": colours, "cmin": round(-most, 1), "cmax": round(most, 1)}
    figure.layout["coloraxis"] |= scale
    for trace, (steady, level) in zip(figure.data, levels.values(), strict=True):
        open_ones = ~decided_states(steady, level)
        numbers = [[number_text(x, "+.1f") if np.isfinite(x) else "" for x in row] for row in level.tolist()]
        numbers = [
            [f"({text})" if text and undecided else text for text, undecided in zip(*row, strict=True)]
            for row in zip(numbers, open_ones.tolist(), strict=True)
        ]
        trace |= {
            "text": numbers,
            "texttemplate": "%{text}",
            "hovertemplate": trace["hovertemplate"].replace("%{z:.1f}", "%{text}"),
        }
    return figure
