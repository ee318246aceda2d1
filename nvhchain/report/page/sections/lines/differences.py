"""Levels of orders and speeds, and the differences of configurations."""

from __future__ import annotations

from typing import Any

from nvhchain import plots
from nvhchain.levels import a_weighting
from nvhchain.report.page.blocks import Figure, Table, axes, label, level_bars
from nvhchain.report.stored import Stored

TITLE = "Orders"

STRONGEST = 14
"""Number of orders in the figure."""

RANGE = 50.0
"""Range (dB) of the figure."""


def blocks(stored: Stored) -> list[Any]:
    """Return the levels of the strongest orders or of speeds, as figure and table."""
    summaries = {run.name: run.summary for run in stored.runs if "orders" in run.summary or "over_speed" in run.summary}
    if not summaries or len({"over_speed" in summary for summary in summaries.values()}) > 1:
        return []
    table = plots.difference_table(summaries)
    shown = 2 * len(summaries) + 1  # limits of run-ups stand in the section of run-ups
    named = [(_named(stored, row[0]), *row[1:shown]) for row in table.rows]
    written = " The same table: differences.csv." if (stored.folder / "differences.csv").is_file() else ""
    block = Table(table.header[:shown], named, f"Levels at {stored.microphone}, dB re 20 µPa.{written}")
    figure = _figure(stored)
    return [figure, block] if figure else [block]


def _named(stored: Stored, quantity: str) -> str:
    """Return the quantity of a row, with the origin of an order."""
    words = quantity.split()
    if len(words) != 4 or words[0] != "order":
        return quantity
    origin = stored.origin(float(words[1]))
    return f"order {words[1]} ({origin}) / dB" if origin else quantity


def _figure(stored: Stored) -> Figure | None:
    """Return bars of the strongest orders in dB(A)."""
    found: dict[float, dict[int, float]] = {}
    for number, run in enumerate(stored.runs):
        for line in run.summary.get("orders", []):
            weighted = line["level_db"] + float(a_weighting(line["frequency_hz"]))
            found.setdefault(round(line["order"], 6), {})[number] = weighted
    if not found:
        return None
    listed = sorted(sorted(found, key=lambda order: -max(found[order].values()))[:STRONGEST])
    top = max(max(found[order].values()) for order in listed)
    floor = top - RANGE
    names = []
    for order in listed:
        origin = label(stored.origin(order)).replace(" = ", "<br>").replace(" + ", "<br>+ ").replace(" − ", "<br>− ")
        names.append(label(f"{order:g}") + (f"<br>{origin}" if origin else ""))
    traces = [
        level_bars(
            number, run.name, names, [found[order].get(number) for order in listed], floor, "%{customdata} dB(A)"
        )
        for number, run in enumerate(stored.runs)
        if any(number in found[order] for order in listed)
    ]
    ticks = {"type": "category", "tickfont": {"size": 11}, "tickangle": 0}
    layout = axes("order of the input", "level / dB(A)", xaxis=ticks, bargap=0.3)
    caption = "A-weighted levels of the strongest orders, with the gear mesh and its harmonic."
    if stored.marks.slots:
        caption += " Sidebands lie slots per turn of a gear apart: 1 × slots is the first."
    return Figure(caption, traces, layout)
