"""Contributions of modes and panels, where `nvhchain contributions` has written them."""

from __future__ import annotations

import csv
from typing import Any

from nvhchain import levels
from nvhchain.errors import InputError
from nvhchain.report.page.blocks import Figure, Text, axes, label, rounded
from nvhchain.report.page.stored import Stored

TITLE = "Contributions"

LINES = 3
"""Number of lines that are shown, the loudest in dB(A)."""

PARTS = 12
"""Largest number of parts in a figure."""

FIXED = 3
"""Columns before the parts: field point, frequency and level."""


def blocks(stored: Stored) -> list[Any]:
    """Return bars of the shares in the loudest lines."""
    found = []
    for run in stored.runs:
        for kind in ("modes", "panels"):
            path = run.folder / f"contributions-{kind}.csv"
            if not path.is_file():
                continue
            try:
                rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
                figure = _figure(rows, f"{run.name}: {kind}")
            except (KeyError, ValueError, TypeError, OSError) as error:
                raise InputError(f"{path} cannot be read ({error}): run `nvhchain contributions` again") from None
            found += [figure] if figure else []
    note = (
        "Share of each part in the pressure, Re(p_i p*)/|p|². Shares sum to one; "
        "they are negative where a part cancels others."
    )
    return [Text(note), *found] if found else []


def _figure(rows: list[dict[str, str]], title: str) -> Figure | None:
    here = [row for row in rows if row["field point"] == rows[0]["field point"]]
    loud = sorted(
        here, key=lambda row: -float(row["level / dB"]) - float(levels.a_weighting(float(row["frequency / Hz"])))
    )[:LINES]
    if not loud:
        return None
    names = list(rows[0])[FIXED:]
    strongest = sorted(names, key=lambda name: -max(abs(float(row[name])) for row in loud))[:PARTS]
    traces = [
        {
            "type": "bar",
            "name": f"{float(row['frequency / Hz']):.0f} Hz, {float(row['level / dB']):.1f} dB",
            "x": [label(name) for name in strongest],
            "y": rounded((100 * float(row[name]) for name in strongest), 1),
            "marker": {"color": shade, "line": {"color": "#1d2329", "width": 0.5}},
            "hovertemplate": "%{x}: %{y} %<extra></extra>",
        }
        for row, shade in zip(loud, ("#1d2329", "#7a8590", "#cfd5db"), strict=False)
    ]
    layout = axes("", "share / %", xaxis={"type": "category"}, bargap=0.3)
    return Figure(f"{title} in the loudest lines at {here[0]['field point']}.", traces, layout)
