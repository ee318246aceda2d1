"""Table of all designs with limits, and differences from the first one."""

from __future__ import annotations

from typing import Any

from nvhchain.report.page.blocks import Table, Text
from nvhchain.study.analysis import responses_of
from nvhchain.study.page.results import (
    Results,
    level_text,
    limits_of,
    point_texts,
    point_titles,
    response_text,
    text_of,
    unit_of,
)

TITLE = "Designs"

MOST_ROWS = 500
"""Number of rows of the table; the others are in study.csv."""


def blocks(results: Results) -> list[Any]:
    """Return the table of runs, the lowest level first; a click on a title sorts it."""
    used = [(index, row) for index, row in enumerate(results.rows) if row.refused is None]
    if not used:
        return []
    main = results.main
    if main is not None:
        used.sort(key=lambda item: item[1].responses.get(main, float("inf")))
    parameters = list(used[0][1].values)
    responses = responses_of(results.rows)
    limited = {name for name in responses if any(name in row.limits for _, row in used)}
    head = ["design", *map(results.study.title, parameters), *point_titles(results.study)]
    for name in responses:
        head += [unit_of(name), "95 % limits"] if name in limited else [unit_of(name)]
        if results.differences and name == main:
            head += ["less design 0 / dB", "limits of it"]
    cells = []
    for index, row in used[:MOST_ROWS]:
        line = [str(row.design), *(text_of(row.values[name]) for name in parameters)]
        line += point_texts(row)
        for name in responses:
            line.append(response_text(name, row.responses.get(name)))
            if name in limited:
                line.append(limits_of(row.limits.get(name)))
            if results.differences and name == main:
                found = results.differences.get(index)
                line += ["", ""] if found is None else [level_text(found.change), limits_of(found.limits)]
        cells.append(line)
    text = "A click on a title sorts."
    if results.differences:
        text += (
            " Errors of shared models cancel in the limits of a difference from design 0 at the same operating point."
        )
    if len(used) > MOST_ROWS:
        text += f" The first {MOST_ROWS} of {len(used)} runs; study.csv has all."
    return [Text(text, "small"), Table(head, cells, numbers=1 + len(parameters), sortable=True)]
