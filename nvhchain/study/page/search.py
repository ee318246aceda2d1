"""Best designs of a search, and its course."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.report.page.blocks import Figure, Table, axes, label
from nvhchain.report.stored import significant
from nvhchain.study.page.results import Results, response_text, text_of
from nvhchain.study.plans.optimise import scores
from nvhchain.study.responses import response_title

TITLE = "Best designs"

MOST_BEST = 10
"""Number of designs in the table of the best."""


def blocks(results: Results) -> list[Any]:
    """Return the course of the search, and its best designs with all responses that count."""
    goal = results.study.goal
    if goal is None:
        return []
    found = scores(results.study, results.rows)
    valid = [score for score in found if score.valid]
    names = [goal.response, *(name for name in results.study.targets if name != goal.response)]
    rows = [
        (
            str(score.design),
            *(text_of(value) for value in score.values.values()),
            *(response_text(name, score.responses[name]) for name in names),
        )
        for score in sorted(valid, key=lambda score: score.responses[goal.response])[:MOST_BEST]
    ]
    percent = f", {goal.percent:g} % of {goal.draws} gearboxes" if goal.draws else ""
    head = ("design", *(parameter.title for parameter in results.study.parameters), *map(response_title, names))
    caption = f"Best designs that meet all targets, at their worst operating point{percent}."
    return [Table(head, rows, caption, numbers=1, sortable=True)] if rows else []


def course(results: Results) -> Figure | None:
    """Return the response of every design in the order of the search, and the best so far; None for other plans."""
    if results.study.goal is None:
        return None
    found, name = scores(results.study, results.rows), results.study.goal.response
    valid = [score for score in found if score.valid]
    lowest = list(np.minimum.accumulate([score.responses[name] for score in valid])) if valid else []
    others = [score for score in found if score.responses and not score.valid and not score.forbidden]
    outside = [score for score in found if score.responses and score.forbidden]
    traces: list[dict[str, Any]] = []
    for title, some, colour, symbol in (
        ("meets all targets", valid, "#0072b2", "circle"),
        ("misses a target", others, "#8a929b", "x"),
        ("outside the ranges", outside, "#1d2329", "diamond-open"),
    ):
        if some:
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": title,
                    "x": [score.design for score in some],
                    "y": significant(score.responses[name] for score in some),
                    "marker": {"color": colour, "symbol": symbol, "size": 7},
                    "customdata": [
                        label(", ".join(results.study.text(*given) for given in score.values.items())) for score in some
                    ],
                    "hovertemplate": "design %{x}: %{y:.4g}<br>%{customdata}<extra></extra>",
                }
            )
    if valid:
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": "best so far",
                "x": [score.design for score in valid],
                "y": significant(lowest),
                "line": {"shape": "hv", "color": "#d55e00", "width": 1.5},
            }
        )
    return Figure(
        "Designs in the order of the search.", traces, axes("design", response_title(name), showlegend=True), 320
    )
