"""Parameters of a study: values, variants and distributions of places of a case."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from scipy.stats import norm

from nvhchain.case import Case
from nvhchain.case.checks.names import nearest
from nvhchain.case.toml.load import parse_change
from nvhchain.dimensions import UNITS
from nvhchain.errors import require
from nvhchain.levels import number_text
from nvhchain.names import check_names
from nvhchain.report.case_record import case_values

Design = dict[str, Any]
"""Name of a parameter → its value."""

SEEDS = 2**31
"""Number of seeds from which a draw takes one."""
_SCATTER = re.compile(
    r"^gears\..+\.deviations\.|^stages\..+\.tolerances\.|^(shafts|bearings)\..+damping|^housing\.modal_damping"
)
"""Places of a case that change neither housing modes nor transfer vectors, and vary from one gearbox to the next."""

_PRINTED = {"mm": "mm", "um": "µm", "deg": "°", "mrad": "mrad", "rpm": "rpm", "kg_cm2": "kg cm²", "GPa": "GPa"}
"""Unit at the end of a key → the same in print."""

_SI = (
    (r"torque", "N m"),
    (r"(axial|radial|bearing)_stiffness$", "N/m"),
    (r"(axial|radial)_damping$", "N s/m"),
    (r"_load(_rating)?$", "N"),
    (r"^mass$", "kg"),
    (r"^density$", "kg/m³"),
    (r"^duration$", "s"),
    (r"frequency$", "Hz"),
)
"""Last name of a path without a unit → its SI unit; others are ratios and numbers."""


@dataclass(frozen=True)
class Parameter:
    """Value of a case that a study varies: by values, by variants, or by a distribution.

    Parameters
    ----------
    name : str
        Name in tables and figures.
    paths : tuple of str
        Places of the case that get the value, such as "gears.wheel.geometry.face_width_mm"; entries of a list by name.
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
        check_names((name for name, _ in self.variants), f"{self.name}: variants")
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
        for path in self.given_paths:
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
    def unit(self) -> str:
        """Unit of the values in print, as the paths have it; empty for numbers, variants and mixed units."""
        units = {_unit(path) for path in self.paths}
        return units.pop() if len(units) == 1 and not self.draw else ""

    @property
    def title(self) -> str:
        """Name and unit, such as "hole radius / mm"."""
        return f"{self._plain_name} / {self.unit}" if self.unit else self.name

    def text(self, value: object) -> str:
        """Return name, value and unit, such as "hole radius = 14 mm"."""
        if value is None:
            return f"{self._plain_name} as in the case"
        number = number_text(value, ".4g") if isinstance(value, float) else str(value)
        gap = "" if self.unit in ("", "°") else " "
        return f"{self._plain_name} = {number}{gap}{self.unit}"

    @property
    def _plain_name(self) -> str:
        """Name without the unit at its end."""
        endings = (f"_{key}" for key, unit in _PRINTED.items() if unit == self.unit)
        return self.name.removesuffix(next(endings, ""))

    @property
    def is_scatter(self) -> bool:
        """True where only deviations of gears, tolerances of axes, and damping vary."""
        return all(_SCATTER.search(path) for path in self.given_paths)

    @property
    def is_seed(self) -> bool:
        """True where it draws other gearboxes of the same kind."""
        return self.draw or all(path.endswith(".seed") for path in self.given_paths)

    @property
    def given_paths(self) -> tuple[str, ...]:
        """Places of the case that it changes."""
        return self.paths or tuple(path for _, changes in self.variants for path in changes)

    @property
    def span(self) -> tuple[float, float]:
        """Ends of an even distribution; mean less and plus deviation of a normal one."""
        if self.low is not None and self.high is not None:
            return self.low, self.high
        assert self.mean is not None
        assert self.deviation is not None
        return self.mean - self.deviation, self.mean + self.deviation

    def base_value(self, case: Case) -> Any:
        """Return the value of a case in the unit of the paths; None where it states none, or several."""
        given = dict(case_values(case))
        si_values = dict(_convert(path, value) for path, value in given.items() if isinstance(value, int | float))
        found = []
        for path in self.paths:
            stem, factor = _convert(path, 1.0)
            value = given.get(path)
            if value is None and stem in si_values:
                value = float(f"{si_values[stem] / factor:.9g}")
            found.append(value)
        return found[0] if found and all(value == found[0] for value in found) else None

    def holds(self, value: Any) -> bool:
        """Return True for one of the values or variants, or a value inside the range."""
        if self.levels or value is None:
            return value in self.levels
        low, high = self.span
        return bool(low <= value <= high)

    def changes(self, value: Any) -> list[str]:
        """Return the assignments "path = value" that give a case this value; none for None, the value of the case."""
        if value is None:
            return []
        if self.variants:
            return [f"{path} = {_toml(new)}" for path, new in dict(self.variants)[value].items()]
        return [f"{path} = {_toml(value)}" for path in self.paths]


def numbers(given: Any, place: str) -> Iterable[float]:
    """Return given numbers; InputError for anything else."""
    require(
        isinstance(given, tuple)
        and all(isinstance(one, int | float) and not isinstance(one, bool) and isfinite(one) for one in given),
        f"{place} = {given!r}: give a list of numbers",
    )
    numbers: Iterable[float] = given
    return numbers


def parameter_from(table: Mapping[str, Any], place: str) -> Parameter:
    """Return a parameter from its table in a study file."""
    name = table.get("name")
    require(isinstance(name, str) and bool(name), f"{place}: name is missing: give a text")
    known = ("name", "path", "paths", "values", "variants", "low", "high", "mean", "deviation", "draw")
    for key in table:
        require(key in known, f"{name}: unknown field {key!r}: {nearest(key, known)}")
    require(not {"path", "paths"} <= set(table), f"{name}: give path or paths, not both: add the path to paths")
    paths = table.get("paths", [table["path"]] if "path" in table else [])
    values, variants = table.get("values", []), table.get("variants", {})
    require(isinstance(paths, list) and all(isinstance(path, str) for path in paths), f"{name}: paths must be texts")
    require(isinstance(values, list), f"{name}: values = {values!r} must be a list")
    require(values != [] or "values" not in table, f"{name}: values = [] is empty: give two values or more")
    require(
        isinstance(variants, dict) and all(isinstance(one, dict) for one in variants.values()),
        f"{name}: variants must be tables of path = value",
    )
    limits: dict[str, float] = {}
    for key in ("low", "high", "mean", "deviation"):
        if key in table:
            require(
                isinstance(table[key], int | float) and not isinstance(table[key], bool) and isfinite(table[key]),
                f"{name}: {key} = {table[key]!r} must be a finite number",
            )
            limits[key] = float(table[key])
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


def _unit(path: str) -> str:
    """Return the unit of the values of a path in print; empty for a number."""
    key = path.rpartition(".")[2]
    for ending, unit in _PRINTED.items():
        if key.endswith(f"_{ending}"):
            return unit
    return next((unit for pattern, unit in _SI if re.search(pattern, key)), "")


def _convert(path: str, value: float) -> tuple[str, float]:
    """Return a path without the unit at its end, and its value in SI units."""
    for unit, (_, factor) in UNITS.items():
        if path.endswith(f"_{unit}"):
            return path.removesuffix(f"_{unit}"), factor * value
    return path, float(value)
