"""Values of the cases, and those that differ."""

from __future__ import annotations

import json
from typing import Any

from nvhchain.report.page.blocks import Table, Text
from nvhchain.report.page.stored import Stored

TITLE = "Cases"

ABSENT = "–"


def blocks(stored: Stored) -> list[Any]:
    """Return the values that differ between the cases, and all values."""
    values = {run.name: run.case["values"] for run in stored.runs if run.case.get("values")}
    if not values:
        return []
    paths = list(dict.fromkeys(path for of in values.values() for path in of))
    rows = [(path, *(_text(of[path]) if path in of else ABSENT for of in values.values())) for path in paths]
    found: list[Any] = []
    if len(values) > 1:
        differing = [row for row in rows if len(set(row[1:])) > 1]
        head = ("value", *values)
        found.append(
            Table(head, differing, "Values that differ between the cases.", numbers=9)
            if differing
            else Text("All values of the cases are equal.")
        )
    found.append(Table(("value", *values), rows, f"All {len(rows)} values of the cases", folded=True, numbers=9))
    return found


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.9g}"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
