"""Table of the differences between configurations: overall levels and the strongest orders."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nvhchain.errors import require

ABSENT = "–"
AUDIBLE_RANGE = 100.0
"""Range (dB) below the strongest line of a configuration; lower values are rounding of a Fourier transform."""


@dataclass(frozen=True)
class Table:
    """Table of texts.

    Parameters
    ----------
    header : tuple of str
        Titles of the columns.
    rows : tuple of tuple of str
        Cells.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def text(self) -> str:
        """Return aligned columns for a terminal; the first to the left, the rest to the right."""
        lines = (self.header, *self.rows)
        width = [max(len(line[i]) for line in lines) for i in range(len(self.header))]
        return "\n".join(
            "  ".join(
                cell.ljust(n) if i == 0 else cell.rjust(n) for i, (cell, n) in enumerate(zip(line, width, strict=True))
            )
            for line in lines
        )

    def markdown(self) -> str:
        """Return a pipe table for GitHub."""
        rule = ("---", *("---:" for _ in self.header[1:]))
        return "\n".join("| " + " | ".join(line) + " |" for line in (self.header, rule, *self.rows))

    def csv(self) -> str:
        """Return comma-separated values by RFC 4180, with ASCII minus signs and empty cells for absent values."""
        buffer = io.StringIO()
        plain = (
            [("" if cell == ABSENT else cell).replace("−", "-") for cell in row] for row in (self.header, *self.rows)
        )
        csv.writer(buffer).writerows(plain)
        return buffer.getvalue()


def difference_table(configurations: Mapping[str, Mapping[str, Any]], *, strongest: int = 20) -> Table:
    """Return the levels of every configuration, and each minus the first.

    Parameters
    ----------
    configurations : mapping of str to mapping
        Configuration → {`overall_dBA`: dB(A), `orders`: [{`order`, `frequency_hz`, `level_db`}]}, as `compare` writes
        them to summary.json.
    strongest : int
        Number of orders with the highest level in any configuration; listed in rising order.

    Returns
    -------
    Table
        Table of levels (dB).
    """
    require(len(configurations) > 0, "no configuration given: at least one is needed")
    names = list(configurations)
    found: dict[float, dict[str, float]] = {}
    frequency: dict[float, float] = {}
    for name, summary in configurations.items():
        loudest = max((float(line["level_db"]) for line in summary["orders"]), default=0.0)
        for line in summary["orders"]:
            order, level = round(float(line["order"]), 6), float(line["level_db"])
            if level > loudest - AUDIBLE_RANGE:
                found.setdefault(order, {})[name] = level
                frequency[order] = float(line["frequency_hz"])
    listed = sorted(sorted(found, key=lambda order: -max(found[order].values()))[:strongest])
    header = ("quantity", "f / Hz", *names, *(f"{name} − {names[0]}" for name in names[1:]))
    overall = {name: float(summary["overall_dBA"]) for name, summary in configurations.items()}
    rows = [("overall / dB(A)", "", *_cells(overall, names))]
    rows += [(f"order {order:g} / dB", f"{frequency[order]:.1f}", *_cells(found[order], names)) for order in listed]
    return Table(header, tuple(rows))


def _cells(level: Mapping[str, float], names: list[str]) -> tuple[str, ...]:
    """Return levels in the order of `names`, then differences to the first; a dash for a missing line."""
    values = [f"{level[name]:.1f}" if name in level else ABSENT for name in names]
    differences = [
        f"{level[name] - level[names[0]]:+.1f}" if name in level and names[0] in level else ABSENT for name in names[1:]
    ]
    return (*values, *differences)
