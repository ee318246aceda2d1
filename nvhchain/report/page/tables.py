"""Tables and curves of a page as CSV files or one Excel workbook."""

from __future__ import annotations

import base64
import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import unescape
from io import StringIO
from itertools import product, zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.files.atomic_write import write_output
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.report.page.blocks import Figure, Hero, Table
from nvhchain.report.page.sections import SECTIONS, section_module
from nvhchain.report.stored import is_study, stored_results
from nvhchain.runtime.extras import check_installed

FOLDER = "tables"
"""Name of the folder of CSV files."""

FILES = (".csv", ".doc", ".docx", ".h5", ".html", ".json", ".ods", ".pdf", ".png", ".svg", ".txt", ".xls", ".xlsm")
"""Suffixes of files that are neither a workbook nor the name of a folder."""

_LIMITS = re.compile(r"(?:(below )|([+−-]?\d+(?:\.\d+)?)…)([+−-]?\d+(?:\.\d+)?)")
"""Limits as text: the lower one or none, and the upper one."""

MOST_POINTS = 10_000
"""Largest number of points of a map in a table."""

_LONGEST_NAME = 28
"""Largest number of characters in the name of a table; numbers may follow."""


@dataclass(frozen=True)
class PageTable:
    """Table of a page, or the curves of a figure.

    rows : titles, then cells: numbers, texts or None.
    """

    name: str
    caption: str
    rows: Sequence[Sequence[str | float | None]]


def page_tables(folder: str | Path) -> list[PageTable]:
    """Return all tables and curves of the page of a run or comparison, or the tables of a study.

    Raises InputError if the folder holds no results, or unreadable ones.
    """
    if is_study(Path(folder)):
        return [PageTable(path.stem[:_LONGEST_NAME], "", _read(path)) for path in sorted(Path(folder).glob("*.csv"))]
    stored = stored_results(Path(folder))
    found: list[PageTable] = []
    for name in SECTIONS:
        section = name.rpartition(".")[2]
        parts = [part for block in section_module(name).blocks(stored) for part in _parts(block)]
        for number, (caption, rows) in enumerate(parts, start=1):
            end = f"-{number}" if len(parts) > 1 else ""
            found.append(PageTable(section[:_LONGEST_NAME] + end, caption, [_distinct(rows[0]), *rows[1:]]))
    return found


def _distinct(head: list[str | float | None]) -> list[str | float | None]:
    """Return the head of a table with a number behind a name that stands there before."""
    return [
        f"{name} ({head[: place + 1].count(name)})" if name and name in head[:place] else name
        for place, name in enumerate(head)
    ]


def write_tables(folder: str | Path, out: str | Path | None = None) -> list[Path]:
    """Write all tables and curves of the page of a run or comparison, or the tables of a study.

    out : Excel workbook (.xlsx), or folder of CSV files; by default `tables` in the folder.

    Raises InputError if the folder holds no results, or XlsxWriter is not installed for a workbook.
    """
    place = Path(folder) / FOLDER if out is None else Path(out)
    if place.suffix.lower() == ".xlsx":
        check_installed("xlsxwriter")
        from nvhchain.report.page._xlsxwriter import workbook

        tables = page_tables(folder)
        return [write_output(place, workbook([(table.name, table.caption, table.rows) for table in tables]))]
    require(
        place.suffix.lower() not in FILES or place.is_dir(),
        f"--out {place}: name a folder for CSV files, or a workbook that ends in .xlsx",
    )
    tables = page_tables(folder)
    target, written = writable_folder(place, "out"), []
    for table in tables:
        text = StringIO()
        csv.writer(text, lineterminator="\n").writerows(table.rows)
        written.append(target / f"{table.name}.csv")
        write_text(written[-1], text.getvalue())
    return written


def _parts(block: Any) -> Iterator[tuple[str, list[list[str | float | None]]]]:
    """Yield caption and rows of everything in a block that has numbers."""
    if isinstance(block, Hero):
        for figure in (block.levels, block.where):
            yield from _parts(figure) if figure is not None else ()
    elif isinstance(block, Table):
        yield block.caption, _typed([block.head, *block.rows])
    elif isinstance(block, Figure) and block.kind == "plotly":
        yield from _curves(block)
        yield from _map(block)
    elif isinstance(block, Figure) and block.kind == "spectrum":
        yield block.caption, _spectrum(block.data)


