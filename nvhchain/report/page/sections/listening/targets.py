"""Targets: which are passed or failed, by how much and with which confidence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import (
    Figure,
    Table,
    Text,
    axes,
    colour,
    dash,
    label,
    limits_text,
    rounded,
    symbol,
    whiskers,
)  # fmt: skip
from nvhchain.report.sound.targets import percent
from nvhchain.report.stored import Stored

TITLE = "Targets"

EXPLANATION = (
    "The confidence is the probability that the level keeps to its target. The error of the amplitude in pascals, not "
    "of the level in dB, counts as normally distributed. The limits lie two standard deviations from it. Over several "
    "speeds or frequencies it is the least of them. Errors of the model itself, such as joints, damping or tolerances "
    "of the real gearbox, are not included."
)


def blocks(stored: Stored) -> list[Any]:
    """Return the table of targets, and a figure of every curve or spectrum."""
    found = stored.having(lambda run: run.summary.get("targets"))
    judged = [(number, run.name, target) for number, run, every in found for target in every]
    if not judged:
        return []
    head = ("configuration", "target", "result", "at", "level", "limits", "target level", "margin / dB", "confidence")
    table = Table(head, [_row(name, target) for _, name, target in judged], numbers=4)
    names = dict.fromkeys(target["name"] for _, _, target in judged if len(target["points"]) > 1)
    figures = [_figure([one for one in judged if one[2]["name"] == name]) for name in names]
    return [table, *figures, Text(EXPLANATION, style="small")]


def _row(name: str, target: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the cells of a target, with the level that is nearest to it or farthest above."""
    if target["passed"] is None:
        return (name, target["name"], "not judged", *[""] * 6)
    point = min(target["points"], key=lambda one: one["target_dB"] - _level(one))
    margin = target["margin_dB"]
    return (
        name,
        target["name"],
        "✓ passed" if target["passed"] else "✗ failed",
        target["at"],
        "silence" if point["level_dB"] is None else f"{point['level_dB']:.1f} {target['unit']}",
        limits_text(point["limits_dB"]),
        f"{point['target_dB']:.1f} {target['unit']}",
        "" if margin is None else number_text(margin, "+.1f"),
        percent(target["confidence"]),
    )


def _limits(target: Mapping[str, Any]) -> list[tuple[float, float]]:
    return [(point["axis"], point["target_dB"]) for point in target["points"]]


def _level(point: Mapping[str, Any]) -> float:
    return -1000.0 if point["level_dB"] is None else float(point["level_dB"])


def _figure(judged: list[tuple[int, str, Mapping[str, Any]]]) -> Figure:
    """Return levels with their limits below a target."""
    first = judged[0][2]
    traces: list[dict[str, Any]] = []
    shown = [_level(point) for _, _, target in judged for point in target["points"] if point["level_dB"] is not None]
    floor = max([*shown, first["points"][0]["target_dB"]]) - 40.0
    for number, name, target in judged:
        points = [point for point in target["points"] if _level(point) > floor]
        traces.append(
            {
                "type": "scatter", "mode": "markers", "name": label(name),
                "x": rounded((point["axis"] for point in points), 3),
                "y": rounded(point["level_dB"] for point in points),
                "marker": {"color": colour(number), "symbol": symbol(number), "size": 8},
                "error_y": whiskers([(point["level_dB"], point["limits_dB"]) for point in points], floor, number, 1),
                "hovertemplate": "%{x:.5g}: %{y:.1f} " + first["unit"] + "<extra>" + label(name) + "</extra>",
            }
        )  # fmt: skip
        if number == judged[0][0] or _limits(target) != _limits(first):
            traces.append(
                {
                    "type": "scatter", "mode": "lines",
                    "name": label(f"target {target['name']}" + ("" if number == judged[0][0] else f" of {name}")),
                    "x": rounded((point["axis"] for point in target["points"]), 3),
                    "y": rounded(point["target_dB"] for point in target["points"]),
                    "line": {"color": "#1d2329", "width": 2, "dash": dash(number), "shape": "linear"},
                }
            )  # fmt: skip
    speed_axis = first["axis"] == "speed_rpm"
    frequencies = [point["axis"] for point in first["points"]]
    frequencies = frequencies[:: -(-len(frequencies) // 20)]
    top = max([*shown, *(point["target_dB"] for _, _, target in judged for point in target["points"])])
    ticks = {"type": "log", "tickvals": frequencies, "ticktext": [f"{f:g}" for f in frequencies]}
    x, span = "input speed / rpm" if speed_axis else "frequency / Hz", {"range": [floor, top + 6.0]}
    layout = axes(x, f"level / {first['unit']}", xaxis={} if speed_axis else ticks, yaxis=span)
    caption = f"Target {first['name']}, and the levels with their confidence limits."
    return Figure(caption, traces, layout, height=300)
