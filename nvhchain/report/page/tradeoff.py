"""Page of a trade-off: time and error of every knob of the fidelity."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import DASHES, SYMBOLS, Figure, Hero, Table, axes, colour, label, upright
from nvhchain.report.stored import TRADEOFF, json_table, rounded

GOOD = 0.5
"""Error (dB) of mesh harmonics below which a cheaper setting is named on the first screen."""


NAMED = 8
"""Largest number of settings whose names stand beside their points."""


def tradeoff_sections(folder: Path) -> list[tuple[str, str, list[Any]]]:
    """Return name, title and blocks of the sections of the page of a trade-off in a folder."""
    sweep = json_table(folder / TRADEOFF)
    base, *rows = sweep["measurements"]
    cost = _seconds(base)
    measured = sorted((row for row in rows if row.get("deviation")), key=_seconds)
    cheap = [row for row in measured if abs(_worst(row)) <= GOOD and _seconds(row) < cost]
    sentences = [
        f"Preset {sweep['base']}: {cost:.0f} s of processor time. Errors are those of the worst mesh harmonic."
    ]
    sentences += [
        f"  {_name(row)}: {number_text(_seconds(row) - cost, '+.1f')} s, {number_text(_worst(row), '+.2f')} dB"
        for row in cheap[:5]
    ]
    if measured:
        best = min(measured, key=lambda row: abs(_worst(row)))
        sentences.append(f"Least error: {_name(best)}, {abs(_worst(best)):.2g} dB in {_seconds(best):.0f} s.")
    headline = f"{sweep['case']}: {len(cheap)} of {len(measured)} settings are cheaper within {GOOD:g} dB"
    hero = Hero(headline, "", sentences, _figure(measured, cost), None, None, "")
    head = ("knob", "value", "processor / s", "memory / MB", "overall / dB", "worst line / dB", "worst harmonic / dB")
    cells = [
        (
            row["knob"], str(row["value"]), f"{_seconds(row):.1f}", f"{_megabytes(row):.0f}",
            *(("–", "–", "–") if not row.get("deviation") else _errors(row)),
        )
        for row in (base, *rows)
    ]  # fmt: skip
    refused = [(row["knob"], str(row["value"]), str(row["refused"])) for row in rows if row.get("refused")]
    tables = [Table(head, cells, numbers=2)]
    tables += [Table(("knob", "value", "reason"), refused, "Settings that were refused.", numbers=9)] if refused else []
    return [("answer", "Verdict", [hero]), ("settings", "Settings", tables)]


def _figure(rows: list[Mapping[str, Any]], cost: float) -> Figure:
    """Return errors over processor time, a colour and marker per package."""
    groups = list(dict.fromkeys(row["knob"].partition(".")[0] for row in rows))
    traces: list[dict[str, Any]] = []
    for number, group in enumerate(groups):
        settings = [row for row in rows if row["knob"].partition(".")[0] == group]
        traces.append(
            {
                "type": "scatter", "name": label(group), "x": rounded(map(_seconds, settings)),
                "mode": "markers+text" if len(rows) <= NAMED else "markers",
                "y": rounded((max(abs(_worst(row)), 1e-4) for row in settings), 5),
                "text": [label(_name(row)) for row in settings],
                "marker": {"color": colour(number), "symbol": SYMBOLS[number % len(SYMBOLS)], "size": 8},
                "textposition": "top center", "cliponaxis": False,
                "hovertemplate": "%{text}<br>%{x:.1f} s, %{y:.3g} dB<extra></extra>",
            }
        )  # fmt: skip
    layout = axes("processor time / s", "error of the worst harmonic / dB", yaxis={"type": "log", "dtick": 1})
    if len(rows) <= NAMED:
        layout["margin"] = {"l": 60, "r": 70, "t": 34, "b": 46}  # room for the last name
    layout["shapes"] = [upright(cost, DASHES[2])]
    return Figure("One point per setting. Dotted: the preset.", traces, layout, height=420)


def _name(row: Mapping[str, Any]) -> str:
    return f"{row['knob']} = {row['value']}"


def _seconds(row: Mapping[str, Any]) -> float:
    return float(sum(cost["processor"] for cost in row["stages"].values()))


def _megabytes(row: Mapping[str, Any]) -> float:
    return float(max((cost["megabytes"] for cost in row["stages"].values()), default=0.0))


def _worst(row: Mapping[str, Any]) -> float:
    error = row["deviation"]
    orders = error.get("orders") or {}
    values = orders.values() if isinstance(orders, Mapping) else [value for _, value in orders]
    return float(max(values, key=abs, default=error["worst_line"]))


def _errors(row: Mapping[str, Any]) -> tuple[str, str, str]:
    error = row["deviation"]
    overall, line, harmonic = (
        number_text(value, "+.3f") for value in (error["overall"], error["worst_line"], _worst(row))
    )
    return overall, line, harmonic
