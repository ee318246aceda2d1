"""Scatter of production: percentiles, shares that fail, and tolerances ranked by their effect."""

from __future__ import annotations

from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import Figure, Table, Text, axes, label
from nvhchain.report.stored import rounded, significant
from nvhchain.study.definition import DRAWN
from nvhchain.study.page.results import Results, level_text, limits_of, point_texts, point_titles
from nvhchain.study.quality import (
    FEWEST,
    Influence,
    count_text,
    failed_shares,
    influences,
    loudest,
    percentiles,
    share_text,
)
from nvhchain.study.responses import response_title
from nvhchain.study.rows import Point

TITLE = "Scatter"


def blocks(results: Results) -> list[Any]:
    """Return percentiles over speed or the distribution, shares that fail, and the ranking."""
    main = results.main
    if results.study.plan not in DRAWN or main is None:
        return []
    found: list[Any] = []
    drawn = results.study.drawn
    names = [main, *(name for name in results.study.targets if name != main)]
    rows = [
        (
            response_title(one.response),
            *point_texts(one),
            f"{one.percent:g} %",
            level_text(one.value),
            limits_of(one.limits),
            f"{one.designs} of {one.designs + one.missing}" if one.missing else str(one.designs),
        )
        for name in names
        for one in percentiles(results.rows, name)
    ]
    head = ("response", *point_titles(results.study), f"{drawn} below", "value", "95 % limits", drawn)
    found.append(Table(head, rows, "Percentiles", folded=len(rows) > 6, numbers=1, sortable=True))
    for one in failed_shares(results.study, results.rows):
        found.append(
            Text(
                f"{100 * one.share:.1f} % ({limits_of([100 * limit for limit in one.limits])}) of "
                f"{count_text(results.study, one)} exceed {one.response} = {one.target:g} at their worst operating "
                "point."
            )
        )
    ranking = influences(results.study, results.rows, main)
    seeds = [parameter.name for parameter in results.study.parameters if parameter.draw]
    if ranking:
        found += _ranking(results, ranking, main)
    elif len(seeds) < len(results.study.parameters):
        found.append(Text(f"A ranking of parameters needs {FEWEST} {drawn} or more that differ in {main}.", "small"))
    if seeds:
        found.append(Text(f"Not ranked, since seeds have no order: {', '.join(seeds)}.", "small"))
    return found


def distribution(results: Results) -> Figure | None:
    """Return percentiles over speed, or the distribution where there is one speed; None for other plans."""
    main = results.main
    if results.study.plan not in DRAWN or main is None:
        return None
    found = percentiles(results.rows, main)
    target, drawn = results.study.targets.get(main), results.study.drawn
    line, dashed = {"color": "#1d2329", "width": 1, "dash": "dash"}, "" if target is None else " Dashed: target."
    speeds = sorted({one.speed_rpm for one in found if one.speed_rpm is not None})
    if len(speeds) > 1:
        torque = loudest(found).torque
        traces = []
        for percent, colour in zip(
            sorted({one.percent for one in found}, reverse=True), ("#d55e00", "#0072b2", "#009e73"), strict=False
        ):
            own = {one.speed_rpm: one.value for one in found if one.percent == percent and one.torque == torque}
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines+markers",
                    "name": f"{percent:g} % of the {drawn} below",
                    "x": speeds,
                    "y": significant(own.get(speed) for speed in speeds),
                    "line": {"color": colour},
                }
            )
        layout = axes("input speed / rpm", response_title(main), showlegend=True)
        if target is not None:
            layout["shapes"] = [
                {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": target, "y1": target, "line": line}
            ]
        caption = f"Percentiles over speed{Point(None, torque).words}.{dashed}"
        return Figure(caption, traces, layout, height=320)
    ordered = sorted(row.responses[main] for row in results.worst if main in row.responses)
    shares = [100.0 * (number + 1) / len(ordered) for number in range(len(ordered))]
    trace = {
        "type": "scatter",
        "mode": "lines",
        "x": significant(ordered),
        "y": rounded(shares),
        "line": {"shape": "hv", "color": "#0072b2"},
    }
    layout = axes(response_title(main), f"{drawn} below / %", yaxis={"range": [0, 100]})
    if target is not None:
        layout["shapes"] = [
            {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "x0": target, "x1": target, "line": line}
        ]
    several = " at their worst operating point" if len({row.point for row in results.rows}) > 1 else ""
    caption = f"Distribution over {len(ordered)} {drawn}{several}.{dashed}"
    return Figure(caption, [trace], layout, height=320)


def _ranking(results: Results, ranking: list[Influence], main: str) -> list[Any]:
    """Return bars of the influences, and their table."""
    trace = {
        "type": "bar",
        "orientation": "h",
        "x": rounded(100 * max(0.0, one.share) for one in ranking),
        "y": [label(results.study.title(one.parameter)) for one in ranking],
        "marker": {"color": "#0072b2"},
        "error_x": {
            "type": "data",
            "symmetric": False,
            "array": rounded(100 * (min(1.0, one.share_limits[1]) - max(0.0, one.share)) for one in ranking),
            "arrayminus": rounded(100 * (max(0.0, one.share) - max(0.0, one.share_limits[0])) for one in ranking),
            "thickness": 1.2,
        },
    }
    layout = axes(f"share of the variance of {main} / %", "", yaxis={"autorange": "reversed"})
    rows = [
        (
            results.study.title(one.parameter),
            share_text(one.share, one.share_limits),
            "" if one.correlation is None else number_text(one.correlation, ".2f"),
            "" if one.correlation is None else limits_of(one.correlation_limits, 2),
        )
        for one in ranking
    ]
    head = ("parameter", "share of variance (95 % limits)", "rank correlation", "95 % limits")
    figure = Figure("Parameters by their effect, with 95 % limits.", [trace], layout, height=110 + 38 * len(ranking))
    return [figure, Table(head, rows, numbers=1, sortable=True)]
