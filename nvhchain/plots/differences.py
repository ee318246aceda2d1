"""Table of the differences between configurations: overall levels, and strongest orders or levels over speed."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.levels import number_text

ABSENT = "–"
AUDIBLE_RANGE = 100.0
"""Range (dB) below the strongest line of a configuration; lower values are rounding of a Fourier transform."""


@dataclass(frozen=True)
class Table:
    """Table of texts.

    header: titles of the columns.
    rows: cells.
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

    configurations: configuration → {`overall_dBA`: dB(A), `orders`: [{`order`, `frequency_hz`, `level_db`}]}, as
    `compare` writes them to summary.json. Run-ups have `over_speed` and `highest` in place of `orders`.
    strongest: number of orders with the highest level in any configuration; listed in rising order.
    Returns table of levels (dB).
    """
    require(len(configurations) > 0, "no configuration given: at least one is needed")
    names = list(configurations)
    if all("over_speed" in summary for summary in configurations.values()):
        return _run_up_table(configurations)
    found: dict[float, dict[str, float]] = {}
    frequency: dict[float, dict[str, None]] = {}
    for name, summary in configurations.items():
        loudest = max((float(line["level_db"]) for line in summary["orders"]), default=0.0)
        for line in summary["orders"]:
            order, level = round(float(line["order"]), 6), float(line["level_db"])
            if level > loudest - AUDIBLE_RANGE:
                found.setdefault(order, {})[name] = level
                frequency.setdefault(order, {})[f"{line['frequency_hz']:.1f}"] = None
    listed = sorted(sorted(found, key=lambda order: -max(found[order].values()))[:strongest])
    header = ("quantity", "f / Hz", *names, *(f"{name} − {names[0]}" for name in names[1:]))
    overall = {name: float(summary["overall_dBA"]) for name, summary in configurations.items()}
    rows = [("overall / dB(A)", "", *_cells(overall, names))]
    rows += [(f"order {order:g} / dB", "; ".join(frequency[order]), *_cells(found[order], names)) for order in listed]
    return Table(header, tuple(rows))


_SAME_SPEED = 0.02
"""Relative range of speeds below which a record has no rows at speeds."""


def _run_up_table(configurations: Mapping[str, Mapping[str, Any]]) -> Table:
    """Return levels and limits of whole records and at the speeds of the first, and the highest level of each order.

    Speeds outside the range of a configuration have no level there.
    """
    names = list(configurations)
    header = ("quantity", "n / rpm", *names, *(f"{name} − {names[0]}" for name in names[1:]))
    header += tuple(f"{name} {end} limit" for name in names for end in ("lower", "upper"))
    overall = {name: float(summary["overall_dBA"]) for name, summary in configurations.items()}
    edges = {name: summary["error_band_dBA"] for name, summary in configurations.items()}
    rows = [("whole record / dB(A)", "", *_cells(overall, names), *_edges(edges, names))]
    curves = {name: _speed_rows(summary["over_speed"]) for name, summary in configurations.items()}
    speeds = curves[names[0]][0]
    for speed in speeds if np.ptp(speeds) >= _SAME_SPEED * speeds.mean() else ():
        here = {
            name: [float(np.interp(speed, speeds, column)) for column in columns.T]
            for name, (speeds, columns) in curves.items()
            if speeds[0] - 1e-6 <= speed <= speeds[-1] + 1e-6
        }
        level = {name: values[0] for name, values in here.items()}
        limits = {name: values[1:] for name, values in here.items()}
        rows.append(("at a speed / dB(A)", f"{speed:.0f}", *_cells(level, names), *_edges(limits, names)))
    for quantity in configurations[names[0]]["highest"]:
        highest = {
            n: summary["highest"][quantity] for n, summary in configurations.items() if quantity in summary["highest"]
        }
        level = {name: float(peak["level_db"]) for name, peak in highest.items()}
        title, unit = quantity.rsplit(", ", 1)
        where = "; ".join(f"{peak['speed_rpm']:.0f}" for peak in highest.values())
        edges = {name: peak.get("limits_db", (None, None)) for name, peak in highest.items()}
        rows.append((f"highest {title} / {unit}", where, *_cells(level, names), *_edges(edges, names)))
    return Table(header, tuple(rows))


def _speed_rows(rows: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return rising speeds (n,) rpm, and level and limits (n, 3); NaN for no limit."""
    table = np.array([[row["speed_rpm"], row["level_dBA"], *row["limits_dBA"]] for row in rows], dtype=float)
    table = table[table[:, 0].argsort()]
    return table[:, 0], table[:, 1:]


def _edges(limits: Mapping[str, Any], names: list[str]) -> tuple[str, ...]:
    """Return lower and upper limits in the order of `names`; a dash for none."""
    return tuple(
        ABSENT if edge is None or edge != edge else number_text(edge)
        for name in names
        for edge in limits.get(name, (None, None))
    )


def _cells(level: Mapping[str, float], names: list[str]) -> tuple[str, ...]:
    """Return levels in the order of `names`, then differences to the first; a dash for a missing line."""
    values = [number_text(level[name]) if name in level else ABSENT for name in names]
    differences = [
        number_text(level[name] - level[names[0]], "+.1f") if name in level and names[0] in level else ABSENT
        for name in names[1:]
    ]
    return (*values, *differences)
