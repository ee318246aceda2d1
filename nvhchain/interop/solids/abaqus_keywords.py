"""Abaqus input as keyword blocks: parameters, data lines, *INCLUDE; CalculiX writes the same language."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from nvhchain.interop.notation._texts import lines_with_includes

_FILLED = {
    "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "KINEMATIC", "MPC", "BOUNDARY", "ELASTIC", "DENSITY",
    "EQUATION", "TIE",
}  # fmt: skip
"""Keywords that are read and may have their data in a separate file."""


@dataclass(frozen=True)
class Block:
    """Keyword block: upper-case name, parameters and cells of the data lines.

    Parameters are upper-case name → value as written, "" for a flag.
    """

    name: str
    parameters: dict[str, str]
    data: list[list[str]]

    def get(self, name: str, default: str = "") -> str:
        """Return the value of parameter `name`, without quotes."""
        return self.parameters.get(name, default).strip("\"'")


def real(cell: str) -> float:
    """Return a number with an exponent after E or D; raises ValueError."""
    return float(cell.upper().replace("D", "E"))


def blocks(path: Path) -> Iterator[Block]:
    """Yield every keyword of the file in order, with its data lines."""
    current: Block | None = None
    for line in all_lines(path):
        text = line.strip()
        if text.startswith("**"):
            continue
        if text.startswith("*"):
            if current is not None:
                yield current
            current = _keyword(text)
        elif text and current is not None:
            current.data.append([cell.strip() for cell in text.rstrip(",").split(",")])
    if current is not None:
        yield current


def all_lines(path: Path) -> Iterator[str]:
    """Yield lines of the file, one per keyword, and of the files in *INCLUDE and INPUT."""
    return lines_with_includes(path, _joined, _included)


def _joined(lines: Iterable[str]) -> Iterator[str]:
    """Join keyword lines that end with a comma with the next line."""
    pending = ""
    for line in lines:
        text = line.strip()
        if pending and text.startswith("**"):
            continue
        if pending:
            line = text = pending + text
            pending = ""
        if text.startswith("*") and not text.startswith("**") and text.endswith(","):
            pending = text
        else:
            yield line


def _included(line: str) -> tuple[str, str] | None:
    text = line.strip()
    if not text.startswith("*") or text.startswith("**"):
        return None
    block = _keyword(text)
    if block.name == "INCLUDE":
        return "", block.get("INPUT")
    return (text, block.get("INPUT")) if block.name in _FILLED and block.get("INPUT") else None


def _keyword(text: str) -> Block:
    head, *rest = text[1:].split(",")
    parameters = {}
    for part in rest:
        name, _, value = part.partition("=")
        if name.strip():
            parameters[" ".join(name.upper().split())] = value.strip()
    return Block(" ".join(head.upper().split()), parameters, [])
