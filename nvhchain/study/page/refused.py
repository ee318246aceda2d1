"""Runs that failed, with their reasons."""

from __future__ import annotations

from typing import Any

from nvhchain.report.page.blocks import Table
from nvhchain.study.page.results import Results, design_text, point_texts, point_titles

TITLE = "Refused"


def blocks(results: Results) -> list[Any]:
    """Return the table of refused runs."""
    rows = [
        (str(row.design), design_text(results.study, row), *point_texts(row), row.refused)
        for row in results.rows
        if row.refused is not None
    ]
    caption = f"{len(rows)} of {len(results.rows)} runs have no result."
    head = ("design", "values", *point_titles(results.study), "reason")
    return [Table(head, rows, caption, numbers=9)] if rows else []
