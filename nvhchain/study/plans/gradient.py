"""Slopes of responses by central differences, extrapolated to a step of zero, with their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.study.analysis import sized_responses
from nvhchain.study.definition import Study
from nvhchain.study.differences import LEVELS, level_difference
from nvhchain.study.parameter import Parameter
from nvhchain.study.plans.designs import STEPS
from nvhchain.study.rows import Evaluate, Point, Row

FIRST_STEP = 0.5
"""First step, relative to the distance from the middle of a range to its ends."""

CLOSE = 0.02
"""Relative error of all slopes of the level at which steps end."""

FLAT_DB = 0.02
"""Error of the level over a range (dB) that is close enough, however flat it is."""


@dataclass(frozen=True)
class Slope:
    """Slope of a response in a parameter at the middle of all ranges.

    parameter, response: names.
    speed_rpm, torque: operating point, where the study sets it (rpm, N·m).
    value: slope, in units of the response per unit of the parameter.
    error: error of the difference quotient, estimated from two steps.
    limits: 95 % confidence limits of the slope of a level, from its fidelity; None where there are none.
    step: smallest step, in the unit of the parameter.
    """

    parameter: str
    response: str
    speed_rpm: float | None
    torque: float | None
    value: float
    error: float
    limits: tuple[float | None, float | None]
    step: float


def walk_gradient(study: Study, evaluate: Evaluate) -> list[Row]:
    """Evaluate the middle of all ranges, and both sides of it for one parameter after the other.

    evaluate: function that runs numbered designs.
    Returns rows; steps of a parameter halve until the slopes of the level are close or their error grows.
    """
    middle = {parameter.name: _middle(parameter) for parameter in study.parameters}
    rows = evaluate([(0, middle)])
    for parameter in study.parameters:
        last = np.inf
        for halving in range(STEPS):
            step = _step(parameter, halving)
            number = rows[-1].design
            rows += evaluate(
                [
                    (number + 1, middle | {parameter.name: middle[parameter.name] - step}),
                    (number + 2, middle | {parameter.name: middle[parameter.name] + step}),
                ]
            )
            if halving == 0:
                continue
            errors = [
                max(0.0, one.error - max(CLOSE * abs(one.value), FLAT_DB / (2.0 * _reach(parameter))))
                for one in slopes(study, rows)
                if one.parameter == parameter.name and one.response in ("level", "sound_power")
            ]
            worst = max(errors, default=0.0)
            if worst == 0.0 or worst > last:
                break
            last = worst
    return rows


def slopes(study: Study, rows: Sequence[Row]) -> list[Slope]:
    """Return the slopes of all responses in all parameters, at every operating point.

    Returns slopes by parameter, operating point and response.

    Difference quotients of steps h, h/2, … are extrapolated by Neville's scheme in h² (Ridders, Adv. Eng. Softw. 4
    (1982) 75). The error is the smallest change between neighbours of the scheme. Limits are those of the widest
    difference, in which errors of shared operators cancel, divided by its step.
    """
    require(study.plan == "gradient", f"plan = '{study.plan}': slopes need plan = 'gradient'")
    middle = {parameter.name: _middle(parameter) for parameter in study.parameters}
    found = []
    for parameter in study.parameters:
        others = {name: value for name, value in middle.items() if name != parameter.name}
        here = [
            row
            for row in rows
            if row.refused is None and all(row.values[name] == value for name, value in others.items())
        ]
        for point in dict.fromkeys(row.point for row in here):
            pairs = _pairs(parameter, [row for row in here if row.point == point])
            if len(pairs) > 1:
                found += _slopes(parameter, point, pairs)
    return found


def _slopes(parameter: Parameter, point: Point, pairs: Sequence[tuple[float, Row, Row]]) -> list[Slope]:
    """Return the slopes of all responses from pairs of rows (step, below, above), the widest first."""
    found = []
    for name in sized_responses([pairs[0][1]]):
        if not all(name in row.responses for _, *both in pairs for row in both):
            continue
        quotients = [(more.responses[name] - less.responses[name]) / (2 * step) for step, less, more in pairs]
        value, error = _extrapolated(quotients)
        limits: tuple[float | None, float | None] = (None, None)
        if name in LEVELS:
            step, less, more = pairs[0]
            change = level_difference(less, more, name)
            if change is not None:
                low, high = (None if limit is None else limit - change.change for limit in change.limits)
                limits = (
                    None if low is None else value + low / (2 * step) - error,
                    None if high is None else value + high / (2 * step) + error,
                )
        found.append(Slope(parameter.name, name, point.speed_rpm, point.torque, value, error, limits, pairs[-1][0]))
    return found


def _extrapolated(quotients: Sequence[float]) -> tuple[float, float]:
    """Return the limit of quotients with halved steps, and its error."""
    column, best, error = [quotients[0]], quotients[0], np.inf
    for quotient in quotients[1:]:
        row = [quotient]
        for order, left in enumerate(column, 1):
            row.append(row[-1] + (row[-1] - left) / (4.0**order - 1.0))
            apart = max(abs(row[-1] - row[-2]), abs(row[-1] - left))
            if apart <= error:
                best, error = row[-1], apart
        column = row
    return float(best), float(error)


def _pairs(parameter: Parameter, rows: Sequence[Row]) -> list[tuple[float, Row, Row]]:
    """Return the steps of a parameter with the rows below and above the middle, as far as both exist."""
    found, middle = [], _middle(parameter)
    for halving in range(STEPS):
        step = _step(parameter, halving)
        both = [
            next((row for row in rows if row.values[parameter.name] == middle + side * step), None) for side in (-1, 1)
        ]
        if both[0] is not None and both[1] is not None:
            found.append((step, both[0], both[1]))
    return found


def _middle(parameter: Parameter) -> float:
    return float(f"{sum(parameter.span) / 2:.12g}")


def _reach(parameter: Parameter) -> float:
    low, high = parameter.span
    return 0.5 * (high - low)


def _step(parameter: Parameter, halving: int) -> float:
    return FIRST_STEP * _reach(parameter) / 2.0**halving
