"""Commands of an archive, each with the lines of numbers that follow it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from nvhchain.interop.notation._texts import text_lines

_NUMBERS = re.compile(r"\s*[-+.\d]")
_GROUP = re.compile(r"(\d{1,2})([aiefg])(\d{1,2})", re.IGNORECASE)
_TAGS = re.compile(r"(R\d+\.\d+|UNBL)$")


@dataclass
class Command:
    """Command in capitals, its fields without the tag of the release, and the lines of numbers that follow."""

    name: str
    fields: list[str]
    line: int
    rows: list[str] = field(default_factory=list)
    widths: tuple[tuple[int, int], ...] = ()

    def get(self, place: int, default: str = "") -> str:
        """Return a field, or the default where it is blank."""
        return (self.fields[place] if place < len(self.fields) else "") or default

    def cells(self) -> Iterator[list[str]]:
        """Yield the lines of numbers, divided by the format of the block."""
        for row in self.rows:
            if "," in row:
                yield [cell.strip() for cell in row.split(",")]
                continue
            start, cells = 0, []
            for count, width in self.widths:
                for _ in range(count):
                    cells.append(row[start : start + width].strip())
                    start += width
            if not self.widths:
                cells = row.split()
            while cells and not cells[-1]:
                cells.pop()
            yield cells


def commands(path: Path) -> list[Command]:
    """Return the commands of an archive; FileFormatError for a file that cannot be read."""
    found: list[Command] = []
    for number, raw in enumerate(text_lines(path), start=1):
        line = raw.split("!", 1)[0].rstrip()
        if not line:
            continue
        if found and _NUMBERS.match(line):
            found[-1].rows.append(line)
        elif found and line.lstrip().startswith("("):
            found[-1].widths = tuple((int(count), int(width)) for count, _, width in _GROUP.findall(line))
        else:
            name, *fields = (cell.strip() for cell in line.split(","))
            found.append(Command(name.upper(), [one for one in fields if not _TAGS.match(one)], number))
    return found
