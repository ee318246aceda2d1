"""Nastran bulk data as cards: small, large and free fields, continuations, INCLUDE; case control before BEGIN BULK."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from nvhchain.interop.notation._texts import lines_with_includes

_SHORT_EXPONENT = re.compile(r"(?<=[0-9.])([+-]\d+)$")


def _joined(lines: Iterable[str]) -> Iterator[str]:
    """Join lines of INCLUDE until its name has begun and its quote is closed."""
    pending = ""
    for line in lines:
        whole = pending + line.strip() if pending else line
        name = _file_name(whole)
        unclosed = name is not None and name[:1] in ("'", '"') and name.count(name[:1]) == 1
        pending = whole.rstrip() if name == "" or unclosed else ""
        if not pending:
            yield whole
    if pending:
        yield pending


def _included(line: str) -> tuple[str, str] | None:
    name = _file_name(line)
    return None if name is None else ("", name.strip("'\""))


def _file_name(line: str) -> str | None:
    """Return the file name of an INCLUDE statement with its quotes."""
    text = line.lstrip()
    return text[7:].split("$")[0].strip() if text[:7].upper() == "INCLUDE" else None


def split_deck(path: Path) -> tuple[list[str], list[str]]:
    """Return case control and bulk data lines; a file without BEGIN BULK is all bulk data."""
    lines = list(lines_with_includes(path, _joined, _included))
    start = next((i for i, line in enumerate(lines) if re.match(r"\s*BEGIN\s+BULK", line, re.I)), -1)
    return lines[: max(start, 0)], lines[start + 1 :]


def cards(lines: list[str]) -> Iterator[list[str]]:
    """Yield each card as its upper-case name and its fields without the continuation marks, up to ENDDATA."""
    card: list[str] = []
    for raw in lines:
        line = raw.split("$", 1)[0].rstrip().expandtabs(8)
        if not line.strip():
            continue
        fields, continues = _fields(line)
        if continues:
            if card:
                # a line holds eight fields (large: four) even if trailing ones are blank
                card += [""] * (-(len(card) - 1) % (4 if "*" in line[:8] else 8))
                card += fields
            continue
        if card:
            yield card
        name = fields[0].rstrip("*").strip().upper()
        if name.startswith("DEQATN"):  # its formula may have commas
            name = "DEQATN"
        if name == "ENDDATA":
            return
        card = [name, *fields[1:]]
    if card:
        yield card


def _fields(line: str) -> tuple[list[str], bool]:
    """Return the fields of one line without continuation marks, and True if it continues the card before."""
    if "," in line:
        parts = [part.strip() for part in line.split(",")]
        limit = 5 if "*" in parts[0] else 9
        continues = parts[0] == "" or parts[0][0] in "+*"
        return (parts[1:limit] if continues else parts[:limit]), continues
    head = line[:8].strip()
    width, count = (16, 4) if "*" in head else (8, 8)
    values = [line[8 + width * i : 8 + width * (i + 1)].strip() for i in range(count)]
    while values and not values[-1]:
        values.pop()
    continues = head == "" or head[0] in "+*"
    return (values if continues else [head, *values]), continues


def real(text: str) -> float:
    """Return a Nastran real: `1.5`, `1.5E-3`, `1.5D-3` or `1.5-3`; raises ValueError."""
    text = text.upper().replace("D", "E").replace(" ", "")
    if "E" not in text:
        text = _SHORT_EXPONENT.sub(r"E\1", text)
    return float(text)


_MOST_NUMBERS = 20_000_000
"""Largest number of members of a range."""


def numbers(fields: list[str], known: Collection[int] | None = None) -> list[int]:
    """Return whole numbers with `THRU` (and `BY`) expanded, without blanks.

    known : numbers to keep of a range; Nastran keeps the existing grid points.
    """
    words = [field.upper() for field in fields if field]
    result: list[int] = []
    i = 0
    while i < len(words):
        if words[i] == "THRU":
            stepped = i + 2 < len(words) and words[i + 2] == "BY"
            span = range(result.pop(), int(words[i + 1]) + 1, int(words[i + 3]) if stepped else 1)
            if known is None and len(span) > _MOST_NUMBERS:
                raise ValueError(f"THRU makes {len(span)} numbers, more than {_MOST_NUMBERS}")
            result += span if known is None else _known_in_range(span, known)
            i += 4 if stepped else 2
        else:
            result.append(int(words[i]))
            i += 1
    return result


def _known_in_range(span: range, known: Collection[int]) -> list[int]:
    """Return the known numbers in a range, which may be far longer than their list."""
    if len(span) > len(known):
        return sorted(n for n in known if n in span)
    return [n for n in span if n in known]
