"""Effects of parameters on responses, Sobol indices, and best designs."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import beta, sobol_indices

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.study.definition import DRAWN, Study
from nvhchain.study.responses import LOUDEST_ORDER
from nvhchain.study.rows import Point, Row

POINT = ("speed_rpm", "torque_Nm")
"""Names of the operating point among the parameters."""


@dataclass(frozen=True)
class Effect:
    """Main effect of a parameter on a response.

    parameter, response: names.
    change: highest less lowest mean of the response over the groups of values, in the unit of the response.
    lowest, highest: value, or middle of a quarter of the values, with the lowest and with the highest mean.
    share: share of the variance of the response that lies between the groups, 0 to 1.
    chance: share that chance alone exceeds for one of twenty parameters without effect; None in a plan without draws.
    """

    parameter: str
    response: str
    change: float
    lowest: object
    highest: object
    share: float
    chance: float | None = None

    @property
    def unclear(self) -> bool:
        """True for an effect that is no larger than chance."""
        return self.chance is not None and self.share <= self.chance


@dataclass(frozen=True)
class SobolIndex:
    """Share of the variance of a response that is due to a parameter.

    parameter, response: names.
    first, total: share by the parameter alone, and with all its interactions.
    first_limits, total_limits: 95 % confidence limits, by resampling.
    """

    parameter: str
    response: str
    first: float
    total: float
    first_limits: tuple[float, float]
    total_limits: tuple[float, float]


def main_effects(study: Study, rows: Sequence[Row]) -> list[Effect]:
    """Return the main effects of all parameters, and of speed and torque, on all responses, the largest first.

    Parameters
    ----------
    study : Study
        Study.
    rows : sequence of Row
        Rows of `run_study`; refused ones are omitted.

    Returns
    -------
    list of Effect
        Effects by response. Values of a distribution are grouped in quarters. Parameters that leave all responses
        alone have none, whatever the means of their groups. Those that `confounded_names` returns are omitted, and
        so are draws, which have no order. Speeds and torques are compared over designs with all of them.

    Notes
    -----
    Designs that are drawn, searched, or gearboxes of several seeds differ by chance. The share of a parameter without
    effect then has the beta distribution of the analysis of variance. Its degrees of freedom lie between the
    gearboxes where each has one value, and within them where each has all values.
    """
    used = [row for row in rows if row.refused is None and None not in row.values.values()]
    idle, found = idle_parameters(study, used), []
    confounded = confounded_names(study, rows)
    names = sized_responses(used)
    for response in names:
        known = [row for row in used if response in row.responses]
        for name, given in _columns(study, known).items():
            here = known
            if name in POINT:
                here = _complete_rows(known)
                given = [row.speed_rpm if name == POINT[0] else row.torque for row in here]
            if len(set(map(str, given))) > 1 and name not in confounded:
                values, gearboxes = np.array([row.responses[response] for row in here]), _gearboxes(study, here)
                effect = _effect(name, response, given, values if name not in idle else np.zeros_like(values))
                chance = None if gearboxes is None else _chance(study, name, given, gearboxes, values)
                found.append(replace(effect, chance=chance))
    return sorted(found, key=lambda effect: (names.index(effect.response), -effect.share))


def _complete_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of designs with all operating points: others would move the means of some points only."""
    points: dict[int, set[Point]] = {}
    for row in rows:
        points.setdefault(row.design, set()).add(row.point)
    every = len({row.point for row in rows})
    return [row for row in rows if len(points[row.design]) == every]


def _gearboxes(study: Study, rows: Sequence[Row]) -> list[str] | None:
    """Return the gearbox of every row, whose properties are due to chance; None in a plan without draws."""
    if study.plan in (*DRAWN, "sensitivity", "optimise"):
        return [str(row.design) for row in rows]
    seeds = [parameter.name for parameter in study.parameters if parameter.is_seed]
    return [str([row.values[name] for name in seeds]) for row in rows] if seeds else None


def _chance(
    study: Study, name: str, given: Sequence[object], gearboxes: Sequence[str], values: FloatArray
) -> float | None:
    """Return the share of the variance that chance alone exceeds for one of twenty parameters without effect."""
    levels, several = len(set(map(str, given))), len(set(gearboxes))
    share, drawn = _share_between(gearboxes, values), {parameter.name: parameter for parameter in study.parameters}
    if name in drawn and drawn[name].is_seed:
        return None
    if name in drawn and study.plan not in ("grid", "list"):
        if study.plan == "sensitivity":
            several = 2 * study.designs  # the others repeat their values
        freedom = several - levels
    else:
        cells = [f"{one} {value}" for one, value in zip(gearboxes, given, strict=True)]
        share, freedom = max(_share_between(cells, values) - share, 0.0), (several - 1) * (levels - 1)
    return share * float(beta.ppf(0.95, 0.5 * (levels - 1), 0.5 * freedom)) if freedom > 0 else share


