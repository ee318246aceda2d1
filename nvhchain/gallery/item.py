"""One figure or table of the thesis: how it is made, the numbers that the thesis states, and the verdict."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from nvhchain.fidelity import Fidelity

Numbers = dict[str, float]
"""Quantity with its unit, such as "mesh order / µm" → value; 1 and 0 stand for yes and no where the unit is "yes"."""


@dataclass(frozen=True)
class Place:
    """Folders and fidelity of a gallery.

    picture: PNG of the item.
    shared: folder of intermediate results that items share.
    cases: folder of the gearbox cases.
    fidelity: fidelity of gears and gearboxes.
    """

    picture: Path
    shared: Path
    cases: Path
    fidelity: Fidelity


@dataclass(frozen=True)
class Stated:
    """Number that the thesis or a verdict states.

    value: value, in the unit of its quantity.
    margin: deviation of the chain up to which the verdict holds, relative to the value; absolute where it is 0.
    bound: True for the upper limit of a quantity.
    """

    value: float
    margin: float = 0.0
    bound: bool = False

    def holds(self, ours: float) -> bool:
        """Return True if our number is as near as the verdict states."""
        above = ours - self.value
        return (above if self.bound else abs(above)) <= self.margin * (abs(self.value) or 1.0)


@dataclass(frozen=True)
class Item:
    """Figure or table of the thesis.

    number: number in the thesis, such as "5.7" or "table 3.2"; a span "3.5-3.16" has a letter for each of its parts.
    title: content.
    verdict: one sentence: agreement and deviations.
    make: writes the picture and returns our numbers.
    stated: numbers of the thesis by quantity.
    reading: assumption about the content, where the project has no record of the caption.
    uses: packages whose code decides the numbers.
    ours: numbers of the chain that the verdict states.
    drawn: False for a table, which has no picture.
    """

    number: str
    title: str
    verdict: str
    make: Callable[[Place], Numbers]
    stated: Mapping[str, Stated] = field(default_factory=dict)
    reading: str = ""
    uses: tuple[str, ...] = ("lumped",)
    ours: Mapping[str, Stated] = field(default_factory=dict)
    drawn: bool = True

    @property
    def name(self) -> str:
        """Name of the item's files."""
        return re.sub(r"[^a-z0-9]+", "_", self.number.lower())

    def answers(self, number: str) -> bool:
        """Return True if the item is, or belongs to, the requested number."""
        asked, own = (n.lower().replace("–", "-").removeprefix("figure ").strip() for n in (number, self.number))
        if asked == own:
            return True
        span = re.fullmatch(r"(\d)\.(\d+)-\1\.(\d+)[a-z]?", own)
        if span is None:
            return False
        chapter, first, last = span.groups()
        figure = re.fullmatch(rf"{chapter}\.(\d+)", asked)
        return asked == f"{chapter}.{first}-{chapter}.{last}" or (
            figure is not None and int(first) <= int(figure[1]) <= int(last)
        )
