"""Lines of the keys of a TOML text, and the line to which an error message belongs.

`tomllib` gives no positions. The scanner here reads texts that `tomllib` has accepted, and skips values.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from typing import Any

from nvhchain.dimensions import UNITS

_BLANK = re.compile(r"(?:[ \t\r\n,]|#[^\n]*)*")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|' r"'''.*?'{3,5}|" r'"(?:\\.|[^"\\\n])*"|' r"'[^'\n]*'", re.S)
_KEY = re.compile(r"""[ \t]*("(?:\\.|[^"\\\n])*"|'[^'\n]*'|[A-Za-z0-9_-]+)[ \t]*(\.?)""")
_SCALAR = re.compile(r"[^,\]}\n#]*")
_STEP = re.compile(r"\.(?P<key>\w+)|\[(?P<number>\d+)\](?: \([^)]*\))?")
_SUBJECT = re.compile(
    r"\b(gear|shaft|bearing|stage|field point|housing\.bores:) '?([^':]+?)'?(?=:| at | is |$| in | and )"
)
_LISTS = {"field point": "field_points", "housing.bores:": "bores"}


class Table(dict[str, Any]):
    """Table of a case file with the places of its keys.

    place : file and line of the table itself.
    """

    def __init__(
        self, content: Mapping[str, Any], places: dict[str, tuple[str, int]], place: tuple[str, int] | None = None
    ) -> None:
        super().__init__(content)
        self.places, self.place = places, place


def placed(content: Any, text: str, file: str) -> Any:
    """Return the content of a text, as tables that have the places of their keys."""
    lines = _Scanner(text).lines()

    def convert(value: Any, path: tuple[str | int, ...]) -> Any:
        if isinstance(value, dict):
            inner = {key: convert(item, (*path, key)) for key, item in value.items()}
            places = {key: (file, lines[(*path, key)]) for key in value if (*path, key) in lines}
            return Table(inner, places, (file, lines[path]) if path in lines else None)
        if isinstance(value, list):
            return [convert(item, (*path, number)) for number, item in enumerate(value)]
        return value

    return convert(content, ())


def merged_places(base: Any, change: Any) -> dict[str, tuple[str, int]]:
    """Return the places of two tables of which the second replaces the first."""
    return {**getattr(base, "places", {}), **getattr(change, "places", {})}


def path_steps(text: str) -> tuple[list[str | int], int]:
    """Return the keys and numbers of the path at the begin of a text, such as ".gears[1].teeth", and where it ends."""
    steps, end = list[str | int](), 0
    while step := _STEP.match(text, end):
        steps.append(step["key"] if step["key"] is not None else int(step["number"]))
        end = step.end()
    return steps, end


def add_line(message: str, file: str, table: Mapping[str, Any]) -> str:
    """Return a message as `file:line: message`, by the path at its begin and the parts and fields that it names.

    A change of the file, which has line 0, is named instead of the line.
    """
    if not message.startswith(file):
        return message
    rest, place, here, own = message.removeprefix(file), None, table, False
    value: Any = table
    steps, position = path_steps(rest)
    for step in steps:
        own = False
        if isinstance(step, str):
            own = step in getattr(here, "places", {})
            place = getattr(here, "places", {}).get(step, place)
            value = here.get(step) if isinstance(here, Mapping) else None
        else:
            value = value[step] if isinstance(value, list) and step < len(value) else None
        if isinstance(value, Mapping):
            here, place, own = value, getattr(value, "place", None) or place, False
    said = rest[position:].lstrip(": ")
    opening = re.match(r"(\w+): ", said)
    if opening and isinstance(here.get(opening[1]), Table):
        here = here[opening[1]]
        place, said = here.place, said[opening.end() :]
        rest, position = f"{rest[:position]}{opening[1]}: {said}", position + opening.end()
    part, place = _subject(said, table, here, place)
    place = (None if own else _field_place(said, part, every_word=part is here)) or place
    if place is None:
        return message
    shown = rest.lstrip(".: ") if position else said
    return f"{place[0]}:{place[1]}: {shown}" if place[1] else f"{file} with {place[0]}: {shown}"


def _subject(
    said: str, table: Mapping[str, Any], here: Mapping[str, Any], place: tuple[str, int] | None
) -> tuple[Mapping[str, Any], tuple[str, int] | None]:
    """Return the table, and its place, of the first part that a message names; those given if there is none."""
    found = _SUBJECT.match(said)
    if found is not None:
        kind, name = found.groups()
        key = _LISTS.get(kind, f"{kind}s")
        owner = table.get("housing") if key == "bores" else table
        items = owner.get(key) if isinstance(owner, Mapping) else None
        for item in items if isinstance(items, list) else ():
            if isinstance(item, Mapping) and item.get("name") == name and getattr(item, "place", None):
                return item, item.place  # type: ignore[attr-defined]
    return here, place


