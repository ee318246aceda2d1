"""Results of a study as its page needs them, and the form of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any

from nvhchain.levels import number_text
from nvhchain.study.analysis import Effect, best_designs, main_effects, main_response, pareto_pair, worst_rows
from nvhchain.study.definition import DRAWN, PAIRED, Study
from nvhchain.study.differences import Difference, differences
from nvhchain.study.plans.gradient import Slope
from nvhchain.study.quality import Percentile
from nvhchain.study.responses import is_level
from nvhchain.study.rows import Row


@dataclass(frozen=True)
class Results:
    """Rows of a study and what follows from them.

    lines: lines that sum it up.
    """

    study: Study
    rows: tuple[Row, ...]
    lines: tuple[str, ...] = ()

    @property
    def main(self) -> str | None:
        """Response of the first figures."""
        return main_response(self.rows)

    @cached_property
    def worst(self) -> list[Row]:
        """Designs at their worst operating point."""
        return worst_rows(self.rows)

    @cached_property
    def effects(self) -> list[Effect]:
        """Main effects."""
        return main_effects(self.study, self.rows)

    @cached_property
    def differences(self) -> Mapping[int, Difference]:
        """Index of a row → its difference from design 0."""
        return differences(self.rows) if self.study.plan in PAIRED else {}

    @property
    def pair(self) -> tuple[str, str] | None:
        """Two responses of the figure of best designs."""
        if self.study.pareto:
            return self.study.pareto[0], self.study.pareto[1]
        return None if self.study.plan in DRAWN else pareto_pair(self.rows)

    @cached_property
    def best(self) -> list[Row]:
        """Designs that no other betters in both responses of `pair`."""
        return best_designs(self.worst, *self.pair) if self.pair else []


def text_of(value: Any, digits: int = 4) -> str:
    """Return a value as text of a table."""
    if not isinstance(value, float):
        return "" if value is None else str(value)
    return number_text(value, f".{digits}g")


def level_text(value: float | None) -> str:
    """Return a level or a difference of levels with one decimal."""
    return "" if value is None else number_text(value)


def limits_of(limits: Sequence[float | None] | None, digits: int = 1) -> str:
    """Return limits as text; "none" for one that does not exist."""
    if limits is None:
        return ""
    low, high = (
        "none" if limit is None or not isfinite(limit) else number_text(limit, f".{digits}f") for limit in limits
    )
    return f"{low} … {high}"


def response_text(name: str, value: float | None) -> str:
    """Return a response: levels with one decimal, others with four digits."""
    return level_text(value) if is_level(name) else text_of(value)


def design_text(study: Study, row: Row) -> str:
    """Return the values of a row in words."""
    return ", ".join(study.text(name, value) for name, value in row.values.items())


def point_titles(study: Study) -> list[str]:
    """Return the titles of the columns of `point_texts`."""
    given = {"speed / rpm": study.speeds_rpm, "torque / N m": study.torques}
    return [title for title, values in given.items() if values]


def point_texts(found: Row | Slope | Percentile) -> list[str]:
    """Return speed and torque as texts, as far as the study sets them."""
    return [text_of(value, 6) for value in (found.speed_rpm, found.torque) if value is not None]
