"""Microphones added to a finished run, and the directivity balloon."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.handoff import FieldPressure
from nvhchain.report.page.blocks import Figure, Table, packed
from nvhchain.report.sound.microphones import BALLOON, added_levels, balloon_shape
from nvhchain.report.stored import Stored, StoredRun

TITLE = "Directivity"

RANGE = 40.0
"""Range (dB) of a balloon: levels this far below the loudest direction lie in the middle."""

LINES = 6
"""Largest number of lines whose balloon is drawn, the loudest in dB(A)."""


def blocks(stored: Stored) -> list[Any]:
    """Return the levels of added microphones, and the balloons."""
    rows = []
    for run in stored.runs:
        for one in added_levels(run):
            place = levels.place_text(one["position_m"])
            rows.append((run.name, one["name"], place, levels.number_text(one["level_dBA"])))
    caption = "Microphones added from the spherical waves of the sound power, A-weighted levels re 20 µPa."
    head = ("configuration", "microphone", "position / m", "level / dB(A)")
    found: list[Any] = [Table(head, rows, caption, folded=len(rows) > 12, numbers=3)] if rows else []
    balloons = stored.having(lambda run: run.hand_off(BALLOON, FieldPressure))
    tops = _tops([balloon for *_, balloon in balloons])
    return found + [_balloon(run, balloon, tops) for _, run, balloon in balloons]


def _tops(balloons: list[FieldPressure]) -> dict[float, float]:
    """Return frequency (Hz) → highest level (dB) of the lines that are loudest in dB(A) in any configuration."""
    found: dict[float, float] = {}
    for balloon in balloons:
        for f, level in zip(
            balloon.frequency.tolist(), levels.decibel(balloon.pressure).max(axis=1).tolist(), strict=True
        ):
            if f > 0:
                found[f] = max(found.get(f, level), level)
    loudest = sorted(found, key=lambda f: -(found[f] + float(levels.a_weighting(f))))
    return {f: found[f] for f in loudest[:LINES]}


def _balloon(run: StoredRun, pressure: FieldPressure, tops: dict[float, float]) -> Figure:
    """Return the balloon of the loudest lines, which a list chooses; `tops` sets the scale of each line."""
    shape = balloon_shape(pressure)
    level = levels.decibel(pressure.pressure)
    chosen = [line for f in tops for line in np.flatnonzero(pressure.frequency == f)]
    grid = pressure.points.reshape(*shape, 3)
    middle = 0.5 * (pressure.points.min(axis=0) + pressure.points.max(axis=0))
    unit = grid - middle
    unit = unit / np.linalg.norm(unit, axis=2, keepdims=True)
    traces = []
    for number, line in enumerate(chosen):
        line_level, top = level[line].reshape(shape), tops[float(pressure.frequency[line])]
        size = np.maximum(line_level - top + RANGE, 0.0)
        x, y, z = np.moveaxis(unit * size[:, :, None], 2, 0)
        traces.append(
            {
                "type": "surface", "x": packed(x), "y": packed(y), "z": packed(z), "surfacecolor": packed(line_level),
                "colorscale": "Viridis", "cmin": top - RANGE, "cmax": top,
                "colorbar": {"title": {"text": "dB re<br>20 µPa"}, "thickness": 12}, "visible": number == 0,
                "hovertemplate": "%{surfacecolor:.1f} dB<extra></extra>",
            }
        )  # fmt: skip
    buttons = [
        {
            "label": f"{pressure.frequency[line]:.0f} Hz",
            "method": "restyle",
            "args": ["visible", [other == number for other in range(len(chosen))]],
        }
        for number, line in enumerate(chosen)
    ]
    axis = {"visible": False, "range": [-RANGE, RANGE]}
    layout = {
        "scene": {
            **dict.fromkeys(("xaxis", "yaxis", "zaxis"), axis),
            "aspectmode": "cube",
            "camera": {"up": {"x": 0, "y": 1, "z": 0}},
        },
        "updatemenus": [{"buttons": buttons, "x": 0, "y": 1, "xanchor": "left", "yanchor": "top"}],
        "margin": {"l": 0, "r": 0, "t": 8, "b": 8},
    }
    distance = float(np.linalg.norm(pressure.points - middle, axis=1).max())
    caption = (
        f"{run.name}: levels in directions {distance:.3g} m from the middle, {RANGE:g} dB from the middle to "
        "the loudest direction of any design; the list chooses the line."
    )
    return Figure(caption, traces, layout, height=460)
