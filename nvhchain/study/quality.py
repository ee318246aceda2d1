"""Scatter of production: percentiles of responses, shares that fail a target, and tolerances by their effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta, binom, rankdata

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.study.analysis import is_constant, responses_of, worst_rows
from nvhchain.study.definition import Study
from nvhchain.study.rows import Point, Row

CONFIDENCE = 0.95
"""Confidence of all limits."""
PERCENTS = (5.0, 50.0, 95.0)
"""Percentiles."""
GROUPS = 10
"""Groups of equal size into which the values of a parameter are divided for its share of the variance."""
FEWEST = 50
"""Smallest number of designs of a ranking: five in a group."""
RESAMPLES = 500
"""Samples of designs for the limits of a ranking."""


@dataclass(frozen=True)
class Percentile:
    """Value below which a part of all gearboxes lies.

    response: name of the response.
    speed_rpm, torque: operating point, where the study sets it (rpm, N·m).
    percent: part of the gearboxes (%).
    value: value of the response.
    limits: 95 % confidence limits, by order statistics; those beyond all gearboxes are infinite.
    designs, missing: number of gearboxes with this response, and without it: refused ones and those that lack it.
    """

    response: str
    speed_rpm: float | None
    torque: float | None
    percent: float
    value: float
    limits: tuple[float, float]
    designs: int
    missing: int


@dataclass(frozen=True)
class FailedShare:
    """Share of the gearboxes that exceed a target at their worst operating point.

    response: name of the response.
    target: largest value that passes.
    share: share that fails, 0 to 1.
    limits: 95 % confidence limits (Clopper and Pearson).
    designs, missing: number of gearboxes with this response at all operating points, and of the others.
    """

    response: str
    target: float
    share: float
    limits: tuple[float, float]
    designs: int
    missing: int


@dataclass(frozen=True)
class Influence:
    """Influence of a parameter on a response over all gearboxes.

    parameter, response: names.
    share: share of the variance of the response between groups of equal or similar values of the parameter, less its
        expectation for a parameter without influence.
    share_limits: 95 % confidence limits, by resampling.
    correlation: rank correlation of Spearman, −1 to 1: 0 where the sign of a deviation does not matter. None for
        variants and values that are no numbers.
    correlation_limits: 95 % confidence limits, by resampling.
    """

    parameter: str
    response: str
    share: float
    share_limits: tuple[float, float]
    correlation: float | None
    correlation_limits: tuple[float | None, float | None]


def share_text(share: float, limits: tuple[float, float]) -> str:
    """Return a share of a variance with its limits in percent, inside 0…100; an estimate beyond them is stated, too."""
    value, low, high = (100.0 * min(max(one, 0.0), 1.0) for one in (share, *limits))
    note = "" if 0.0 <= round(100 * share) <= 100.0 else f"; estimated {100 * share:.0f}, take more designs"
    return f"{value:.0f} % ({low:.0f}…{high:.0f}{note})".replace("-", "−")


def percentiles(rows: Sequence[Row], response: str) -> list[Percentile]:
    """Return percentiles of a response over all designs, at each operating point.

    Parameters
    ----------
    rows : sequence of Row
        Rows of `run_study`; refused ones are omitted.
    response : str
        Name of the response.

    Returns
    -------
    list of Percentile
        The 5th, 50th and 95th percentile, by operating point.

    Notes
    -----
    Limits hold for independent designs (plan `monte_carlo`). They are ranks a, b with P(a ≤ B < b) ≥ 95 % for B
    binomial, whatever the distribution. Designs of low discrepancy have narrower ones.
    """
    points: dict[Point, list[float]] = {}
    for row in rows:
        if response in row.responses:
            points.setdefault(row.point, []).append(row.responses[response])
    found = []
    for point, values in points.items():
        ordered = np.sort(np.array(values))
        counts = len(ordered), sum(row.point == point for row in rows) - len(ordered)
        for percent in PERCENTS:
            value, limits = float(np.percentile(ordered, percent)), _ranks(ordered, percent)
            found.append(Percentile(response, point.speed_rpm, point.torque, percent, value, limits, *counts))
    return found


def loudest(found: Sequence[Percentile]) -> Percentile:
    """Return the largest of the highest percentiles: its operating point is that of sentences and figures."""
    return max((one for one in found if one.percent == PERCENTS[-1]), key=lambda one: one.value)


def count_text(study: Study, found: Percentile | FailedShare) -> str:
    """Return the number of gearboxes in words, such as "38 gearboxes with a result (of 40)"."""
    kind = "a result" if isinstance(found, Percentile) else "all results"
    return f"{found.designs} {study.drawn}" + (
        f" with {kind} (of {found.designs + found.missing})" if found.missing else ""
    )


def _ranks(ordered: FloatArray, percent: float) -> tuple[float, float]:
    """Return the order statistics that enclose a percentile with the confidence."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = int(binom.ppf(tail, len(ordered), percent / 100)) - 1
    high = int(binom.ppf(1.0 - tail, len(ordered), percent / 100))
    return (
        float(ordered[low]) if low >= 0 else -np.inf,
        float(ordered[high]) if high < len(ordered) else np.inf,
    )


