"""Why designs differ: parts of the difference by line, mode and path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from textwrap import wrap
from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import LOUDER, QUIETER, Figure, Table, Text, axes, label
from nvhchain.report.sentences import differing_records, sound_between_orders
from nvhchain.report.stored import Stored, StoredRun, rounded

TITLE = "Why"

STRONGEST = 3
"""Number of modes and of paths that are named beside a line."""

ROW = 14
"""Largest number of letters in a row of names under a figure, where words allow it."""

INAUDIBLE = -20.0
"""Level (dB(A)) below which a line counts as absent."""

LEVEL = "#59636e"
"""Colour of levels."""


def blocks(stored: Stored) -> list[Any]:
    """Return the parts of every difference from the first configuration."""
    base, *others = stored.runs
    found = [block for run in others if run.summary.get("causes") for block in _difference(stored, base, run)]
    if not found:
        return []
    note = (
        "Lines add up to the difference of the levels; modes add up to their line, and so do paths. A path is a "
        "bearing and the direction of its force."
    )
    return [Text(note), *found]


def _difference(stored: Stored, base: StoredRun, run: StoredRun) -> list[Any]:
    """Return steps from one level to the other, and the table of lines."""
    lines = run.summary["causes"]
    names = [_line(stored, line) for line in lines]
    ends = [float(each.summary["overall_dBA"]) for each in (base, run)]
    traces = [
        {
            "type": "waterfall",
            "x": [_narrow(text) for text in (base.name, *names, run.name)],
            "y": rounded([ends[0], *(line["part_db"] for line in lines), ends[1]], 3),
            "measure": ["absolute", *["relative"] * len(lines), "total"],
            "text": [f"{ends[0]:.1f}", *(number_text(line["part_db"], "+.1f") for line in lines), f"{ends[1]:.1f}"],
            "textposition": "outside",
            "increasing": {"marker": {"color": LOUDER}},
            "decreasing": {"marker": {"color": QUIETER}},
            "totals": {"marker": {"color": LEVEL}},
            "connector": {"line": {"color": "#b4bac1", "width": 1}},
            "hovertemplate": "%{x}: %{text} dB<extra></extra>",
        }
    ]
    steps = [ends[0]]
    for line in lines:
        steps.append(steps[-1] + line["part_db"])
    span = max(max(steps) - min(steps), 1.0)
    layout = axes("", "level / dB(A)", xaxis={"type": "category", "tickangle": 0, "tickfont": {"size": 11}})
    layout["yaxis"]["range"] = [min(steps) - 0.25 * span, max(steps) + 0.15 * span]
    caption = f"From {base.name} to {run.name}, line by line (dB)."
    head = ("line", f"{base.name} / dB(A)", f"{run.name} / dB(A)", "part / dB", "modes / dB", "paths / dB")
    rows = [
        (
            name,
            *(_level(line["levels_dBA"][i]) if "levels_dBA" in line else "" for i in (0, 1)),
            number_text(line["part_db"], "+.2f"),
            *(_strongest(line.get(kind, [])) for kind in ("modes", "paths")),
        )
        for name, line in zip(names, lines, strict=True)
    ]
    parts = [
        (name, kind, part["name"], number_text(part["part_db"], "+.3f"))
        for name, line in zip(names, lines, strict=True)
        for kind in ("modes", "paths")
        for part in line.get(kind, [])
    ]
    table = (
        Table(head, rows, "Strongest parts of each line.")
        if parts
        else Table(head[:4], [row[:4] for row in rows], "Part of each line.")
    )
    every = Table(("line", "kind", "part", "dB"), parts, "All parts", folded=True, numbers=3)
    remarks = map(Text, _remarks(base, run))
    return [*remarks, Figure(caption, traces, layout, height=340), table, *([every] if parts else [])]


def _remarks(base: StoredRun, run: StoredRun) -> list[str]:
    """Return remarks on records of two ramps, and on modes of two housings."""
    found = []
    if differ := differing_records((base.name, base.summary), (run.name, run.summary)):
        found.append(
            f"{differ[0].upper()}{differ[1:]}. Parts compare means over each record: speeds of one record alone, and "
            "how long it stays at each, count as a change, too."
        )
    if run.summary.get("housing") != base.summary.get("housing"):
        split = [line for line in run.summary["causes"] if line.get("paths")]
        if any(line.get("modes") for line in split):
            found.append(f"Modes of {base.name} and {run.name} are paired by their shapes and frequencies.")
        elif split:
            found.append(
                f"No mode of {base.name} has a partner of its shape in {run.name}, so that modes have no parts."
            )
    return found


def _line(stored: Stored, line: Mapping[str, Any]) -> str:
    """Return the name of a line, or of all others."""
    if "speeds_rpm" in line:
        return sound_between_orders(line)
    if line["order"] is None:
        return f"{line['lines']} other lines" if line["lines"] is not None else "all other sound"
    if line["order"] == line["frequency_hz"]:
        return f"{line['frequency_hz']:.0f} Hz"
    origin = stored.origin(line["order"])
    where = "" if line["frequency_hz"] is None else f"{line['frequency_hz']:.0f} Hz, "
    return f"{where}order {line['order']:.5g}" + (f" ({origin})" if origin else "")


def _narrow(name: str) -> str:
    """Return the name of a line in short rows, which stand beside each other under a figure."""
    text = name.replace(", order", "\norder").replace(" (", "\n").replace(")", "")
    parts = re.sub(r" ([=−+]) ", r"\n\1 ", text).split("\n")
    return "<br>".join(label(row) for part in parts for row in wrap(part, ROW, break_long_words=False))


def _strongest(parts: list[Mapping[str, Any]]) -> str:
    """Return the largest parts, one a row."""
    named = sorted((part for part in parts if "pressure_Pa" in part), key=lambda part: -abs(part["part_db"]))
    return "\n".join(f"{part['name']}: {number_text(part['part_db'], '+.2f')}" for part in named[:STRONGEST])


def _level(value: float | None) -> str:
    return "–" if value is None or value < INAUDIBLE else number_text(value)
