"""Options of the cases with their estimates, values of the cases, and those that differ."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import Table, Text
from nvhchain.report.stored import Stored

TITLE = "Cases"

ABSENT = "–"


def blocks(stored: Stored) -> list[Any]:
    """Return the options that were modelled, the values that differ between the cases, and all values."""
    return [*_options(stored), *_values(stored)]


def _options(stored: Stored) -> list[Any]:
    """Return the decision of the options, and the estimate of each."""
    decisions = {
        run.name: decision for run in stored.runs if (decision := stored.summary.get("modelling", {}).get(run.name))
    }
    rows = [
        (
            name,
            each["option"],
            "modelled" if each["modelled"] else "excluded",
            "its estimate" if each["asked"] == "auto" else f"the case: {each['asked']}",
            number_text(each["level_db"], "+.1f") if "level_db" in each else "",
            f"{each['distance_db']:.1f}" if "distance_db" in each else each["note"],
        )
        for name, decision in decisions.items()
        for each in decision["options"]
    ]
    if not rows:
        return []
    caption = (
        "Options of the dynamics: estimated effect on the gearbox linearised at its mean load, each on top of what "
        "is modelled."
    )
    head = ("configuration", "option", "outcome", "decided by", "level / dB", "orders / dB")
    return [Table(head, rows, caption, numbers=4)]


def _values(stored: Stored) -> list[Any]:
    """Return the values that differ between the cases, and all values."""
    head, rows = value_rows(stored)
    if not rows:
        return []
    found: list[Any] = []
    if len(head) > 2:
        changed = differing(rows)
        found.append(
            Table(head, changed, "Values that differ between the cases.", numbers=9)
            if changed
            else Text("All values of the cases are equal.")
        )
    found.append(Table(head, rows, f"All {len(rows)} values of the cases", folded=True, numbers=9))
    return found


def value_rows(stored: Stored) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the titles and rows of a table of all values: a path, then a text for each stored case."""
    values = {run.name: run.case["values"] for run in stored.runs if run.case.get("values")}
    paths = list(dict.fromkeys(path for case_values in values.values() for path in case_values))
    return ("value", *values), [
        (path, *(_text(case_values, path) for case_values in values.values())) for path in paths
    ]


def differing(rows: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Return the rows whose values differ between the cases."""
    return [row for row in rows if len(set(row[1:])) > 1]


def _text(values: Mapping[str, Any], path: str) -> str:
    """Return a value of a case as text; a dash where the case has none."""
    if path not in values:
        return ABSENT
    value = values[path]
    if isinstance(value, float):
        return f"{value:.9g}"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