def confounded_names(study: Study, rows: Sequence[Row]) -> list[str]:
    """Return the parameters of a grid or list whose values occur together with those of others, but unevenly.

    Their means contain the effects of the others: the plan `list`, or a grid with refused designs. Parameters without
    any effect are omitted.
    """
    if study.plan not in ("grid", "list"):
        return []
    used = [row for row in rows if row.refused is None]
    idle, found = idle_parameters(study, used), dict[str, None]()
    for response in responses_of(used):
        columns = _columns(study, [row for row in used if response in row.responses])
        texts = {name: list(map(str, given)) for name, given in columns.items()}
        for first, second in combinations(texts, 2):
            if not _even(texts[first], texts[second]):
                found |= dict.fromkeys((first, second))
    return [name for name in found if name not in idle]


def _even(first: Sequence[str], second: Sequence[str]) -> bool:
    """Return True if each value of the first occurs as often with all values of the second as chance has it."""
    both, one, other = Counter(zip(first, second, strict=True)), Counter(first), Counter(second)
    return all(both[a, b] * len(first) == one[a] * other[b] for a in one for b in other)


def responses_of(rows: Sequence[Row]) -> list[str]:
    """Return the names of all responses, in their order."""
    return list(dict.fromkeys(name for row in rows for name in row.responses))


def sized_responses(rows: Sequence[Row]) -> list[str]:
    """Return the names of the responses that have means and slopes; the loudest order only names a line."""
    return [name for name in responses_of(rows) if name != LOUDEST_ORDER]


def lacking(rows: Sequence[Row], response: str) -> int:
    """Return the number of rows without a response."""
    return sum(response not in row.responses for row in rows)


def main_response(rows: Sequence[Row]) -> str | None:
    """Return the response of first rank: level, sound power, or the first one; None where all runs failed."""
    known = responses_of(rows)
    return next((name for name in ("level", "sound_power", *known) if name in known), None)


def pareto_pair(rows: Sequence[Row]) -> tuple[str, str] | None:
    """Return level and mass where both differ between designs."""
    main = main_response(rows)
    if main is None or main == "mass_kg":
        return None
    both = {
        name: {round(row.responses[name], 9) for row in rows if name in row.responses} for name in (main, "mass_kg")
    }
    return (main, "mass_kg") if all(len(values) > 1 for values in both.values()) else None


def worst_rows(rows: Sequence[Row]) -> list[Row]:
    """Return one row per design, with the largest value of each response over its operating points.

    rows: rows; designs with a refused run are omitted.
    Returns rows with the operating point of the largest first response.
    """
    refused = {row.design for row in rows if row.refused is not None}
    designs: dict[int, list[Row]] = {}
    for row in rows:
        if row.design not in refused:
            designs.setdefault(row.design, []).append(row)
    found = []
    for some in designs.values():
        responses, limits = {}, {}
        for name in responses_of(some):
            worst = max((row for row in some if name in row.responses), key=lambda row: row.responses[name])
            responses[name] = worst.responses[name]
            if name in worst.limits:
                limits[name] = worst.limits[name]
        first = next(iter(responses), None)
        place = some[0] if first is None else max(some, key=lambda row: row.responses[first])
        found.append(replace(place, responses=responses, limits=limits))
    return found


def idle_parameters(study: Study, rows: Sequence[Row]) -> list[str]:
    """Return the parameters on which no response depends, as far as pairs of designs decide it.

    A pair differs in the parameter alone, at one operating point. Plans of draws have no such pairs: `run_study` runs
    them, and its first row has their result.
    """
    idle = {name for row in rows for name in row.idle}
    if study.plan not in DRAWN:
        for name, pairs in single_changes(study, [row for row in rows if row.refused is None]).items():
            if pairs and all(same_responses(*pair) for pair in pairs):
                idle.add(name)
    return [parameter.name for parameter in study.parameters if parameter.name in idle]


def same_responses(first: Row, second: Row | None) -> bool:
    """Return True for two rows without failure whose responses differ by rounding alone."""
    if second is None or first.refused is not None or second.refused is not None:
        return False
    names = first.responses.keys()
    return names == second.responses.keys() and all(
        is_constant(np.array([first.responses[name], second.responses[name]])) for name in names
    )


def single_changes(study: Study, rows: Sequence[Row]) -> dict[str, list[tuple[Row, Row]]]:
    """Return parameter → pairs of rows at one operating point that differ in nothing else."""
    found: dict[str, list[tuple[Row, Row]]] = {}
    for parameter in study.parameters:
        found[parameter.name], firsts = [], dict[tuple[object, ...], Row]()
        for row in rows:
            others = {name: value for name, value in row.values.items() if name != parameter.name}
            first = firsts.setdefault((str(others), row.point), row)
            if row.values[parameter.name] != first.values[parameter.name]:
                found[parameter.name].append((first, row))
    return found


def best_designs(rows: Sequence[Row], first: str, second: str) -> list[Row]:
    """Return the rows that no other row betters in two responses, both better the smaller, by the first.

    Returns pareto-optimal rows.
    """
    known = responses_of(rows)
    for name in (first, second):
        require(name in known, f"pareto: no response {name!r}: choose among {', '.join(known) or 'none: all failed'}")
    usable = [row for row in rows if first in row.responses and second in row.responses]
    found: list[Row] = []
    for row in sorted(usable, key=lambda row: (row.responses[first], row.responses[second])):
        if not found or row.responses[second] < found[-1].responses[second]:
            found.append(row)
    return found


