"""Search for the best design: differential evolution by scipy, then Nelder and Mead, within targets of responses."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import groupby
from math import ceil, inf, log10
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.stats import qmc

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.study.analysis import responses_of
from nvhchain.study.definition import Study
from nvhchain.study.parameter import Design, Parameter
from nvhchain.study.rows import Evaluate, Row

EVOLVED = 0.6
"""Share of the designs that the evolution may take; the local search has the others."""

MEMBERS = 4
"""Members of a generation per parameter, at least 5 in all (differential evolution needs them)."""

STEPS = 1e4
"""Least number of decimal values in a range, to which designs are rounded, so that they repeat."""

SIMPLEX = 0.1
"""First steps of the local search, relative to the ranges."""

SMALLEST_CHANGE = (1e-3, 0.01)
"""End of the local search: step relative to the range, and change of the response."""

BROKEN, REFUSED = 1e12, 1e15
"""Scores of a design that misses a target (and more by the relative excess), and of a refused one."""


@dataclass(frozen=True)
class Score:
    """Response of a design with its draws, at its worst operating point.

    design: number of the design.
    values: parameter → value.
    responses: response → value that the percentage of the goal includes; empty for a refused design.
    excess: sum of the relative excesses over targets; 0 for a design that meets them.
    refused: reason why a run of the design failed, or the response that it lacks.
    forbidden: parameters of the base case that lie outside their values or range.
    """

    design: int
    values: Design
    responses: dict[str, float]
    excess: float
    refused: str | None = None
    forbidden: tuple[str, ...] = ()

    @property
    def valid(self) -> bool:
        """True for a design inside the ranges that meets all targets."""
        return self.excess == 0.0 and not self.forbidden


def draws_of(study: Study) -> list[Design]:
    """Return the values of the tolerances of every draw, the same for all designs; they follow the seed of the study.

    study: study; one empty draw without a goal, or without tolerances.
    """
    goal = study.goal
    if goal is None or not goal.scatter:
        return [{}]
    shares = np.clip(np.random.default_rng(study.seed).random((goal.draws, len(goal.scatter))), 1e-9, 1.0 - 1e-9)
    return [{one.name: one.value_at(share) for one, share in zip(goal.scatter, row, strict=True)} for row in shares]


def scores(study: Study, rows: Sequence[Row]) -> list[Score]:
    """Return the score of every design of a search.

    Returns scores in the order of the designs. One without the response of the goal or a target counts as refused.
    """
    assert study.goal is not None
    found = []
    for design, group in groupby(sorted(rows, key=lambda row: row.design), key=lambda row: row.design):
        some = list(group)
        values = {parameter.name: some[0].values[parameter.name] for parameter in study.parameters}
        reasons = [row.refused for row in some if row.refused is not None]
        if reasons:
            found.append(Score(design, values, {}, inf, reasons[0]))
            continue
        responses = {name: _included(some, name, study.goal.percent) for name in responses_of(some)}
        missing = [name for name in _counted(study) if name not in responses]
        if missing:
            found.append(Score(design, values, {}, inf, f"this design has no response {missing[0]!r}"))
            continue
        excess = sum(
            max(0.0, responses[name] - target) / max(abs(target), 1e-12) for name, target in study.targets.items()
        )
        outside = tuple(one.name for one in study.parameters if not one.holds(values[one.name]))
        found.append(Score(design, values, responses, excess, forbidden=outside))
    return found


def _counted(study: Study) -> tuple[str, ...]:
    """Return the response of the goal, and those with a target."""
    assert study.goal is not None
    return (study.goal.response, *study.targets)


def best_score(study: Study, rows: Sequence[Row]) -> Score | None:
    """Return the score with the smallest response among the valid ones; None without one."""
    assert study.goal is not None
    name = study.goal.response
    usable = [score for score in scores(study, rows) if score.valid]
    return min(usable, key=lambda score: score.responses[name], default=None)


def _included(rows: Sequence[Row], name: str, percent: float) -> float:
    """Return the largest value over the operating points that `percent` of the draws do not exceed."""
    points: dict[Any, list[float]] = {}
    for row in rows:
        if name in row.responses:
            points.setdefault(row.point, []).append(row.responses[name])
    return max(float(np.percentile(values, percent, method="inverted_cdf")) for values in points.values())


def search(study: Study, base: Design, evaluate: Evaluate) -> list[Row]:
    """Evaluate designs until the number of the study is reached or the search has converged.

    base: values of the base case, which are design 0; it is no candidate where they lie outside the ranges.
    evaluate: function that runs numbered designs.
    Returns rows of all designs, in the order of the search.

    Storn and Price's differential evolution starts at points of low discrepancy and the base case; generations are run
    as a whole, so that workers change nothing. Nelder and Mead's simplex goes on from the best design. A design that
    misses a target is worse than any that meets them (rules of Deb). The same seed repeats the search: with the rows of
    an interrupted one it goes on.
    """
    found = _Search(study, evaluate)
    with suppress(_Spent):
        found.scored([base])
        found.most = 1 + round(EVOLVED * (study.designs - 1))
        with suppress(_Spent):
            _evolve(found, base)
        found.most = study.designs
        _refine(found)
    return found.rows


class _Spent(Exception):
    """End of a search: all designs are used."""


@dataclass
class _Search:
    """Designs evaluated so far."""

    study: Study
    evaluate: Evaluate
    rows: list[Row] = field(default_factory=list)
    known: dict[tuple[Any, ...], float] = field(default_factory=dict)
    most: int = 1

    def scored(self, designs: Sequence[Design]) -> list[float]:
        """Return the scores of designs; end the search where new ones are too many."""
        keys = [tuple(design.values()) for design in designs]
        new = {key: design for key, design in zip(keys, designs, strict=True) if key not in self.known}
        used = list(new.items())[: self.most - len(self.known)]
        if used:
            first = len(self.known)
            rows = self.evaluate([(first + number, design) for number, (_, design) in enumerate(used)])
            self.rows += rows
            known = responses_of(self.rows)
            for name in _counted(self.study) if known else ():
                require(name in known, f"optimise: no response {name!r}: choose among {', '.join(known)}")
            for (key, _), score in zip(used, scores(self.study, rows), strict=True):
                self.known[key] = self._value(score)
        if len(used) < len(new):
            raise _Spent
        return [self.known[key] for key in keys]

    def _value(self, score: Score) -> float:
        assert self.study.goal is not None
        if score.refused is not None or score.forbidden:
            return REFUSED
        return BROKEN * (1.0 + score.excess) if score.excess > 0 else score.responses[self.study.goal.response]

    def design(self, place: FloatArray) -> Design:
        """Return the design at a place: number of a level, or share of a range."""
        return {
            parameter.name: _value_at(parameter, float(coordinate))
            for parameter, coordinate in zip(self.study.parameters, place, strict=True)
        }


def _value_at(parameter: Parameter, coordinate: float) -> Any:
    if parameter.levels:
        return parameter.levels[min(max(round(coordinate), 0), len(parameter.levels) - 1)]
    low, high = parameter.span
    value = low + min(max(float(coordinate), 0.0), 1.0) * (high - low)
    return min(max(round(value, ceil(log10(STEPS / (high - low)))), low), high)


def _place(parameter: Parameter, value: Any) -> float:
    if parameter.levels:
        return float(parameter.levels.index(value))
    low, high = parameter.span
    return (value - low) / (high - low)


def _evolve(found: _Search, base: Design) -> None:
    """Run differential evolution until it converges or its designs are used."""
    parameters = found.study.parameters
    ends = np.array([float(len(parameter.levels) - 1 or 1) if parameter.levels else 1.0 for parameter in parameters])
    count = min(max(5, MEMBERS * len(parameters)), max(5, (found.most - 1) // 2))
    points = qmc.LatinHypercube(len(parameters), seed=found.study.seed).random(count)
    first = points * ends
    if all(parameter.holds(base[parameter.name]) for parameter in parameters):
        first[0] = [_place(parameter, base[parameter.name]) for parameter in parameters]

    def generation(places: FloatArray) -> FloatArray:
        return np.array(found.scored([found.design(place) for place in np.atleast_2d(places.T)]))

    differential_evolution(
        generation,
        [(0.0, end) for end in ends],
        init=first,
        maxiter=found.study.designs,
        integrality=[bool(parameter.levels) for parameter in parameters],
        rng=found.study.seed,
        polish=False,
        vectorized=True,
        updating="deferred",
    )


def _refine(found: _Search) -> None:
    """Move the ranges of the best design by a simplex, if there is one; parameters with levels keep theirs."""
    names = [parameter.name for parameter in found.study.parameters]
    values, lowest = min(found.known.items(), key=lambda item: item[1])
    best = dict(zip(names, values, strict=True))
    free = [parameter for parameter in found.study.parameters if not parameter.levels]
    if not free or lowest >= REFUSED:
        return
    start = np.array([_place(parameter, best[parameter.name]) for parameter in free])
    simplex = np.vstack([start, start + np.diag(np.where(start > 0.5, -SIMPLEX, SIMPLEX))])

    def value(place: FloatArray) -> float:
        moved = {parameter.name: _value_at(parameter, x) for parameter, x in zip(free, place, strict=True)}
        return found.scored([best | moved])[0]

    step, change = SMALLEST_CHANGE
    minimize(
        value,
        start,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * len(free),
        options={"initial_simplex": simplex, "xatol": step, "fatol": change, "maxiter": 10 * found.study.designs},
    )
