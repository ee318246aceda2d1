"""Record of an import: values taken and assumed, and what is missing, excluded, or contradicts itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Kind = Literal["taken", "assumed", "missing", "excluded", "differs"]


@dataclass(frozen=True)
class Finding:
    """One line of the record.

    kind: `taken`, `assumed`, `missing`, `excluded` or `differs`.
    part: component, such as "gear pinion".
    value: value with its unit.
    source: attribute, standard or rule.
    """

    kind: Kind
    part: str
    quantity: str
    value: str
    source: str = ""


@dataclass
class Findings:
    """Growing record, and the mistakes that refuse a file.

    lines: lines in the order of reading.
    mistakes: mistakes, each with value, limit and remedy.
    """

    lines: list[Finding] = field(default_factory=list)
    mistakes: list[str] = field(default_factory=list)

    def add(self, kind: Kind, part: str, quantity: str, value: str, source: str = "") -> None:
        """Add a line, once."""
        line = Finding(kind, part, quantity, value, source)
        if line not in self.lines:
            self.lines.append(line)

    def select(self, kind: Kind) -> list[Finding]:
        """Return the lines of one kind.

        Returns lines in the order of reading.
        """
        return [line for line in self.lines if line.kind == kind]

    def refuse(self, mistake: str) -> None:
        """Add a mistake, once."""
        if mistake not in self.mistakes:
            self.mistakes.append(mistake)
