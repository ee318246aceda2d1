"""Table of all designs with limits, and differences from the first one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
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
)
from nvhchain.study.responses import response_title
from nvhchain.study.rows import Row

TITLE = "Designs"

Column = tuple[list[str], Callable[[int, Row], list[str]]]
"""Titles of the columns of a response, and their texts in a row of a number."""

MOST_ROWS = 500
"""Number of rows of the table; the others are in study.csv."""

MOST_RESPONSES = 5
"""Number of responses of a table beside the first one, which paper has room for."""


def blocks(results: Results) -> list[Any]:
    """Return the table of runs, the lowest level first, and folded ones of the other responses."""
    used = [(index, row) for index, row in enumerate(results.rows) if row.refused is None]
    if not used:
        return []
    main = results.main
    if main is not None:
        used.sort(key=lambda item: item[1].responses.get(main, float("inf")))
    parameters = list(used[0][1].values)
    titles, points = list(map(results.study.title, parameters)), point_titles(results.study)
    columns = _columns(results, used)
    if not columns:
        return []
    first, *others = columns
    shown = used[:MOST_ROWS]
    places = [[str(row.design), *point_texts(row)] for _, row in shown]
    head = ["design", *titles, *points, *first[0]]
    cells = [
        [place[0], *(text_of(row.values[name]) for name in parameters), *place[1:], *first[1](index, row)]
        for place, (index, row) in zip(places, shown, strict=True)
    ]
    text = "A click on a title sorts."
    if results.differences:
        text += (
            " Errors of shared models cancel in the limits of a difference from design 0 at the same operating point."
        )
    if len(used) > MOST_ROWS:
        text += f" The first {MOST_ROWS} of {len(used)} runs; study.csv has all."
    found: list[Any] = [Text(text, "small"), Table(head, cells, numbers=1 + len(parameters), sortable=True)]
    while others:
        part, others = others[:MOST_RESPONSES], others[MOST_RESPONSES:]
        head = ["design", *points, *(title for column in part for title in column[0])]
        cells = [
            [*place, *(cell for _, texts in part for cell in texts(index, row))]
            for place, (index, row) in zip(places, shown, strict=True)
        ]
        caption = f"{part[0][0][0]} to {part[-1][0][0]}" if len(part) > 1 else part[0][0][0]
        found.append(Table(head, cells, caption, folded=True, sortable=True))
    return found


def _columns(results: Results, used: Sequence[tuple[int, Row]]) -> list[Column]:
    """Return titles and texts of the columns of every response, the main one first, with its differences."""

    def texts(index: int, row: Row, name: str) -> list[str]:
        line = [response_text(name, row.responses.get(name))]
        if name in limited:
            line.append(limits_of(row.limits.get(name)))
        if results.differences and name == main:
            found = results.differences.get(index)
            line += ["", ""] if found is None else [level_text(found.change), limits_of(found.limits)]
        return line

    main, names = results.main, responses_of([row for _, row in used])
    limited = {name for name in names if any(name in row.limits for _, row in used)}
    found: list[Column] = []
    for name in sorted(names, key=lambda name: name != main):
        titles = [response_title(name), *(["95 % limits"] if name in limited else [])]
        if results.differences and name == main:
            titles += ["less design 0 / dB", "limits of it"]
        found.append((titles, partial(texts, name=name)))
    return found