def failed_shares(study: Study, rows: Sequence[Row]) -> list[FailedShare]:
    """Return the share of the designs that fail each target at their worst operating point.

    rows: rows of `run_study`; designs with a refused run are omitted.
    """
    worst, found = worst_rows(rows), []
    for response, target in study.targets.items() if worst else ():
        known = responses_of(worst)
        require(response in known, f"targets: no response {response!r}: choose among {', '.join(known) or 'none'}")
        values = np.array([row.responses[response] for row in worst if response in row.responses])
        failed, count, tail = int((values > target).sum()), len(values), 0.5 * (1.0 - CONFIDENCE)
        low = float(beta.ppf(tail, failed, count - failed + 1)) if failed else 0.0
        high = float(beta.ppf(1.0 - tail, failed + 1, count - failed)) if failed < count else 1.0
        missing = len({row.design for row in rows}) - count
        found.append(FailedShare(response, target, failed / count, (low, high), count, missing))
    return found


def influences(study: Study, rows: Sequence[Row], response: str) -> list[Influence]:
    """Return the influence of all parameters but seeds on a response, the largest first.

    rows: rows of `run_study`; designs with a refused run are omitted.
    response: name of the response, at the worst operating point of each design.
    Returns influences; none with fewer than 50 designs, none for seeds, which have no order, and none for parameters
    that do not vary.

    The share is ε² = 1 − (1 − η²)(n − 1)/(n − k) with η² the variance between k groups over the whole one: the
    first-order Sobol index from any designs. Groups are the values or variants, or ten parts of a distribution.
    Numbers that no two designs share count as a distribution; such variants have no share. For interactions and seeds
    take the plan `sensitivity`.
    """
    worst = [row for row in worst_rows(rows) if response in row.responses]
    if len(worst) < FEWEST:
        return []
    values = np.array([row.responses[response] for row in worst])
    if is_constant(values):
        return []
    random = np.random.default_rng(0)
    picked = random.integers(len(values), size=(RESAMPLES, len(values)))
    found = []
    for parameter in study.parameters:
        if parameter.draw:
            continue
        given = [row.values[parameter.name] for row in worst]
        if len(set(map(str, given))) == 1:
            continue
        numeric = all(isinstance(one, int | float) for one in given)
        levels = parameter.levels if len(set(map(str, given))) < len(given) else ()
        if not levels and not numeric:
            continue
        groups = np.array([levels.index(one) for one in given] if levels else given, dtype=float)
        share, share_limits = _resampled(_share_of_levels if levels else _share, groups, values, picked)
        correlation: float | None = None
        limits: tuple[float | None, float | None] = (None, None)
        if numeric:
            correlation, limits = _resampled(_correlation, np.array(given, dtype=float), values, picked)
        found.append(Influence(parameter.name, response, share, share_limits, correlation, limits))
    return sorted(found, key=lambda one: -one.share)


def _resampled(
    estimate: Callable[[FloatArray, FloatArray], float], given: FloatArray, values: FloatArray, picked: np.ndarray
) -> tuple[float, tuple[float, float]]:
    """Return an estimate and its confidence limits: basic bootstrap, which corrects the bias of repeated designs."""
    here = estimate(given, values)
    again = np.array([estimate(given[some], values[some]) for some in picked])
    tail = 50.0 * (1.0 - CONFIDENCE)
    spread = np.percentile(again - again.mean(), [tail, 100.0 - tail])
    return here, (float(here + spread[0]), float(here + spread[1]))


def _share(given: FloatArray, values: FloatArray) -> float:
    return _share_between(np.array_split(values[np.argsort(given, kind="stable")], GROUPS), values)


def _share_of_levels(given: FloatArray, values: FloatArray) -> float:
    return _share_between([values[given == level] for level in np.unique(given)], values)


def _share_between(groups: Sequence[FloatArray], values: FloatArray) -> float:
    count, mean = len(values), values.mean()
    group_squares = sum(len(group) * (group.mean() - mean) ** 2 for group in groups)
    whole = ((values - mean) ** 2).sum()
    return float(1.0 - (1.0 - group_squares / whole) * (count - 1) / (count - len(groups)))


def _correlation(given: FloatArray, values: FloatArray) -> float:
    return float(np.corrcoef(rankdata(given), rankdata(values))[0, 1])
