"""Abaqus input as keyword blocks: parameters, data lines, *INCLUDE; CalculiX writes the same language."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from nvhchain.interop._includes import lines_with_includes


@dataclass(frozen=True)
class Block:
    """A keyword.  name: upper case.  parameters: upper-case name → value as written, "" for a flag.  data: cells."""

    name: str
    parameters: dict[str, str]
    data: list[list[str]]

    def get(self, name: str, default: str = "") -> str:
        """Value of parameter `name`, without quotes."""
        return self.parameters.get(name, default).strip("\"'")


def blocks(path: Path) -> Iterator[Block]:
    """Every keyword of the file in order, with its data lines."""
    current: Block | None = None
    pending = ""
    for line in lines_with_includes(path, included):
        text = line.strip()
        if text.startswith("**"):
            continue
        if pending:
            text, pending = pending + text, ""
        if text.startswith("*"):
            if text.endswith(","):
                pending = text
                continue
            if current is not None:
                yield current
            current = _keyword(text)
        elif text and current is not None:
            current.data.append([cell.strip() for cell in text.rstrip(",").split(",")])
    if current is not None:
        yield current


def included(line: str) -> str | None:
    """Name of the file that *INCLUDE names."""
    return _keyword(line.strip()).get("INPUT") if line[:8].upper() == "*INCLUDE" else None


def _keyword(text: str) -> Block:
    head, *rest = text[1:].split(",")
    parameters = {}
    for part in rest:
        name, _, value = part.partition("=")
        if name.strip():
            parameters[" ".join(name.upper().split())] = value.strip()
    return Block(" ".join(head.upper().split()), parameters, [])
