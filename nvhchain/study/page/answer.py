"""First screen: result in words, best designs in two responses, levels over speed."""

from __future__ import annotations

from math import inf
from typing import Any

from nvhchain.report.page.blocks import Figure, Hero, axes, label
from nvhchain.report.stored import significant
from nvhchain.study.differences import order_doubt
from nvhchain.study.page.results import Results, design_text, text_of
from nvhchain.study.page.scatter import distribution
from nvhchain.study.page.search import course
from nvhchain.study.page.slopes import tornado
from nvhchain.study.responses import response_title
from nvhchain.study.rows import Point, Row

TITLE = "Answer"

MOST_LINES = 14
"""Number of sentences on the first screen."""

MOST_RANKED = 12
"""Number of designs in the figure of one response."""

MOST_LETTERS = 22
"""Length of the name of a design beside a figure, which has to fit on a phone."""

OPEN = 2.0
"""Length of an error bar without an end, over that of the longest other one."""

MOST_CURVES = 8
"""Number of designs with a curve over speed of their own."""


def blocks(results: Results) -> list[Any]:
    """Return the first screen."""
    headline, *others = results.lines or (f"{len(results.rows)} runs",)
    remarks = [f"{remark}." for row in results.rows for remark in row.remarks]
    doubt = " ".join(filter(None, [order_doubt(results.study, results.worst, results.main), *remarks]))
    drawn = course, tornado, distribution, _pareto, response_curves
    figures = [figure for draw in drawn if (figure := draw(results)) is not None]
    first, second = [*figures, _ranked(results), None][:2]
    sentences = [f" {line}" for line in others[:MOST_LINES]]
    return [Hero(headline, doubt, sentences, first, second, None, "")]


def _ranked(results: Results) -> Figure | None:
    """Return the main response of the best designs with its limits; None for one design, and for gearboxes."""
    main = str(results.main)
    ranked = sorted((row for row in results.worst if main in row.responses), key=lambda row: row.responses[main])
    if len(ranked) < 2 or results.study.is_series:
        return None
    rows = ranked[:MOST_RANKED]
    trace = _points(results, rows, "", "#0072b2", horizontal=True)
    layout = axes(response_title(main), "", yaxis={"type": "category", "autorange": "reversed"}, showlegend=False)
    count = f"The {len(rows)} lowest of {len(ranked)}" if len(rows) < len(ranked) else "All"
    caption = f"{count} designs by number and values{', with 95 % limits' if _has_limits(rows, main) else ''}."
    return Figure(caption, [trace], layout, height=100 + 26 * len(rows))


def _pareto(results: Results) -> Figure | None:
    """Return designs in two responses with the line of the best ones."""
    if results.pair is None:
        return None
    y, x = results.pair
    here = [row for row in results.worst if x in row.responses and y in row.responses]
    best = {row.design for row in results.best}
    traces = [
        _points(results, [row for row in here if row.design not in best], "other designs", "#8a929b"),
        _points(results, results.best, "best designs", "#d55e00")
        | {"mode": "lines+markers+text", "line": {"shape": "vh", "color": "#d55e00", "width": 1.5}},
    ]
    traces[1] |= {"text": [str(row.design) for row in results.best], "textposition": "top right"}
    layout = axes(response_title(x), response_title(y), showlegend=True)
    return Figure(
        f"Every design at its worst operating point{f', with 95 % limits of {y}' if _has_limits(here, y) else ''}. No "
        "design betters the numbered ones in both.",
        traces,
        layout,
        height=330,
    )


def _points(results: Results, rows: list[Row], name: str, colour: str, *, horizontal: bool = False) -> dict[str, Any]:
    """Return designs in the pair of responses, or the main response of each if `horizontal`."""
    y, x = (str(results.main), "") if horizontal else results.pair or ("", "")
    texts = [label(design_text(results.study, row)) for row in rows]
    short = [label(_short_name(row)) for row in rows]
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        ("y" if horizontal else "x"): short if horizontal else [row.responses[x] for row in rows],
        ("x" if horizontal else "y"): significant(row.responses[y] for row in rows),
        "marker": {"color": colour, "size": 8},
        "customdata": [f"design {row.design}: {text}" for row, text in zip(rows, texts, strict=True)],
        "hovertemplate": "%{customdata}<br>" + ("%{x:.4g}" if horizontal else "%{x:.4g}, %{y:.4g}") + "<extra></extra>",
    }
    if _has_limits(rows, y):
        lengths = [
            [None if end is None else abs(end - row.responses[y]) for end in row.limits.get(y, (row.responses[y],) * 2)]
            for row in rows
        ]
        longest = OPEN * max((each for both in lengths for each in both if each is not None), default=0.0)
        trace["error_x" if horizontal else "error_y"] = {
            "type": "data",
            "symmetric": False,
            "array": significant(longest if high is None else high for _, high in lengths),
            "arrayminus": significant(longest if low is None else low for low, _ in lengths),
            "thickness": 1,
            "width": 3,
        }
    return trace


def _has_limits(rows: list[Row], name: str) -> bool:
    """Return True if any row has limits of a response."""
    return any(limit is not None for row in rows for limit in row.limits.get(name, ()))


def _short_name(row: Row) -> str:
    """Return number and values of a design, as many as fit; "…" stands for others and for the rest of a text."""
    name, values = f"{row.design}:", list(map(text_of, row.values.values()))
    for place, value in enumerate(values):
        gap, last = "" if place == 0 else ",", place == len(values) - 1
        if len(f"{name}{gap} {value}") + (0 if last else len(", …")) > MOST_LETTERS:
            if place == 0 and isinstance(next(iter(row.values.values())), str):
                return f"{name} {value}"[: MOST_LETTERS - 1] + "…"
            return f"{name}{gap} …"
        name += f"{gap} {value}"
    return name


def response_curves(results: Results) -> Figure | None:
    """Return the main response of some designs over the speeds of the study."""
    main = results.main
    speeds = sorted({row.speed_rpm for row in results.rows if row.speed_rpm is not None})
    if main is None or len(speeds) < 3 or results.study.plan not in ("grid", "list"):
        return None
    ranked = sorted((row for row in results.worst if main in row.responses), key=lambda row: row.responses[main])
    shown = ranked[: MOST_CURVES // 2] + ranked[max(MOST_CURVES // 2, len(ranked) - MOST_CURVES // 2) :]
    traces = []
    for row in shown:
        own: dict[float, float] = {}
        for one in results.rows:
            if one.design == row.design and one.speed_rpm is not None and main in one.responses:
                own[one.speed_rpm] = max(own.get(one.speed_rpm, -inf), one.responses[main])
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": label(f"{row.design}: {design_text(results.study, row)}"[:60]),
                "x": sorted(own),
                "y": significant(own[speed] for speed in sorted(own)),
            }
        )
    torques = {row.torque for row in results.rows}
    several = ", at the worst torque of every speed" if len(torques) > 1 else Point(None, *torques).words
    caption = f"Quietest and loudest designs over speed{several}."
    return Figure(caption, traces, axes("input speed / rpm", response_title(main)), 300)