def _curves(figure: Figure) -> Iterator[tuple[str, list[list[str | float | None]]]]:
    """Yield the curves and bars of a figure: two columns each; bodies have no table."""
    columns: list[list[str | float | None]] = []
    for trace in figure.data:
        if (
            trace["type"] not in ("scatter", "bar")
            or trace.get("fill")
            or (trace.get("mode") == "lines" and trace.get("hoverinfo") == "skip")
        ):
            continue
        axes = {axis: str(trace.get(f"{axis}axis", axis)).replace(axis, f"{axis}axis", 1) for axis in "xy"}
        titles = [_title(figure.layout, name) for name in axes.values()]
        name = ", ".join(filter(None, (_panel(figure.layout, trace), _plain(str(trace.get("name", ""))))))
        x, y = _values(trace["x"]), _values(trace.get("customdata", trace["y"]))
        if len(y) % 3 == 0 and all(value is None for value in y[2::3]):
            x, y = x[1::3], y[1::3]  # heads of the stems of a line spectrum
        for title, values in zip(titles, (x, y), strict=True):
            columns.append([", ".join(filter(None, (name, title))), *values])
    if columns:
        yield figure.caption, [list(row) for row in zip_longest(*columns)]


def _map(figure: Figure) -> Iterator[tuple[str, list[list[str | float | None]]]]:
    """Yield the points of the maps of a figure; those of many points, such as waterfalls, stand in HDF5 files."""
    maps = [(trace, _values(trace["z"])) for trace in figure.data if trace["type"] == "heatmap"]
    if maps and max(len(z) for _, z in maps) <= MOST_POINTS:
        unit = _plain(figure.layout["coloraxis"]["colorbar"]["title"]["text"])
        rows: list[list[str | float | None]] = [
            ["name", *(_title(figure.layout, f"{axis}axis") for axis in "xy"), unit]
        ]
        for trace, z in maps:
            places = product(_values(trace["y"]), _values(trace["x"]))
            rows += [[_plain(trace["name"]), x, y, level] for (y, x), level in zip(places, z, strict=True)]
        yield figure.caption, rows


def _panel(layout: Mapping[str, Any], trace: Mapping[str, Any]) -> str:
    """Return the title of the panel of a trace; empty for a figure of one."""
    own = f"{trace.get('xaxis', 'x')} domain"
    return next((_plain(note["text"]) for note in layout.get("annotations", []) if note.get("xref") == own), "")


def _spectrum(data: Mapping[str, Any]) -> list[list[str | float | None]]:
    """Return the lines of spectra: configuration, frequency, order, and level at every microphone."""
    rows: list[list[str | float | None]] = [
        [
            "configuration",
            "frequency / Hz",
            "order",
            *(f"{point}, dB re {data['reference']}" for point in data["points"]),
        ]
    ]
    for run in data["runs"]:
        for line, frequency in enumerate(run["frequency"]):
            order = round(frequency / run["turns"], 6) if run["turns"] else None
            rows.append([_plain(run["name"]), frequency, order, *(level[line] for level in run["level"])])
    return rows


def _title(layout: Mapping[str, Any], axis: str) -> str:
    """Return the title of an axis; that of the last panel where panels share it."""
    own = layout.get(axis, {}).get("title", {}).get("text", "")
    if own:
        return _plain(own)
    others = [
        settings.get("title", {}).get("text", "") for name, settings in layout.items() if name.startswith(axis[:5])
    ]
    return _plain(next(filter(None, others), ""))


def _values(given: Any) -> list[str | float | None]:
    """Return the values of a trace, also of a packed one."""
    if isinstance(given, Mapping):
        numbers = np.frombuffer(base64.b64decode(given["bdata"]), dtype=f"<{given['dtype']}")
        digits = np.finfo(numbers.dtype).precision + 1 if numbers.dtype.kind == "f" else 17
        return [float(f"{number:.{digits}g}") if np.isfinite(number) else None for number in numbers]
    return [_plain(value) if isinstance(value, str) else None if value is None else float(value) for value in given]


def _read(path: Path) -> list[list[str | float | None]]:
    """Return the rows of a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        return _typed(list(csv.reader(file)))


def _typed(rows: Sequence[Sequence[str]]) -> list[list[str | float | None]]:
    """Return rows with numbers where cells are numbers; a column of limits becomes two."""
    columns: list[list[str | float | None]] = []
    for title, *cells in zip(*rows, strict=True):
        found = [_LIMITS.fullmatch(cell) for cell in cells]
        if not any(found) or any(cell and not limits for cell, limits in zip(cells, found, strict=True)):
            columns.append([title, *map(_value, cells)])
            continue
        for end, group in (("lower", 2), ("upper", 3)):
            columns.append(
                [f"{title}, {end}", *(_value(limits[group]) if limits and limits[group] else None for limits in found)]
            )
    return [list(row) for row in zip(*columns, strict=True)]


def _value(cell: str) -> str | float | None:
    """Return a cell as a number where it is one."""
    text = cell.replace("−", "-")
    if re.fullmatch(r"[+-]?\d+", text):
        return int(text)
    return float(text) if re.fullmatch(r"[+-]?\d+(\.\d+)?(e[+-]?\d+)?", text) else cell


def _plain(text: str) -> str:
    """Return a text of Plotly without its markup."""
    return unescape(re.sub(r"<[^>]*>", "", text.replace("<br>", " ")))
