"""Slopes of responses at the middle of all ranges."""

from __future__ import annotations

from typing import Any

from nvhchain.report.page.blocks import Figure, Table, Text, axes, bars, label
from nvhchain.report.stored import significant
from nvhchain.study.page.results import Results, point_texts, point_titles, text_of
from nvhchain.study.plans.gradient import slopes
from nvhchain.study.responses import response_title

TITLE = "Slopes"


def blocks(results: Results) -> list[Any]:
    """Return the slopes of the main response, and those of all responses."""
    if results.study.plan != "gradient":
        return []
    rows: dict[bool, list[tuple[str, ...]]] = {True: [], False: []}
    spans = {parameter.name: parameter.span for parameter in results.study.parameters}
    for one in slopes(results.study, results.rows):
        low, high = spans[one.parameter]
        if one.response != results.main and abs(one.value) * (high - low) < 1e-9:
            continue
        rows[one.response == results.main].append(
            (
                results.study.title(one.parameter),
                response_title(one.response, difference=True),
                *point_texts(one),
                text_of(one.value),
                f"± {text_of(one.error, 2)}",
                " … ".join("none" if limit is None else text_of(limit, 3) for limit in one.limits)
                if one.limits != (None, None)
                else "",
                text_of(one.value * (high - low)),
            )
        )
    head = ("parameter", "response", *point_titles(results.study), "slope", "error", "95 % limits", "over the range")
    text = (
        "Change of a response per unit of a parameter, by central differences extrapolated to a step of zero. The "
        "error is that of the difference quotient. The limits count the fidelity of the level, too."
    )
    return [
        Text(text, "small"),
        Table(head, rows[True], numbers=2, sortable=True),
        Table(head, rows[False], "Slopes of other responses", folded=True, numbers=2, sortable=True),
    ]


def tornado(results: Results) -> Figure | None:
    """Return the change of the main response over the range of every parameter; None for other plans."""
    if results.study.plan != "gradient":
        return None
    found = [one for one in slopes(results.study, results.rows) if one.response == results.main]
    spans = {parameter.name: parameter.span for parameter in results.study.parameters}
    traces = []
    for number, point in enumerate(dict.fromkeys((one.speed_rpm, one.torque) for one in found)):
        own = [one for one in found if (one.speed_rpm, one.torque) == point]
        widths = [spans[one.parameter][1] - spans[one.parameter][0] for one in own]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": ", ".join(point_texts(own[0])) or "level",
                "y": [label(results.study.title(one.parameter)) for one in own],
                "x": significant(one.value * width for one, width in zip(own, widths, strict=True)),
                "error_x": {
                    "type": "data",
                    "array": significant(one.error * width for one, width in zip(own, widths, strict=True)),
                },
                "marker": bars(number),
            }
        )
    title = " and ".join(point_titles(results.study))
    layout = axes(
        f"slope × range of {response_title(str(results.main), difference=True)}",
        "",
        showlegend=len(traces) > 1,
        barmode="group",
    )
    caption = f"Change of {results.main} over the range of each parameter" + (f", by {title}." if title else ".")
    return Figure(caption, traces, layout, height=140 + 34 * len(found)) if found else None
