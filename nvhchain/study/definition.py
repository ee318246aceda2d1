"""Studies: a base case, its parameters and the plan of designs."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from scipy.stats import norm

from nvhchain.case.load import parse_change
from nvhchain.errors import InputError, Mistakes, mistakes, require
from nvhchain.kinds import check_fields
from nvhchain.names import check_names

SEEDS = 2**31
"""Number of seeds from which a draw takes one."""
_DEVIATION = re.compile(r"^gears\..+\.deviations\.|^stages\..+\.tolerances\.")
_COLUMNS = ("design", "speed_rpm", "torque_Nm", "seconds", "refused")
"""Columns of the table of runs that are no parameters."""


@dataclass(frozen=True)
class Parameter:
    """Value of a case that a study varies: by values, by variants, or by a distribution.

    Parameters
    ----------
    name : str
        Name in tables and figures.
    paths : tuple of str
        Places of the case that get the value, such as "gears.wheel.face_width_mm"; entries of a list by name.
    values : tuple
        Values in the unit of the path.
    variants : tuple of (str, dict)
        Name and path → value of several places that change together, in place of `paths` and `values`.
    low, high : float, optional
        Limits of an even distribution, in place of `values`.
    mean, deviation : float, optional
        Normal distribution, in place of `values`.
    draw : bool
        True for a whole number at random of every design, in place of `values`: the seed of a gear's deviations.

    Raises
    ------
    InputError
        If it has no values, no distribution, or more than one of both.
    """

    name: str
    paths: tuple[str, ...] = ()
    values: tuple[Any, ...] = ()
    variants: tuple[tuple[str, Mapping[str, Any]], ...] = ()
    low: float | None = None
    high: float | None = None
    mean: float | None = None
    deviation: float | None = None
    draw: bool = False

    def __post_init__(self) -> None:
        given = {
            "values": bool(self.values),
            "variants": bool(self.variants),
            "low and high": self.low is not None or self.high is not None,
            "mean and deviation": self.mean is not None or self.deviation is not None,
            "draw = true": self.draw,
        }
        chosen = [kind for kind, there in given.items() if there]
        require(
            len(chosen) == 1,
            f"{self.name}: give one of {', '.join(given)}" + (f", not {' and '.join(chosen)}" if chosen else ""),
        )
        require(
            bool(self.paths) is not bool(self.variants),
            f"{self.name}: give `path` or `paths` of the case"
            if not self.variants
            else f"{self.name}: variants name their own paths: leave `paths` out",
        )
        for first, second in (("low", "high"), ("mean", "deviation")):
            pair = [getattr(self, first), getattr(self, second)]
            require(
                pair.count(None) != 1 and all(limit is None or isfinite(limit) for limit in pair),
                f"{self.name}: give finite {first} and {second}, both",
            )
        if self.low is not None and self.high is not None:
            require(self.low < self.high, f"{self.name}: low = {self.low:g} must be below high = {self.high:g}")
        if self.deviation is not None:
            require(self.deviation > 0, f"{self.name}: deviation = {self.deviation:g} must be positive")
        for path in self.paths or [path for _, changes in self.variants for path in changes]:
            parse_change(f"{path} = 0")

    @property
    def levels(self) -> tuple[Any, ...]:
        """Values, or names of variants; empty for a distribution."""
        return self.values or tuple(name for name, _ in self.variants)

    def value_at(self, share: float) -> Any:
        """Return the value below which `share` (0 to 1) of its distribution lies."""
        if self.levels:
            return self.levels[min(int(share * len(self.levels)), len(self.levels) - 1)]
        if self.draw:
            return int(share * SEEDS)
        if self.low is not None and self.high is not None:
            return float(self.low + share * (self.high - self.low))
        assert self.mean is not None
        assert self.deviation is not None
        return float(norm.ppf(share, self.mean, self.deviation))

    @property
    def draws_deviations(self) -> bool:
        """True where only deviations of gears, or tolerances of angles between axes, vary."""
        paths = self.paths or tuple(path for _, changes in self.variants for path in changes)
        return all(_DEVIATION.search(path) and "centre_distance" not in path for path in paths)

    def changes(self, value: Any) -> list[str]:
        """Return the assignments "path = value" that give a case this value."""
        if self.variants:
            return [f"{path} = {_toml(new)}" for path, new in dict(self.variants)[value].items()]
        return [f"{path} = {_toml(value)}" for path in self.paths]


@dataclass(frozen=True)
class Study:
    """Base case, parameters, plan and operating points.

    Parameters
    ----------
    case : str or Path
        File of the base case.
    parameters : tuple of Parameter
        Parameters.
    plan : str
        Plan: `grid` has every combination of values, `list` the n-th values of all parameters together.
        `monte_carlo` has independent draws, for percentiles and shares that fail. `latin_hypercube` and `sobol` fill
        the space evenly, `sensitivity` is for Sobol indices.
    designs : int
        Number of designs of the last four plans, a power of two for `sobol` and `sensitivity`. The latter multiplies
        it by the number of parameters plus two.
    seed : int
        Seed of the last four plans.
    speeds_rpm : tuple of float
        Speeds of the input shaft (rpm) at which every design runs; that of the case by default.
    torques : tuple of float
        Torques on the input shaft (N·m), each with every speed; that of the case by default.
    pareto : tuple of str
        Two responses, both better the smaller, of the figure of best designs.
    targets : dict of str to float
        Response → largest value that passes, such as level = 65; at the worst operating point.
    most_designs : int
        Number of designs above which a plan is refused.

    Raises
    ------
    InputError
        If parameters share a name, or the plan does not fit them.
    """

    case: str | Path
    parameters: tuple[Parameter, ...]
    plan: Literal["grid", "list", "monte_carlo", "latin_hypercube", "sobol", "sensitivity"] = "grid"
    designs: int = 0
    seed: int = 1
    speeds_rpm: tuple[float, ...] = ()
    torques: tuple[float, ...] = ()
    pareto: tuple[str, ...] = ()
    targets: Mapping[str, float] = field(default_factory=dict)
    most_designs: int = 10_000

    def __post_init__(self) -> None:
        check_fields(self)
        require(len(self.parameters) > 0, "a study without parameters has one design: use run, or add [[parameters]]")
        check_names([parameter.name for parameter in self.parameters], "parameters")
        for parameter in self.parameters:
            require(parameter.name not in _COLUMNS, f"{parameter.name} is a column of every table: choose another name")
        lengths = {parameter.name: len(parameter.levels) for parameter in self.parameters}
        if self.plan in ("grid", "list"):
            for name, length in lengths.items():
                require(length > 0, f"{name}: plan = '{self.plan}' needs values: give them, or another plan")
            require(self.designs == 0, f"designs = {self.designs}: plan = '{self.plan}' has those of its values")
        else:
            require(self.designs > 0, f"designs = {self.designs}: plan = '{self.plan}' needs a positive number")
        if self.plan == "list":
            require(len(set(lengths.values())) == 1, f"plan = 'list' needs as many values everywhere, not {lengths}")
        if self.plan in ("sobol", "sensitivity"):
            require(
                self.designs & (self.designs - 1) == 0,
                f"designs = {self.designs}: plan = '{self.plan}' needs a power of two, such as "
                f"{1 << self.designs.bit_length()}",
            )
        require(len(self.pareto) in (0, 2), f"pareto = {self.pareto}: name two responses, such as ['level', 'mass_kg']")


def load_study(path: str | Path) -> Study:
    """Read and validate a study (TOML).

    Parameters
    ----------
    path : str or Path
        TOML file; its `case` is relative to it.

    Returns
    -------
    Study
        Study.

    Raises
    ------
    InputError
        If the file cannot be used; all mistakes at once.
    """
    path = Path(path)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file: give a study, such as docs/studies.md shows") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error}): give a study in TOML") from None
    raw = table.pop("parameters", [])
    require(
        isinstance(raw, list) and all(isinstance(one, dict) for one in raw),
        f"{path}: parameters must be tables: write [[parameters]]",
    )
    wrong, parameters = [], []
    for number, one in enumerate(raw):
        try:
            parameters.append(_parameter(one, f"parameters[{number}]"))
        except InputError as error:
            wrong += mistakes(error)
    unknown = sorted(set(table) - (set(Study.__dataclass_fields__) - {"parameters"}))
    wrong += [f"unknown field {name!r}; known fields: {', '.join(Study.__dataclass_fields__)}" for name in unknown]
    require(isinstance(table.get("case"), str), f"{path}: case is missing: name the file of the base case")
    if wrong:
        raise Mistakes([f"{path}: {text}" for text in wrong])
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in table.items()}
    for name in ("speeds_rpm", "torques"):
        if name in values:
            values[name] = tuple(map(float, _numbers(values[name], f"{path}: {name}")))
    values["case"] = path.parent / values["case"]
    targets = values.get("targets", {})
    require(isinstance(targets, dict), f"{path}: targets must be a table of response = largest value")
    _numbers(tuple(targets.values()), f"{path}: targets")
    try:
        return Study(parameters=tuple(parameters), **values)
    except InputError as error:
        raise Mistakes([f"{path}: {text}" for text in mistakes(error)]) from None


def _numbers(given: Any, place: str) -> Iterable[float]:
    require(
        isinstance(given, tuple)
        and all(isinstance(one, int | float) and not isinstance(one, bool) and isfinite(one) for one in given),
        f"{place} = {given!r}: give a list of numbers",
    )
    numbers: Iterable[float] = given
    return numbers


def _parameter(table: Mapping[str, Any], place: str) -> Parameter:
    name = table.get("name")
    require(isinstance(name, str) and bool(name), f"{place}: name is missing: give a text")
    known = ("name", "path", "paths", "values", "variants", "low", "high", "mean", "deviation", "draw")
    for key in table:
        require(key in known, f"{name}: unknown field {key!r}; known fields: {', '.join(known)}")
    paths = table.get("paths", [table["path"]] if "path" in table else [])
    values, variants = table.get("values", []), table.get("variants", {})
    require(isinstance(paths, list) and all(isinstance(path, str) for path in paths), f"{name}: paths must be texts")
    require(isinstance(values, list), f"{name}: values = {values!r} must be a list")
    require(
        isinstance(variants, dict) and all(isinstance(one, dict) for one in variants.values()),
        f"{name}: variants must be tables of path = value",
    )
    limits: dict[str, float] = {}
    for key in ("low", "high", "mean", "deviation"):
        if key in table:
            (limits[key],) = map(float, _numbers((table[key],), f"{name}: {key}"))
    draw = table.get("draw", False)
    require(isinstance(draw, bool), f"{name}: draw = {draw!r}: give true or leave it out")
    return Parameter(str(name), tuple(paths), tuple(values), tuple(variants.items()), draw=draw, **limits)


def _toml(value: Any) -> str:
    """Return a value in TOML on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(value) if isinstance(value, str) else repr(value)
