"""Tables of text: commas, semicolons, tabs; decimal points or commas; UTF-8, UTF-16 or a Windows code page."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.interop.forces.channel_units import unit_called
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.notation._texts import first_line

_SAMPLE = 1 << 20
"""Bytes from which the encoding is judged."""

_LINES = 200
"""Lines from which the separator is judged."""


@dataclass(frozen=True)
class Layout:
    """Separator of cells and decimal mark of a table."""

    separator: str = ","
    decimal: str = "."

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line, which may be quoted."""
        row = csv.reader([line], delimiter=self.separator, skipinitialspace=True)
        return [cell.strip() for cell in next(row, [])]

    def is_number(self, text: str) -> bool:
        """Return True for a number with this decimal mark."""
        if self.decimal == ",":
            if "." in text:
                return False
            text = text.replace(",", ".")
        try:
            float(text)
        except ValueError:
            return False
        return True

    def trimmed(self, line: str) -> str:
        """Return a line without blanks around it and one separator at its end."""
        return (line.strip() if self.separator != "\t" else line.strip(" \r\n")).removesuffix(self.separator)


def encoding_of(path: Path) -> str:
    """Return the encoding of a text file: by its mark, its zeros, or UTF-8 where that fits, else Windows-1252."""
    with path.open("rb") as file:
        data = file.read(_SAMPLE)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in data[:200]:
        return "utf-16-le" if data[1:2] == b"\0" else "utf-16-be"
    for end in range(4):  # the sample may end within a character
        try:
            data[: len(data) - end].decode("utf-8")
        except UnicodeDecodeError:
            continue
        return "utf-8-sig"
    return "cp1252"


def layout_of(lines: Iterator[str]) -> Layout:
    """Return the layout in which a line has most numbers; by default commas and decimal points."""
    best, most = Layout(), 0
    for line in lines:
        for separator in (";", "\t", ","):
            for decimal in (".", ",") if separator != "," else (".",):
                layout = Layout(separator, decimal)
                cells = layout.cells(layout.trimmed(line))
                count = sum(map(layout.is_number, cells))
                if count == len(cells) and count > most and (count > 1 or separator == ","):
                    best, most = layout, count
        if most > 1:
            break
    return best


def read_text_table(path: Path) -> Record:
    """Read comments after #, a line of channel names, a line of units if it holds no number, then numbers.

    Lines above the names with other numbers of cells are free text. Without names, the last comments with as many cells
    are names, with units below them. Cells may be quoted; lines may end with a separator.
    """
    layout = Layout()
    try:
        encoding = encoding_of(path)
        with path.open(newline="", encoding=encoding) as file:
            layout = layout_of(line for line in islice(file, _LINES) if line.strip() and line.lstrip()[0] != "#")
        with path.open(newline="", encoding=encoding) as file:
            lines = map(layout.trimmed, file)
            head, below = _head(lines, layout)
            rows: Iterator[str] = chain(below, lines)
            if layout.decimal == ",":
                rows = map(_point_numbers, rows)
            table = np.loadtxt(rows, delimiter=layout.separator, ndmin=2, comments="#", quotechar='"')
        names, stated = head[0], head[1] if head[1:] else [""] * len(head[0])
        if len(stated) != len(names):
            raise ValueError(f"{len(names)} names, but {len(stated)} units")
        if table.shape[1] != len(names):
            raise ValueError(f"{len(names)} names, but {table.shape[1]} columns")
    except (OSError, ValueError, csv.Error) as error:
        raise FileFormatError(
            f"{path}: not a table of numbers, with commas, semicolons or tabs between them, under a line of names: "
            f"{first_line(error)}"
        ) from None
    return record_of(path, names, stated, table)


def _point_numbers(line: str) -> str:
    """Return numbers with decimal points; ValueError for one that has a point already."""
    numbers = line.split("#")[0]
    if "." in numbers:
        raise ValueError(f"{numbers.strip()[:60]!r} has a point beside decimal commas, which may divide thousands")
    return numbers.replace(",", ".")


def record_of(path: Path, names: list[str], units: list[str], table: np.ndarray) -> Record:
    """Return the columns of a table as channels; FileFormatError where names repeat."""
    if len(set(names)) != len(names):
        raise FileFormatError(f"{path}: channel names repeat: {', '.join(names)}: put a line of different names on top")
    stated = {name: unit for name, unit in zip(names, units, strict=True) if unit}
    return Record(str(path), {name: table[:, i].copy() for i, name in enumerate(names)}, stated)


def _head(lines: Iterator[str], layout: Layout) -> tuple[list[list[str]], list[str]]:
    """Return cells of the line of names and of units, if any, and the lines read below them, numbers first."""
    comments: list[list[str]] = []
    read: list[str] = []
    head: list[list[str]] = []
    for line in lines:
        if line.startswith("#"):
            comments.append(layout.cells(line.lstrip("# ")))
        elif line:
            read.append(line)
            head.append(layout.cells(line))
            if all(map(layout.is_number, head[-1])):
                break
    if not head:
        raise ValueError("it ends before the first number")
    # free text above the names has other numbers of cells than the table
    above = next((i for i, cells in enumerate(head[:-1]) if len(cells) == len(head[-1])), 0)
    head, read = head[above:], read[above:]
    if len(head) == 1:
        named = [cells for cells in comments if len(cells) == len(head[0]) and not all(map(layout.is_number, cells))]
        if named:
            return named[-2:] if all(map(unit_called, named[-1])) else named[-1:], read
    count = 2 if head[1:] and not any(map(layout.is_number, head[1])) else 1
    rest = read[count:] or [next((line for line in lines if line and not line.startswith("#")), "")]
    if not rest[0]:
        raise ValueError("it ends before the first number")
    return head[:count], rest
