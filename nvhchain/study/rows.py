"""Rows of a study: one design at one operating point."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from nvhchain.study.definition import Study
from nvhchain.study.parameter import Design


@dataclass(frozen=True)
class Point:
    """Operating point.

    speed_rpm, torque: speed (rpm) and torque (N·m) on the input shaft; None for that of the case.
    """

    speed_rpm: float | None
    torque: float | None

    @property
    def changes(self) -> list[str]:
        """Assignments "path = value"."""
        places = {"operation.input_speed_rpm": self.speed_rpm, "operation.input_torque": self.torque}
        return [f"{path} = {value!r}" for path, value in places.items() if value is not None]

    @property
    def words(self) -> str:
        """Speed and torque after a blank, such as " at 1500 rpm and 60 N m"; empty for those of the case."""
        given = [f"{self.speed_rpm:g} rpm"] if self.speed_rpm is not None else []
        given += [f"{self.torque:g} N m"] if self.torque is not None else []
        return f" at {' and '.join(given)}" if given else ""


@dataclass(frozen=True)
class Row:
    """One design at one speed and torque.

    design: number of the design, from 0.
    values: parameter → value.
    speed_rpm, torque: operating point, where the study sets it (rpm, N·m).
    responses: response → number; empty for a refused design.
    limits: response → confidence limits (lower, upper); None for a limit that does not exist.
    refused: reason why there is no result.
    seconds: time of the run (s).
    draw: number of the draw of the tolerances, from 0.
    idle: parameters whose other values leave the responses of this design alone, as further runs have found.
    remarks: remarks on the model of the base case, at the first row.
    band: record of the limits of `level` line by line, for differences (`nvhchain.study.differences`).
    """

    design: int
    values: Design
    speed_rpm: float | None = None
    torque: float | None = None
    responses: dict[str, float] = field(default_factory=dict)
    limits: dict[str, tuple[float | None, float | None]] = field(default_factory=dict)
    refused: str | None = None
    seconds: float = 0.0
    draw: int = 0
    idle: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    band: Mapping[str, Any] | None = field(default=None, repr=False, compare=False)

    @property
    def point(self) -> Point:
        """Operating point."""
        return Point(self.speed_rpm, self.torque)


def operating_points(study: Study) -> list[Point]:
    """Return the operating points of every design."""
    return [Point(*both) for both in product(study.speeds_rpm or (None,), study.torques or (None,))]


Evaluate = Callable[[Sequence[tuple[int, Design]]], list[Row]]
"""Function that runs numbered designs at every operating point and returns their rows."""
