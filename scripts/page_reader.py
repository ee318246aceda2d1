"""Texts and figures of a report page, for tests."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any


class Reader(HTMLParser):
    """Texts, ids, addresses and JSON figures of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[tuple[str, dict[str, str | None]]] = []
        self.figures: dict[str | None, Any] = {}
        self.ids, self.links, self.cells, self.texts = (list[Any]() for _ in range(4))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        values = dict(attributes)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[name] for name in ("src", "href") if values.get(name)]
        self.open.append((tag, values))

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open.pop()[0] != tag:
            pass

    def handle_data(self, data: str) -> None:
        tag, values = self.open[-1] if self.open else ("", dict[str, str | None]())
        if tag == "script" and "data-plot" in values:
            self.figures[values["data-plot"]] = json.loads(data)
        elif tag in ("td", "th"):
            self.cells.append(data)
        elif tag not in ("script", "style"):
            self.texts.append(data.strip())


def read(path: Path) -> Reader:
    """Return what a page holds."""
    reader = Reader()
    reader.feed(path.read_text())
    return reader
