"""Sobol indices with their limits."""

from __future__ import annotations

from typing import Any

from nvhchain.report.page.blocks import Figure, Table, Text, axes, label
from nvhchain.report.stored import rounded
from nvhchain.study.analysis import sensitivity
from nvhchain.study.page.results import Results
from nvhchain.study.quality import share_text
from nvhchain.study.responses import response_title

TITLE = "Sobol indices"


def blocks(results: Results) -> list[Any]:
    """Return bars of the indices of the main response, and a table of all."""
    if results.study.plan != "sensitivity" or any(row.refused is not None for row in results.rows):
        return []
    indices = sensitivity(results.study, results.rows)
    shown = [index for index in indices if index.response == results.main]
    traces = []
    for name, colour, value, limits in (
        ("alone", "#0072b2", "first", "first_limits"),
        ("with interactions", "#e69f00", "total", "total_limits"),
    ):
        middle = [_clip(getattr(index, value)) for index in shown]
        ends = [tuple(map(_clip, getattr(index, limits))) for index in shown]
        traces.append(
            {
                "type": "bar",
                "name": name,
                "x": [label(results.study.title(index.parameter)) for index in shown],
                "y": rounded(middle, 3),
                "marker": {"color": colour},
                "error_y": {
                    "type": "data",
                    "symmetric": False,
                    "array": rounded((max(0.0, high - y) for y, (_, high) in zip(middle, ends, strict=True)), 3),
                    "arrayminus": rounded((max(0.0, y - low) for y, (low, _) in zip(middle, ends, strict=True)), 3),
                    "thickness": 1.2,
                },
            }
        )
    layout = axes("", f"share of the variance of {results.main}", barmode="group", showlegend=True)
    rows = [
        (
            response_title(index.response),
            results.study.title(index.parameter),
            share_text(index.first, index.first_limits),
            share_text(index.total, index.total_limits),
        )
        for index in indices
    ]
    head = ("response", "parameter", "alone (95 % limits)", "with interactions (95 % limits)")
    table = Table(head, rows, "Indices of all responses", folded=bool(shown), numbers=2, sortable=True)
    note = Text(
        "Shares of the variance with 95 % limits, drawn inside 0 to 100 %. Estimates beyond come from few designs; "
        "indices.csv has them as they are.",
        "small",
    )
    return [note, Figure("Sobol indices with 95 % limits.", traces, layout, height=320), table] if shown else [table]


def _clip(share: float) -> float:
    """Return a share within 0 to 1, as every index is."""
    return min(max(share, 0.0), 1.0)