def _field_place(said: str, here: Mapping[str, Any], *, every_word: bool) -> tuple[str, int] | None:
    """Return the place of the first field that a message names, of a table or of one in it; changes come first."""
    said = re.split("; did you mean|; known fields", said)[0]
    words = re.findall(r"\b[a-z]\w*\b", said) if every_word else []
    found = [
        next(_places(word, here), None)
        for word in (*re.findall(r"\b([a-z]\w*)(?= = | ')", said), *re.findall(r"\b[a-z]+_\w+\b", said), *words)
    ]
    known = [place for place in found if place is not None]
    return next((place for place in known if not place[1]), known[0] if known else None)


def _places(word: str, here: Mapping[str, Any], depth: int = 1) -> Iterator[tuple[str, int]]:
    places: dict[str, tuple[str, int]] = getattr(here, "places", {})
    for key in (word, *(f"{word}_{unit}" for unit in UNITS)):
        if key in places and word != "name":
            yield places[key]
    for inner in here.values() if depth and "_" in word else ():
        if isinstance(inner, Mapping):
            yield from _places(word, inner, depth - 1)


class _Scanner:
    """Scanner of a valid TOML text for the lines of its keys."""

    def __init__(self, text: str) -> None:
        self._text, self._position = text.replace("\r\n", "\n"), 0
        self._ends = [hit.start() for hit in re.finditer("\n", self._text)]
        self._lines: dict[tuple[str | int, ...], int] = {}
        self._counts: dict[tuple[str | int, ...], int] = {}

    def lines(self) -> dict[tuple[str | int, ...], int]:
        """Return the line of every key, of every table in a list, and of every header."""
        table: tuple[str | int, ...] = ()
        while self._skip(_BLANK) and self._position < len(self._text):
            line = self._line()
            if self._text.startswith("[", self._position):
                listed = self._text.startswith("[[", self._position)
                self._position += 1 + listed
                table = self._resolve(self._key(), listed)
                self._position = self._text.index("]", self._position) + 1 + listed
                self._lines.setdefault(table, line)
            else:
                self._pair(table)
        return self._lines

    def _line(self) -> int:
        return bisect_right(self._ends, self._position - 1) + 1

    def _skip(self, pattern: re.Pattern[str]) -> bool:
        found = pattern.match(self._text, self._position)
        self._position = found.end() if found else self._position
        return True

    def _key(self) -> tuple[str, ...]:
        names, more = [], "."
        while more:
            found = _KEY.match(self._text, self._position)
            assert found is not None, "tomllib accepted the text"
            raw, more = found.groups()
            names.append(json.loads(raw) if raw[0] == '"' else raw.strip("'"))
            self._position = found.end()
        return tuple(names)

    def _resolve(self, names: tuple[str, ...], listed: bool) -> tuple[str | int, ...]:
        """Return the path of a header; a list of tables is entered at its last entry."""
        path: tuple[str | int, ...] = ()
        for number, name in enumerate(names):
            path = (*path, name)
            last = number == len(names) - 1
            if last and listed:
                self._counts[path] = self._counts.get(path, -1) + 1
                self._lines.setdefault(path, self._line())
            if path in self._counts:
                path = (*path, self._counts[path])
            elif not last:
                self._lines.setdefault(path, self._line())
        return path

    def _pair(self, table: tuple[str | int, ...]) -> None:
        line, path = self._line(), table
        for name in self._key():
            path = (*path, name)
            self._lines.setdefault(path, line)
        self._position = self._text.index("=", self._position) + 1
        self._value(path)

    def _value(self, path: tuple[str | int, ...]) -> None:
        self._skip(_BLANK)
        opening = self._text[self._position : self._position + 1]
        if opening not in ("[", "{"):
            found = _STRING.match(self._text, self._position) or _SCALAR.match(self._text, self._position)
            self._position = found.end() if found else self._position
            return
        self._position += 1
        number = 0
        while self._skip(_BLANK) and self._text[self._position] not in "]}":
            if opening == "[":
                self._lines[(*path, number)] = self._line()
                self._value((*path, number))
                number += 1
            else:
                self._pair(path)
        self._position += 1
