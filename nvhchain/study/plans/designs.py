"""Designs of a study: the value of every parameter."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import product
from math import prod
from typing import Any

import numpy as np
from scipy.stats import qmc

from nvhchain.case import Case, load_case
from nvhchain.errors import InputError, require
from nvhchain.files.result_cache import fingerprint
from nvhchain.handoff import FloatArray
from nvhchain.study.definition import Study
from nvhchain.study.parameter import Design, Parameter

STEPS = 3
"""Largest number of steps of a slope, each half of the one before."""


def list_designs(study: Study) -> list[Design]:
    """Return the designs of a study in the order of its plan; those of `optimise` and `gradient` follow from results.

    Returns parameter → value. Designs of `sensitivity` are the matrices A, B and, for every parameter, A with its
    values from B, one after the other.
    """
    count_designs(study)
    names = [parameter.name for parameter in study.parameters]
    levels = [parameter.levels for parameter in study.parameters]
    if study.plan == "grid":
        return [dict(zip(names, values, strict=True)) for values in product(*levels)]
    if study.plan == "list":
        return [dict(zip(names, values, strict=True)) for values in zip(*levels, strict=True)]
    shares = np.clip(_shares(study), 1e-9, 1.0 - 1e-9)  # no end of a normal distribution
    return [
        {parameter.name: parameter.value_at(share) for parameter, share in zip(study.parameters, row, strict=True)}
        for row in shares
    ]


def base_design(study: Study) -> Design:
    """Return the values that the base case has; None for a parameter of which it states none.

    A variant or a value counts as that of the case if the case stays the same with it.
    """
    base = load_case(study.case)
    return {parameter.name: _base_value(study, parameter, base) for parameter in study.parameters}


def _base_value(study: Study, parameter: Parameter, base: Case) -> Any:
    given = parameter.base_value(base)
    for level in parameter.levels:
        with suppress(InputError):
            changed = load_case(study.case, changes=parameter.changes(level))
            if level == given or fingerprint(replace(changed, name=base.name)) == fingerprint(base):
                return level
    return given


def count_designs(study: Study) -> int:
    """Return the number of designs of a plan, each draw of a search for itself; the largest number of a gradient."""
    count = study.designs
    if study.plan == "grid":
        count = prod(len(parameter.levels) for parameter in study.parameters)
    elif study.plan == "list":
        count = len(study.parameters[0].levels)
    elif study.plan == "sensitivity":
        count *= len(study.parameters) + 2
    elif study.plan == "gradient":
        count = 1 + 2 * STEPS * len(study.parameters)
    elif study.goal is not None:
        count *= max(1, study.goal.draws)
    goal = study.goal
    given = f"{study.designs} designs with {goal.draws} draws each" if goal and goal.draws else f"{count} designs"
    fewer = "values, a latin_hypercube," if study.plan == "grid" else "of them"
    require(
        count <= study.most_designs,
        f"{given} are more than most_designs = {study.most_designs}: take fewer {fewer} or raise most_designs",
    )
    return count


def _shares(study: Study) -> FloatArray:
    """Return the shares (n, n_parameter) of the distributions below the values of each design."""
    size = len(study.parameters)
    if study.plan == "monte_carlo":
        return np.asarray(np.random.default_rng(study.seed).random((study.designs, size)))
    if study.plan == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(size, seed=study.seed).random(study.designs))
    if study.plan == "sobol":
        return np.asarray(qmc.Sobol(size, seed=study.seed).random(study.designs))
    both = qmc.Sobol(2 * size, seed=study.seed).random(study.designs)
    first, second = both[:, :size], both[:, size:]
    mixed = [np.where(np.arange(size) == column, second, first) for column in range(size)]
    return np.concatenate([first, second, *mixed])
