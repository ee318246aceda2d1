"""The table that tells two or more configurations apart: overall levels and the strongest orders."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nvhchain.errors import require

ABSENT = "–"
HEARD_DOWN_TO = 100.0
"""dB below the strongest line of a configuration: what lies lower is the rounding of a Fourier transform, no line."""


@dataclass(frozen=True)
class Table:
    """Cells as text.  header: n_column strings.  rows: each with n_column strings."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def text(self) -> str:
        """Columns lined up for a terminal; the first to the left, the rest to the right."""
        lines = (self.header, *self.rows)
        width = [max(len(line[i]) for line in lines) for i in range(len(self.header))]
        return "\n".join(
            "  ".join(
                cell.ljust(n) if i == 0 else cell.rjust(n) for i, (cell, n) in enumerate(zip(line, width, strict=True))
            )
            for line in lines
        )

    def markdown(self) -> str:
        """GitHub's pipe table."""
        rule = ("---", *("---:" for _ in self.header[1:]))
        return "\n".join("| " + " | ".join(line) + " |" for line in (self.header, rule, *self.rows))

    def csv(self) -> str:
        """Comma-separated values after RFC 4180."""
        buffer = io.StringIO()
        csv.writer(buffer).writerows((self.header, *self.rows))
        return buffer.getvalue()


def difference_table(configurations: Mapping[str, Mapping[str, Any]], *, strongest: int = 20) -> Table:
    """Levels of every configuration side by side, and each minus the first.

    configurations: name → {`overall_dBA`: dB(A), `orders`: [{`order`, `frequency_hz`, `level_db`}]}, as `compare`
    writes them to summary.json.  strongest: orders listed, by their level in any configuration, in rising order.
    """
    require(len(configurations) > 0, "no configuration given: at least one is needed")
    names = list(configurations)
    found: dict[float, dict[str, float]] = {}
    frequency: dict[float, float] = {}
    for name, summary in configurations.items():
        loudest = max((float(line["level_db"]) for line in summary["orders"]), default=0.0)
        for line in summary["orders"]:
            order, level = round(float(line["order"]), 6), float(line["level_db"])
            if level > loudest - HEARD_DOWN_TO:
                found.setdefault(order, {})[name] = level
                frequency[order] = float(line["frequency_hz"])
    listed = sorted(sorted(found, key=lambda order: -max(found[order].values()))[:strongest])
    header = ("quantity", "f / Hz", *names, *(f"{name} − {names[0]}" for name in names[1:]))
    overall = {name: float(summary["overall_dBA"]) for name, summary in configurations.items()}
    rows = [("overall / dB(A)", "", *_cells(overall, names))]
    rows += [(f"order {order:g} / dB", f"{frequency[order]:.1f}", *_cells(found[order], names)) for order in listed]
    return Table(header, tuple(rows))


def _cells(level: Mapping[str, float], names: list[str]) -> tuple[str, ...]:
    """Levels in the order of `names`, then differences to the first; a dash where a line does not exist."""
    values = [f"{level[name]:.1f}" if name in level else ABSENT for name in names]
    differences = [
        f"{level[name] - level[names[0]]:+.1f}" if name in level and names[0] in level else ABSENT for name in names[1:]
    ]
    return (*values, *differences)