def sensitivity(study: Study, rows: Sequence[Row]) -> list[SobolIndex]:
    """Return the Sobol indices of a study whose plan is `sensitivity`, worst case over its operating points.

    Parameters
    ----------
    study : Study
        Study.
    rows : sequence of Row
        Rows of `run_study`.

    Returns
    -------
    list of SobolIndex
        Indices of every parameter, by response; none of a response that a design lacks, or that no parameter changes.

    Raises
    ------
    InputError
        If the plan is another one, or a design was refused.
    """
    require(study.plan == "sensitivity", f"plan = '{study.plan}': Sobol indices need plan = 'sensitivity'")
    refused = [row for row in rows if row.refused is not None]
    require(not refused, f"{len(refused)} refused designs leave no Sobol indices: narrow the distributions")
    names = [parameter.name for parameter in study.parameters]
    found = []
    worst = sorted(worst_rows(rows), key=lambda row: row.design)
    for response in sized_responses(worst):
        if lacking(worst, response):
            continue
        values = np.array([row.responses[response] for row in worst])
        if not is_constant(values):
            found += indices_from(names, response, values, study.designs)
    return found


def indices_from(names: Sequence[str], response: str, values: ArrayLike, count: int) -> list[SobolIndex]:
    """Return Sobol indices from the values of a response at the designs of a plan `sensitivity`.

    values (count · (n_parameter + 2),) array: response at the designs A, B, and A with one parameter from B after the
    other.
    count: number of designs of A.

    Estimators of Saltelli et al. (2010) by scipy; limits are percentiles of 999 samples of designs. An index that is
    the same in all samples is its own limit.
    """
    parts = np.asarray(values, dtype=float).reshape(len(names) + 2, count)
    parts = parts - parts.mean()  # less error of the estimators
    made = sobol_indices(
        func={"f_A": parts[:1], "f_B": parts[1:2], "f_AB": parts[2:, None, :]}, n=count, method="saltelli_2010"
    )
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # samples that are all alike, of a parameter without effect
        resampled = made.bootstrap(n_resamples=999)
    first, total = np.ravel(made.first_order), np.ravel(made.total_order)
    limits = [
        [np.where(np.isfinite(end), end, value) for end in map(np.ravel, index.confidence_interval)]
        for index, value in ((resampled.first_order, first), (resampled.total_order, total))
    ]
    return [
        SobolIndex(
            name,
            response,
            float(first[i]),
            float(total[i]),
            (float(limits[0][0][i]), float(limits[0][1][i])),
            (float(limits[1][0][i]), float(limits[1][1][i])),
        )
        for i, name in enumerate(names)
    ]


def _columns(study: Study, rows: Sequence[Row]) -> dict[str, list[object]]:
    """Return the values of every parameter but draws, distributions in quarters, and of speed and torque."""
    columns: dict[str, list[object]] = {}
    for parameter in study.parameters:
        if parameter.draw:
            continue
        given = [row.values[parameter.name] for row in rows]
        columns[parameter.name] = given if parameter.levels else list(_quarters(np.array(given, dtype=float)))
    return columns | dict(zip(POINT, ([row.speed_rpm for row in rows], [row.torque for row in rows]), strict=True))


def _quarters(values: FloatArray) -> list[float]:
    """Return the mean of the quarter of all values to which each one belongs."""
    order = np.argsort(values, kind="stable")
    found = np.empty(len(values))
    for part in np.array_split(order, min(4, len(values))):
        found[part] = values[part].mean()
    return [float(f"{value:.4g}") for value in found]


def _effect(name: str, response: str, given: Sequence[object], values: FloatArray) -> Effect:
    keys = list(map(str, given))
    means = _group_means(keys, values)
    low, high = min(means, key=means.__getitem__), max(means, key=means.__getitem__)
    places = given[keys.index(low)], given[keys.index(high)]
    return Effect(name, response, means[high] - means[low], *places, _share_between(keys, values))


def _group_means(keys: Sequence[str], values: FloatArray) -> dict[str, float]:
    """Return the mean of every group of values, less that of all; 0 where only rounding is left."""
    groups: dict[str, list[int]] = {}
    for index, key in enumerate(keys):
        groups.setdefault(key, []).append(index)
    apart = np.zeros_like(values) if is_constant(values) else values - values.mean()
    return {key: float(apart[some].mean()) for key, some in groups.items()}


def _share_between(keys: Sequence[str], values: FloatArray) -> float:
    """Return the share of the variance of values that lies between groups."""
    if is_constant(values):
        return 0.0
    means, counts = _group_means(keys, values), Counter(keys)
    group_squares = sum(counts[key] * mean**2 for key, mean in means.items())
    return min(1.0, group_squares / float(((values - values.mean()) ** 2).sum()))


def is_constant(values: FloatArray) -> bool:
    """Return True for values that differ by rounding alone: 1e-9 of the largest."""
    return float(np.ptp(values)) <= 1e-9 * float(np.abs(values).max())
